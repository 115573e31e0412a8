//! Orifices as datasheets give them: a diameter, an area, or a flow coefficient.

use quantity::{Dimension, Quantity};

/// Part of the geometric area through which gas flows in the model, for orifices that a flow coefficient describes.
pub const DISCHARGE: f64 = 0.86;

/// Water through an ideal orifice at 1 bar: Kv of 1 m3/h is so many m2 (Q = A sqrt(2 dp / rho), IEC 60534-1).
const KV_M2: f64 = 1.0 / 3600.0 / 14.142_135_623_730_951;
/// Kv of a Cv of 1 (US gallons a minute at 1 psi).
const KV_OF_CV: f64 = 0.865;
/// Choked air at 20 degC: a sonic conductance of 1 l/(s bar) is so many m2 (ISO 6358-1: m = C rho0 p, with
/// m = A p 0.0404 / sqrt(T), rho0 = 1.185 kg/m3).
const CONDUCTANCE_M2: f64 = 1.185e-8 / 0.0404 * 17.121_623_755_944_33;

/// The geometric area of an orifice, m2.
pub fn area_m2(text: &str) -> Result<f64, String> {
    let text = text.trim();
    for (name, effective_m2) in [("Kv", KV_M2), ("Cv", KV_OF_CV * KV_M2), ("C", CONDUCTANCE_M2)] {
        let number = text.strip_prefix(name).map(|rest| rest.trim_start_matches(['=', ' ']));
        if let Some(number) = number.and_then(|number| number.trim().parse::<f64>().ok()) {
            return positive(number * effective_m2 / DISCHARGE);
        }
    }
    for name in ["DN", "NW", "Ø", "ø"] {
        let number = text.strip_prefix(name).map(|rest| rest.trim().trim_end_matches("mm").trim_end());
        if let Some(diameter_mm) = number.and_then(|number| number.parse::<f64>().ok()) {
            return positive(0.25 * std::f64::consts::PI * (1e-3 * diameter_mm).powi(2));
        }
    }
    if let Ok(diameter) = Quantity::parse(text, Dimension::Length) {
        return positive(0.25 * std::f64::consts::PI * diameter.si().powi(2));
    }
    let area = Quantity::parse(text, Dimension::Area);
    let expected = "a diameter such as \"1.2 mm\" or \"DN 1.2\", an area such as \"0.5 mm2\", or \"Kv 0.03\", \"Cv 0.04\", \"C 0.1\"";
    positive(area.map_err(|error| format!("{error}; an orifice is {expected}"))?.si())
}

fn positive(area_m2: f64) -> Result<f64, String> {
    if area_m2 > 0.0 && area_m2.is_finite() { Ok(area_m2) } else { Err("an orifice above 0 is needed".to_owned()) }
}

#[cfg(test)]
mod tests {
    use super::area_m2;

    #[test]
    fn all_ways_of_a_datasheet_lead_to_an_area() {
        let near = |text: &str, mm2: f64| {
            let area = area_m2(text).unwrap() * 1e6;
            assert!((area / mm2 - 1.0).abs() < 0.02, "{text}: {area}");
        };
        near("1.2 mm", 1.131);
        near("0.5 mm2", 0.5);
        // Nominal bores are diameters in mm, with and without the unit.
        for text in ["DN 1.2", "DN1.2", "NW 1.2 mm", "Ø 1.2 mm"] {
            near(text, 1.131);
        }
        // A Kv of 1 is an effective area of 19.6 mm2, a sonic conductance of 1 l/(s bar) one of 5.0 mm2.
        near("Kv 0.1", 1.964 / 0.86);
        near("Cv 0.1", 1.699 / 0.86);
        near("C 0.2", 1.004 / 0.86);
        assert!(
            area_m2("big").unwrap_err().contains("Kv 0.03") && area_m2("0 mm").is_err() && area_m2("-1 mm2").is_err()
        );
    }
}
