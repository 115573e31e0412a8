//! What the estimator says after a cycle.

use leak_table::{Degradation, DegradationId};
use serde::ser::SerializeMap;
use serde::{Serialize, Serializer};

use super::ending::Quantiles;
use super::hypothesis::Cause;
use super::plant::{MOST_WEARS, Plant};
use crate::fault_call::FaultCall;

/// What has changed at a cycle.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Change {
    /// The wear fell.
    Repaired,
    /// It stepped up.
    Stepped,
    /// Nothing that was thought of the valve explains its last rows: the estimate began anew.
    Anew,
    /// Its times are again what they were while it was healthy, after others that nothing explained.
    AsBefore,
}

/// Probability of each hypothesis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FaultProbability {
    /// Nothing wears.
    pub none: f64,
    /// Each kind of wear that there is a table for.
    wears: [(DegradationId, f64); MOST_WEARS],
    count: usize,
    /// Leaks of both kinds.
    pub both_leaks: f64,
    /// A drift that no table has.
    pub other: f64,
}

impl FaultProbability {
    /// Nothing for anything, with these kinds of wear.
    pub(crate) fn new(plant: &Plant) -> Self {
        let mut wears = [(DegradationId::new(""), 0.0); MOST_WEARS];
        for wear in 0..plant.wears() {
            wears[usize::from(wear)].0 = plant.id(wear);
        }
        Self { none: 0.0, wears, count: usize::from(plant.wears()), both_leaks: 0.0, other: 0.0 }
    }

    /// From each probability; wears beyond those that there can be are left out.
    pub(crate) fn of_shares(none: f64, shares: &[(DegradationId, f64)], both_leaks: f64, other: f64) -> Self {
        let mut wears = [(DegradationId::new(""), 0.0); MOST_WEARS];
        let count = shares.len().min(MOST_WEARS);
        wears[..count].copy_from_slice(&shares[..count]);
        Self { none, wears, count, both_leaks, other }
    }

    /// Each kind of wear that there is a table for.
    pub fn wears(&self) -> &[(DegradationId, f64)] {
        &self.wears[..self.count]
    }

    /// The probability of one fault; of "undecided", and of what has no table, nothing.
    pub fn of(&self, fault: FaultCall) -> f64 {
        match fault {
            FaultCall::None => self.none,
            FaultCall::Wears(id) => self.wears().iter().find(|(wear, _)| *wear == id).map_or(0.0, |(_, share)| *share),
            FaultCall::BothLeaks => self.both_leaks,
            FaultCall::Other => self.other,
            FaultCall::Undecided => 0.0,
        }
    }

    pub(crate) fn add(&mut self, cause: Cause, share: f64) {
        let slot = match cause {
            Cause::None => &mut self.none,
            Cause::Wear(wear) => &mut self.wears[usize::from(wear)].1,
            Cause::Both => &mut self.both_leaks,
            Cause::Other => &mut self.other,
        };
        *slot += share;
    }

    /// The same with something done to each.
    pub(crate) fn map(mut self, change: impl Fn(f64) -> f64) -> Self {
        for (_, value) in &mut self.wears {
            *value = change(*value);
        }
        for value in [&mut self.none, &mut self.both_leaks, &mut self.other] {
            *value = change(*value);
        }
        self
    }

    /// What most likely wears; of equal causes, the first of the tables.
    #[expect(clippy::cast_possible_truncation, reason = "at most MOST_WEARS")]
    pub(crate) fn leading(&self) -> (Cause, f64) {
        let mut best = (Cause::Other, f64::NEG_INFINITY);
        let wears = self.wears().iter().enumerate().map(|(wear, (_, share))| (Cause::Wear(wear as u8), *share));
        for (cause, share) in wears.chain([(Cause::Both, self.both_leaks), (Cause::Other, self.other)]) {
            if share > best.1 {
                best = (cause, share);
            }
        }
        best
    }

