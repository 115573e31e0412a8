//! The catalogue as the benchmark draws from it: ids, sizes and how they scale with the valve.
//!
//! The sizes hold for the testbed valve and a position noise of 0.1 mm. Their lower ends are at
//! least five times what position alone can just tell there once the tolerated parameters have
//! taken their share (7.5 N of Coulomb friction, 2 ms of delay, 0.1 % of vent area, 3.3 kPa of
//! back pressure, ...); the upper ends are what one meets on worn or badly piped valves. Less
//! noise lowers the lower end, more noise raises both, see [`SizeRange::for_noise`].

use rand::RngExt;
use rand::rngs::StdRng;

use crate::hidden::{DryFriction, Hidden, Spool};
use crate::valve::Valve;

/// Ids of the catalogue's effects.
pub const CATALOGUE: [&str; 17] = [
    "dry-friction",
    "seal-friction",
    "progressive-spring",
    "closing-cushion",
    "opening-cushion",
    "seat-adhesion",
    "process-force",
    "gas-heating",
    "supply-droop",
    "vent-restriction",
    "back-pressure",
    "orifice-law",
    "leak-to-atmosphere",
    "leak-from-supply",
    "solenoid-lag",
    "sensor-lag",
    "clock-offset",
];

/// Pairs that no campaign hides together: each would be read as one effect.
const NEVER_TOGETHER: [(&str, &str); 6] = [
    ("dry-friction", "seal-friction"),
    ("solenoid-lag", "sensor-lag"),
    ("solenoid-lag", "clock-offset"),
    ("sensor-lag", "clock-offset"),
    ("leak-to-atmosphere", "leak-from-supply"),
    ("gas-heating", "orifice-law"),
];

/// Whether two effects may be hidden in one campaign.
pub(crate) fn go_together(one: &str, other: &str) -> bool {
    one != other && !NEVER_TOGETHER.contains(&(one, other)) && !NEVER_TOGETHER.contains(&(other, one))
}

/// A drawn parameter of a hidden effect.
#[derive(Debug, Clone, PartialEq)]
pub struct Parameter {
    /// Its name in the catalogue.
    pub name: &'static str,
    /// Its value in SI units.
    pub value: f64,
    /// The SI unit, empty for a pure number.
    pub unit: &'static str,
}

/// A hidden effect with its parameters.
#[derive(Debug, Clone, PartialEq)]
pub struct Drawn {
    /// Id in the catalogue, or the name of an effect outside of it.
    pub id: &'static str,
    /// Its parameters.
    pub parameters: Vec<Parameter>,
}

/// How a valve compares with the testbed valve: what sizes are multiplied by.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Scale {
    pub force: f64,
    pub pressure: f64,
    pub area: f64,
    pub time: f64,
    pub length: f64,
}

impl Scale {
    /// `close_s` is the nominal closing time at the usual supply pressure.
    pub fn of(valve: &Valve, close_s: f64) -> Self {
        let testbed = Valve::testbed();
        let force = valve.spring_n_per_m * valve.preload_m / (testbed.spring_n_per_m * testbed.preload_m);
        Self {
            force,
            pressure: force * testbed.piston_area_m2 / valve.piston_area_m2,
            area: valve.solenoid_area_m2 / testbed.solenoid_area_m2,
            time: close_s / 1.0422,
            length: valve.stroke_m / testbed.stroke_m,
        }
    }

    /// For forces per speed.
    pub fn damping(&self) -> f64 {
        self.force * self.time / self.length
    }
}

/// Ends of a log-uniform range of sizes.
#[derive(Debug, Clone, Copy)]
pub(crate) struct SizeRange {
    pub low: f64,
    pub high: f64,
}

impl SizeRange {
    /// The range at a position noise of `noise_m`: the lower end follows the noise between 0.04
    /// and 0.25 mm, the upper end gives way so that the range spans at least a factor of two.
    pub fn for_noise(low: f64, high: f64, noise_m: f64) -> Self {
        let low = low * (noise_m / 1e-4).clamp(0.4, 2.5);
        Self { low, high: high.max(2.0 * low) }
    }

    pub fn draw(self, rng: &mut StdRng) -> f64 {
        log_uniform(rng, self.low, self.high)
    }
}

/// A number whose logarithm is uniform.
pub(crate) fn log_uniform(rng: &mut StdRng, low: f64, high: f64) -> f64 {
    (rng.random_range(low.ln()..high.ln())).exp()
}

/// Three significant digits, so that the truth reads well.
pub(crate) fn three_digits(value: f64) -> f64 {
    format!("{value:.2e}").parse().unwrap_or(value)
}

