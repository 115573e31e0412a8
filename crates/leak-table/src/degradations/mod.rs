//! The degradations that come along, one file each.
//!
//! To add one: a file here, a line below, and a file and a line in the builder that says how it
//! changes the model.

mod atmosphere;
mod exhaust;
mod friction;
mod solenoid;
mod spring;
mod supply;
mod supply_line;

use std::borrow::Cow;

use crate::degradation::{Degradation, Severity};

/// In the order used throughout; the two leaks come first.
static CATALOGUE: [Degradation; 7] =
    [atmosphere::INFO, supply::INFO, friction::INFO, spring::INFO, exhaust::INFO, supply_line::INFO, solenoid::INFO];

impl Degradation {
    /// The degradations that come along, the two leaks first.
    #[must_use]
    pub fn catalogue() -> &'static [Self] {
        &CATALOGUE
    }

    /// The degradation of the catalogue with this id.
    #[must_use]
    pub fn from_id(id: &str) -> Option<&'static Self> {
        CATALOGUE.iter().find(|degradation| degradation.id == id)
    }
}

/// What a leak is measured by.
const LEAK_AREA: Severity = Severity {
    quantity: Cow::Borrowed("leak area"),
    unit: Cow::Borrowed("mm2"),
    column: Cow::Borrowed("leak_area_mm2"),
    per_si: 1e6,
};

/// A severity that is a share of something, 0 to 1.
const fn share(quantity: &'static str, column: &'static str) -> Severity {
    Severity { quantity: Cow::Borrowed(quantity), unit: Cow::Borrowed(""), column: Cow::Borrowed(column), per_si: 1.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ids_and_columns_are_what_files_can_hold() {
        for (index, degradation) in CATALOGUE.iter().enumerate() {
            let plain =
                |text: &str| text.bytes().all(|b| b.is_ascii_lowercase() || b.is_ascii_digit() || b"-_".contains(&b));
            assert!(plain(&degradation.id) && plain(&degradation.severity.column), "{degradation:?}");
            assert!(CATALOGUE[..index].iter().all(|other| other.id != degradation.id), "{}", degradation.id);
            assert!(degradation.severity.column.ends_with(&degradation.severity.unit.to_lowercase()));
            assert_eq!(Degradation::from_id(&degradation.id), Some(degradation));
            // Something must tell the severity.
            assert!(degradation.moves.close.or(degradation.moves.open).is_some());
        }
    }

    #[test]
    fn severities_are_shown_in_the_unit_of_files() {
        assert_eq!(LEAK_AREA.text(0.25e-6), "0.25 mm2");
        assert_eq!(share("lost share", "lost").text(0.4), "0.4");
    }
}
