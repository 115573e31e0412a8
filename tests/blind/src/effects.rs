//! The catalogue as the benchmark draws from it: ids, sizes and how they scale with the valve.
//!
//! The sizes hold for the testbed valve and a position noise of 0.1 mm. Their lower ends are at
//! least five times what position alone can just tell there (a gain of 30 in chi squared after the
//! tolerated parameters took their share under their priors): 5.6 times for a slow sensor or a
//! clock, 7 for a solenoid's delay, 13 for the supply's droop, 20 to 75 for all others; the upper
//! ends are what one meets on worn or badly piped valves. Less noise lowers the lower end, more
//! noise raises it, both against the length of the stroke. Heat exchange and the orifice law are far above the noise at any usual size
//! and do not follow it.

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

    /// For delays: a slow valve shows a delay less, a long stroke more.
    pub fn delay(&self) -> f64 {
        (self.time.sqrt() / self.length).max(0.7)
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

/// An effect being drawn.
#[derive(Debug)]
pub(crate) struct Draft<'a> {
    pub rng: &'a mut StdRng,
    pub scale: Scale,
    pub noise_m: f64,
    pub parameters: Vec<Parameter>,
}

impl Draft<'_> {
    /// A size within the range for the campaign's noise, times `scale`.
    pub fn size(&mut self, low: f64, high: f64, scale: f64) -> f64 {
        three_digits(SizeRange::for_noise(low, high, self.noise_m / self.scale.length).draw(self.rng) * scale)
    }

    /// A number that does not follow the noise.
    pub fn between(&mut self, low: f64, high: f64) -> f64 {
        three_digits(self.rng.random_range(low..high))
    }

    fn sign(&mut self) -> f64 {
        if self.rng.random_bool(0.5) { 1.0 } else { -1.0 }
    }

    /// Draws a size and notes it.
    pub fn tell_size(&mut self, name: &'static str, unit: &'static str, low: f64, high: f64, scale: f64) -> f64 {
        let size = self.size(low, high, scale);
        self.tell(name, size, unit)
    }

    /// Draws a number that does not follow the noise, and notes it.
    pub fn tell_between(&mut self, name: &'static str, unit: &'static str, low: f64, high: f64) -> f64 {
        let value = self.between(low, high);
        self.tell(name, value, unit)
    }

    /// The effect as drawn so far; what follows is another one.
    pub fn finish(&mut self, id: &'static str) -> Drawn {
        Drawn { id, parameters: std::mem::take(&mut self.parameters) }
    }

    /// Notes a parameter and hands its value on.
    pub fn tell(&mut self, name: &'static str, value: f64, unit: &'static str) -> f64 {
        self.parameters.push(Parameter { name, value, unit });
        value
    }
}

/// Draws the size of the catalogue's effect `id`, puts it into `hidden` and tells it.
pub(crate) fn hide(id: &'static str, d: &mut Draft<'_>, hidden: &mut Hidden) -> Drawn {
    if !hide_force(id, d, hidden) && !hide_flow(id, d, hidden) {
        hide_timing(id, d, hidden);
    }
    d.finish(id)
}

