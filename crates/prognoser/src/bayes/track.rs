//! One fault hypothesis followed over the cycles.

use leak_table::Stroke;

use super::guess::{first_guess, first_variance};
use super::model::FaultModel;
use super::posterior::{Posterior, most_likely, posterior};
use super::sums::{GlitchModel, Linearised, Sums};
use super::view::{GrowthPrior, NoisePrior, View};
use crate::reading::Reading;

/// Rounds of reweighting when the first readings are fitted together.
const ROUNDS: usize = 5;
/// The same if the estimate before is close.
const ROUNDS_FROM_GUESS: usize = 2;
/// Change of leak (in limits) and of noise (relative) below which the rounds
/// end.
const SETTLED: f64 = 1e-2;
/// Smallest growth at which the timings are linearised, in limits per cycle.
pub(super) const SMALLEST_GROWTH: f64 = 1e-5;
/// Predicted standard deviations beyond which a timing is linearised again
/// about the leak it gives.
const RELINEARISE_FROM: f64 = 1e-3;

/// The priors all hypotheses share.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Priors {
    pub noise: NoisePrior,
    pub growth: GrowthPrior,
    pub glitch: GlitchModel,
    /// Logarithm of the prior probability of no fault.
    pub ln_none: f64,
    /// Logarithm of the prior probability of each fault.
    pub ln_fault: f64,
}

/// Sums and estimate of one fault, one law of growth and one kind of start.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Track {
    pub sums: Sums,
    pub state: Posterior,
    /// Probability that the last close and open timing were proper readings.
    pub inlier: [f64; 2],
    /// Residuals of the last timings against the leak estimated before them,
    /// in units of their expected standard deviation.
    pub surprise: [Option<f64>; 2],
    /// The same residuals in s.
    pub residual_s: [Option<f64>; 2],
}

impl Track {
    /// Fits readings together; `shape` gives phi of a cycle. Without a guess
    /// it starts from medians, which no few glitches can mislead.
    pub(crate) fn fit(
        model: &FaultModel,
        readings: &[Reading],
        shape: &impl Fn(u64) -> f64,
        views: &[View],
        priors: &Priors,
        guess: Option<&Posterior>,
    ) -> Self {
        let (mut start, mut growth, mut sigma2) = guess.map_or_else(
            || {
                let (start, growth) = first_guess(model, readings, shape, views);
                let line = (start, growth);
                let sigma2 = first_variance(model, readings, shape, line, &priors.noise);
                (start, growth, sigma2)
            },
            |known| (known.start, known.growth, known.sigma2),
        );
        let rounds = if guess.is_some() { ROUNDS_FROM_GUESS } else { ROUNDS };
        let mut track = Self {
            sums: Sums::default(),
            state: Posterior::default(),
            inlier: [1.0; 2],
            surprise: [None; 2],
            residual_s: [None; 2],
        };
        let last = readings.last().map_or(0.0, |reading| shape(reading.cycle));
        for _ in 0..rounds {
            track.sums = Sums::default();
            for reading in readings {
                let phi = shape(reading.cycle);
                let leak = start + growth.max(SMALLEST_GROWTH) * phi;
                for (i, stroke) in Stroke::ALL.into_iter().enumerate() {
                    track.inlier[i] = 1.0;
                    match reading.time_s(stroke) {
                        Some(time) => {
                            let lin = model.linearise(stroke, leak, time);
                            let window = model.window_s(stroke);
                            let (p, ln_extra) = priors.glitch.inlier(lin.residual, sigma2, window);
                            track.sums.add(phi, &lin, p);
                            track.sums.ln_extra += ln_extra;
                            track.inlier[i] = p;
                            track.surprise[i] = Some(lin.residual / sigma2.sqrt());
                            track.residual_s[i] = Some(lin.residual);
                        }
                        None => track.miss(model, stroke, i, phi, leak, sigma2, priors),
                    }
                }
            }
            let peak = most_likely(&track.sums, views, &priors.noise, &priors.growth, sigma2);
            let moved = (peak.start - start).abs()
                + (peak.growth - growth).abs() * last.max(1.0)
                + (peak.sigma2 / sigma2 - 1.0).abs();
            (start, growth, sigma2) = (peak.start, peak.growth, peak.sigma2);
            track.state.cov = peak.cov;
            if moved < SETTLED {
                break;
            }
        }
        track.state = posterior(&track.sums, views, &priors.noise, &priors.growth, sigma2, last, f64::MIN);
        track
    }

