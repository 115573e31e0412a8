//! One hypothesis of a valve: what wears, by which law, how steadily, and a Gaussian
//! of the numbers that go with it.

#![expect(clippy::needless_range_loop, reason = "rows and columns of matrices")]

use serde::{Deserialize, Serialize};

use super::law::Law;
use super::noise::NoiseState;
use super::rate_prior::WideGrowth;
use super::special::{above_zero, quick_exp, quick_ln};

/// What wears.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) enum Cause {
    /// Nothing.
    None,
    /// The wear of this table.
    Wear(u8),
    /// Leaks of both kinds at once.
    Both,
    /// Both times drift freely.
    Other,
}

/// How steadily it goes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) enum Mode {
    /// At one pace since the first cycle of the log.
    Steady,
    /// At one pace since some later cycle.
    Late,
    /// The same at a slow pace, which takes many cycles to show.
    Slow,
    /// By increments that vary from cycle to cycle.
    Rough,
    /// At a pace that changes little by little.
    Wander,
    /// It rests.
    Rest,
}

/// Numbers of a hypothesis: coordinate, its growth per cycle, and the relative errors
/// of the tables' closing and opening time for this valve. For both leaks: the
/// two severities and their growths. For a free drift: what the two times are
/// off by, and how they drift, in s.
pub(crate) const SIZE: usize = 4;

/// Standard deviations from which on a severity can be told from none.
pub(crate) const SEEN_FROM: f64 = 3.0;

/// Most hypotheses that are made one: more than are kept.
const MOST_MERGED: usize = 80;

/// Change of the noise variance, a share of it, for which no prior is weighed anew.
const UNTUNED: f64 = 0.02;

/// Share of the variance that taking a prior away may leave at least; below, the covariance would no longer be one.
const LEAST_LEFT: f64 = 1e-3;

/// A hypothesis with its weight.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Hypothesis {
    pub cause: Cause,
    pub law: Law,
    pub mode: Mode,
    /// Logarithm of its weight.
    pub ln_weight: f64,
    /// Mean.
    pub mean: [f64; SIZE],
    /// Covariance in units of the noise variance.
    pub cov: [[f64; SIZE]; SIZE],
    /// Half the sum of squared innovations, with the prior's: the scale of the
    /// noise variance's inverse gamma posterior, s2.
    pub scale: f64,
    /// Prior variance of the relative errors of the tables.
    pub unit_variance: f64,
    /// Noise variance for which the priors are weighed within `cov`, s2.
    pub tuned: f64,
    /// Relative errors of the tables' closing and opening time that a hypothesis of both leaks was begun with.
    pub unit: [f64; 2],
    /// What is known of the correlation of the noise.
    pub noise: NoiseState,
    /// By how much the variance of a reading counts as larger in `cov`.
    pub inflation: f64,
    /// Cycles for which it has rested so far.
    pub rested: f64,
}

impl Hypothesis {
    /// Whether two hypotheses are of the same kind: cause, law and mode.
    pub(crate) fn same_kind(&self, other: &Self) -> bool {
        self.cause == other.cause && self.law == other.law && self.mode == other.mode
    }

    /// Sets variances, in s2 or squared units, given the noise variance.
    pub(crate) fn set_variances(&mut self, variances: [f64; SIZE], sigma2: f64) {
        self.cov = [[0.0; SIZE]; SIZE];
        for (i, variance) in variances.into_iter().enumerate() {
            self.cov[i][i] = variance / sigma2;
        }
    }

    /// Whether its first severity can be told from none.
    #[inline]
    pub(crate) fn is_seen(&self, shape: f64) -> bool {
        let square = SEEN_FROM * SEEN_FROM * self.cov[0][0] * self.scale;
        self.mean[0] > 0.0 && self.mean[0] * self.mean[0] * shape > square
    }

