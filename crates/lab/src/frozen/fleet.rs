//! How the valves of a log stand, and how each came to that.

use std::sync::Arc;

use leak_table::TableBundle;
use prognoser::{LogRow, Method, Prognosis};

use crate::watch::fleet::{Fleet, WholeFleet};

/// Points of the pasts of all valves together, so that a page of many valves stays small.
const POINTS: usize = 28_000;

/// Points of one valve's past: the least that still show how it came to its end, and the most.
const POINTS_OF_VALVE: [usize; 2] = [10, 240];

/// Valves of a log that is read once.
pub struct FrozenFleet(Fleet);

impl FrozenFleet {
    /// Before the first row.
    pub fn new(tables: &Arc<TableBundle>) -> Self {
        Self(Fleet::new(Arc::clone(tables), &Method::default()))
    }

    /// Takes in what was told of a row.
    pub fn take(&self, row: &LogRow<'_>, told: &Prognosis) {
        self.0.take(row, told.clone());
    }

    /// What the page shows: all valves, and the past of each.
    pub fn whole(&self, log: &str) -> WholeFleet {
        let count = POINTS / self.0.len().max(1);
        self.0.whole(log, count.clamp(POINTS_OF_VALVE[0], POINTS_OF_VALVE[1]))
    }
}