    fn faults(&self) -> impl Iterator<Item = (FaultCall, f64)> {
        let wears = self.wears().iter().map(|(id, share)| (FaultCall::Wears(*id), *share));
        wears.chain([(FaultCall::BothLeaks, self.both_leaks), (FaultCall::Other, self.other)])
    }

    /// All faults, likeliest first; of equal ones, in the order of the tables.
    pub(crate) fn ranked(&self) -> Vec<(FaultCall, f64)> {
        let mut all: Vec<_> = self.faults().collect();
        all.sort_by(|a, b| b.1.total_cmp(&a.1));
        all
    }
}

/// Every fault of the catalogue, with or without a table, and the tables' own.
impl Serialize for FaultProbability {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let catalogue = Degradation::catalogue();
        let is_own = |id: DegradationId| catalogue.iter().all(|known| known.id != id);
        let mut map = serializer.serialize_map(None)?;
        map.serialize_entry("none", &self.none)?;
        for known in catalogue {
            map.serialize_entry(known.id.name(), &self.of(FaultCall::Wears(known.id)))?;
        }
        for (id, share) in self.wears().iter().filter(|(id, _)| is_own(*id)) {
            map.serialize_entry(id.name(), share)?;
        }
        map.serialize_entry(FaultCall::BothLeaks.name(), &self.both_leaks)?;
        map.serialize_entry(FaultCall::Other.name(), &self.other)?;
        map.end()
    }
}

/// The name of a cause.
pub(crate) fn fault_call(cause: Cause, plant: &Plant) -> FaultCall {
    match cause {
        Cause::None => FaultCall::None,
        Cause::Wear(wear) => FaultCall::Wears(plant.id(wear)),
        Cause::Both => FaultCall::BothLeaks,
        Cause::Other => FaultCall::Other,
    }
}

/// What is asked of an estimate.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Wanted {
    /// Its numbers.
    Numbers,
    /// Of its end, no more than whether it is now, and whether what is left of the risk is used up within less than each of
    /// some cycles, in rising order.
    Standing([f64; 2]),
}

/// The estimate after a cycle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BayesEstimate {
    /// Probability of each hypothesis.
    pub probability: FaultProbability,
    /// The most probable fault; severity, growth and end of life hold given it.
    pub leading: FaultCall,
    /// Severity now: 1 at the limit. Of a free drift, the share of the way to
    /// the limit.
    pub severity: f64,
    /// Growth of the severity a cycle, now.
    pub growth: f64,
    /// Best single estimate of the cycle at end of life, the one with the
    /// smallest expected relative error, with its distribution; none while
    /// nothing wears.
    pub end: Option<EndEstimate>,
    /// Number of readings so far.
    pub readings: u64,
    /// Estimated standard deviation of the timings' noise, in s.
    pub noise_sd_s: f64,
    /// By how much a reading counts less because noise goes on.
    pub inflation: f64,
    /// The same as expected over all that the noise may yet turn out to be, which is larger.
    pub doubt: f64,
    /// Relative errors of the tables for this valve, closing and opening, with
    /// their standard deviations.
    pub unit: [(f64, f64); 2],
    /// Probability that the closing and the opening time of this cycle were
    /// proper readings.
    pub inlier: [f64; 2],
    /// Residuals of this cycle's times against what was expected of them, in s.
    pub residual_s: [Option<f64>; 2],
    /// What has changed at this cycle.
    pub change: Option<Change>,
    /// Given the fault: probability that its growth is curved, varies from
    /// cycle to cycle, and rests.
    pub curved: f64,
    /// See [`curved`](Self::curved).
    pub rough: f64,
    /// See [`curved`](Self::curved).
    pub resting: f64,
    /// Given that something wears: probability that its severity can be told from none.
    pub seen: f64,
}

/// The end of life.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EndEstimate {
    /// The best single estimate, a cycle.
    pub cycle: f64,
    /// The distribution.
    pub quantiles: Quantiles,
    /// The cycle before which the end comes with what is left of the configured risk.
    pub at_risk: f64,
    /// Probability that the end comes within a cycle.
    pub soon: f64,
}
