//! Leaks of the pipe.

use valve_model::Valve;

use super::described;
use crate::wear::Wear;

/// Largest leaks tried, in areas of the solenoid's orifice.
const REACH: [f64; 4] = [2.0, 8.0, 32.0, 128.0];

fn reach(valve: &Valve) -> Vec<f64> {
    REACH.map(|reach| reach * valve.parameters().solenoid_orifice_area_m2).into()
}

pub(super) fn to_atmosphere() -> Wear {
    Wear {
        degradation: described("atmosphere"),
        reach,
        apply: |worn, area_m2| {
            worn.conditions.leak_to_atmosphere_m2 = area_m2;
            Ok(())
        },
    }
}

pub(super) fn from_supply() -> Wear {
    Wear {
        degradation: described("supply"),
        reach,
        apply: |worn, area_m2| {
            worn.conditions.leak_from_supply_m2 = area_m2;
            Ok(())
        },
    }
}
