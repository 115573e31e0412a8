//! A hypothesis meets a reading.

#![expect(clippy::needless_range_loop, reason = "rows and columns of matrices")]

use super::hypothesis::{Cause, Hypothesis, SIZE};
use super::law::Law;
use super::plant::Plant;
use super::special::{normal_tail, quick_ln};

/// Squared innovation, in expected variances, from which on something else than
/// noise is considered.
const LARGE_INNOVATION: f64 = 12.0;
/// Share of the readings that stray farther than noise does, and their variance in
/// that of the noise: few hands and clocks are Gaussian.
const STRAYS: f64 = 0.02;
const STRAY_VARIANCE: f64 = 12.0;
/// Shape of the noise's posterior up to which its size is not known.
const UNKNOWN_UP_TO: f64 = 30.0;
/// Moves of the severity up to which the tables are straight enough.
const STRAIGHT: f64 = 0.004;
/// The same of a hypothesis that is too unlikely to matter.
const IDLY_STRAIGHT: f64 = 0.05;
/// The same where the law of growth bends, share of the coordinate itself.
const BENT_STRAIGHT: f64 = 0.1;
/// Largest move of a severity from one linearisation to the next: no further than the tables can be trusted to be
/// anything like straight.
const LARGEST_PASS: f64 = 0.3;
/// Probability of being a proper reading from which on a time teaches anything.
pub(crate) const PROPER_FROM: f64 = 0.5;
/// Probability of a stroke that does not arrive below which it counts as far off as an outlier.
const HARDLY_LATE: f64 = 1e-3;
/// Most linearisations of one reading.
const MOST_PASSES: usize = 4;

/// What one cycle says, as the hypotheses meet it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Observation {
    /// Times in s, closing and opening; none where there is none.
    pub time_s: [Option<f64>; 2],
    /// Strokes that did not arrive.
    pub stalled: [bool; 2],
    /// Share of outliers.
    pub outlier_share: f64,
    /// What a reading counts for the noise variance.
    pub weight: f64,
    /// Shape of the inverse gamma posterior of the noise variance.
    pub shape: f64,
    /// Logarithm of the weight below which a hypothesis is hardly looked at.
    pub ln_idle: f64,
}

/// How a hypothesis met it.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Update {
    /// Logarithm of the probability of the reading.
    pub ln: f64,
    /// Probability that each time was a proper reading.
    pub inlier: [f64; 2],
    /// Innovation of each time in s.
    pub residual_s: [Option<f64>; 2],
    /// Whether noise hardly explains it.
    pub is_outlying: bool,
}

/// The time of a stroke under a hypothesis at some state. It moves with two numbers of
/// the hypothesis at most: which, and by how much.
#[derive(Clone, Copy, Debug)]
struct Expected {
    time_s: f64,
    moves_with: [usize; 2],
    by: [f64; 2],
}

impl Expected {
    /// Of both strokes.
    #[inline]
    fn of(hypothesis: &Hypothesis, plant: &Plant, at: &[f64; SIZE]) -> [Self; 2] {
        match hypothesis.cause {
            Cause::None => {
                let of = |stroke: usize| {
                    let healthy_s = plant.healthy_s(stroke);
                    let time_s = healthy_s * (1.0 + at[2 + stroke]);
                    Self { time_s, moves_with: [0, 2 + stroke], by: [0.0, healthy_s] }
                };
                [of(0), of(1)]
            }
            Cause::Wear(wear) => {
                let (severity, grows) = hypothesis.law.severity(at[0]);
                let times = plant.times_and_slopes(wear, severity);
                let of = |stroke: usize| {
                    let (time, by_severity) = times[stroke];
                    let factor = 1.0 + at[2 + stroke];
                    let by = [by_severity * grows * factor, time];
                    Self { time_s: time * factor, moves_with: [0, 2 + stroke], by }
                };
                [of(0), of(1)]
            }
            Cause::Both => {
                let times = plant.both_leaks([at[0], at[1]]);
                let of = |stroke: usize| {
                    let ((time_s, [by_first, by_second]), factor) = (times[stroke], 1.0 + hypothesis.unit[stroke]);
                    let by = [by_first * factor, by_second * factor];
                    Self { time_s: time_s * factor, moves_with: [0, 1], by }
                };
                [of(0), of(1)]
            }
            Cause::Other => {
                let of = |stroke: usize| {
                    let time_s = plant.healthy_s(stroke) + at[stroke];
                    Self { time_s, moves_with: [stroke, 2], by: [1.0, 0.0] }
                };
                [of(0), of(1)]
            }
        }
    }
}

