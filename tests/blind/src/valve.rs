//! The valve as its user describes it: plain numbers and the text of `valve.toml`.

use std::fmt::Write as _;

/// Standard gravity.
pub const GRAVITY_M_PER_S2: f64 = 9.806_65;
/// One pound per square inch.
pub const PSI_PA: f64 = 6894.757;

/// How the actuator stands, which decides where its weight pulls.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Orientation {
    /// The weight helps closing.
    Upright,
    /// The weight helps opening.
    Inverted,
    /// The weight does neither.
    Horizontal,
}

impl Orientation {
    /// The word for it in `valve.toml`.
    pub fn word(self) -> &'static str {
        match self {
            Self::Upright => "upright",
            Self::Inverted => "inverted",
            Self::Horizontal => "horizontal",
        }
    }

    /// +1 when the weight opens, -1 when it closes.
    pub fn opening_sign(self) -> f64 {
        match self {
            Self::Upright => -1.0,
            Self::Inverted => 1.0,
            Self::Horizontal => 0.0,
        }
    }
}

/// A normally open valve with a linear cylinder and a spring, in SI units.
#[derive(Debug, Clone, PartialEq)]
pub struct Valve {
    /// Moving mass in kg.
    pub mass_kg: f64,
    /// Distance between the stops.
    pub stroke_m: f64,
    /// Area of the piston.
    pub piston_area_m2: f64,
    /// Volume of the chamber with the valve fully open.
    pub dead_volume_m3: f64,
    /// Viscous friction in N s/m.
    pub viscous_ns_per_m: f64,
    /// Spring rate in N/m.
    pub spring_n_per_m: f64,
    /// Compression of the spring with the valve fully open.
    pub preload_m: f64,
    /// Stiffness of both stops in N/m.
    pub contact_n_per_m: f64,
    /// Usual supply pressure, gauge, in psi.
    pub supply_psig: f64,
    /// Volume of the pipe between solenoid and chamber.
    pub pipe_volume_m3: f64,
    /// Geometric area of the solenoid's ports.
    pub solenoid_area_m2: f64,
    /// Geometric area of the chamber's port.
    pub port_area_m2: f64,
    /// How the actuator stands.
    pub orientation: Orientation,
    /// When the usual cycle lets the valve open again.
    pub open_at_s: f64,
    /// When the usual cycle ends.
    pub cycle_end_s: f64,
}

/// Atmospheric pressure of every campaign.
pub const AMBIENT_PA: f64 = 101_325.0;
/// Temperature of every campaign.
pub const TEMPERATURE_K: f64 = 293.15;
/// Ratio of specific heats of the gas of every campaign.
pub const GAMMA: f64 = 1.4;
/// Z R of the gas of every campaign, J/(kg K).
pub const GAS_CONSTANT: f64 = 296.8;
/// Flow coefficient of every orifice.
pub const FLOW_COEFFICIENT: f64 = 0.86;

/// The parameters a user knows only within a tolerance: key in `valve.toml`, relative one sigma.
pub const TOLERANCES: [(&str, f64); 7] = [
    ("actuator.viscous_friction", 0.20),
    ("actuator.dead_volume", 0.10),
    ("spring.stiffness", 0.02),
    ("spring.preload_compression", 0.03),
    ("pneumatics.solenoid_orifice_area", 0.05),
    ("pneumatics.port_orifice_area", 0.20),
    ("pneumatics.pipe_volume", 0.10),
];

impl Valve {
    /// The valve of the testbed, closing in 1.04 s at 75 psig.
    pub fn testbed() -> Self {
        Self {
            mass_kg: 1.5,
            stroke_m: 25.4e-3,
            piston_area_m2: 31.17e-4,
            dead_volume_m3: 30e-6,
            viscous_ns_per_m: 600.0,
            spring_n_per_m: 16e3,
            preload_m: 36e-3,
            contact_n_per_m: 1e6,
            supply_psig: 75.0,
            pipe_volume_m3: 40e-6,
            solenoid_area_m2: 0.5e-6,
            port_area_m2: 3.488_372e-6,
            orientation: Orientation::Upright,
            open_at_s: 4.0,
            cycle_end_s: 12.0,
        }
    }

    /// The value behind the key of [`TOLERANCES`] at `index`.
    pub fn tolerated_mut(&mut self, index: usize) -> &mut f64 {
        match index {
            0 => &mut self.viscous_ns_per_m,
            1 => &mut self.dead_volume_m3,
            2 => &mut self.spring_n_per_m,
            3 => &mut self.preload_m,
            4 => &mut self.solenoid_area_m2,
            5 => &mut self.port_area_m2,
            _ => &mut self.pipe_volume_m3,
        }
    }