/// Draws the size of the effect `id`, puts it into `hidden` and tells it.
pub(crate) fn hide(id: &'static str, scale: Scale, noise_m: f64, rng: &mut StdRng, hidden: &mut Hidden) -> Drawn {
    let mut parameters = Vec::new();
    let size = |rng: &mut StdRng, low: f64, high: f64, scale: f64| {
        three_digits(SizeRange::for_noise(low, high, noise_m).draw(rng) * scale)
    };
    let mut tell = |name: &'static str, value: f64, unit: &'static str| {
        parameters.push(Parameter { name, value, unit });
        value
    };
    match id {
        "dry-friction" => {
            let coulomb = size(rng, 35.0, 130.0, scale.force);
            let over = if rng.random_bool(0.5) { 1.0 } else { rng.random_range(1.2..2.0) };
            hidden.dry_friction = Some(DryFriction {
                coulomb_n: tell("coulomb_force", coulomb, "N"),
                static_n: tell("static_force", three_digits(coulomb * over), "N"),
                stribeck_m_per_s: tell("stribeck_velocity", three_digits(log_uniform(rng, 0.005, 0.02)), "m/s"),
            });
        }
        "seal-friction" => {
            hidden.seal_friction_m2 =
                tell("friction_per_pressure", size(rng, 1e-4, 4e-4, scale.force / scale.pressure), "m2");
        }
        "progressive-spring" => hidden.hardening = tell("hardening", size(rng, 0.08, 0.4, 1.0), ""),
        "closing-cushion" => {
            hidden.closing_cushion = (
                tell("damping", size(rng, 1500.0, 12e3, scale.damping()), "N s/m"),
                tell("length", three_digits(rng.random_range(3e-3..8e-3) * scale.length), "m"),
            );
        }
        "opening-cushion" => {
            hidden.opening_cushion = (
                tell("damping", size(rng, 4000.0, 30e3, scale.damping()), "N s/m"),
                tell("length", three_digits(rng.random_range(3e-3..8e-3) * scale.length), "m"),
            );
        }
        "seat-adhesion" => {
            hidden.seat_adhesion = (
                tell("force", size(rng, 40.0, 160.0, scale.force), "N"),
                tell("reach", three_digits(rng.random_range(0.2e-3..0.8e-3)), "m"),
            );
        }
        "process-force" => {
            let sign = if rng.random_bool(0.5) { 1.0 } else { -1.0 };
            hidden.process_force = (
                tell("force", sign * size(rng, 60.0, 160.0, scale.force), "N"),
                tell("exponent", three_digits(rng.random_range(1.3..2.5)), ""),
            );
        }
        "gas-heating" => {
            // Here a large effect is a small number.
            let exchange = log_uniform(rng, 0.04, 0.5) * scale.area;
            hidden.wall_conductance_w_per_k = Some(tell("wall_conductance", three_digits(exchange), "W/K"));
        }
        "supply-droop" => {
            hidden.supply_droop = Some((
                tell("resistance", size(rng, 2e7, 1.2e8, 1.0 / scale.area), "Pa s/kg"),
                tell("line_volume", 20e-6, "m3"),
            ));
        }
        "vent-restriction" => {
            hidden.vent_factor = tell("area_factor", three_digits(1.0 - size(rng, 0.03, 0.4, 1.0)), "");
        }
        "back-pressure" => hidden.back_pressure_pa = tell("pressure", size(rng, 16e3, 55e3, scale.pressure), "Pa"),
        "orifice-law" => {
            hidden.critical_ratio = Some(tell("critical_ratio", three_digits(rng.random_range(0.1..0.4)), ""));
        }
        "leak-to-atmosphere" => {
            hidden.leak_to_atmosphere_m2 = tell("area", size(rng, 0.02e-6, 0.15e-6, scale.area), "m2");
        }
        "leak-from-supply" => {
            hidden.leak_from_supply_m2 = tell("area", size(rng, 0.01e-6, 0.06e-6, scale.area), "m2");
        }
        "solenoid-lag" => {
            let energise = size(rng, 12e-3, 60e-3, 1.0);
            let release = size(rng, 12e-3, 60e-3, 1.0);
            let travel = if rng.random_bool(0.5) { 0.0 } else { size(rng, 20e-3, 100e-3, 1.0) };
            hidden.solenoid = Spool {
                energise_s: tell("energise_delay", energise, "s"),
                release_s: tell("deenergise_delay", release, "s"),
                travel_s: tell("travel_time", travel, "s"),
            };
        }
        "sensor-lag" => hidden.sensor_lag_s = tell("time_constant", size(rng, 10e-3, 60e-3, 1.0), "s"),
        _ => {
            let sign = if rng.random_bool(0.5) { 1.0 } else { -1.0 };
            hidden.clock_offset_s = tell("offset", sign * size(rng, 10e-3, 60e-3, 1.0), "s");
        }
    }
    Drawn { id, parameters }
}
