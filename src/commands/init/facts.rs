//! What a valve file needs, where each number stands on a datasheet, and what it usually is.

use quantity::{Dimension, Quantity, pressure_pa};

use super::orifice::area_m2;
use super::typical::Size;

/// A number of the valve file that has a question of its own.
pub struct Fact {
    /// Its key.
    pub key: &'static str,
    /// The option that gives it.
    pub option: &'static str,
    /// What it is.
    pub what: &'static str,
    /// Where it stands.
    pub stands: &'static str,
    /// How it is written.
    pub example: &'static str,
    /// The unit in which a typical or converted value is written.
    pub unit: &'static str,
    /// From text to SI; the second is false where the text cannot stand in the file as it is.
    pub read: fn(&str) -> Result<(f64, bool), String>,
    /// What it usually is, SI.
    pub typical: fn(Size) -> f64,
    /// Relative one-sigma tolerance of a given and of a typical value; `None` for one that is trusted.
    pub tolerance: [Option<f64>; 2],
}

impl Fact {
    /// The name of its option, without the dashes.
    pub fn option_name(&self) -> &'static str {
        self.option.split(' ').next().unwrap_or(self.option).trim_start_matches('-')
    }
}

/// All that is asked after stroke, area and supply, in the order of the questions.
pub const FACTS: [Fact; 8] = [
    Fact {
        key: "actuator.moving_mass",
        option: "--moving-mass",
        what: "mass of piston, stem and plug",
        stands: "datasheets rarely give it; weigh the parts, or a share of the actuator's weight",
        example: "1.5 kg",
        unit: "kg",
        read: |text| plain(text, Dimension::Mass),
        typical: Size::mass_kg,
        tolerance: [None, Some(0.5)],
    },
    Fact {
        key: "spring.stiffness",
        option: "--spring-stiffness (or --bench-set)",
        what: "stiffness of the spring",
        stands: "datasheet: spring rate, Federrate; the bench set on the nameplate (\"0.8..2.4 bar\") gives it too",
        example: "16 N/mm",
        unit: "kN/m",
        read: |text| zero_or_more(text, Dimension::Stiffness),
        typical: Size::stiffness_n_per_m,
        tolerance: [Some(0.03), Some(0.3)],
    },
    Fact {
        key: "spring.preload_compression",
        option: "--spring-preload (or --bench-set)",
        what: "compression of the spring with the valve open",
        stands: "free length of the spring less its length with the valve open, or its force then, such as \"300 lbf\"; or from the bench set",
        example: "36 mm",
        unit: "mm",
        read: |text| zero_or_more(text, Dimension::Length),
        typical: Size::preload_m,
        tolerance: [Some(0.05), Some(0.3)],
    },
    Fact {
        key: "actuator.dead_volume",
        option: "--dead-volume",
        what: "volume of the chamber with the valve open",
        stands: "datasheet: dead volume, clearance volume, Totvolumen; or the chamber's volume less what the piston sweeps",
        example: "30 cm3",
        unit: "cm3",
        read: |text| plain(text, Dimension::Volume),
        typical: Size::dead_volume_m3,
        tolerance: [Some(0.1), Some(0.5)],
    },
    Fact {
        key: "actuator.viscous_friction",
        option: "--viscous-friction",
        what: "viscous friction of seals and guides",
        stands: "on no datasheet: leave it typical, a calibration finds it",
        example: "600 N s/m",
        unit: "N s/m",
        read: |text| zero_or_more(text, Dimension::ViscousFriction),
        typical: Size::friction_n_s_per_m,
        tolerance: [Some(0.2), Some(0.5)],
    },
    Fact {
        key: "pneumatics.solenoid_orifice_area",
        option: "--solenoid",
        what: "orifice of the solenoid valve",
        stands: "solenoid's nameplate or datasheet: DN, orifice, Nennweite, Kv, Cv, or C (ISO 6358)",
        example: "1.2 mm, 0.5 mm2, Kv 0.03, Cv 0.04 or C 0.1",
        unit: "mm2",
        read: |text| orifice(text),
        typical: Size::solenoid_m2,
        tolerance: [Some(0.1), Some(0.5)],
    },
    Fact {
        key: "pneumatics.port_orifice_area",
        option: "--port",
        what: "orifice between pipe and cylinder: port, fitting or throttle, whichever is the narrowest",
        stands: "bore of the port's thread or of the throttle; the solenoid's datasheet does not have it",
        example: "2.1 mm or 3.5 mm2",
        unit: "mm2",
        read: |text| orifice(text),
        typical: Size::port_m2,
        tolerance: [Some(0.2), Some(0.5)],
    },
    Fact {
        key: "pneumatics.pipe_volume",
        option: "--pipe",
        what: "volume between solenoid and cylinder",
        stands: "length and inner diameter of the hose, measured",
        example: "40 cm3, or 6 mm x 1.4 m",
        unit: "cm3",
        read: pipe,
        typical: Size::pipe_m3,
        tolerance: [Some(0.1), Some(0.5)],
    },
];