    /// The valve whose tolerated parameters are `factors` times these, in the order of
    /// [`TOLERANCES`].
    #[must_use]
    pub fn scaled(&self, factors: &[f64; 7]) -> Self {
        let mut other = self.clone();
        for (index, factor) in factors.iter().enumerate() {
            *other.tolerated_mut(index) *= factor;
        }
        other
    }

    /// The text of `valve.toml`.
    pub fn to_toml(&self, name: &str) -> String {
        let mut text = format!("name = \"{name}\"\n");
        let mut section = |title: &str, lines: &[(&str, f64, &str)]| {
            let _ = writeln!(text, "\n[{title}]");
            for (key, value, unit) in lines {
                let _ = if unit.is_empty() {
                    writeln!(text, "{key} = {value:?}")
                } else {
                    writeln!(text, "{key} = \"{} {unit}\"", tidy(*value))
                };
            }
        };
        section(
            "actuator",
            &[
                ("moving_mass", self.mass_kg, "kg"),
                ("stroke", self.stroke_m * 1e3, "mm"),
                ("piston_area", self.piston_area_m2 * 1e4, "cm2"),
                ("dead_volume", self.dead_volume_m3 * 1e6, "cm3"),
                ("viscous_friction", self.viscous_ns_per_m, "N s/m"),
            ],
        );
        section(
            "spring",
            &[("stiffness", self.spring_n_per_m, "N/m"), ("preload_compression", self.preload_m * 1e3, "mm")],
        );
        section("stops", &[("contact_stiffness", self.contact_n_per_m, "N/m")]);
        section(
            "gas",
            &[
                ("ratio_of_specific_heats", GAMMA, ""),
                ("specific_gas_constant", GAS_CONSTANT, "J/(kg K)"),
                ("compressibility", 1.0, ""),
            ],
        );
        section(
            "pneumatics",
            &[
                ("supply_pressure", self.supply_psig, "psig"),
                ("ambient_pressure", AMBIENT_PA / 1e3, "kPa"),
                ("temperature", TEMPERATURE_K, "K"),
                ("pipe_volume", self.pipe_volume_m3 * 1e6, "cm3"),
                ("flow_coefficient", FLOW_COEFFICIENT, ""),
                ("solenoid_orifice_area", self.solenoid_area_m2 * 1e6, "mm2"),
                ("port_orifice_area", self.port_area_m2 * 1e6, "mm2"),
            ],
        );
        section("cycle", &[("close_at", 0.0, "s"), ("open_at", self.open_at_s, "s"), ("end", self.cycle_end_s, "s")]);
        section(
            "limits",
            &[
                ("close_within", self.open_at_s * 0.75, "s"),
                ("open_within", (self.cycle_end_s - self.open_at_s) * 0.75, "s"),
            ],
        );
        text.push_str("\n[tolerance]\n");
        for (key, sigma) in TOLERANCES {
            let _ = writeln!(text, "\"{key}\" = {sigma:.2}");
        }
        if self.orientation != Orientation::Upright {
            let line = format!("[actuator]\norientation = \"{}\"\n", self.orientation.word());
            text = text.replacen("[actuator]\n", &line, 1);
        }
        text
    }

    /// This valve with every number rounded to four digits in the unit in which
    /// [`Valve::to_toml`] writes it, so that file and memory tell the same.
    #[must_use]
    pub fn rounded(&self) -> Self {
        let r = |value: f64, scale: f64| format!("{:.3e}", value * scale).parse().unwrap_or(value * scale) / scale;
        Self {
            mass_kg: r(self.mass_kg, 1.0),
            stroke_m: r(self.stroke_m, 1e3),
            piston_area_m2: r(self.piston_area_m2, 1e4),
            dead_volume_m3: r(self.dead_volume_m3, 1e6),
            viscous_ns_per_m: r(self.viscous_ns_per_m, 1.0),
            spring_n_per_m: r(self.spring_n_per_m, 1.0),
            preload_m: r(self.preload_m, 1e3),
            contact_n_per_m: r(self.contact_n_per_m, 1.0),
            supply_psig: r(self.supply_psig, 1.0),
            pipe_volume_m3: r(self.pipe_volume_m3, 1e6),
            solenoid_area_m2: r(self.solenoid_area_m2, 1e6),
            port_area_m2: r(self.port_area_m2, 1e6),
            orientation: self.orientation,
            open_at_s: r(self.open_at_s, 1.0),
            cycle_end_s: r(self.cycle_end_s, 1.0),
        }
    }
}

/// A number with at most six decimals and no zeros at its end.
pub(crate) fn tidy(value: f64) -> String {
    let text = format!("{value:.6}");
    text.trim_end_matches('0').trim_end_matches('.').to_owned()
}
