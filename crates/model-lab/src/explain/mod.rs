//! Which physical effect is missing, how large it is, how sure that is, and what would decide.

pub mod candidate;
pub mod experiment;
pub mod held_out;
pub mod impression;
pub mod lack;
pub mod model;
pub mod outside;
pub mod report;
pub mod search;
pub mod twins;
pub mod view;

use std::sync::atomic::{AtomicBool, Ordering};

use rayon::prelude::*;
use valve_model::EffectKind;

use crate::calibrate::polished;
use crate::data::Dataset;
use crate::fit::{Fit, FitOptions, fit};
use crate::scatter::Scatter;
use crate::space::Space;
use search::Found;
use view::View;

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

impl Watch<'static> {
    /// Nobody watches, and nothing stops it.
    pub fn nobody() -> Self {
        static NEVER: AtomicBool = AtomicBool::new(false);
        Self { report: &|_| {}, stop: &NEVER }
    }
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
    /// The datasheet's values.
    pub datasheet: Fit,
    /// The calibrated model.
    pub fit: Fit,
    /// The scatter from stroke to stroke.
    pub scatter: Scatter,
}

/// Calibrates a space on a dataset: several starts, scatter estimated where strokes are repeated.
pub fn calibrated(data: &Dataset, space: &Space) -> Option<Calibrated> {
    let none = Scatter::unknown(data);
    let start = space.start();
    let shifted = |by: f64| -> Vec<f64> { start.iter().map(|u| u + by).collect() };
    let rough = data.rough();
    let quick = FitOptions { steps: 2, tolerance: 0.5, stall: 0.0 };
    let datasheet = fit(data, &none, space, &start, FitOptions { steps: 0, ..FitOptions::default() })?;
    let best = [start.clone(), shifted(0.7), shifted(-0.7)]
        .par_iter()
        .filter_map(|start| fit(&rough, &none, space, start, quick))
        .min_by(|a, b| a.cost.total_cmp(&b.cost))?;
    let best = fit(&rough, &none, space, &best.u, FitOptions { steps: 10, ..FitOptions::default() })?;
    let mut best = fit(data, &none, space, &best.u, FitOptions::default())?;
    let scatter = Scatter::estimate(data, &best.valve());
    if scatter.is_known() {
        best = fit(data, &scatter, space, &best.u, FitOptions::default())?;
    }
    Some(Calibrated { datasheet, fit: best, scatter })
}

/// Root mean square of the residuals up to which a calibrated model shows the scatter of strokes well
/// enough to make it linear.
const SHOWS_SCATTER: f64 = 1.5;

/// Explains what a model lacks on a dataset; nothing if not even the valve file's own values can be
/// simulated.
pub fn explain(data: &Dataset, space: &Space, watch: &Watch<'_>) -> Option<Explanation> {
    let Calibrated { datasheet, fit, scatter } = calibrated(data, space)?;
    watch.tell(Progress::Calibrated { normalised_rms: fit.normalised_rms(&scatter) });
    let found = searched(data, View::new(data.clone(), scatter), fit, watch);
    Some(report::assemble(datasheet.normalised_rms(&found.view.scatter), &found, watch))
}

/// Searches from a calibrated model, with the scatter of strokes seen through it where it shows that.
fn searched(data: &Dataset, mut view: View, mut base: Fit, watch: &Watch<'_>) -> Found {
    if view.scatter.is_known() && base.normalised_rms(&view.scatter) < SHOWS_SCATTER {
        view = view.through(data, &base);
        base = view.finely(&base);
    }
    base = polished(&view.fine, &view.scatter, base);
    search::search(data, view, base, watch)
}
