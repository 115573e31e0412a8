//! The state of a valve as plain numbers: what is kept from row to row, and
//! what a store of states writes. It has a bounded size.

#![expect(clippy::needless_range_loop, reason = "rows and columns of matrices")]

use serde::{Deserialize, Serialize};

use super::hypothesis::{Cause, Hypothesis, Mode, SIZE};
use super::law::Law;
use super::noise::NoiseState;

/// Version of [`ValveRecord`]. A record of another version is not understood.
pub const STATE_VERSION: u32 = 12;

/// Ratio of the usual number of cycles between rows to the unit from which on the unit is another one: priors of paces and of
/// changes are wider than that.
const UNIT_APART: f64 = 4.0;
/// Share of the readings that are improper though a hypothesis is right, with some more than the outliers and strays that are
/// allowed for.
const USUALLY_IMPROPER: f64 = 0.05;
/// Nats for half of the readings being improper from which on no hypothesis is believed: more than once in a million rows by
/// chance is an alarm too many.
const NATS_OF_DOUBT: f64 = 14.0;

/// Numbers of a symmetric matrix.
const HALF: usize = SIZE * (SIZE + 1) / 2;

/// As it is kept: far more precise than any stroke is timed.
#[expect(clippy::cast_possible_truncation, reason = "single precision is meant")]
pub(crate) fn single(value: f64) -> f32 {
    value as f32
}

/// A hypothesis in single precision, which is far below the noise of any stroke.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
struct StoredHypothesis {
    cause: Cause,
    law: Law,
    mode: Mode,
    ln_weight: f32,
    mean: [f32; SIZE],
    cov: [f32; HALF],
    scale: f32,
    unit_variance: f32,
    tuned: f32,
    unit: [f32; 2],
    inflation: f32,
    rested: f32,
    correlated: [f32; 2],
    left_s: [f32; 2],
}

/// Times of a healthy valve: what its tables are off by, relative, and the variances of that.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct Baseline {
    mean: [f32; 2],
    variance: [f32; 2],
}

impl Baseline {
    /// That of a hypothesis with a noise variance.
    pub(crate) fn of(healthy: &Hypothesis, sigma2: f64) -> Self {
        Self {
            mean: [2, 3].map(|i| single(healthy.mean[i])),
            variance: [2, 3].map(|i| single(healthy.cov[i][i] * sigma2)),
        }
    }

    /// A healthy valve with these times.
    pub(crate) fn healthy(&self, mut new: Hypothesis, sigma2: f64) -> Hypothesis {
        let [close, open] = self.mean.map(f64::from);
        new.mean = [0.0, 0.0, close, open];
        let [close, open] = self.variance.map(f64::from);
        new.set_variances([0.0, 0.0, close, open], sigma2);
        new
    }
}

/// All that is remembered of the readings of one valve.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ValveRecord {
    /// [`STATE_VERSION`] of the program that wrote it.
    pub version: u32,
    /// Cycle of the latest reading.
    pub(crate) cycle: u64,
    /// Number of readings.
    pub(crate) readings: u64,
    /// Cycles that count as one: about as many as lie between two rows. Wear is looked for at paces a row, whatever the counter
    /// counts: with thousands of strokes a day a life is as many rows as with one.
    pub(crate) unit: u32,
    /// Cycles between the rows before, the latest first.
    gaps: [u32; 2],
    /// Evidence that no hypothesis is right, nats: [`doubted`](Self::doubted).
    improper: f32,
    /// Shape of the inverse gamma posterior of the noise variance.
    pub(crate) shape: f32,
    /// By how much a reading counts less because noise goes on.
    pub(crate) inflation: f32,
    /// Probability so far that the valve would have ended in service.
    pub(crate) spent: f32,
    /// Its times while it was last surely healthy.
    pub(crate) healthy: Option<Baseline>,
    /// Those before the estimate began anew, which may come back.
    pub(crate) before: Option<Baseline>,
    #[serde(rename = "parts")]
    hypotheses: Vec<StoredHypothesis>,
}

impl ValveRecord {
    pub(crate) fn new(shape: f64) -> Self {
        Self {
            version: STATE_VERSION,
            cycle: 0,
            readings: 0,
            unit: 1,
            gaps: [0; 2],
            improper: 0.0,
            shape: single(shape),
            inflation: 1.0,
            spent: 0.0,
            healthy: None,
            before: None,
            hypotheses: Vec::new(),
        }
    }

