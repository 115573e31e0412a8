//! Effects outside the catalogue as the benchmark draws them.

use crate::effects::{Draft, Drawn, three_digits};
use crate::hidden::{Hidden, Outside};
use crate::valve::Valve;

/// Names of the effects outside the catalogue.
pub const OUTSIDE: [&str; 10] = [
    "friction-bump",
    "worn-liner",
    "upper-leak",
    "supply-ripple",
    "dwell-friction",
    "closing-drag",
    "quadratic-damping",
    "wavy-force",
    "detent",
    "second-spring",
];

/// Draws the effect `id`, adds it to `hidden` and tells it.
pub(crate) fn hide_outside(id: &'static str, valve: &Valve, d: &mut Draft<'_>, hidden: &mut Hidden) -> Drawn {
    let scale = d.scale;
    let stroke = valve.stroke_m;
    let effect = match id {
        "friction-bump" => Outside::FrictionBump {
            height_n: d.tell_size("height", "N", 60.0, 150.0, scale.force),
            centre_m: d.tell_between("centre", "m", 0.25 * stroke, 0.75 * stroke),
            width_m: d.tell_between("width", "m", 0.05 * stroke, 0.12 * stroke),
        },
        "worn-liner" => Outside::WornLiner {
            area_m2: d.tell_size("area", "m2", 0.08e-6, 0.25e-6, scale.area),
            centre_m: d.tell_between("centre", "m", 0.3 * stroke, 0.7 * stroke),
            width_m: d.tell_between("width", "m", 0.08 * stroke, 0.2 * stroke),
        },
        "upper-leak" => Outside::UpperLeak {
            area_m2: d.tell_size("area", "m2", 0.06e-6, 0.2e-6, scale.area),
            from_m: d.tell_between("from", "m", 0.4 * stroke, 0.6 * stroke),
            over_m: d.tell("over", three_digits(0.05 * stroke), "m"),
        },
        "supply-ripple" => Outside::SupplyRipple {
            amplitude_pa: d.tell_size("amplitude", "Pa", 15e3, 60e3, 1.0),
            frequency_hz: d.tell_between("frequency", "Hz", 1.2 / scale.time, 3.5 / scale.time),
            phase_rad: d.tell_between("phase", "rad", 0.1, 6.2),
        },
        "dwell-friction" => Outside::DwellFriction {
            force_n: d.tell_size("force_per_e_fold", "N", 12.0, 30.0, scale.force),
            onset_s: d.tell("onset", 0.05, "s"),
            distance_m: d.tell_between("distance", "m", 0.04 * stroke, 0.09 * stroke),
        },
        "closing-drag" => Outside::ClosingDrag {
            force_n: d.tell_size("force", "N", 60.0, 150.0, scale.force),
            below_m: d.tell_between("below", "m", 0.3 * stroke, 0.6 * stroke),
        },
        "quadratic-damping" => Outside::QuadraticDamping {
            coefficient: d.tell_size("coefficient", "N s2/m2", 1.5e4, 6e4, scale.damping() * scale.time / scale.length),
        },
        "wavy-force" => Outside::WavyForce {
            amplitude_n: d.tell_size("amplitude", "N", 30.0, 90.0, scale.force),
            waves: d.tell_between("waves", "", 1.5, 3.5),
            phase_rad: d.tell_between("phase", "rad", 0.1, 6.2),
        },
        "second-spring" => {
            let from_m = d.tell_between("from", "m", 0.1 * stroke, 0.75 * stroke);
            let at_closed_n = d.tell_size("force_closed", "N", 50.0, 160.0, scale.force);
            Outside::SecondSpring { rate_n_per_m: at_closed_n / from_m, from_m }
        }
        _ => Outside::Detent {
            force_n: d.tell_size("force", "N", 40.0, 120.0, scale.force),
            centre_m: d.tell_between("centre", "m", 0.25 * stroke, 0.75 * stroke),
            width_m: d.tell_between("width", "m", 0.04 * stroke, 0.1 * stroke),
        },
    };
    hidden.outside.push(effect);
    d.finish(id)
}
