//! What looks wrong in a valve file that can be used.

use crate::ValveFile;

/// A value that can be and hardly is, with its place.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("{file}:{line}: {key} {found}; {question}")]
pub struct ValveDoubt {
    /// The file.
    pub file: String,
    /// The line, counted from 1.
    pub line: usize,
    /// The key with its table.
    pub key: &'static str,
    /// What was found.
    pub found: String,
    /// What is probably meant.
    pub question: &'static str,
}

/// Atmospheric pressures from the highest mines' depths to 5000 m, Pa.
const AMBIENT_PA: std::ops::RangeInclusive<f64> = 50e3..=115e3;
/// Supply pressures of pneumatic actuators above the atmosphere, Pa.
const SUPPLY_GAUGE_PA: std::ops::RangeInclusive<f64> = 30e3..=2.5e6;
/// Temperatures that gas and seals of hardly any valve leave, K.
const TEMPERATURE_K: std::ops::RangeInclusive<f64> = 223.0..=403.0;
/// Bores of the smallest pen-sized cylinders to the largest gate valves' actuators, m.
const BORE_M: std::ops::RangeInclusive<f64> = 1e-3..=3.0;
/// Strokes of pilot valves to those of sluice gates, m.
const STROKE_M: std::ops::RangeInclusive<f64> = 1e-4..=5.0;
/// A dead volume or a pipe of more than so many swept volumes, m3/m3.
const LARGE_VOLUME: f64 = 20.0;
/// An orifice larger than this share of the piston, m2/m2.
const LARGE_ORIFICE: f64 = 0.25;

impl ValveFile {
    /// What looks wrong though it can be used: values in the unit of another one, a valve that cannot close, limits
    /// beyond the cycle. Empty for nearly every file.
    #[must_use]
    pub fn doubts(&self) -> Vec<ValveDoubt> {
        let mut doubts = Vec::new();
        let mut doubt = |key: &'static str, found: String, question: &'static str| {
            let (table, name) = key.split_once('.').unwrap_or(("", key));
            let line = self.document.root().section(table).ok().flatten().map_or(1, |section| section.line_of(name));
            doubts.push(ValveDoubt { file: self.file_name().to_owned(), line, key, found, question });
        };
        let parameters = self.valve.parameters();
        let ambient_pa = parameters.ambient_pressure_pa;
        if !AMBIENT_PA.contains(&ambient_pa) {
            doubt(
                "pneumatics.ambient_pressure",
                format!("is {ambient_pa} Pa absolute"),
                "is its unit right (kPa called Pa)?",
            );
        }
        let gauge_pa = parameters.supply_pressure_pa - ambient_pa;
        if !SUPPLY_GAUGE_PA.contains(&gauge_pa) {
            let found = format!("is {:.4} bar above the atmosphere", gauge_pa / 1e5);
            doubt(
                "pneumatics.supply_pressure",
                found,
                "is its unit right (kPa, bar and psi differ by factors of 7 to 100)?",
            );
        }
        let temperature_k = parameters.temperature_k;
        if !TEMPERATURE_K.contains(&temperature_k) {
            let found = format!("is {temperature_k:.2} K, which is {:.2} degC", temperature_k - 273.15);
            doubt("pneumatics.temperature", found, "is its unit right (kelvin called degC)?");
        }
        let bore_m = 2.0 * (parameters.piston_area_m2 / std::f64::consts::PI).sqrt();
        if !BORE_M.contains(&bore_m) {
            let found = format!("is that of a bore of {:.3} mm", 1e3 * bore_m);
            doubt("actuator.piston_area", found, "is its unit right (mm2, cm2 and in2 differ by factors of 6 to 645)?");
        }
        if !STROKE_M.contains(&parameters.stroke_m) {
            let found = format!("is {:.3} mm", 1e3 * parameters.stroke_m);
            doubt("actuator.stroke", found, "is its unit right (mm, cm and m differ by factors of 10 to 1000)?");
        }
        let swept_m3 = parameters.piston_area_m2 * parameters.stroke_m;
        for (key, volume_m3) in
            [("actuator.dead_volume", parameters.dead_volume_m3), ("pneumatics.pipe_volume", parameters.pipe_volume_m3)]
        {
            if volume_m3 > LARGE_VOLUME * swept_m3 {
                let found = format!("is {:.1} times the volume that the piston sweeps", volume_m3 / swept_m3);
                doubt(key, found, "are its unit, the piston's area and the stroke right?");
            }
        }
        for (key, area_m2) in [
            ("pneumatics.solenoid_orifice_area", parameters.solenoid_orifice_area_m2),
            ("pneumatics.port_orifice_area", parameters.port_orifice_area_m2),
        ] {
            if area_m2 > LARGE_ORIFICE * parameters.piston_area_m2 {
                let found = format!("is {:.2} of the piston's area", area_m2 / parameters.piston_area_m2);
                doubt(key, found, "is its unit right (cm2 called mm2, or the area of the pipe)?");
            }
        }
        let spring_n = parameters.spring_stiffness_n_per_m * (parameters.preload_compression_m + parameters.stroke_m);
        let supply_n = gauge_pa * parameters.piston_area_m2;
        if spring_n > supply_n {
            let found = format!("pushes with {spring_n:.0} N at the closed stop, the supply with {supply_n:.0} N");
            doubt("spring.stiffness", found, "the valve cannot close: are preload, stiffness, area and supply right?");
        }
        let (schedule, limits) = (self.schedule, self.limits);
        let for_s = [schedule.open_at_s - schedule.close_at_s, schedule.end_s - schedule.open_at_s];
        for (key, limit_s, for_s) in [
            ("limits.close_within", limits.close_within_s, for_s[0]),
            ("limits.open_within", limits.open_within_s, for_s[1]),
        ] {
            if limit_s > for_s {
                let [limit, room] = [limit_s, (for_s * 1e9).round() * 1e-9].map(quantity::format_number);
                let found = format!("is {limit} s, and the cycle leaves {room} s for that stroke");
                doubt(key, found, "no time beyond the cycle can be seen: is the cycle right?");
            }
        }
        doubts
    }
}
