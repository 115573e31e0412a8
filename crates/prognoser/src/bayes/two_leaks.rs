//! Leaks of both kinds, of which one may begin later, and when they bring a stroke to its limit.
//!
//! They hide each other, so that the times may stand still or turn while both grow. How a stroke stands is told as the
//! severity of the one leak that would do the same ([`Plant::stand`]), which over the two severities is nearly a plane: a
//! Gaussian of severities and paces is then one of that, and the end is where a line meets 1, as with a single wear.

use super::config::GrowthPrior;
use super::ending::{LONGEST, Line};
use super::hypothesis::{Cause, Hypothesis, Mode, SIZE};
use super::law::Law;
use super::motion::drift_turn;
use super::plant::Plant;
use super::rate_prior::{Corrected, NODES, RatePrior, WideGrowth};
use super::special::quick_ln;

/// Most hypotheses of a second leak, by when it began. With one, those that begin in each cycle would blur it: they start from
/// what a single leak makes of the times, which by then is wrong.
const MOST_SECONDS: usize = 3;
/// Severity of a leak up to which both are looked at together: as far as their table goes.
const FARTHEST_LEAK: f64 = 2.5;
/// Most places looked at for their end, and how close to it is near enough, share of the limit.
const MOST_STEPS: usize = 8;
const CLOSE: f64 = 2e-3;
/// The leak that slows down each stroke, which is its place among the tables.
const LEAKS: [u8; 2] = [0, 1];

/// Adds the hypotheses of one leak and then another, with those that begin in this cycle. One does beside the leak that is likelier
/// to be there, where it can be told from none; hypotheses below a weight have none.
pub(crate) fn second_leaks(
    hypotheses: &[Hypothesis],
    seconds: &mut Vec<Hypothesis>,
    prior: &GrowthPrior,
    ln_likely: f64,
    shape: f64,
) {
    let others = seconds.len();
    seconds.extend(
        hypotheses.iter().filter(|hypothesis| hypothesis.cause == Cause::Both && hypothesis.mode == Mode::Late),
    );
    let leaks = || {
        hypotheses
            .iter()
            .filter(|hypothesis| matches!(hypothesis.cause, Cause::Wear(0 | 1)) && hypothesis.ln_weight > ln_likely)
    };
    let likeliest = leaks().max_by(|a, b| a.ln_weight.total_cmp(&b.ln_weight)).map(|hypothesis| hypothesis.cause);
    let first = seconds.len();
    let begin = leaks()
        .filter(|hypothesis| {
            Some(hypothesis.cause) == likeliest && hypothesis.law == Law::Linear && hypothesis.mode != Mode::Rest
        })
        .filter(|hypothesis| hypothesis.is_seen(shape))
        .map(|hypothesis| with_second(hypothesis, prior.second, shape));
    seconds.extend(begin);
    if seconds.len() > first {
        seconds[first] = Hypothesis::merged(&seconds[first..], shape);
        seconds.truncate(first + 1);
    }
    if seconds.len() > others + MOST_SECONDS {
        merge_nearest(seconds, others, shape);
    }
}

/// A hypothesis of one leak, with one of the other kind that begins now. What the tables are off by is held from then on.
fn with_second(hypothesis: &Hypothesis, probability: f64, shape: f64) -> Hypothesis {
    let one = usize::from(hypothesis.cause == Cause::Wear(1));
    let other = 1 - one;
    let mut both = Hypothesis { cause: Cause::Both, mode: Mode::Late, ..*hypothesis };
    both.ln_weight += quick_ln(probability);
    both.unit = [hypothesis.mean[2], hypothesis.mean[3]];
    both.mean = [0.0; SIZE];
    both.cov = [[0.0; SIZE]; SIZE];
    for (i, from_i) in [(one, 0), (2 + one, 1)] {
        both.mean[i] = hypothesis.mean[from_i];
        for (j, from_j) in [(one, 0), (2 + one, 1)] {
            both.cov[i][j] = hypothesis.cov[from_i][from_j];
        }
    }
    let WideGrowth { mean, sd } = WideGrowth::ANY;
    both.mean[2 + other] = mean;
    both.cov[2 + other][2 + other] = sd * sd * shape / hypothesis.scale;
    both
}

/// Makes one hypothesis of the two that are least worth telling apart, of those from a place on.
fn merge_nearest(hypotheses: &mut Vec<Hypothesis>, first: usize, shape: f64) {
    let apart = |a: &Hypothesis, b: &Hypothesis| {
        let sigma2 = 0.5 * (a.scale + b.scale) / shape;
        let of = |i: usize| (a.mean[i] - b.mean[i]).powi(2) / ((a.cov[i][i] + b.cov[i][i]) * sigma2 + 1e-12);
        // What is lost: the distance, by the smaller weight.
        quick_ln((0..SIZE).map(of).sum::<f64>() + 1e-3) + a.ln_weight.min(b.ln_weight)
    };
    let mut best = (f64::INFINITY, first, first + 1);
    for j in first + 1..hypotheses.len() {
        for i in first..j {
            let lost = apart(&hypotheses[i], &hypotheses[j]);
            if lost < best.0 {
                best = (lost, i, j);
            }
        }
    }
    let (_, i, j) = best;
    hypotheses[i] = Hypothesis::merged(&[hypotheses[i], hypotheses[j]], shape);
    hypotheses.swap_remove(j);
}

/// A hypothesis of both leaks, and the severity at which each stroke ends.
pub(crate) struct TwoLeaks<'a, 't> {
    pub hypothesis: &'a Hypothesis,
    pub plant: &'a Plant<'t>,
    pub sigma2: f64,
    /// Of the leak that slows down closing, and opening, alone.
    pub ends: [f64; 2],
}

