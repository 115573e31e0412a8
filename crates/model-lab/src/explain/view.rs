//! A campaign as a search sees it: how finely it is simulated, and how its strokes scatter.

use super::impression::Impression;
use super::lack::lack_of_fit;
use crate::calibrate::{is_within_tolerances, relinearised};
use crate::data::Dataset;
use crate::fit::{Fit, FitOptions, fit};
use crate::scatter::Scatter;

/// How often the scatter of strokes is made linear about what it most likely is.
const ROUNDS: usize = 3;

/// Change of the cost below which it is linear enough.
const SETTLED: f64 = 5.0;

/// Rise of the cost from which it got worse.
const WORSE: f64 = 1.5;

/// Lack of fit, in standard deviations of noise, below which nothing more is looked for.
pub const FITS: f64 = 5.0;

/// The same where strokes scatter: what the scatter's few directions leave is not quite noise.
const FITS_SCATTERED: f64 = 12.0;

/// Lack of fit below which nothing more is looked for.
pub fn fits(scatter: &Scatter) -> f64 {
    if scatter.is_known() { FITS_SCATTERED } else { FITS }
}

/// A campaign with the scatter of its strokes, for the search and for its results.
#[derive(Debug, Clone)]
pub struct View {
    /// Simulated finely: costs that decide.
    pub fine: Dataset,
    /// Simulated roughly: the way there.
    pub rough: Dataset,
    /// A few of its runs, simulated roughly: where to start.
    pub impression: Impression,
    /// The scatter from stroke to stroke.
    pub scatter: Scatter,
}

impl View {
    /// A campaign with a known scatter.
    pub fn new(data: Dataset, scatter: Scatter) -> Self {
        let rough = data.rough();
        let impression = Impression::of(&rough, &scatter);
        Self { fine: data, rough, impression, scatter }
    }

    /// The scatter seen anew, and made linear about what it most likely is in each stroke, through a
    /// better model; `recorded` are the data as they were recorded.
    #[must_use]
    pub fn through(&self, recorded: &Dataset, model: &Fit) -> Self {
        let mut view = self.clone();
        let mut best = self.roughly(model);
        for _ in 0..ROUNDS {
            let valve = best.valve();
            let straight = relinearised(recorded, &view.fine, &view.scatter, &valve);
            let scatter = view.scatter.seen_through(&straight, &best);
            let next = Self::new(straight, scatter);
            let again = refitted(&next.rough, &next.scatter, &best, 2);
            // A model that is far from the data takes their misfit for scatter; that gets worse, not better.
            // (Costs with different scatter do not compare exactly: less scatter, higher cost.)
            if again.cost > WORSE * best.cost {
                break;
            }
            let settled = (best.cost - again.cost).abs() < SETTLED;
            (view, best) = (next, again);
            if settled {
                break;
            }
        }
        view
    }

    /// Whether a model with believable parameters leaves no more than noise.
    pub fn explains(&self, model: &Fit) -> bool {
        let left = lack_of_fit(&self.fine, &self.scatter.without_scatter(&model.residual));
        left < fits(&self.scatter) && is_within_tolerances(model)
    }

    /// A fit carried on in the rough simulation.
    pub fn roughly(&self, from: &Fit) -> Fit {
        refitted(&self.rough, &self.scatter, from, 3)
    }

    /// A fit carried on in the fine simulation.
    pub fn finely(&self, from: &Fit) -> Fit {
        refitted(&self.fine, &self.scatter, from, 4)
    }
}

fn refitted(data: &Dataset, scatter: &Scatter, from: &Fit, steps: usize) -> Fit {
    let options = FitOptions { steps, tolerance: 0.1, stall: 1e-3 };
    fit(data, scatter, &from.space, &from.u, options).unwrap_or_else(|| from.clone())
}
