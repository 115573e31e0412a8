//! Leak areas as whole numbers of the last digit that a table's file holds.

use leak_table::{m2_from_mm2, mm2_from_m2};

/// A geometric leak area in units of 1e-9 mm2.
pub(crate) type Area = u64;

const UNITS_PER_MM2: f64 = 1e9;

/// The area in m2: the very number that reading the table's file gives.
pub(crate) fn m2(area: Area) -> f64 {
    m2_from_mm2(area as f64 / UNITS_PER_MM2)
}

/// The nearest area to one in m2; 0 for a negative one.
pub(crate) fn nearest(area_m2: f64) -> Area {
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "saturates at the ends, which is meant"
    )]
    let area = (mm2_from_m2(area_m2) * UNITS_PER_MM2).round() as Area;
    area
}

/// The `count` areas that cut the gap between two areas into equal parts; fewer where it is narrow.
pub(crate) fn between(low: Area, high: Area, count: u64) -> Vec<Area> {
    let mut areas: Vec<Area> = (1..=count).map(|i| low + (high - low) * i / (count + 1)).collect();
    areas.dedup();
    areas.retain(|area| *area > low && *area < high);
    areas
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn areas_are_those_of_the_file() {
        for area in [1, 654_321_987, 123_456_789_012] {
            let text = format!("{:.9}", mm2_from_m2(m2(area)));
            let read = m2_from_mm2(text.parse().expect("a number"));
            assert_eq!(read, m2(area));
            assert_eq!(nearest(read), area);
        }
    }

    #[test]
    fn between_stays_inside() {
        assert_eq!(between(0, 8, 3), [2, 4, 6]);
        assert_eq!(between(5, 7, 7), [6]);
        assert!(between(5, 6, 7).is_empty());
    }
}
