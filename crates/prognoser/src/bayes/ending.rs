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
/// Most points looked at for a quantile between two known ones.
const MOST_STEPS: usize = 18;
/// Error of a probability from which on a straight line does the rest.
const CLOSE: f64 = 2e-4;
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

    /// Its most likely end, and the standard deviation of it.
    fn end(&self) -> (f64, f64) {
        let growth = self.growth.max(1e-6);
        let t = ((1.0 - self.level) / growth).max(0.0);
        let variance = self.variance(t);
        ((self.rest + t).min(LONGEST), variance.max(0.0).sqrt() / growth)
    }
}

/// Lines side by side, for the vector registers that every processor has.
const SIDE: usize = 4;

/// Some lines, number by number. Where there are fewer, the others weigh nothing.
#[derive(Clone, Copy, Debug, Default)]
struct Block {
    weight: [f64; SIDE],
    short: [f64; SIDE],
    growth: [f64; SIDE],
    var_level: [f64; SIDE],
    by_cycle: [f64; SIDE],
    by_square: [f64; SIDE],
    by_cube: [f64; SIDE],
    later: [f64; SIDE],
}

impl Block {
    /// Lines with their weights, and by how many cycles each is looked at later.
    fn all<'a>(lines: impl Iterator<Item = (f64, f64, &'a Line)>) -> Vec<Self> {
        let mut blocks: Vec<Self> = Vec::with_capacity(12);
        for (count, (weight, later, line)) in lines.enumerate() {
            let k = count % SIDE;
            if k == 0 {
                blocks.push(Self::default());
            }
            let Some(block) = blocks.last_mut() else { continue };
            block.weight[k] = weight;
            block.short[k] = line.level - 1.0;
            block.growth[k] = line.growth;
            block.var_level[k] = line.var_level;
            block.by_cycle[k] = 2.0 * line.cov + line.rough;
            block.by_square[k] = line.var_growth;
            block.by_cube[k] = line.turns / 3.0;
            block.later[k] = later - line.rest;
        }
        blocks
    }

    /// Weighed probability that the end comes within so many cycles.
    #[inline]
    fn within(&self, cycles: f64) -> f64 {
        let mut share = [0.0; SIDE];
        for (k, share) in share.iter_mut().enumerate() {
            let t = (cycles + self.later[k]).max(0.0);
            let variance = self.var_level[k] + t * (self.by_cycle[k] + t * (self.by_square[k] + t * self.by_cube[k]));
            let over = self.short[k] + t * self.growth[k];
            *share = self.weight[k] * normal_tail(-over / variance.max(1e-18).sqrt());
        }
        share.iter().sum()
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

    /// The remaining cycles within which the end comes with each probability.
    pub(crate) fn quantiles<const N: usize>(&self, probabilities: [f64; N]) -> [f64; N] {
        let blocks = Block::all(self.lines.iter().map(|line| (line.weight, 0.0, line)));
        let within = |t: f64| blocks.iter().map(|block| block.within(t)).sum();
        let mut curve = Curve::new(within, &self.ends);
        probabilities.map(|probability| curve.place_of(probability))
    }

    /// The remaining life with the smallest expected relative error: the median
    /// with every possible life weighed by its inverse.
    pub(crate) fn best(&self) -> f64 {
        let total: f64 = self.lines.iter().zip(&self.ends).map(|(line, (t, _))| line.weight / t.max(SOON)).sum();
        let blocks = Block::all(self.lines.iter().zip(&self.ends).map(|(line, (t, sd))| {
            // Within a line the weighing moves the median by variance over life.
            (line.weight / t.max(SOON) / total, (sd * sd / t.max(SOON)).min(0.3 * t), line)
        }));
        let within = |t: f64| blocks.iter().map(|block| block.within(t)).sum();
        Curve::new(within, &self.ends).place_of(0.5)
    }

    /// How many cycles ago the level was 1, where that is over.
    pub(crate) fn ago(&self) -> f64 {
        let ago = |line: &Line| line.weight * ((line.level - 1.0) / line.growth.max(1e-6)).clamp(0.0, LONGEST);
        self.lines.iter().map(ago).sum()
    }
}

/// A rising probability over the cycles to come, with the points where it is
/// known so far: what was computed for one quantile serves the next.
struct Curve<F> {
    within: F,
    /// In rising order.
    points: Vec<(f64, f64)>,
}

impl<F: Fn(f64) -> f64> Curve<F> {
    fn new(within: F, ends: &[(f64, f64)]) -> Self {
        let reach = |sign: f64| ends.iter().map(move |(t, sd)| t + sign * 2.0 * sd);
        let low = reach(-1.0).fold(f64::INFINITY, f64::min).max(0.0);
        let high = reach(1.0).fold(0.0, f64::max).min(LONGEST) + 1e-3;
        let points = [low, high].map(|t| (t, within(t))).to_vec();
        Self { within, points }
    }

    fn know(&mut self, t: f64) -> f64 {
        let value = (self.within)(t);
        let place = self.points.partition_point(|(known, _)| *known < t);
        self.points.insert(place, (t, value));
        value
    }

    fn place_of(&mut self, probability: f64) -> f64 {
        while self.points[0].1 > probability {
            let low = 0.5 * self.points[0].0;
            if low < 1e-6 {
                if self.points[0].0 == 0.0 || self.know(0.0) >= probability {
                    return 0.0;
                }
                break;
            }
            self.know(low);
        }
        while self.points[self.points.len() - 1].1 < probability {
            let high = 2.0 * self.points[self.points.len() - 1].0;
            if high > 2.0 * LONGEST {
                return LONGEST;
            }
            self.know(high);
        }
        let after = self.points.partition_point(|(_, value)| *value < probability).max(1);
        let ((mut low, below), (mut high, above)) = (self.points[after - 1], self.points[after]);
        // Regula falsi with halved ends (Illinois).
        let (mut below, mut above) = (below - probability, above - probability);
        let mut side = 0_i8;
        for _ in 0..MOST_STEPS {
            if above <= 0.0 || high - low < 1e-5 * high {
                break;
            }
            let mut t = (low * above - high * below) / (above - below);
            if !(t > low && t < high) {
                t = f64::midpoint(low, high);
            }
            let off = self.know(t) - probability;
            if off.abs() < CLOSE {
                // The straight line from the nearer side does the rest.
                let (other, there) = if off > 0.0 { (low, below) } else { (high, above) };
                let rest = off * (t - other) / (off - there);
                return if rest.is_finite() { (t - rest).clamp(low, high) } else { t };
            }
            if off > 0.0 {
                (high, above) = (t, off);
                if side == 1 {
                    below *= 0.5;
                }
                side = 1;
            } else {
                (low, below) = (t, off);
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