    /// Whether a severity is told to be negative.
    pub(crate) fn is_below_none(&self, number: usize, shape: f64) -> bool {
        let square = SEEN_FROM * SEEN_FROM * self.cov[number][number] * self.scale;
        self.mean[number] < 0.0 && self.mean[number] * self.mean[number] * shape > square
    }

    /// Whether so much more is known of the noise that the priors have to be weighed anew.
    #[inline]
    pub(crate) fn is_untuned(&self, sigma2: f64) -> bool {
        (sigma2 - self.tuned).abs() >= UNTUNED * self.tuned
    }

    /// Weighs the priors anew once more is known of the noise: in units of the
    /// noise variance the data keep their weight, the priors do not. Given are
    /// mean and variance of the prior of each number, variance zero for none.
    pub(crate) fn retune(&mut self, priors: [(f64, f64); SIZE], sigma2: f64) {
        let change = sigma2 - self.tuned;
        self.tuned = sigma2;
        for (k, (mean, variance)) in priors.into_iter().enumerate() {
            if variance == 0.0 || self.cov[k][k] == 0.0 {
                continue;
            }
            // A reading of the number at its prior mean, of which a part is
            // taken away again where the change is negative.
            let precision = change / variance;
            let denominator = 1.0 + precision * self.cov[k][k];
            if denominator < LEAST_LEFT {
                continue;
            }
            let gain: [f64; SIZE] = std::array::from_fn(|i| precision * self.cov[i][k] / denominator);
            let row = self.cov[k];
            let off = mean - self.mean[k];
            for i in 0..SIZE {
                self.mean[i] += gain[i] * off;
                for j in 0..SIZE {
                    self.cov[i][j] -= gain[i] * row[j];
                }
            }
        }
    }

    /// Brings the covariance in line with what is known of the noise.
    pub(crate) fn inflate(&mut self) {
        let inflation = self.noise.inflation();
        let ratio = inflation / self.inflation;
        if ratio != 1.0 {
            for value in self.cov.as_flattened_mut() {
                *value *= ratio;
            }
            self.tuned /= ratio;
            self.inflation = inflation;
        }
    }

    /// There is no negative severity: what lies below zero of a number is cut off, the rest
    /// taken for a Gaussian again.
    pub(crate) fn keep_positive(&mut self, number: usize, shape: f64) {
        let (mean, variance) = (self.mean[number], self.cov[number][number] * self.scale / shape);
        if mean >= 0.0 || variance <= 0.0 {
            return;
        }
        let sd = variance.sqrt();
        let (ln_share, mills) = above_zero(mean / sd);
        let by = mills * sd;
        let left = 1.0 - mills * (mills + mean / sd);
        self.ln_weight += ln_share;
        let row = self.cov[number];
        let along = row.map(|value| value / row[number]);
        for i in 0..SIZE {
            self.mean[i] += along[i] * by;
            for j in 0..SIZE {
                self.cov[i][j] -= along[i] * row[j] * (1.0 - left);
            }
        }
    }

    /// The same with one of its numbers known; nothing else is learnt.
    pub(crate) fn given(self, number: usize, value: f64) -> Self {
        self.matched(number, value, 0.0)
    }

    /// The means with one of the numbers known.
    pub(crate) fn means_given(&self, number: usize, value: f64) -> [f64; SIZE] {
        let row = &self.cov[number];
        if row[number] <= 0.0 {
            return self.mean;
        }
        let off = (value - self.mean[number]) / row[number];
        std::array::from_fn(|i| self.mean[i] + row[i] * off)
    }

    /// The same with another mean and variance, in units of the noise variance, of one of its numbers, which the others follow.
    pub(crate) fn matched(mut self, number: usize, mean: f64, variance: f64) -> Self {
        let row = self.cov[number];
        if row[number] <= 0.0 {
            return self;
        }
        let off = (mean - self.mean[number]) / row[number];
        let lost = (1.0 - variance / row[number]) / row[number];
        for i in 0..SIZE {
            self.mean[i] += row[i] * off;
            for j in 0..SIZE {
                self.cov[i][j] -= row[i] * row[j] * lost;
            }
        }
        self
    }

