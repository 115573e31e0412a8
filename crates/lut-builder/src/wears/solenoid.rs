//! Fill and vent path pass less, by the same share.

use super::{described, shares};
use crate::wear::Wear;

pub(super) fn wear() -> Wear {
    Wear {
        degradation: described("solenoid"),
        reach: shares,
        apply: |worn, clogged| {
            // What narrows the vent is a share of this area.
            worn.parameters.solenoid_orifice_area_m2 *= 1.0 - clogged;
            Ok(())
        },
    }
}
