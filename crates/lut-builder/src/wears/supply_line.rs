//! The fill path passes less; the vent path stays as it is.

use valve_model::EffectKind;

use super::{described, shares};
use crate::wear::Wear;

pub(super) fn wear() -> Wear {
    Wear {
        degradation: described("supply-line"),
        reach: shares,
        apply: |worn, clogged| {
            if clogged == 0.0 {
                return Ok(());
            }
            // The model has one area for both paths and a factor for the vent, which is widened by what the area loses.
            let open = 1.0 - clogged;
            let factor = worn.size_of(EffectKind::VENT_RESTRICTION).unwrap_or(1.0);
            worn.parameters.solenoid_orifice_area_m2 *= open;
            worn.set(EffectKind::VENT_RESTRICTION, &[Some(factor / open)])
        },
    }
}
