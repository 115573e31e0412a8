//! The spring pushes with a smaller force everywhere.

use super::{described, shares};
use crate::wear::Wear;

pub(super) fn wear() -> Wear {
    Wear {
        degradation: described("spring"),
        reach: shares,
        apply: |worn, lost| {
            worn.parameters.spring_stiffness_n_per_m *= 1.0 - lost;
            Ok(())
        },
    }
}
