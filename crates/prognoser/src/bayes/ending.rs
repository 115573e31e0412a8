//! When the stories end.

use super::special::normal_tail;

/// Three quantiles of a distribution.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Quantiles {
    /// 5 %.
    pub p05: f64,
    /// 50 %.
    pub p50: f64,
    /// 95 %.
    pub p95: f64,
}

/// Remaining lives are looked for up to so many cycles.
const LONGEST: f64 = 1e5;
/// Halvings of a bracket in which a quantile lies.
const HALVINGS: usize = 18;
/// Remaining cycles below which an error is no longer counted relative to them.
const SOON: f64 = 0.5;
/// Weight below which a way to end does not count.
const NEGLIGIBLE: f64 = 5e-4;

/// A level that rises along a straight line with Gaussian uncertainty until it
/// reaches 1, in cycles from now.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Line {
    pub weight: f64,
    /// Level and growth a cycle.
    pub level: f64,
    pub growth: f64,
    /// Variances of level and growth, and their covariance.
    pub var_level: f64,
    pub cov: f64,
    pub var_growth: f64,
    /// Variance added in each cycle to come.
    pub rough: f64,
    /// Variance of the change of the growth in each cycle to come.
    pub turns: f64,
    /// Cycles before it goes on.
    pub rest: f64,
}

impl Line {
    /// Variance of the level after so many cycles.
    #[inline]
    fn variance(&self, t: f64) -> f64 {
        self.var_level + t * (2.0 * self.cov + self.rough + t * (self.var_growth + t * self.turns / 3.0))
    }

    /// Probability that the end comes within so many cycles.
    #[inline]
    fn within(&self, cycles: f64) -> f64 {
        let t = (cycles - self.rest).max(0.0);
        let variance = self.variance(t);
        let over = self.level + t * self.growth - 1.0;
        normal_tail(-over / variance.max(1e-18).sqrt())
    }

    /// Its most likely end, and the standard deviation of it.
    fn end(&self) -> (f64, f64) {
        let growth = self.growth.max(1e-6);
        let t = ((1.0 - self.level) / growth).max(0.0);
        let variance = self.variance(t);
        ((self.rest + t).min(LONGEST), variance.max(0.0).sqrt() / growth)
    }
}

/// The end of several stories together.
pub(crate) struct Ending {
    lines: Vec<Line>,
    ends: Vec<(f64, f64)>,
}

impl Ending {
    pub(crate) fn new(mut lines: Vec<Line>) -> Self {
        let total: f64 = lines.iter().map(|line| line.weight).sum();
        lines.retain(|line| line.weight > NEGLIGIBLE * total);
        let total: f64 = lines.iter().map(|line| line.weight).sum();
        for line in &mut lines {
            line.weight /= total;
        }
        let ends = lines.iter().map(Line::end).collect();
        Self { lines, ends }
    }

    /// The remaining cycles within which the end comes with a probability.
    pub(crate) fn quantile(&self, probability: f64) -> f64 {
        self.solve(probability, |t| self.lines.iter().map(|line| line.weight * line.within(t)).sum())
    }

    /// The remaining life with the smallest expected relative error: the median
    /// with every possible life weighed by its inverse.
    pub(crate) fn best(&self) -> f64 {
        let weights: Vec<f64> =
            self.lines.iter().zip(&self.ends).map(|(line, (t, _))| line.weight / t.max(SOON)).collect();
        let total: f64 = weights.iter().sum();
        // Within a line the weighing moves the median by variance over life.
        let shifts: Vec<f64> = self.ends.iter().map(|(t, sd)| (sd * sd / t.max(SOON)).min(0.3 * t)).collect();
        self.solve(0.5, |t| {
            let parts = self.lines.iter().zip(&weights).zip(&shifts);
            parts.map(|((line, weight), shift)| weight / total * line.within(t + shift)).sum()
        })
    }

    /// How many cycles ago the level was 1, where that is over.
    pub(crate) fn ago(&self) -> f64 {
        let ago = |line: &Line| line.weight * ((line.level - 1.0) / line.growth.max(1e-6)).clamp(0.0, LONGEST);
        self.lines.iter().map(ago).sum()
    }

    fn solve(&self, probability: f64, within: impl Fn(f64) -> f64) -> f64 {
        let reach = |sign: f64| self.ends.iter().map(move |(t, sd)| t + sign * 2.0 * sd);
        let mut low = reach(-1.0).fold(f64::INFINITY, f64::min).max(0.0);
        let mut high = reach(1.0).fold(0.0, f64::max).min(LONGEST) + 1e-3;
        while low > 1e-6 && within(low) > probability {
            low *= 0.5;
        }
        if low <= 1e-6 {
            low = 0.0;
            if within(0.0) >= probability {
                return 0.0;
            }
        }
        while high < LONGEST && within(high) < probability {
            high *= 2.0;
        }
        // Regula falsi with halved ends (Illinois), then what is left.
        let (mut below, mut above) = (within(low) - probability, within(high) - probability);
        if above <= 0.0 {
            return high.min(LONGEST);
        }
        let mut side = 0_i8;
        for _ in 0..HALVINGS {
            if high - low < 1e-5 * high {
                break;
            }
            let mut t = (low * above - high * below) / (above - below);
            if !(t > low && t < high) {
                t = f64::midpoint(low, high);
            }
            let value = within(t) - probability;
            if value.abs() < 1e-5 {
                return t;
            }
            if value > 0.0 {
                (high, above) = (t, value);
                if side == 1 {
                    below *= 0.5;
                }
                side = 1;
            } else {
                (low, below) = (t, value);
                if side == -1 {
                    above *= 0.5;
                }
                side = -1;
            }
        }
        f64::midpoint(low, high)
    }
}

/// The waiting times, in cycles, until rested growth goes on: the thirds of an
/// exponential distribution.
pub(crate) fn waits(resume: f64) -> [f64; 3] {
    [0.18, 0.69, 1.99].map(|share| share / resume)
}
