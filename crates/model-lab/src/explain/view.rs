//! A campaign as a search sees it: how finely it is simulated, and how its strokes scatter.

use crate::calibrate::relinearised;
use crate::data::Dataset;
use crate::fit::{Fit, FitOptions, fit};
use crate::scatter::Scatter;

/// How often the scatter of strokes is made linear about what it most likely is.
const ROUNDS: usize = 3;

/// A campaign with the scatter of its strokes, for the search and for its results.
#[derive(Debug, Clone)]
pub struct View {
    /// Simulated finely: costs that decide.
    pub fine: Dataset,
    /// Simulated roughly: the way there.
    pub rough: Dataset,
    /// The scatter from stroke to stroke.
    pub scatter: Scatter,
}

impl View {
    /// A campaign with a known scatter.
    pub fn new(data: Dataset, scatter: Scatter) -> Self {
        Self { rough: data.rough(), fine: data, scatter }
    }

    /// The scatter seen anew, and made linear about what it most likely is in each stroke, through a
    /// better model; `recorded` are the data as they were recorded.
    #[must_use]
    pub fn through(&self, recorded: &Dataset, model: &Fit) -> Self {
        let mut straight = self.fine.clone();
        let mut scatter = self.scatter.clone();
        let mut best = model.clone();
        for round in 0..ROUNDS {
            let valve = best.valve();
            straight = relinearised(recorded, &straight, &scatter, &valve);
            scatter = Scatter::estimate(&straight, &valve);
            if round + 1 < ROUNDS {
                best = refitted(&straight.rough(), &scatter, &best, 2);
            }
        }
        Self::new(straight, scatter)
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
