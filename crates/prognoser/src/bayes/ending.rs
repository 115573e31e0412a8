//! When the hypotheses end.

use super::config::REST_SHAPE;
use super::special::{normal_deviation, normal_share, quick_exp, quick_ln};
use super::wide::{Wide, widely};

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
pub const LONGEST: f64 = 1e5;
/// Smallest growth a cycle that an end is told for: slower wear never ends a life.
pub(crate) const SMALLEST_GROWTH: f64 = 1e-6;
/// Share of a remaining life by which weighing by its inverse moves it at most: beyond, the first order no longer holds.
const LARGEST_WEIGHING: f64 = 0.3;
/// Share of the variance of leaps to come that counts for the best single estimate.
const LEAPS_TOLD: f64 = 0.2;
/// Gaussian deviations that a step towards a quantile goes at most, and what it goes beyond, so that it soon lies between two.
const LARGEST_STEP: f64 = 4.0;
const BEYOND: f64 = 0.3;
/// Share of the cycles to which a quantile is found at the finest.
const FINEST: f64 = 1e-5;
/// Most points looked at for a quantile between two known ones.
const MOST_STEPS: usize = 18;
/// Error of a Gaussian deviation from which on a straight line does the rest.
const CLOSE: f64 = 0.05;
/// Remaining cycles below which an error is no longer counted relative to them.
const SOON: f64 = 0.5;
/// Gaussian deviations from a probability from which on it is clear, without a search, on which side of it another one lies.
const CLEAR: f64 = 0.3;
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
    /// Cycles from which on that is no longer counted, where it is not to go on for ever; 0 for ever.
    pub turns_until: f64,
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
    pub(crate) fn end(&self) -> (f64, f64) {
        let growth = self.growth.max(SMALLEST_GROWTH);
        let t = ((1.0 - self.level) / growth).max(0.0);
        let variance = self.variance(t);
        ((self.rest + t).min(LONGEST), variance.max(0.0).sqrt() / growth)
    }
}

/// Lines side by side, for the vector registers that every processor has.
const SIDE: usize = 4;

/// Some lines, number by number. Where there are fewer, the others weigh nothing.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Block {
    weight: [f64; SIDE],
    short: [f64; SIDE],
    growth: [f64; SIDE],
    var_level: [f64; SIDE],
    by_cycle: [f64; SIDE],
    by_square: [f64; SIDE],
    by_cube: [f64; SIDE],
    until: [f64; SIDE],
    later: [f64; SIDE],
}

impl Block {
    /// Lines with their weights, and by how many cycles each is looked at later.
    fn all(blocks: &mut Vec<Self>, lines: impl Iterator<Item = (f64, f64, Line)>) {
        blocks.clear();
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
            block.until[k] = if line.turns_until > 0.0 { line.turns_until } else { f64::MAX };
            block.later[k] = later - line.rest;
        }
    }

    /// Weighed probability that the end comes within so many cycles.
    #[inline(always)]
    fn within(&self, cycles: f64) -> f64 {
        let mut share = [0.0; SIDE];
        // Numbers that are none are the smaller ones here: the largest and smallest of the library take care of them
        // with instructions of their own.
        let larger = |a: f64, b: f64| if a > b { a } else { b };
        for (k, share) in share.iter_mut().enumerate() {
            let t = larger(cycles + self.later[k], 0.0);
            let turning = if t < self.until[k] { t } else { self.until[k] };
            let variance =
                self.var_level[k] + t * (self.by_cycle[k] + t * (self.by_square[k] + turning * self.by_cube[k]));
            let over = self.short[k] + t * self.growth[k];
            *share = over / larger(variance, 1e-18).sqrt();
        }
        let mut all = 0.0;
        for (deviation, weight) in share.into_iter().zip(self.weight) {
            all += weight * normal_share(deviation);
        }
        all
    }
}

/// Weighed probability that the end comes within some cycles, over all blocks.
struct Within<'a> {
    blocks: &'a [Block],
    cycles: f64,
}

impl Wide for Within<'_> {
    type Out = f64;

    #[inline(always)]
    fn run(self) -> f64 {
        // No iterator's sum, which would be compiled by itself for the registers that every processor has.
        let mut all = 0.0;
        for block in self.blocks {
            all += block.within(self.cycles);
        }
        all
    }
}

/// The end of several hypotheses together.
pub(crate) struct Ending<'a> {
    lines: &'a [Line],
    ends: Vec<(f64, f64)>,
}