/// Updates a hypothesis by a reading. It is linearised where it is expected, and
/// again where it leads, if that is elsewhere.
pub(crate) fn assimilate(
    hypothesis: &mut Hypothesis,
    before: &Hypothesis,
    plant: &Plant,
    observed: &Observation,
) -> Update {
    let levels = match hypothesis.cause {
        Cause::None | Cause::Other => 0,
        Cause::Wear(_) => 1,
        Cause::Both => 2,
    };
    if levels == 0 {
        let at = hypothesis.mean;
        return pass(hypothesis, plant, observed, &at);
    }
    let curved = hypothesis.law != Law::Linear;
    let straight = if hypothesis.ln_weight < observed.ln_idle { IDLY_STRAIGHT } else { STRAIGHT };
    let mut at = before.mean;
    let mut update = pass(hypothesis, plant, observed, &at);
    for _ in 1..MOST_PASSES {
        let moved = (0..levels).map(|i| (hypothesis.mean[i] - at[i]).abs()).fold(0.0, f64::max);
        if moved < straight && !(curved && moved > BENT_STRAIGHT * at[0].abs()) {
            break;
        }
        for i in 0..levels {
            at[i] += (hypothesis.mean[i] - at[i]).clamp(-LARGEST_PASS, LARGEST_PASS);
        }
        if levels == 1 {
            (at[2], at[3]) = (hypothesis.mean[2], hypothesis.mean[3]);
        }
        *hypothesis = *before;
        update = pass(hypothesis, plant, observed, &at);
    }
    update
}

/// One linearised update.
fn pass(out: &mut Hypothesis, plant: &Plant, observed: &Observation, at: &[f64; SIZE]) -> Update {
    let mut update = Update { inlier: [1.0; 2], ..Update::default() };
    let shape = observed.shape;
    let (mut distance, mut probability) = (0.0, 1.0);
    for (stroke, expected) in Expected::of(out, plant, at).into_iter().enumerate() {
        if observed.time_s[stroke].is_none() && !observed.stalled[stroke] {
            out.noise.left_s[stroke] = f64::NAN;
            continue;
        }
        let window_s = plant.window_s(stroke);
        let Expected { time_s, moves_with: [a, b], by: [by_a, by_b] } = expected;
        let predicted = time_s + by_a * (out.mean[a] - at[a]) + by_b * (out.mean[b] - at[b]);
        let (row_a, row_b) = (out.cov[a], out.cov[b]);
        let mut by_cov = [0.0; SIZE];
        for i in 0..SIZE {
            by_cov[i] = by_a * row_a[i] + by_b * row_b[i];
        }
        let model_spread = (by_a * by_cov[a] + by_b * by_cov[b]).max(0.0);
        let spread = out.inflation + model_spread;
        let (innovation, inlier) = if let Some(measured) = observed.time_s[stroke] {
            let innovation = measured - predicted;
            let before = out.noise;
            let far = (model_spread + STRAY_VARIANCE) * out.scale / shape;
            let (density, stray) = out.noise.densities(stroke, innovation, model_spread, 2.0 * out.scale, shape, far);
            // Not before the noise is known: else it would be taken for them.
            let strays = STRAYS * (1.0 - UNKNOWN_UP_TO / shape).max(0.0);
            let density = density * (1.0 - observed.outlier_share) * (1.0 - strays);
            let total = density + strays * stray + observed.outlier_share / window_s;
            probability *= total;
            let inlier = density / total;
            update.residual_s[stroke] = Some(innovation);
            distance += innovation * innovation * shape / ((1.0 + model_spread) * out.scale);
            if inlier < PROPER_FROM {
                out.noise = before;
                out.noise.left_s[stroke] = f64::NAN;
            } else {
                out.noise.left_s[stroke] = innovation * out.inflation / spread;
            }
            (innovation, inlier)
        } else {
            // Not there within the window: anything beyond is as likely.
            out.noise.left_s[stroke] = f64::NAN;
            let sd = (spread * out.scale / shape).sqrt();
            let late = normal_tail((window_s - predicted) / sd) * (1.0 - observed.outlier_share);
            let total = late + observed.outlier_share;
            probability *= total;
            distance += if late < HARDLY_LATE { LARGE_INNOVATION } else { 0.0 };
            // Where it is expected beyond the window, nothing is learnt.
            (window_s - predicted, late / total)
        };
        update.inlier[stroke] = inlier;
        if observed.time_s[stroke].is_none() && predicted >= window_s {
            continue;
        }
        if inlier < PROPER_FROM {
            continue;
        }
        // A doubtful reading counts as noisier, in proportion.
        let doubted = spread + out.inflation * (1.0 / inlier - 1.0);
        let share = 1.0 / doubted;
        for i in 0..SIZE {
            let gain = by_cov[i] * share;
            out.mean[i] += gain * innovation;
            for j in 0..SIZE {
                out.cov[i][j] -= gain * by_cov[j];
            }
        }
        out.scale += 0.5 * observed.weight * innovation * innovation * out.inflation * share;
    }
    update.ln = quick_ln(probability);
    update.is_outlying = distance > LARGE_INNOVATION;
    out.ln_weight += update.ln;
    update
}
