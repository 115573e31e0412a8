//! No fault, a leak to atmosphere, a leak from the supply: followed side by
//! side from the same first cycle and with the same law of growth.

use leak_table::Fault;

use super::model::FaultModel;
use super::none::NoneTrack;
use super::track::{Priors, Track};
use super::view::{View, ln_sum};
use crate::reading::Reading;

/// Logarithm of the odds at which a hypothesis is not worth exact numbers.
const NEGLIGIBLE: f64 = 20.0;

/// How the leak goes with the cycles since the origin: a0 + g phi(cycles).
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Shape {
    /// phi = cycles.
    Linear,
    /// phi = (exp(rate cycles) - 1) / rate.
    Exponential { rate: f64 },
}

impl Shape {
    pub(crate) fn phi(self, cycles: f64) -> f64 {
        match self {
            Self::Linear => cycles,
            Self::Exponential { rate } => (rate * cycles).exp_m1() / rate,
        }
    }

    /// The cycles at which phi has a value.
    pub(crate) fn cycles(self, phi: f64) -> f64 {
        match self {
            Self::Linear => phi,
            Self::Exponential { rate } => (rate * phi).max(-1.0).ln_1p() / rate,
        }
    }

    /// Growth per cycle, as a multiple of g.
    pub(crate) fn rate_at(self, cycles: f64) -> f64 {
        match self {
            Self::Linear => 1.0,
            Self::Exponential { rate } => (rate * cycles).exp(),
        }
    }
}

/// The priors of the start of a set of hypotheses.
#[derive(Clone, Debug)]
pub(crate) struct StartViews {
    /// No leak, and a small one.
    pub healthy: Vec<View>,
    /// Any leak.
    pub unknown: Vec<View>,
    /// No leak, and a small one, for a valve that does not degrade.
    pub none: Vec<View>,
}

/// The three hypotheses.
#[derive(Clone, Debug)]
pub(crate) struct Hypotheses {
    pub origin: u64,
    pub shape: Shape,
    pub tracks: [Track; 2],
    /// Whether each fault's track starts from health.
    healthy: [bool; 2],
    pub none: NoneTrack,
    /// Logarithm of prior times probability of the data: none, then the faults
    /// in the order of [`Fault::ALL`].
    pub ln: [f64; 3],
}

impl Hypotheses {
    /// Fits readings that hold the ones these hypotheses were fitted to and few
    /// more, starting from what is known.
    pub(crate) fn fit_on(
        &self,
        models: &[FaultModel; 2],
        readings: &[Reading],
        starts: &StartViews,
        priors: &Priors,
    ) -> Self {
        let phi = |cycle: u64| self.phi(cycle);
        let tracks = Fault::ALL.map(|fault| {
            let i = fault as usize;
            let views = self.views(fault, starts);
            let guess = Some(&self.tracks[i].state);
            Track::fit(&models[i], readings, &phi, views, priors, guess)
        });
        let mut all = Self { tracks, none: NoneTrack::fit(models, readings, priors), ..self.clone() };
        all.weigh(all.none.ln_evidence(&starts.none, priors), priors);
        all
    }

    /// Fits readings from scratch.
    pub(crate) fn fit(
        models: &[FaultModel; 2],
        readings: &[Reading],
        origin: u64,
        shape: Shape,
        starts: &StartViews,
        priors: &Priors,
    ) -> Self {
        let phi = |cycle: u64| shape.phi(cycle.saturating_sub(origin) as f64);
        let mut healthy = [true; 2];
        let tracks = Fault::ALL.map(|fault| {
            let model = &models[fault as usize];
            let fit = |views: &[View]| Track::fit(model, readings, &phi, views, priors, None);
            let mut best = None;
            for (views, from_health) in [(&starts.healthy, true), (&starts.unknown, false)] {
                if views.is_empty() {
                    continue;
                }
                let track = fit(views);
                let better = best.is_none_or(|old: Track| track.state.ln_evidence > old.state.ln_evidence);
                if better {
                    healthy[fault as usize] = from_health;
                    best = Some(track);
                }
            }
            best.expect("a start has a prior for health, for anything, or for both")
        });
        let none = NoneTrack::fit(models, readings, priors);
        let mut all = Self { origin, shape, tracks, healthy, none, ln: [0.0; 3] };
        all.weigh(all.none.ln_evidence(&starts.none, priors), priors);
        all
    }

    /// Adds one cycle.
    pub(crate) fn update(&mut self, models: &[FaultModel; 2], reading: &Reading, starts: &StartViews, priors: &Priors) {
        let phi = self.phi(reading.cycle);
        self.none.update(models, reading, priors);
        let none = self.none.ln_evidence(&starts.none, priors);
        let mut best = priors.ln_none - priors.ln_fault + none;
        // The leading fault first: it may make the other one not worth much.
        let leading = self.leading();
        let other = Fault::ALL.into_iter().find(|fault| *fault != leading);
        for fault in [leading].into_iter().chain(other) {
            let i = fault as usize;
            let views = self.views(fault, starts);
            let floor = best - NEGLIGIBLE;
            self.tracks[i].update(&models[i], reading, phi, views, priors, floor);
            best = best.max(self.tracks[i].state.ln_evidence);
        }
        self.weigh(none, priors);
    }

    fn views<'v>(&self, fault: Fault, starts: &'v StartViews) -> &'v [View] {
        if self.healthy[fault as usize] { &starts.healthy } else { &starts.unknown }
    }

    /// Weighs the hypotheses, given the evidence of no fault.
    fn weigh(&mut self, none: f64, priors: &Priors) {
        let [atmosphere, supply] = &self.tracks;
        self.ln = [
            priors.ln_none + none,
            priors.ln_fault + atmosphere.state.ln_evidence,
            priors.ln_fault + supply.state.ln_evidence,
        ];
    }

    /// Logarithm of the probability of all data under any of the hypotheses.
    pub(crate) fn ln_total(&self) -> f64 {
        ln_sum(self.ln.iter().copied())
    }

    pub(crate) fn phi(&self, cycle: u64) -> f64 {
        self.shape.phi(cycle.saturating_sub(self.origin) as f64)
    }

    /// The more probable fault.
    pub(crate) fn leading(&self) -> Fault {
        if self.ln[1] >= self.ln[2] { Fault::Atmosphere } else { Fault::Supply }
    }

    /// What the most probable hypothesis thinks of the last timings.
    pub(crate) fn view_of_last(&self) -> LastView {
        let track = &self.tracks[self.leading() as usize];
        if self.ln[0] > self.ln[1].max(self.ln[2]) {
            LastView {
                inlier: self.none.inlier,
                surprise: self.none.surprise,
                residual_s: self.none.residual_s,
                sigma2: self.none.sigma2,
            }
        } else {
            LastView {
                inlier: track.inlier,
                surprise: track.surprise,
                residual_s: track.residual_s,
                sigma2: track.state.sigma2,
            }
        }
    }
}

/// The last timings as a hypothesis sees them, closing then opening.
pub(crate) struct LastView {
    /// Probability of being a proper reading.
    pub inlier: [f64; 2],
    /// Residuals in expected standard deviations.
    pub surprise: [Option<f64>; 2],
    /// Residuals in s.
    pub residual_s: [Option<f64>; 2],
    /// Noise variance in s2.
    pub sigma2: f64,
}