impl<'a> Ending<'a> {
    /// Of some ways to come to it, of which those that do not count are dropped.
    pub(crate) fn new(lines: &'a mut Vec<Line>) -> Self {
        let total: f64 = lines.iter().map(|line| line.weight).sum();
        lines.retain(|line| line.weight > NEGLIGIBLE * total);
        let total: f64 = lines.iter().map(|line| line.weight).sum();
        for line in lines.iter_mut() {
            line.weight /= total;
        }
        let ends = lines.iter().map(Line::end).collect();
        Self { lines, ends }
    }

    /// The remaining cycles within which the end comes with each probability, and
    /// the probability that it comes within one.
    pub(crate) fn quantiles<const N: usize>(
        &self,
        probabilities: [f64; N],
        blocks: &mut Vec<Block>,
    ) -> ([f64; N], f64) {
        Block::all(blocks, self.lines.iter().map(|line| (line.weight, 0.0, *line)));
        let within = |cycles: f64| widely(Within { blocks, cycles });
        let mut curve = Curve::new(within, self.lines.iter().map(|line| line.weight), &self.ends);
        (probabilities.map(|probability| curve.place_of(probability)), within(1.0))
    }

    /// Whether the end comes with a probability within each of some cycles, which is far less work than when it does: the
    /// last of them within which it does not, half a cycle if it does within the first, and the probability that it comes
    /// within one. None where that is not clear, or the end may be now.
    pub(crate) fn standing<const N: usize>(
        &self,
        probability: f64,
        cycles: [f64; N],
        blocks: &mut Vec<Block>,
    ) -> Option<(f64, f64)> {
        Block::all(blocks, self.lines.iter().map(|line| (line.weight, 0.0, *line)));
        let within = |cycles: f64| widely(Within { blocks, cycles });
        if normal_deviation(within(0.0)) > -CLEAR {
            return None;
        }
        let wanted = normal_deviation(probability);
        let mut at_least = 0.5;
        for cycles in cycles {
            let off = normal_deviation(within(cycles)) - wanted;
            if off.abs() < CLEAR {
                return None;
            }
            if off > 0.0 {
                break;
            }
            at_least = cycles;
        }
        Some((at_least, within(1.0)))
    }

    /// The remaining life with the smallest expected relative error: the median
    /// with every possible life weighed by its inverse. Leaps to come count for less: of lives that they make very short the
    /// error is 100 % whatever is told, and weighing those would move the estimate of all others.
    pub(crate) fn best(&self, blocks: &mut Vec<Block>) -> f64 {
        let told = |line: &Line| Line { rough: LEAPS_TOLD * line.rough, ..*line };
        let ends = self.lines.iter().zip(&self.ends);
        let ends: Vec<(f64, f64)> =
            ends.map(|(line, end)| if line.rough > 0.0 { told(line).end() } else { *end }).collect();
        let weight = |(line, (t, _)): (&Line, &(f64, f64))| line.weight / t.max(SOON);
        let total: f64 = self.lines.iter().zip(&ends).map(weight).sum();
        let weighed = self.lines.iter().zip(&ends).map(|(line, (t, sd))| {
            // Within a line the weighing moves the median by variance over life.
            (line.weight / t.max(SOON) / total, (sd * sd / t.max(SOON)).min(LARGEST_WEIGHING * t), told(line))
        });
        Block::all(blocks, weighed);
        let within = |cycles: f64| widely(Within { blocks, cycles });
        Curve::new(within, self.lines.iter().zip(&ends).map(weight), &ends).place_of(0.5)
    }

    /// How many cycles ago the level was 1, where that is over.
    pub(crate) fn ago(&self) -> f64 {
        let ago =
            |line: &Line| line.weight * ((line.level - 1.0) / line.growth.max(SMALLEST_GROWTH)).clamp(0.0, LONGEST);
        self.lines.iter().map(ago).sum()
    }
}

/// A rising probability over the cycles to come, with the points where it is
/// known so far: what was computed for one quantile serves the next.
struct Curve<F> {
    within: F,
    /// Standard deviation of the logarithm of the end, one cycle added.
    ln_sd: f64,
    /// In rising order, one at least.
    points: Vec<Point>,
}

/// A point of such a curve: along the Gaussian deviation of the probability and
/// the logarithm of the cycles the curve is nearly straight.
#[derive(Clone, Copy, Debug)]
struct Point {
    cycles: f64,
    /// Logarithm of the cycles and one.
    ln: f64,
    deviation: f64,
}

/// The cycles at which the straight line through two points has a deviation.
fn between(low: Point, high: Point, deviation: f64) -> f64 {
    let [first, last] = [low.ln, high.ln];
    let share = (deviation - low.deviation) / (high.deviation - low.deviation);
    (quick_exp(first + share * (last - first)) - 1.0).clamp(low.cycles, high.cycles)
}

