//! Effects outside the catalogue as the benchmark draws them.

use rand::RngExt;
use rand::rngs::StdRng;

use crate::effects::{Drawn, Parameter, Scale, SizeRange, three_digits};
use crate::hidden::{Hidden, Outside};
use crate::valve::Valve;

/// Names of the effects outside the catalogue.
pub const OUTSIDE: [&str; 9] = [
    "friction-bump",
    "worn-liner",
    "upper-leak",
    "supply-ripple",
    "dwell-friction",
    "closing-drag",
    "quadratic-damping",
    "wavy-force",
    "detent",
];

/// Draws the effect `id`, adds it to `hidden` and tells it.
pub(crate) fn hide_outside(
    id: &'static str,
    valve: &Valve,
    scale: Scale,
    noise_m: f64,
    rng: &mut StdRng,
    hidden: &mut Hidden,
) -> Drawn {
    let mut parameters = Vec::new();
    let size = |rng: &mut StdRng, low: f64, high: f64, scale: f64| {
        three_digits(SizeRange::for_noise(low, high, noise_m).draw(rng) * scale)
    };
    let part = |rng: &mut StdRng, low: f64, high: f64| three_digits(rng.random_range(low..high));
    let mut tell = |name: &'static str, value: f64, unit: &'static str| {
        parameters.push(Parameter { name, value, unit });
        value
    };
    let stroke = valve.stroke_m;
    let effect = match id {
        "friction-bump" => Outside::FrictionBump {
            height_n: tell("height", size(rng, 60.0, 150.0, scale.force), "N"),
            centre_m: tell("centre", part(rng, 0.25 * stroke, 0.75 * stroke), "m"),
            width_m: tell("width", part(rng, 0.05 * stroke, 0.12 * stroke), "m"),
        },
        "worn-liner" => Outside::WornLiner {
            area_m2: tell("area", size(rng, 0.08e-6, 0.25e-6, scale.area), "m2"),
            centre_m: tell("centre", part(rng, 0.3 * stroke, 0.7 * stroke), "m"),
            width_m: tell("width", part(rng, 0.08 * stroke, 0.2 * stroke), "m"),
        },
        "upper-leak" => Outside::UpperLeak {
            area_m2: tell("area", size(rng, 0.06e-6, 0.2e-6, scale.area), "m2"),
            from_m: tell("from", part(rng, 0.4 * stroke, 0.6 * stroke), "m"),
            over_m: tell("over", three_digits(0.05 * stroke), "m"),
        },
        "supply-ripple" => Outside::SupplyRipple {
            amplitude_pa: tell("amplitude", size(rng, 15e3, 60e3, 1.0), "Pa"),
            frequency_hz: tell("frequency", part(rng, 1.2 / scale.time, 3.5 / scale.time), "Hz"),
            phase_rad: tell("phase", part(rng, 0.1, 6.2), "rad"),
        },
        "dwell-friction" => Outside::DwellFriction {
            force_n: tell("force_per_e_fold", size(rng, 12.0, 30.0, scale.force), "N"),
            onset_s: tell("onset", 0.05, "s"),
            distance_m: tell("distance", part(rng, 0.04 * stroke, 0.09 * stroke), "m"),
        },
        "closing-drag" => Outside::ClosingDrag {
            force_n: tell("force", size(rng, 60.0, 150.0, scale.force), "N"),
            below_m: tell("below", part(rng, 0.3 * stroke, 0.6 * stroke), "m"),
        },
        "quadratic-damping" => Outside::QuadraticDamping {
            coefficient: tell(
                "coefficient",
                size(rng, 1.5e4, 6e4, scale.damping() * scale.time / scale.length),
                "N s2/m2",
            ),
        },
        "wavy-force" => Outside::WavyForce {
            amplitude_n: tell("amplitude", size(rng, 30.0, 90.0, scale.force), "N"),
            waves: tell("waves", part(rng, 1.5, 3.5), ""),
            phase_rad: tell("phase", part(rng, 0.1, 6.2), "rad"),
        },
        _ => Outside::Detent {
            force_n: tell("force", size(rng, 40.0, 120.0, scale.force), "N"),
            centre_m: tell("centre", part(rng, 0.25 * stroke, 0.75 * stroke), "m"),
            width_m: tell("width", part(rng, 0.04 * stroke, 0.1 * stroke), "m"),
        },
    };
    hidden.outside.push(effect);
    Drawn { id, parameters }
}
