//! The vent path passes less.

use valve_model::EffectKind;

use super::{described, shares};
use crate::wear::Wear;

pub(super) fn wear() -> Wear {
    Wear {
        degradation: described("exhaust"),
        reach: shares,
        apply: |worn, clogged| {
            if clogged == 0.0 {
                return Ok(());
            }
            let factor = worn.size_of(EffectKind::VENT_RESTRICTION).unwrap_or(1.0);
            worn.set(EffectKind::VENT_RESTRICTION, &[Some(factor * (1.0 - clogged))])
        },
    }
}
