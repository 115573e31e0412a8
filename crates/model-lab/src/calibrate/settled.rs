//! A fit and the scatter of strokes, each seen through the other until both stay.

use super::polish::polished;
use super::relinearise::relinearised;
use super::verdict::{LackOfFit, is_within_tolerances};
use crate::data::Dataset;
use crate::fit::{Fit, FitOptions, fit};
use crate::scatter::{Origin, Scatter};

/// Times that the scatter of single strokes is made linear about what it most likely is.
const ROUNDS: usize = 6;

/// How much supposed scatter that was seen wrongly may cost when it is seen better.
const WORSE: f64 = 1.2;

/// Change of the cost below which they are linear enough.
const SETTLED: f64 = 10.0;

/// A fit with the scatter that it allows for.
#[derive(Debug, Clone)]
pub struct Settled {
    /// The fit.
    pub fit: Fit,
    /// The scatter.
    pub scatter: Scatter,
    /// The data with the scatter of single strokes made linear.
    pub data: Dataset,
}

impl Settled {
    /// A fit carried on with a scatter, which is seen anew through every better fit.
    pub(super) fn new(data: &Dataset, scatter: Scatter, start: Fit) -> Self {
        let mut found = Self { fit: start, scatter, data: data.clone() };
        let space = found.fit.space.clone();
        let finely = FitOptions { steps: 6, tolerance: 0.1, ..FitOptions::default() };
        if let Some(best) = fit(data, &found.scatter, &space, &found.fit.u, finely) {
            found.fit = best;
        }
        if !found.scatter.is_known() {
            return found;
        }
        for _ in 0..ROUNDS {
            let next = relinearised(data, &found.data, &found.scatter, &found.fit.valve());
            let scatter = found.scatter.seen_through(&next, &found.fit);
            let options = FitOptions { steps: 3, tolerance: 0.2, ..FitOptions::default() };
            let Some(again) = fit(&next, &scatter, &space, &found.fit.u, options) else { break };
            // A model that is far from the data takes their misfit for scatter; that gets worse, not better.
            // Supposed scatter must first leave only noise: until then it is seen wrongly.
            let is_wrong = found.scatter.origin == Origin::Supposed && found.lack_of_fit(data).excess().is_some();
            if again.cost > if is_wrong { WORSE * found.fit.cost } else { found.fit.cost } {
                break;
            }
            let settled = !is_wrong && (found.fit.cost - again.cost).abs() < SETTLED;
            found = Self { fit: again, scatter, data: next };
            if settled {
                break;
            }
        }
        found
    }

    /// A fit carried on as if strokes of which none was repeated scattered, where that explains all that it
    /// leaves; `scatter` is what is known beforehand.
    pub fn supposed(data: &Dataset, scatter: &Scatter, start: &Fit) -> Option<Self> {
        let supposed = Self::new(data, scatter.or_supposed(data, start)?, start.clone());
        let explains = supposed.lack_of_fit(data).excess().is_none() && is_within_tolerances(&supposed.fit);
        explains.then_some(supposed)
    }

    /// With its optimum made exact.
    pub(super) fn polished(self) -> Self {
        Self { fit: polished(&self.data, &self.scatter, self.fit), ..self }
    }

    /// What is left.
    pub(super) fn lack_of_fit(&self, recorded: &Dataset) -> LackOfFit {
        LackOfFit::new(recorded, &self.fit, &self.scatter)
    }
}
