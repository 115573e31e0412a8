//! Which physical effect is missing, how large it is, how sure that is, and what would decide.

pub mod candidate;
pub mod experiment;
pub mod held_out;
pub mod lack;
pub mod outside;
pub mod report;
pub mod search;
pub mod twins;

use std::sync::atomic::{AtomicBool, Ordering};

use valve_model::EffectKind;

use crate::calibrate::relinearised;
use crate::data::Dataset;
use crate::fit::{Fit, FitOptions, fit};
use crate::scatter::Scatter;
use crate::space::Space;
use search::Scope;

pub use report::{Explanation, Verdict};

/// What a search tells while it runs.
#[derive(Debug, Clone, PartialEq)]
pub enum Progress {
    /// The base model is calibrated.
    Calibrated {
        /// Root mean square of its residuals in units of the noise.
        normalised_rms: f64,
    },
    /// A candidate was fitted.
    Tried {
        /// How many effects it has.
        depth: usize,
        /// How many candidates there are at this depth.
        total: usize,
        /// The effect added.
        kind: EffectKind,
        /// The cost reached.
        cost: f64,
    },
    /// A set of effects was accepted.
    Accepted {
        /// The effects.
        kinds: Vec<EffectKind>,
        /// The lack of fit that remains.
        lack: f64,
    },
    /// Something else is being done.
    Doing(&'static str),
}

/// Where progress goes, and whether to stop.
#[derive(Clone, Copy)]
pub struct Watch<'a> {
    /// Called with every piece of progress, from any thread.
    pub report: &'a (dyn Fn(Progress) + Sync),
    /// Set from outside to stop early; what is known by then is returned.
    pub stop: &'a AtomicBool,
}

impl Watch<'_> {
    pub(crate) fn tell(&self, progress: Progress) {
        (self.report)(progress);
    }

    pub(crate) fn is_stopped(&self) -> bool {
        self.stop.load(Ordering::Relaxed)
    }
}

/// The model calibrated within its tolerances, and the scatter of strokes that the repeats show.
#[derive(Debug, Clone)]
pub struct Calibrated {
    /// The residuals of the datasheet's values, in units of the noise.
    pub datasheet_rms: f64,
    /// The calibrated model.
    pub fit: Fit,
    /// The scatter from stroke to stroke.
    pub scatter: Scatter,
}

/// Calibrates a space on a dataset: several starts, scatter estimated where strokes are repeated.
pub fn calibrated(data: &Dataset, space: &Space) -> Option<Calibrated> {
    let none = Scatter::none();
    let start = space.start();
    let shifted = |by: f64| -> Vec<f64> { start.iter().map(|u| u + by).collect() };
    let quick = FitOptions { steps: 6, tolerance: 0.5, stall: 0.0 };
    let datasheet = fit(data, &none, space, &start, FitOptions { steps: 0, ..FitOptions::default() })?;
    let best = [start.clone(), shifted(0.7), shifted(-0.7)]
        .iter()
        .filter_map(|start| fit(data, &none, space, start, quick))
        .min_by(|a, b| a.cost.total_cmp(&b.cost))?;
    let mut best = fit(data, &none, space, &best.u, FitOptions::default())?;
    let scatter = Scatter::estimate(data, &best.valve());
    if scatter.is_known {
        best = fit(data, &scatter, space, &best.u, FitOptions::default())?;
    }
    Some(Calibrated { datasheet_rms: datasheet.normalised_rms(&scatter), fit: best, scatter })
}

/// How often the scatter of strokes is made linear about what it most likely is.
const SCATTER_ROUNDS: usize = 3;

/// Single effects that are looked at again when the scatter of strokes is seen anew.
const CONTENDERS: usize = 5;

/// Explains what a model lacks on a dataset; nothing if not even the valve file's own values can be
/// simulated.
pub fn explain(data: &Dataset, space: &Space, watch: &Watch<'_>) -> Option<Explanation> {
    let Calibrated { datasheet_rms, fit: base, mut scatter } = calibrated(data, space)?;
    watch.tell(Progress::Calibrated { normalised_rms: base.normalised_rms(&scatter) });
    if !scatter.is_known {
        let found = search::search(data, &scatter, base, Scope::ALL, watch);
        return Some(report::assemble(data, &scatter, datasheet_rms, &found, watch));
    }
    // Scatter seen through a model that does not fit is seen wrongly: the single effects are tried with
    // it, and everything is looked at again with the scatter that the best of them shows.
    let mut found = search::search(data, &scatter, base.clone(), Scope { deepest: 1, ..Scope::ALL }, watch);
    if watch.is_stopped() {
        return Some(report::assemble(data, &scatter, datasheet_rms, &found, watch));
    }
    watch.tell(Progress::Doing("looking again with the scatter of strokes seen by the better model"));
    let mut best = found.steps[found.steps.len() - 1].fit.clone();
    let mut straight = data.clone();
    for _ in 0..SCATTER_ROUNDS {
        let valve = best.valve();
        straight = relinearised(data, &straight, &scatter, &valve);
        scatter = Scatter::estimate(&straight, &valve);
        best = fit(&straight, &scatter, &best.space, &best.u, FitOptions { steps: 6, ..FitOptions::default() })
            .unwrap_or(best);
    }
    let base = fit(&straight, &scatter, space, &base.u, FitOptions::default()).unwrap_or(base);
    let first = found.contenders(CONTENDERS);
    found = search::search(&straight, &scatter, base, Scope { first: &first, ..Scope::ALL }, watch);
    Some(report::assemble(&straight, &scatter, datasheet_rms, &found, watch))
}
