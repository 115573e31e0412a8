//! A story meets a reading.

#![expect(clippy::needless_range_loop, reason = "rows and columns of matrices")]

use super::law::Law;
use super::part::{Cause, Part, SIZE};
use super::plant::Plant;
use super::special::{normal_tail, quick_ln};

/// Squared innovation, in expected variances, from which on something else than
/// noise is considered.
const SURPRISE: f64 = 12.0;
/// Share of the readings that stray farther than noise does, and their variance in
/// that of the noise: few hands and clocks are Gaussian.
const STRAYS: f64 = 0.02;
const STRAY_VARIANCE: f64 = 12.0;
/// Shape of the noise's posterior up to which its size is not known.
const UNKNOWN_UP_TO: f64 = 30.0;
/// Moves of the severity up to which the tables are straight enough.
const STRAIGHT: f64 = 0.004;
/// The same of a story that is too unlikely to matter.
const IDLY_STRAIGHT: f64 = 0.05;
/// Most linearisations of one reading.
const MOST_PASSES: usize = 4;

/// What one cycle says, as the stories meet it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Sight {
    /// Times in s, closing and opening; none where there is none.
    pub time_s: [Option<f64>; 2],
    /// Strokes that did not arrive.
    pub stalled: [bool; 2],
    /// Share of glitches.
    pub glitches: f64,
    /// What a reading counts for the noise variance.
    pub weight: f64,
    /// Shape of the inverse gamma posterior of the noise variance.
    pub shape: f64,
    /// Logarithm of the weight below which a story is hardly looked at.
    pub ln_idle: f64,
}

/// How a story met it.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Met {
    /// Logarithm of the probability of the reading.
    pub ln: f64,
    /// Probability that each time was a proper reading.
    pub inlier: [f64; 2],
    /// Innovation of each time in s.
    pub residual_s: [Option<f64>; 2],
    /// Whether noise hardly explains it.
    pub surprise: bool,
}

/// The time of a stroke under a story at some state. It moves with two numbers of
/// the story at most: which, and by how much.
#[derive(Clone, Copy, Debug)]
struct Expected {
    time_s: f64,
    moves_with: [usize; 2],
    by: [f64; 2],
}

impl Expected {
    /// Of both strokes.
    #[inline]
    fn of(part: &Part, plant: &Plant, at: &[f64; SIZE]) -> [Self; 2] {
        match part.cause {
            Cause::None => {
                let of = |stroke: usize| {
                    let healthy_s = plant.healthy_s(stroke);
                    let time_s = healthy_s * (1.0 + at[2 + stroke]);
                    Self { time_s, moves_with: [0, 2 + stroke], by: [0.0, healthy_s] }
                };
                [of(0), of(1)]
            }
            Cause::Wear(wear) => {
                let (severity, grows) = part.law.severity(at[0]);
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
                    let ((time_s, [by_first, by_second]), factor) = (times[stroke], 1.0 + part.unit[stroke]);
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

/// Updates a story by a reading. It is linearised where it is expected, and
/// again where it leads, if that is elsewhere.
pub(crate) fn assimilate(part: &mut Part, before: &Part, plant: &Plant, sight: &Sight) -> Met {
    let levels = match part.cause {
        Cause::None | Cause::Other => 0,
        Cause::Wear(_) => 1,
        Cause::Both => 2,
    };
    if levels == 0 {
        let at = part.mean;
        return pass(part, plant, sight, &at);
    }
    let curved = part.law != Law::Linear;
    let straight = if part.ln_weight < sight.ln_idle { IDLY_STRAIGHT } else { STRAIGHT };
    let mut at = before.mean;
    let mut met = pass(part, plant, sight, &at);
    for _ in 1..MOST_PASSES {
        let moved = (0..levels).map(|i| (part.mean[i] - at[i]).abs()).fold(0.0, f64::max);
        if moved < straight && !(curved && moved > 0.1 * at[0].abs()) {
            break;
        }
        // No further than the tables can be trusted to be anything like straight.
        for i in 0..levels {
            at[i] += (part.mean[i] - at[i]).clamp(-0.3, 0.3);
        }
        if levels == 1 {
            (at[2], at[3]) = (part.mean[2], part.mean[3]);
        }
        *part = *before;
        met = pass(part, plant, sight, &at);
    }
    met
}

/// One linearised update.
fn pass(out: &mut Part, plant: &Plant, sight: &Sight, at: &[f64; SIZE]) -> Met {
    let mut met = Met { inlier: [1.0; 2], ..Met::default() };
    let shape = sight.shape;
    let (mut distance, mut probability) = (0.0, 1.0);
    for (stroke, expected) in Expected::of(out, plant, at).into_iter().enumerate() {
        if sight.time_s[stroke].is_none() && !sight.stalled[stroke] {
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
        let (innovation, inlier) = if let Some(measured) = sight.time_s[stroke] {
            let innovation = measured - predicted;
            let before = out.noise;
            let far = (model_spread + STRAY_VARIANCE) * out.scale / shape;
            let (density, stray) = out.noise.densities(stroke, innovation, model_spread, 2.0 * out.scale, shape, far);
            // Not before the noise is known: else it would be taken for them.
            let strays = STRAYS * (1.0 - UNKNOWN_UP_TO / shape).max(0.0);
            let density = density * (1.0 - sight.glitches) * (1.0 - strays);
            let total = density + strays * stray + sight.glitches / window_s;
            probability *= total;
            let inlier = density / total;
            met.residual_s[stroke] = Some(innovation);
            distance += innovation * innovation * shape / ((1.0 + model_spread) * out.scale);
            if inlier < 0.5 {
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
            let late = normal_tail((window_s - predicted) / sd) * (1.0 - sight.glitches);
            let total = late + sight.glitches;
            probability *= total;
            distance += if late < 1e-3 { SURPRISE } else { 0.0 };
            // Where it is expected beyond the window, nothing is learnt.
            (window_s - predicted, late / total)
        };
        met.inlier[stroke] = inlier;
        if sight.time_s[stroke].is_none() && predicted >= window_s {
            continue;
        }
        if inlier < 0.5 {
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
        out.scale += 0.5 * sight.weight * innovation * innovation * out.inflation * share;
    }
    met.ln = quick_ln(probability);
    met.surprise = distance > SURPRISE;
    out.ln_weight += met.ln;
    met
}