/// A quantity above 0.
pub fn plain(text: &str, dimension: Dimension) -> Result<(f64, bool), String> {
    let (si, _) = zero_or_more(text, dimension)?;
    if si > 0.0 { Ok((si, true)) } else { Err(format!("\"{text}\" is not above 0")) }
}

/// A quantity of 0 or more.
fn zero_or_more(text: &str, dimension: Dimension) -> Result<(f64, bool), String> {
    let si = Quantity::parse(text, dimension).map_err(|error| error.to_string())?.si();
    if si >= 0.0 && si.is_finite() { Ok((si, true)) } else { Err(format!("\"{text}\" is not 0 or more")) }
}

/// The compression of a spring, m, as a length or as the force that its stiffness makes of it.
pub fn preload(text: &str, stiffness_n_per_m: f64) -> Result<(f64, bool), String> {
    match Quantity::parse(text, Dimension::Force) {
        Ok(_) if stiffness_n_per_m <= 0.0 => {
            Err(format!("\"{text}\" is a force, which is a compression only with a stiffness above 0"))
        }
        Ok(force) if force.si() >= 0.0 => Ok((force.si() / stiffness_n_per_m, false)),
        _ => zero_or_more(text, Dimension::Length),
    }
}

fn orifice(text: &str) -> Result<(f64, bool), String> {
    Ok((area_m2(text)?, Quantity::parse(text, Dimension::Area).is_ok()))
}

/// A volume, or inner diameter times length of a hose.
fn pipe(text: &str) -> Result<(f64, bool), String> {
    let Some((diameter, length)) = text.split_once(" x ").or_else(|| text.split_once('×')) else {
        return plain(text, Dimension::Volume);
    };
    let (diameter_m, _) = plain(diameter, Dimension::Length)?;
    let (length_m, _) = plain(length, Dimension::Length)?;
    Ok((0.25 * std::f64::consts::PI * diameter_m.powi(2) * length_m, false))
}

/// The two ends of a bench set, Pa above the atmosphere.
pub fn bench_set_pa(text: &str) -> Result<(f64, f64), String> {
    let expected = "a bench set is a range such as \"0.8..2.4 barg\" or \"3-15 psig\"";
    let (low, high) =
        ["..", " to ", "-", "–"].into_iter().find_map(|mark| text.trim().split_once(mark)).ok_or(expected)?;
    let unit =
        high.trim().trim_start_matches(|character: char| character.is_ascii_digit() || ".+ ".contains(character));
    // A bench set is always gauge, however it is written.
    let gauge = |number: &str| {
        let unit = unit.trim();
        let bare = ["bar", "psi"].into_iter().any(|bare| unit.eq_ignore_ascii_case(bare));
        let text = if bare { format!("{number} {unit}g") } else { format!("{number} {unit}") };
        pressure_pa(&text, 0.0).map_err(|error| format!("{error}; {expected}"))
    };
    let high_number = high.trim().strip_suffix(unit.trim()).unwrap_or(high).trim();
    let low_number = low.trim().strip_suffix(unit.trim()).unwrap_or(low).trim();
    let (low_pa, high_pa) = (gauge(low_number)?, gauge(high_number)?);
    if low_pa >= 0.0 && high_pa > low_pa {
        Ok((low_pa, high_pa))
    } else {
        Err(format!("\"{text}\" does not rise; {expected}"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn typical_values_of_the_known_valve_are_near_its_own() {
        let size = Size { stroke_m: 0.0254, area_m2: 31.17e-4, supply_gauge_pa: 75.0 * 6894.757 };
        let known = [1.5, 16e3, 0.036, 30e-6, 600.0, 0.5e-6, 3.488e-6, 40e-6];
        for (fact, known) in FACTS.iter().zip(known) {
            let typical = (fact.typical)(size);
            assert!((0.4..2.5).contains(&(typical / known)), "{}: {typical} for {known}", fact.key);
        }
    }

    #[test]
    fn every_example_is_read() {
        for fact in &FACTS {
            let first = fact.example.split([',']).next().unwrap().split(" or ").next().unwrap();
            assert!((fact.read)(first).is_ok(), "{}", fact.key);
        }
        assert!((pipe("6 mm x 1.4 m").unwrap().0 - 39.6e-6).abs() < 0.1e-6);
        assert_eq!(bench_set_pa("0.8..2.4 bar").unwrap(), (0.8e5, 2.4e5));
        assert!((bench_set_pa("3 psig to 15 psig").unwrap().1 - 15.0 * 6894.757).abs() < 1e-6);
        for text in ["3-15 psig", "3 - 15 psig", "3–15 PSI", "3 psig - 15 psig", "3..15 psi gauge"] {
            assert_eq!(bench_set_pa(text).unwrap(), bench_set_pa("3..15 psig").unwrap(), "{text}");
        }
        assert!((bench_set_pa("26.8 - 45.7 psig").unwrap().0 - 26.8 * 6894.757).abs() < 1e-6);
        assert!(bench_set_pa("-3 psig").is_err() && bench_set_pa("15-3 psig").is_err());
        assert!(bench_set_pa("2.4..0.8 barg").is_err() && bench_set_pa("0.8 barg").is_err());
    }
}
