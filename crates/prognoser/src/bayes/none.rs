//! The hypothesis that the valve does not degrade.

use leak_table::Stroke;

use super::guess::robust_variance;
use super::model::FaultModel;
use super::posterior::ln_evidence_without_growth;
use super::sums::{Linearised, Sums};
use super::track::Priors;
use super::view::View;
use crate::reading::Reading;

/// Rounds of reweighting when the first readings are fitted together.
const ROUNDS: usize = 3;
/// Relative change of the noise variance below which the rounds end.
const SETTLED: f64 = 1e-2;

/// Sums about a leak of zero, for the slopes of either fault.
#[derive(Clone, Copy, Debug)]
pub(crate) struct NoneTrack {
    sums: [Sums; 2],
    /// Estimated noise variance in s2.
    pub sigma2: f64,
    /// Probability that the last timings were proper readings.
    pub inlier: [f64; 2],
    /// Residuals of the last timings in expected standard deviations.
    pub surprise: [Option<f64>; 2],
    /// The same residuals in s.
    pub residual_s: [Option<f64>; 2],
}

/// What the tables say of a valve without a leak.
struct Healthy {
    strokes: [StrokeOfHealthy; 2],
}

/// One stroke of it.
#[derive(Clone, Copy)]
struct StrokeOfHealthy {
    time_s: f64,
    /// Derivative of the time by the leak of either fault, in s.
    slopes: [f64; 2],
    window_s: f64,
}

impl Healthy {
    fn of(models: &[FaultModel; 2]) -> Self {
        let strokes = Stroke::ALL.map(|stroke| {
            let (time_s, slope) = models[0].time_and_slope(stroke, 0.0);
            let (_, other) = models[1].time_and_slope(stroke, 0.0);
            StrokeOfHealthy { time_s, slopes: [slope, other], window_s: models[0].window_s(stroke) }
        });
        Self { strokes }
    }
}

impl NoneTrack {
    /// Fits readings from scratch.
    pub(crate) fn fit(models: &[FaultModel; 2], readings: &[Reading], priors: &Priors) -> Self {
        let residuals = readings.iter().flat_map(|reading| {
            Stroke::ALL.into_iter().filter_map(|stroke| {
                let time = reading.time_s(stroke)?;
                Some(time - models[0].time_and_slope(stroke, 0.0).0)
            })
        });
        let mut track = Self {
            sums: [Sums::default(); 2],
            sigma2: robust_variance(residuals, &priors.noise),
            inlier: [1.0; 2],
            surprise: [None; 2],
            residual_s: [None; 2],
        };
        let healthy = Healthy::of(models);
        for _ in 0..ROUNDS {
            let before = track.sigma2;
            track.sums = [Sums::default(); 2];
            for reading in readings {
                track.add(&healthy, reading, priors);
            }
            track.settle(priors);
            if (track.sigma2 / before - 1.0).abs() < SETTLED {
                break;
            }
        }
        track
    }

    /// Adds one more cycle.
    pub(crate) fn update(&mut self, models: &[FaultModel; 2], reading: &Reading, priors: &Priors) {
        self.add(&Healthy::of(models), reading, priors);
        self.settle(priors);
    }

    fn add(&mut self, healthy: &Healthy, reading: &Reading, priors: &Priors) {
        for (i, stroke) in Stroke::ALL.into_iter().enumerate() {
            let Some(time) = reading.time_s(stroke) else {
                for sums in &mut self.sums {
                    sums.ln_extra += priors.glitch.share.ln();
                }
                self.inlier[i] = 0.0;
                self.surprise[i] = None;
                self.residual_s[i] = None;
                continue;
            };
            let StrokeOfHealthy { time_s, slopes, window_s } = healthy.strokes[i];
            let residual = time - time_s;
            let (p, ln_extra) = priors.glitch.inlier(residual, self.sigma2, window_s);
            self.inlier[i] = p;
            self.surprise[i] = Some(residual / self.sigma2.sqrt());
            self.residual_s[i] = Some(residual);
            for (sums, slope) in self.sums.iter_mut().zip(slopes) {
                sums.add(0.0, &Linearised { leak: 0.0, residual, slope }, p);
                sums.ln_extra += ln_extra;
            }
        }
    }

    fn settle(&mut self, priors: &Priors) {
        let sums = &self.sums[0];
        self.sigma2 = (priors.noise.b + 0.5 * sums.c) / (priors.noise.a + 0.5 * sums.n);
    }

    /// Logarithm of the probability of the data, which may hold a small
    /// constant leak.
    pub(crate) fn ln_evidence(&self, views: &[View], priors: &Priors) -> f64 {
        ln_evidence_without_growth(&self.sums, views, &priors.noise, self.sigma2)
    }
}