    /// The same of a valve of which nothing is known but how its cycles are counted, and what its times were.
    pub(crate) fn anew(&self, shape: f64) -> Self {
        Self { unit: self.unit, gaps: self.gaps, before: self.healthy.or(self.before), ..Self::new(shape) }
    }

    /// Takes in how many cycles lie before a reading. Where the usual number has become another one, by how much the unit has
    /// grown; of three the middle one is usual, so that a row that is missing does not count.
    pub(crate) fn pace(&mut self, cycles: u64) -> Option<f64> {
        let cycles = u32::try_from(cycles).unwrap_or(u32::MAX).max(1);
        let [last, before] = self.gaps;
        let is_second = last == 0;
        self.gaps = [cycles, last];
        let middle = cycles.max(last).min(cycles.min(last).max(before));
        // After two rows there is but one.
        let usual = if is_second { cycles } else { middle };
        let apart = f64::from(usual) / f64::from(self.unit);
        if usual == 0 || (1.0 / UNIT_APART < apart && apart < UNIT_APART) {
            return None;
        }
        self.unit = usual;
        Some(apart)
    }

    /// Takes in whether a reading was a proper one under the likeliest hypothesis, and tells whether so many were not that none
    /// of the hypotheses can be right: a sequential test (Wald) of half of them being improper against as many as there usually
    /// are, which begins anew wherever it speaks for the latter (Page's CUSUM).
    pub(crate) fn doubted(&mut self, is_proper: bool) -> bool {
        let [usual, doubtful] = [USUALLY_IMPROPER, 0.5];
        let nats = if is_proper { ((1.0 - doubtful) / (1.0 - usual)).ln() } else { (doubtful / usual).ln() };
        self.improper = single((f64::from(self.improper) + nats).max(0.0));
        f64::from(self.improper) > NATS_OF_DOUBT
    }

    /// Takes the hypotheses out to work on them.
    pub(crate) fn unpack(&self, hypotheses: &mut Vec<Hypothesis>) {
        hypotheses.clear();
        hypotheses.extend(self.hypotheses.iter().map(StoredHypothesis::unpacked));
    }

    /// Keeps the hypotheses.
    pub(crate) fn keep(&mut self, hypotheses: &[Hypothesis]) {
        self.hypotheses.clear();
        // There is one of these for every valve of a fleet: no room in advance.
        self.hypotheses.reserve_exact(hypotheses.len());
        self.hypotheses.extend(hypotheses.iter().map(StoredHypothesis::packed));
    }
}

impl StoredHypothesis {
    #[inline]
    #[expect(clippy::cast_possible_truncation, reason = "single precision is meant")]
    fn packed(hypothesis: &Hypothesis) -> Self {
        let mut cov = [0.0; HALF];
        let mut next = 0;
        for i in 0..SIZE {
            for j in i..SIZE {
                cov[next] = hypothesis.cov[i][j] as f32;
                next += 1;
            }
        }
        Self {
            cause: hypothesis.cause,
            law: hypothesis.law,
            mode: hypothesis.mode,
            ln_weight: hypothesis.ln_weight as f32,
            mean: hypothesis.mean.map(|value| value as f32),
            cov,
            scale: hypothesis.scale as f32,
            unit_variance: hypothesis.unit_variance as f32,
            tuned: hypothesis.tuned as f32,
            unit: hypothesis.unit.map(|unit| unit as f32),
            inflation: hypothesis.inflation as f32,
            rested: hypothesis.rested as f32,
            correlated: [hypothesis.noise.weight[1] as f32, hypothesis.noise.weight[2] as f32],
            left_s: hypothesis.noise.left_s.map(|left| left as f32),
        }
    }

    #[inline]
    fn unpacked(&self) -> Hypothesis {
        let [medium, strong] = self.correlated.map(f64::from);
        let mut cov = [[0.0; SIZE]; SIZE];
        let mut next = 0;
        for i in 0..SIZE {
            for j in i..SIZE {
                cov[i][j] = f64::from(self.cov[next]);
                cov[j][i] = cov[i][j];
                next += 1;
            }
        }
        Hypothesis {
            cause: self.cause,
            law: self.law,
            mode: self.mode,
            ln_weight: f64::from(self.ln_weight),
            mean: self.mean.map(f64::from),
            cov,
            scale: f64::from(self.scale),
            unit_variance: f64::from(self.unit_variance),
            tuned: f64::from(self.tuned),
            unit: self.unit.map(f64::from),
            inflation: f64::from(self.inflation),
            rested: f64::from(self.rested),
            noise: NoiseState { weight: [1.0 - medium - strong, medium, strong], left_s: self.left_s.map(f64::from) },
        }
    }
}
