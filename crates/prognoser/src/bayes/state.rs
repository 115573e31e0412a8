//! The state of a valve as plain numbers: what is kept from row to row, and
//! what a store of states writes. It has a bounded size.

#![expect(clippy::needless_range_loop, reason = "rows and columns of matrices")]

use serde::{Deserialize, Serialize};

use super::hypothesis::{Cause, Hypothesis, Mode, SIZE};
use super::law::Law;
use super::noise::NoiseState;

/// Version of [`ValveRecord`]. A record of another version is not understood.
pub const STATE_VERSION: u32 = 8;

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
    correlated: [f32; 2],
    left_s: [f32; 2],
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
    /// Shape of the inverse gamma posterior of the noise variance.
    pub(crate) shape: f32,
    /// By how much a reading counts less because noise goes on.
    pub(crate) inflation: f32,
    /// Probability so far that the valve would have ended in service.
    pub(crate) spent: f32,
    #[serde(rename = "parts")]
    hypotheses: Vec<StoredHypothesis>,
}

impl ValveRecord {
    pub(crate) fn new(shape: f64) -> Self {
        Self {
            version: STATE_VERSION,
            cycle: 0,
            readings: 0,
            shape: single(shape),
            inflation: 1.0,
            spent: 0.0,
            hypotheses: Vec::new(),
        }
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
            noise: NoiseState { weight: [1.0 - medium - strong, medium, strong], left_s: self.left_s.map(f64::from) },
        }
    }
}