impl TwoLeaks<'_, '_> {
    /// The ways in which they may come to their end: for paces of the leak whose pace is known less.
    pub(crate) fn lines(&self, prior: &RatePrior, weight: f64, finely: bool, lines: &mut Vec<Line>) {
        let vague = |i: usize| self.hypothesis.cov[i][i] / self.hypothesis.mean[i].powi(2).max(1e-12);
        let (less, more) = if vague(2) > vague(3) { (2, 3) } else { (3, 2) };
        let correct = |i: usize| {
            let sd = (self.hypothesis.cov[i][i] * self.sigma2).max(0.0).sqrt();
            prior.correct(self.hypothesis.mean[i], sd, Mode::Steady)
        };
        let mut hypothesis = *self.hypothesis;
        if let Corrected::Wide { nodes, .. } = correct(more) {
            // Nothing grows backwards.
            let mean: f64 = nodes.iter().map(|node| node.weight * node.growth).sum();
            let square: f64 = nodes.iter().map(|node| node.weight * (node.growth - mean).powi(2)).sum();
            hypothesis = hypothesis.matched(more, mean, square / self.sigma2);
        }
        let hypothesis = &hypothesis;
        match correct(less) {
            Corrected::Narrow { mean, .. } => {
                let mut moved = *hypothesis;
                let off = (mean - hypothesis.mean[less]) / hypothesis.cov[less][less].max(1e-300);
                for i in 0..SIZE {
                    moved.mean[i] += hypothesis.cov[less][i] * off;
                }
                lines.push(Line { weight, ..self.line(&moved) });
            }
            Corrected::Wide { nodes, .. } => {
                for nodes in nodes.chunks(if finely { 2 } else { NODES }) {
                    let share: f64 = nodes.iter().map(|node| node.weight).sum();
                    let pace = nodes.iter().map(|node| node.weight * node.growth).sum::<f64>() / share.max(1e-300);
                    lines.push(Line { weight: weight * share, ..self.line(&hypothesis.given(less, pace)) });
                }
            }
        }
    }

    /// By how much the stroke that stands worst is over its end after some cycles, and its derivatives by the severities.
    fn over(&self, hypothesis: &Hypothesis, t: f64) -> (f64, [f64; 2]) {
        let severities = [0, 1].map(|i| hypothesis.mean[i] + t * hypothesis.mean[2 + i]);
        let stand = self.plant.stand(severities).unwrap_or([(0.0, [0.0; 2]); 2]);
        let over = [0, 1].map(|stroke| {
            let nearer = hypothesis.unit[stroke] * self.plant.end_shift(LEAKS[stroke])[stroke];
            stand[stroke].0 + nearer - self.ends[stroke]
        });
        let first = usize::from(over[1] > over[0]);
        (over[first], stand[first].1)
    }

    /// The line along which the stroke that comes to its end first does so.
    fn line(&self, hypothesis: &Hypothesis) -> Line {
        let (mut t, (mut over, mut by)) = (0.0, self.over(hypothesis, 0.0));
        if over < 0.0 {
            (t, over, by) = self.first_crossing(hypothesis, over);
        }
        let square = |i: usize, j: usize| {
            let mut sum = 0.0;
            for a in 0..2 {
                for b in 0..2 {
                    sum += by[a] * hypothesis.cov[i + a][j + b] * by[b];
                }
            }
            sum * self.sigma2
        };
        let paces = [0, 1].map(|leak| by[leak] * hypothesis.mean[2 + leak]);
        let growth = paces[0] + paces[1];
        let turns = drift_turn(hypothesis.cause, self.plant).powi(2) * (paces[0].powi(2) + paces[1].powi(2));
        Line {
            weight: 0.0,
            level: 1.0 + over - t * growth,
            growth,
            var_level: square(0, 0),
            cov: square(0, 2),
            var_growth: square(2, 2),
            turns,
            turns_until: t.max(1.0),
            ..Line::default()
        }
    }

    /// When a stroke that is not over yet will be: the cycles, by how much it is over then, and its derivatives.
    fn first_crossing(&self, hypothesis: &Hypothesis, over_now: f64) -> (f64, f64, [f64; 2]) {
        // Until the quicker one leaves the table.
        let quickest = hypothesis.mean[2].max(hypothesis.mean[3]).max(1e-6);
        let whole = ((FARTHEST_LEAK - hypothesis.mean[0].min(hypothesis.mean[1])) / quickest).clamp(1.0, LONGEST);
        let (mut low, mut low_over) = (0.0, over_now);
        let (mut t, mut over, mut by) = (0.0, over_now, [0.0; 2]);
        for share in [0.125, 0.25, 0.5, 1.0] {
            t = share * whole;
            (over, by) = self.over(hypothesis, t);
            if over >= 0.0 {
                break;
            }
            (low, low_over) = (t, over);
        }
        if over < 0.0 {
            return (t, over, by);
        }
        // Regula falsi on what is nearly straight; the end that stays is taken for half as far (Illinois).
        let (mut high, mut high_over) = (t, over);
        let mut was_high = None;
        for _ in 0..MOST_STEPS {
            if over.abs() < CLOSE {
                break;
            }
            t = low + (high - low) * low_over / (low_over - high_over);
            (over, by) = self.over(hypothesis, t);
            let is_high = over >= 0.0;
            let again = was_high == Some(is_high);
            if is_high {
                (high, high_over) = (t, over);
                low_over *= if again { 0.5 } else { 1.0 };
            } else {
                (low, low_over) = (t, over);
                high_over *= if again { 0.5 } else { 1.0 };
            }
            was_high = Some(is_high);
        }
        (t, over, by)
    }
}