/// Effects that are forces; false when `id` is none of them.
fn hide_force(id: &str, d: &mut Draft<'_>, hidden: &mut Hidden) -> bool {
    let scale = d.scale;
    match id {
        "dry-friction" => {
            let coulomb = d.size(35.0, 130.0, scale.force);
            let over = if d.sign() > 0.0 { 1.0 } else { d.between(1.2, 2.0) };
            let stribeck = three_digits(log_uniform(d.rng, 0.005, 0.02));
            hidden.dry_friction = Some(DryFriction {
                coulomb_n: d.tell("coulomb_force", coulomb, "N"),
                static_n: d.tell("static_force", three_digits(coulomb * over), "N"),
                stribeck_m_per_s: d.tell("stribeck_velocity", stribeck, "m/s"),
            });
        }
        "seal-friction" => {
            hidden.seal_friction_m2 =
                d.tell_size("friction_per_pressure", "m2", 1e-4, 4e-4, scale.force / scale.pressure);
        }
        "progressive-spring" => {
            hidden.hardening = d.tell_size("hardening", "", 0.08, 0.4, 1.0);
        }
        "closing-cushion" => hidden.closing_cushion = cushion(1500.0, 12e3, d),
        "opening-cushion" => hidden.opening_cushion = cushion(4000.0, 30e3, d),
        "seat-adhesion" => {
            let (size, reach) = (d.size(40.0, 160.0, scale.force), d.between(0.2e-3, 0.8e-3));
            hidden.seat_adhesion = (d.tell("force", size, "N"), d.tell("reach", reach, "m"));
        }
        "process-force" => {
            let (size, exponent) = (d.sign() * d.size(60.0, 160.0, scale.force), d.between(1.3, 2.5));
            hidden.process_force = (d.tell("force", size, "N"), d.tell("exponent", exponent, ""));
        }
        _ => return false,
    }
    true
}

fn cushion(low: f64, high: f64, d: &mut Draft<'_>) -> (f64, f64) {
    let scale = d.scale;
    let (size, length) = (d.size(low, high, scale.damping()), d.between(3e-3, 8e-3));
    let length = three_digits(length * scale.length);
    (d.tell("damping", size, "N s/m"), d.tell("length", length, "m"))
}

/// Effects on the gas; false when `id` is none of them.
fn hide_flow(id: &str, d: &mut Draft<'_>, hidden: &mut Hidden) -> bool {
    let scale = d.scale;
    match id {
        "gas-heating" => {
            // Here a large effect is a small number.
            let exchange = three_digits(log_uniform(d.rng, 0.04, 0.5) * scale.area);
            hidden.wall_conductance_w_per_k = Some(d.tell("wall_conductance", exchange, "W/K"));
        }
        "supply-droop" => {
            let size = d.size(2e7, 1.2e8, 1.0 / scale.area);
            hidden.supply_droop = Some((d.tell("resistance", size, "Pa s/kg"), d.tell("line_volume", 20e-6, "m3")));
        }
        "vent-restriction" => {
            let factor = three_digits(1.0 - d.size(0.03, 0.4, 1.0));
            hidden.vent_factor = d.tell("area_factor", factor, "");
        }
        "back-pressure" => {
            hidden.back_pressure_pa = d.tell_size("pressure", "Pa", 16e3, 55e3, scale.pressure);
        }
        "orifice-law" => {
            let ratio = d.between(0.1, 0.4);
            hidden.critical_ratio = Some(d.tell("critical_ratio", ratio, ""));
        }
        "leak-to-atmosphere" => {
            hidden.leak_to_atmosphere_m2 = d.tell_size("area", "m2", 0.02e-6, 0.15e-6, scale.area);
        }
        "leak-from-supply" => {
            hidden.leak_from_supply_m2 = d.tell_size("area", "m2", 0.01e-6, 0.06e-6, scale.area);
        }
        _ => return false,
    }
    true
}

/// Delays of the solenoid and of the measurement.
fn hide_timing(id: &str, d: &mut Draft<'_>, hidden: &mut Hidden) {
    let delay = d.scale.delay();
    match id {
        "solenoid-lag" => {
            let (energise, release) = (d.size(12e-3, 60e-3, delay), d.size(12e-3, 60e-3, delay));
            let travel = if d.sign() > 0.0 { 0.0 } else { d.size(20e-3, 100e-3, delay) };
            hidden.solenoid = Spool {
                energise_s: d.tell("energise_delay", energise, "s"),
                release_s: d.tell("deenergise_delay", release, "s"),
                travel_s: d.tell("travel_time", travel, "s"),
            };
        }
        "sensor-lag" => {
            hidden.sensor_lag_s = d.tell_size("time_constant", "s", 10e-3, 60e-3, delay);
        }
        _ => {
            let size = d.sign() * d.size(10e-3, 60e-3, delay);
            hidden.clock_offset_s = d.tell("offset", size, "s");
        }
    }
}
