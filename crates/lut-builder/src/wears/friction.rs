//! Dry friction of piston and rod, beyond what the valve has.

use valve_model::{EffectKind, Valve};

use super::described;
use crate::wear::Wear;

/// Largest frictions tried, in forces that the supply has left over on the piston.
const REACH: [f64; 3] = [0.5, 1.0, 2.0];

/// The first parameters of dry friction are its forces, Coulomb's and the static one.
const FORCES: usize = 2;

pub(super) fn wear() -> Wear {
    Wear {
        degradation: described("friction"),
        reach: |valve| REACH.map(|reach| reach * gas_force_n(valve)).into(),
        apply: |worn, force_n| {
            if force_n == 0.0 {
                return Ok(());
            }
            let present = worn.effects.iter().find(|effect| effect.kind() == EffectKind::DRY_FRICTION);
            // What rubs more while moving holds more at rest, where and whichever way it rubbed before.
            let values = present.map_or_else(
                || vec![Some(force_n)],
                |effect| {
                    let mut values: Vec<Option<f64>> = effect.values().iter().copied().map(Some).collect();
                    for force in &mut values[..FORCES] {
                        *force = force.map(|before_n| before_n + force_n);
                    }
                    values
                },
            );
            worn.set(EffectKind::DRY_FRICTION, &values)
        },
    }
}

/// The force of the full supply pressure on the piston, N.
fn gas_force_n(valve: &Valve) -> f64 {
    let parameters = valve.parameters();
    (parameters.supply_pressure_pa - parameters.ambient_pressure_pa) * parameters.piston_area_m2
}
