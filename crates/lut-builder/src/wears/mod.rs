//! What each degradation of the catalogue does to a valve, one file each.

mod exhaust;
mod friction;
mod leaks;
mod solenoid;
mod spring;
mod supply_line;

use leak_table::Degradation;
use valve_model::Valve;

use crate::wear::Wear;

impl Wear {
    /// The two leaks, which every bundle of tables has.
    #[must_use]
    pub fn leaks() -> Vec<Self> {
        vec![leaks::to_atmosphere(), leaks::from_supply()]
    }

    /// All that come along, the two leaks first.
    #[must_use]
    pub fn catalogue() -> Vec<Self> {
        let others = [friction::wear(), spring::wear(), exhaust::wear(), supply_line::wear(), solenoid::wear()];
        Self::leaks().into_iter().chain(others).collect()
    }
}

/// The description of a degradation of the catalogue.
fn described(id: &str) -> Degradation {
    Degradation::from_id(id).expect("the catalogue of leak-table has every id that is asked for here").clone()
}

/// How much of a path may be clogged or of a force be lost, one after the other: nearly all in the end.
fn shares(_: &Valve) -> Vec<f64> {
    vec![0.5, 0.9, 0.99, 0.999]
}
