//! SI values back in the unit that the user wrote.

use crate::{Quantity, Reference, Unit};

/// Significant digits written at most: below any tolerance that a valve's parameter has.
const DIGITS: usize = 7;

/// A number with up to seven significant digits, without trailing zeros; plain
/// between 1e-4 and 1e9, scientific beyond.
#[must_use]
pub fn format_number(number: f64) -> String {
    if number == 0.0 {
        return "0".into();
    }
    if !number.is_finite() {
        return if number.is_nan() {
            "nan".into()
        } else if number > 0.0 {
            "inf".into()
        } else {
            "-inf".into()
        };
    }
    let scientific = format!("{number:.*e}", DIGITS - 1);
    let rounded: f64 = scientific.parse().unwrap_or(number);
    // Printing the rounded double in the shortest form that reads back as itself drops the trailing zeros.
    if (1e-4..1e9).contains(&rounded.abs()) { format!("{rounded}") } else { format!("{rounded:e}") }
}

/// An SI value as text in `unit`, such as "25.4 mm". For a gauge unit the value is the gauge
/// pressure.
#[must_use]
pub fn format_si(si: f64, unit: &Unit) -> String {
    let number = format_number(unit.from_si(si));
    if unit.text().is_empty() { number } else { format!("{number} {}", unit.text()) }
}

/// An SI value as text in the unit of an earlier quantity. Where that is a gauge pressure, `si`
/// is absolute and is turned into a gauge pressure over `ambient_pressure_pa`.
#[must_use]
pub fn format_si_like(si: f64, earlier: &Quantity, ambient_pressure_pa: f64) -> String {
    let unit = earlier.unit();
    let gauge = unit.reference() == Reference::Gauge;
    format_si(if gauge { si - ambient_pressure_pa } else { si }, unit)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Dimension, si_value};
    use proptest::prelude::*;

    #[test]
    fn the_digits_are_those_that_matter() {
        let text = |si, unit| format_si(si, &Unit::parse(unit).unwrap());
        assert_eq!(text(0.0254, "mm"), "25.4 mm");
        assert_eq!(text(30e-6, "cm3"), "30 cm3");
        assert_eq!(text(1.0 / 3.0, "s"), "0.3333333 s");
        assert_eq!(text(293.15, "degC"), "20 degC");
        assert_eq!(text(3.2e-7, "kg/s"), "3.2e-7 kg/s");
        assert_eq!(text(0.86, ""), "0.86");
        assert_eq!(text(f64::INFINITY, "W/K"), "inf W/K");
        assert_eq!(text(-0.015, "ms"), "-15 ms");
    }

    #[test]
    fn a_gauge_pressure_stays_gauge() {
        let earlier = Quantity::parse("75 psig", Dimension::Pressure).unwrap();
        assert_eq!(format_si_like(80.0 * 6894.757 + 101_325.0, &earlier, 101_325.0), "80 psig");
    }

    proptest! {
        #[test]
        fn formatting_and_reading_give_the_value_back(
            mantissa in -9.999f64..9.999,
            power in -9i32..9,
            kind in 0usize..Dimension::ALL.len(),
            unit in 0usize..16,
        ) {
            let dimension = Dimension::ALL[kind];
            let number = mantissa * 10f64.powi(power);
            let units = dimension.units();
            let unit = Unit::parse(units.get(unit % units.len().max(1)).copied().unwrap_or("")).unwrap();
            let si = unit.to_si(number);
            let back = Quantity::parse(&format_si(si, &unit), dimension).unwrap().si();
            // Half of the seventh digit, and the rounding of a zero point that lies far off.
            let tolerance = 6e-7 * (si.abs() + unit.to_si(0.0).abs());
            prop_assert!((back - si).abs() <= tolerance, "{si} became {back}");
        }

        #[test]
        fn the_second_writing_equals_the_first(number in 1e-6f64..1e6, kind in 1usize..Dimension::ALL.len()) {
            let dimension = Dimension::ALL[kind];
            for unit in dimension.units() {
                let unit = Unit::parse(unit).unwrap();
                let once = format_si(unit.to_si(number), &unit);
                let twice = format_si(Quantity::parse(&once, dimension).unwrap().si(), &unit);
                prop_assert_eq!(once, twice);
            }
        }

        #[test]
        fn no_text_makes_the_reader_panic(text in "\\PC{0,24}") {
            for dimension in Dimension::ALL {
                let _ = Quantity::parse(&text, dimension);
            }
            let _ = si_value(&format!("1 {text}"), "N s/m");
        }
    }
}