impl<F: Fn(f64) -> f64> Curve<F> {
    /// Of ends with their weights and standard deviations.
    fn new(within: F, weights: impl Iterator<Item = f64>, ends: &[(f64, f64)]) -> Self {
        let (mut total, mut mean, mut square) = (0.0, 0.0, 0.0);
        for (weight, (cycles, sd)) in weights.zip(ends) {
            let ln = quick_ln(cycles + 1.0);
            let spread = (sd / (cycles + 1.0)).min(2.0);
            total += weight;
            mean += weight * ln;
            square += weight * (ln * ln + spread * spread);
        }
        let mean = mean / total;
        let ln_sd = (square / total - mean * mean).max(1e-6).sqrt();
        let mut curve = Self { within, ln_sd, points: Vec::with_capacity(16) };
        curve.know(quick_exp(mean) - 1.0);
        curve
    }

    fn know(&mut self, cycles: f64) -> Point {
        let cycles = cycles.clamp(0.0, 2.0 * LONGEST);
        let point = Point { cycles, ln: quick_ln(cycles + 1.0), deviation: normal_deviation((self.within)(cycles)) };
        let place = self.points.partition_point(|known| known.cycles < cycles);
        self.points.insert(place, point);
        point
    }

    /// Known points on both sides of a deviation; the end of the range where it
    /// lies beyond.
    fn around(&mut self, deviation: f64) -> Result<(Point, Point), f64> {
        let mut step = self.ln_sd;
        loop {
            let after = self.points.partition_point(|point| point.deviation < deviation);
            let (end, sign) = match (after, self.points.len() - after) {
                (0, _) => (self.points[0], -1.0),
                (_, 0) => (self.points[after - 1], 1.0),
                _ => return Ok((self.points[after - 1], self.points[after])),
            };
            if end.cycles <= 0.0 && sign < 0.0 {
                return Err(0.0);
            }
            if end.cycles > LONGEST && sign > 0.0 {
                return Err(LONGEST);
            }
            // A little farther than it would be if the curve were straight.
            let far = (deviation - end.deviation).abs().min(LARGEST_STEP) + BEYOND;
            let ln = end.ln + sign * far * step;
            self.know(quick_exp(ln.min(20.0)) - 1.0);
            step *= 2.0;
        }
    }

    fn place_of(&mut self, probability: f64) -> f64 {
        let wanted = normal_deviation(probability);
        let (mut low, mut high) = match self.around(wanted) {
            Ok(ends) => ends,
            Err(end) => return end,
        };
        // Regula falsi; the end that stays is taken for half as far (Illinois).
        let (mut side, mut off) = (0.0, (high.deviation - wanted).min(wanted - low.deviation));
        for _ in 0..MOST_STEPS {
            if off < CLOSE || high.cycles - low.cycles < FINEST * high.cycles {
                break;
            }
            let point = self.know(between(low, high, wanted));
            off = (point.deviation - wanted).abs();
            let kept = if point.deviation < wanted { &mut high } else { &mut low };
            let now = (wanted - point.deviation).signum();
            if now == side {
                kept.deviation = f64::midpoint(kept.deviation, wanted);
            }
            side = now;
            if point.deviation < wanted {
                low = point;
            } else {
                high = point;
            }
        }
        between(low, high, wanted)
    }
}

/// The waiting times, in cycles, until rested growth goes on that does so with some probability in the next one: the middles of the
/// thirds of a Lomax distribution, which an exponential one is whose rate has a gamma prior.
pub(crate) fn waits(resume: f64) -> [f64; 3] {
    [1.0 / 6.0, 0.5, 5.0 / 6.0].map(|within: f64| REST_SHAPE / resume * ((1.0 - within).powf(-1.0 / REST_SHAPE) - 1.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn registers_of_any_width_give_the_same_bits() {
        let line = |i: u32| {
            let k = f64::from(i);
            let growth = 0.002 * (1.0 + k);
            Line {
                weight: 0.1,
                level: 0.03 * k,
                growth,
                var_level: 1e-3 * k,
                var_growth: 1e-6,
                turns: 1e-8,
                ..Line::default()
            }
        };
        let lines: Vec<Line> = (0..10).map(line).collect();
        let mut blocks = Vec::new();
        Block::all(&mut blocks, lines.iter().map(|line| (line.weight, 0.0, *line)));
        for t in 0..400_u32 {
            let within = || Within { blocks: &blocks, cycles: 1.7 * f64::from(t) };
            assert_eq!(within().run().to_bits(), widely(within()).to_bits(), "after {t}");
        }
    }
}
