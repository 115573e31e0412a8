//! Effects by strength: from nothing (0) to as much as a valve bears (1), so that a wanted visible change can be
//! aimed at whatever the valve.

use rand::RngExt;
use rand::rngs::StdRng;

use crate::effects::{Drawn, Parameter, log_uniform, three_digits};
use crate::hidden::{DryFriction, Hidden, Spool};
use crate::world::play::gauge_pa;
use crate::world::valves::{Class, Subject};

/// Effects that a cylinder without a spring, driven by its pipe pressure, may hide.
pub(crate) const SPRINGLESS: [&str; 6] =
    ["dry-friction", "seal-friction", "gas-heating", "orifice-law", "opening-cushion", "sensor-lag"];

/// What an effect has besides its strength, drawn once.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Shape {
    first: f64,
    second: f64,
    third: f64,
    sign: f64,
}

impl Shape {
    pub fn draw(rng: &mut StdRng) -> Self {
        let mut part = || three_digits(rng.random_range(0.05..1.0));
        let (first, second, third) = (part(), part(), part());
        Self { first, second, third, sign: if rng.random_bool(0.5) { 1.0 } else { -1.0 } }
    }

    /// A value between two ends, log-uniform over the draw.
    fn between(part: f64, low: f64, high: f64) -> f64 {
        three_digits(low * (high / low).powf(part))
    }
}

/// Puts the effect `id` into `hidden` at a strength between 0 and 1, and tells it.
pub(crate) fn hide(id: &'static str, strength: f64, shape: Shape, subject: &Subject, hidden: &mut Hidden) -> Drawn {
    let mut told = Vec::new();
    let mut tell = |name: &'static str, value: f64, unit: &'static str| {
        let value = three_digits(value);
        told.push(Parameter { name, value, unit });
        value
    };
    let valve = &subject.valve;
    let force = subject.force_n();
    let pressure = force / valve.piston_area_m2;
    let speed = valve.stroke_m / subject.close_s;
    let area = valve.solenoid_area_m2;
    let s = strength;
    match id {
        "dry-friction" => {
            let coulomb = tell("coulomb_force", 0.6 * s * force, "N");
            // Half of the valves stick no harder than they slide.
            let over = if shape.sign > 0.0 { 1.0 } else { Shape::between(shape.first, 1.1, 2.2) };
            hidden.dry_friction = Some(DryFriction {
                coulomb_n: coulomb,
                static_n: tell("static_force", coulomb * over, "N"),
                stribeck_m_per_s: tell("stribeck_velocity", Shape::between(shape.second, 0.003, 0.03), "m/s"),
            });
        }
        "seal-friction" => {
            let most = 0.4 * force / gauge_pa(valve.supply_psig).max(pressure);
            hidden.seal_friction_m2 = tell("friction_per_pressure", s * most, "m2");
            // They stick as often as a dry friction does, if not by as much.
            hidden.seal_holds = if shape.sign > 0.0 { 1.0 } else { Shape::between(shape.first, 1.1, 1.6) };
            tell("static_friction_per_pressure", s * most * hidden.seal_holds, "m2");
            hidden.seal_stribeck_m_per_s = tell("stribeck_velocity", Shape::between(shape.second, 0.003, 0.03), "m/s");
        }
        "progressive-spring" => hidden.hardening = tell("hardening", 0.6 * s, ""),
        "closing-cushion" | "opening-cushion" => {
            let damping = tell("damping", 6.0 * s * force / speed, "N s/m");
            let length = tell("length", Shape::between(shape.first, 0.05, 0.3) * valve.stroke_m, "m");
            if id == "closing-cushion" {
                hidden.closing_cushion = (damping, length);
            } else {
                hidden.opening_cushion = (damping, length);
            }
        }
        "seat-adhesion" => {
            let most = 0.8 * s * force;
            hidden.seat_adhesion = (
                tell("force", most, "N"),
                tell("reach", Shape::between(shape.first, 0.005, 0.04) * valve.stroke_m, "m"),
            );
        }
        "process-force" => {
            let size = shape.sign * 0.5 * s * force;
            hidden.process_force =
                (tell("force", size, "N"), tell("exponent", Shape::between(shape.first, 0.7, 3.0), ""));
        }
        "gas-heating" => {
            // The exchange that a swept volume of gas would need to follow a stroke, over the strength.
            let swept = valve.piston_area_m2 * valve.stroke_m;
            let most = gauge_pa(valve.supply_psig) * swept / (293.0 * 0.4 * subject.close_s);
            hidden.wall_conductance_w_per_k = Some(tell("wall_conductance", 0.02 * most / (s * s), "W/K"));
        }
        "supply-droop" => {
            let choked = 0.86 * 0.6847 * area * (gauge_pa(valve.supply_psig) + 1e5) / (296.8_f64 * 293.15).sqrt();
            let resistance = tell("resistance", 0.6 * s * gauge_pa(valve.supply_psig) / choked, "Pa s/kg");
            let volume = Shape::between(shape.first, 0.05, 1.0) * valve.pipe_volume_m3;
            hidden.supply_droop = Some((resistance, tell("line_volume", volume, "m3")));
        }
        "vent-restriction" => hidden.vent_factor = tell("area_factor", 1.0 / (1.0 + 3.0 * s), ""),
        "back-pressure" => hidden.back_pressure_pa = tell("pressure", 0.5 * s * pressure, "Pa"),
        "orifice-law" => hidden.critical_ratio = Some(tell("critical_ratio", 0.52 - 0.45 * s, "")),
        "leak-to-atmosphere" => hidden.leak_to_atmosphere_m2 = tell("area", 0.5 * s * area, "m2"),
        "leak-from-supply" => hidden.leak_from_supply_m2 = tell("area", 0.25 * s * area, "m2"),
        "solenoid-lag" => {
            let most = 0.25 * s * subject.close_s;
            let travel = if shape.sign > 0.0 { 0.0 } else { 2.0 * shape.third * most };
            hidden.solenoid = Spool {
                energise_s: tell("energise_delay", most, "s"),
                release_s: tell("deenergise_delay", most * Shape::between(shape.first, 0.3, 3.0), "s"),
                travel_s: tell("travel_time", travel, "s"),
            };
        }
        "sensor-lag" => hidden.sensor_lag_s = tell("time_constant", 0.15 * s * subject.close_s, "s"),
        _ => hidden.clock_offset_s = tell("offset", shape.sign * 0.15 * s * subject.close_s, "s"),
    }
    Drawn { id, parameters: told }
}

/// Effects that a valve of a class may hide.
pub(crate) fn may_hide(class: Class, catalogue: &[&'static str]) -> Vec<&'static str> {
    match class {
        Class::Springless => SPRINGLESS.to_vec(),
        _ => catalogue.to_vec(),
    }
}

/// A visible change to aim at, as a share of the stroke: from what is hardly seen to what nobody misses.
pub(crate) fn wanted_change(rng: &mut StdRng) -> f64 {
    log_uniform(rng, 2e-3, 0.1)
}
