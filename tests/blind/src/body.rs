//! Forces on the moving part that do not depend on its history.

use crate::bristle::Grip;
use crate::hidden::{Hidden, Laws, Outside};
use crate::valve::{AMBIENT_PA, GRAVITY_M_PER_S2, Valve};

/// Everything but dry friction and inertia, + opens.
pub(crate) fn driving_force(valve: &Valve, hidden: &Hidden, x: f64, v: f64, chamber_pa: f64) -> f64 {
    let stroke = valve.stroke_m;
    let squeezed = stroke - x;
    let spring = valve.spring_n_per_m * (squeezed + valve.preload_m) * (1.0 + hidden.hardening * squeezed / stroke);
    let gas = (chamber_pa - AMBIENT_PA) * valve.piston_area_m2;
    let weight = valve.orientation.opening_sign() * valve.mass_kg * GRAVITY_M_PER_S2;
    let mut stops = -valve.contact_n_per_m * (x.min(0.0) + (x - stroke).max(0.0));
    if hidden.laws.stop_damping_s_per_m != 0.0 && stops != 0.0 {
        // Speed into the stop; a stop pushes and never pulls.
        let into = if x < 0.0 { -v } else { v };
        stops *= (1.0 + hidden.laws.stop_damping_s_per_m * into).max(0.0);
    }
    let mut force = spring - gas + weight + stops - valve.viscous_ns_per_m * v;

    for ((damping, length), distance) in [(hidden.closing_cushion, x), (hidden.opening_cushion, squeezed)] {
        if damping != 0.0 {
            force -= damping * v * (1.0 - distance.max(0.0) / length).max(0.0);
        }
    }
    let (adhesion, reach) = hidden.seat_adhesion;
    if adhesion != 0.0 {
        force -= adhesion * (1.0 - x / reach).clamp(0.0, 1.0);
    }
    let (process, exponent) = hidden.process_force;
    if process != 0.0 {
        force += process * (1.0 - x / stroke).max(0.0).powf(exponent);
    }
    if hidden.load_n != 0.0 {
        force += hidden.load_n;
    }
    for effect in &hidden.outside {
        force += odd_force(effect, stroke, x, v);
    }
    force
}

/// Forces of effects outside the catalogue, friction left aside.
fn odd_force(effect: &Outside, stroke: f64, x: f64, v: f64) -> f64 {
    match *effect {
        Outside::QuadraticDamping { coefficient } => -coefficient * v * v.abs(),
        Outside::WavyForce { amplitude_n, waves, phase_rad } => {
            let place = (x / stroke).clamp(0.0, 1.0);
            amplitude_n * (std::f64::consts::TAU * waves * place + phase_rad).sin()
        }
        Outside::Detent { force_n, centre_m, width_m } => {
            let u = (x - centre_m) / width_m;
            -force_n * u * (0.5 - 0.5 * u * u).exp()
        }
        Outside::SecondSpring { rate_n_per_m, from_m } => rate_n_per_m * (from_m - x).max(0.0),
        _ => 0.0,
    }
}

/// What dry friction of every kind can hold at this place and pressure; `lean` is negative while
/// the piston moves, or is pushed, to the closed side.
pub(crate) fn grip(valve: &Valve, hidden: &Hidden, x: f64, lean: f64, chamber_pa: f64, rest_age: f64) -> Grip {
    let mut sum = Grip::default();
    if let Some(dry) = hidden.dry_friction {
        sum.sliding_n += dry.coulomb_n;
        sum.holding_n += dry.static_n;
    }
    let pressed_n = hidden.seal_friction_m2 * (chamber_pa - AMBIENT_PA).max(0.0);
    sum.sliding_n += pressed_n;
    sum.holding_n += hidden.seal_holds * pressed_n;
    let mut both = 0.0;
    for effect in &hidden.outside {
        both += match *effect {
            Outside::FrictionBump { height_n, centre_m, width_m } => {
                let u = (x - centre_m) / width_m;
                height_n * (-u * u).exp()
            }
            Outside::DwellFriction { force_n, .. } => force_n * rest_age,
            Outside::ClosingDrag { force_n, below_m } if lean < 0.0 => {
                // The edge is a hundredth of the place wide, so that the motion has no corner.
                force_n * ((below_m - x) / (0.02 * below_m) + 0.5).clamp(0.0, 1.0)
            }
            _ => 0.0,
        };
    }
    sum.sliding_n += both;
    sum.holding_n += both;
    let Laws { friction_asymmetry: asymmetry, friction_slope: slope, .. } = hidden.laws;
    if asymmetry != 0.0 || slope != 0.0 {
        let sided = if lean < 0.0 { 1.0 + asymmetry } else { 1.0 - asymmetry };
        let factor = sided * (1.0 + slope * (x / valve.stroke_m - 0.5)).max(0.0);
        sum.sliding_n *= factor;
        sum.holding_n *= factor;
    }
    sum
}

/// Area through which the chamber leaks to the atmosphere at the place `x`.
pub(crate) fn chamber_leak_m2(hidden: &Hidden, x: f64) -> f64 {
    let mut area = 0.0;
    for effect in &hidden.outside {
        area += match *effect {
            Outside::WornLiner { area_m2, centre_m, width_m } => {
                let u = (x - centre_m) / width_m;
                area_m2 * (-u * u).exp()
            }
            Outside::UpperLeak { area_m2, from_m, over_m } => area_m2 * ((x - from_m) / over_m).clamp(0.0, 1.0),
            _ => 0.0,
        };
    }
    area
}