    /// Replaces the growth by a fresh guess, independent of everything else.
    pub(crate) fn with_growth(mut self, growth: WideGrowth, sigma2: f64) -> Self {
        self.begin_growth(growth, sigma2);
        self
    }

    /// The same in place.
    pub(crate) fn begin_growth(&mut self, WideGrowth { mean, sd }: WideGrowth, sigma2: f64) {
        for i in 0..SIZE {
            self.cov[i][1] = 0.0;
            self.cov[1][i] = 0.0;
        }
        self.mean[1] = mean;
        self.cov[1][1] = sd * sd / sigma2;
    }

    /// Tells its paces in a unit that is so many times as long.
    pub(crate) fn rescale(&mut self, by: f64) {
        let paces: &[usize] = match self.cause {
            Cause::None => &[],
            Cause::Wear(_) => &[1],
            Cause::Both | Cause::Other => &[2, 3],
        };
        for &pace in paces {
            self.mean[pace] *= by;
            for i in 0..SIZE {
                self.cov[pace][i] *= by;
            }
            for i in 0..SIZE {
                self.cov[i][pace] *= by;
            }
        }
    }

    /// Lets the growth go on at a pace that is off by some share.
    pub(crate) fn unsettle(&mut self, relative_sd: f64, shape: f64) {
        self.cov[1][1] += (relative_sd * self.mean[1]).powi(2) * shape / self.scale;
    }

    /// One hypothesis with the weight, mean and covariance of several, at most [`MOST_MERGED`].
    pub(crate) fn merged(hypotheses: &[Self], shape: f64) -> Self {
        debug_assert!(hypotheses.len() <= MOST_MERGED, "{} hypotheses", hypotheses.len());
        let top = hypotheses.iter().map(|hypothesis| hypothesis.ln_weight).fold(f64::NEG_INFINITY, f64::max);
        let mut shares = [0.0; MOST_MERGED];
        let mut total = 0.0;
        for (share, hypothesis) in shares.iter_mut().zip(hypotheses) {
            *share = quick_exp(hypothesis.ln_weight - top);
            total += *share;
        }
        let by_total = 1.0 / total;
        let mut out = Self {
            ln_weight: top + quick_ln(total),
            mean: [0.0; SIZE],
            cov: [[0.0; SIZE]; SIZE],
            scale: 0.0,
            unit_variance: 0.0,
            tuned: 0.0,
            unit: [0.0; 2],
            noise: NoiseState { weight: [0.0; 3], left_s: [0.0; 2] },
            inflation: 0.0,
            rested: 0.0,
            ..hypotheses[0]
        };
        for (share, hypothesis) in shares.iter_mut().zip(hypotheses) {
            *share *= by_total;
            let share = *share;
            for i in 0..SIZE {
                out.mean[i] += share * hypothesis.mean[i];
            }
            out.scale += share * hypothesis.scale;
            out.unit_variance += share * hypothesis.unit_variance;
            out.noise.mix(&hypothesis.noise, share);
            out.inflation += share * hypothesis.inflation;
            out.rested += share * hypothesis.rested;
            for stroke in 0..2 {
                out.unit[stroke] += share * hypothesis.unit[stroke];
            }
        }
        let by_sigma2 = shape / out.scale;
        for (share, hypothesis) in shares.iter().zip(hypotheses) {
            let own = hypothesis.scale / out.scale;
            out.tuned += share * hypothesis.tuned / own;
            let (inside, apart) = (share * own, share * by_sigma2);
            let mut off = [0.0; SIZE];
            for i in 0..SIZE {
                off[i] = hypothesis.mean[i] - out.mean[i];
            }
            for i in 0..SIZE {
                let along = apart * off[i];
                for j in 0..SIZE {
                    out.cov[i][j] += inside * hypothesis.cov[i][j] + along * off[j];
                }
            }
        }
        out
    }
}