    /// Adds one more cycle; `floor` as for [`posterior`].
    pub(crate) fn update(
        &mut self,
        model: &FaultModel,
        reading: &Reading,
        phi: f64,
        views: &[View],
        priors: &Priors,
        floor: f64,
    ) {
        let Posterior { start, growth, cov, sigma2, .. } = self.state;
        let leak = start + growth.max(SMALLEST_GROWTH) * phi;
        let leak_var = (cov[0] + phi * (2.0 * cov[1] + phi * cov[2])).max(0.0);
        let mut lins = [None; 2];
        let (mut info, mut pull) = (1.0 / leak_var.max(f64::MIN_POSITIVE), 0.0);
        for (i, stroke) in Stroke::ALL.into_iter().enumerate() {
            let Some(time) = reading.time_s(stroke) else {
                self.miss(model, stroke, i, phi, leak, sigma2, priors);
                continue;
            };
            let lin = model.linearise(stroke, leak, time);
            let variance = sigma2 * (1.0 + lin.slope * lin.slope * leak_var);
            let window = model.window_s(stroke);
            let (p, ln_extra) = priors.glitch.inlier(lin.residual, variance, window);
            self.sums.ln_extra += ln_extra;
            self.inlier[i] = p;
            self.surprise[i] = Some(lin.residual / variance.sqrt());
            self.residual_s[i] = Some(lin.residual);
            info += p * lin.slope * lin.slope;
            pull += p * lin.slope * lin.residual;
            lins[i] = Some((lin, p, time));
        }
        let shift = pull / info;
        for (stroke, entry) in Stroke::ALL.into_iter().zip(lins) {
            if let Some((mut lin, p, time)) = entry {
                if shift.abs() > RELINEARISE_FROM {
                    lin = model.linearise(stroke, leak + shift, time);
                }
                self.sums.add(phi, &lin, p);
            }
        }
        self.state = posterior(&self.sums, views, &priors.noise, &priors.growth, sigma2, phi, floor);
    }

    /// Adds a stroke that did not finish. If the leak is expected beyond the
    /// stall this says nothing more; otherwise it pulls the leak there, unless
    /// it is so unlikely that it must be a glitch.
    #[expect(clippy::too_many_arguments, reason = "the state of one timing, used in two places")]
    fn miss(
        &mut self,
        model: &FaultModel,
        stroke: Stroke,
        index: usize,
        phi: f64,
        leak: f64,
        sigma2: f64,
        priors: &Priors,
    ) {
        self.surprise[index] = None;
        self.residual_s[index] = None;
        let Some(stall) = model.stall(stroke) else {
            // No leak of this kind stops the stroke.
            self.sums.ln_extra += priors.glitch.share.ln();
            self.inlier[index] = 0.0;
            return;
        };
        let (_, slope) = model.time_and_slope(stroke, stall);
        let cov = self.state.cov;
        let leak_var = (cov[0] + phi * (2.0 * cov[1] + phi * cov[2])).clamp(0.0, 1e6);
        let spread = (sigma2 * (1.0 / (slope * slope) + leak_var)).sqrt().max(1e-6);
        let z = (stall - leak) / spread;
        let tail = super::special::normal_tail(z);
        let kept = (1.0 - priors.glitch.share) * tail;
        let p = kept / (kept + priors.glitch.share);
        self.sums.ln_extra += (kept + priors.glitch.share).ln();
        self.inlier[index] = p;
        if z > -3.0 && p > 1e-6 {
            // Mean of what lies beyond the stall, by the inverse Mills ratio,
            // with the information a bound has there.
            let density = (-0.5 * z * z).exp() / std::f64::consts::TAU.sqrt();
            let mills = density / tail.max(1e-300);
            let information = p * (mills * (mills - z)).clamp(0.0, 1.0);
            let lin = Linearised { leak, residual: slope * spread * mills, slope };
            // A bound tells nothing of the noise: the residual is left out of
            // the count and of the sum of squares.
            let (n, c) = (self.sums.n, self.sums.c);
            let excess = {
                self.sums.add(phi, &lin, information);
                information * lin.residual * lin.residual
            };
            self.sums.n = n;
            self.sums.c = (self.sums.c - excess).max(c);
        }
    }
}
