//! Laws of growth: how the severity goes with the share of life that has
//! passed.
//!
//! Under each law there is a coordinate u, 0 for a healthy valve and 1 at the
//! limit, that grows by the same amount every cycle. So every law is a straight
//! line in its own coordinate, and the end of life is where the line meets 1.

use serde::{Deserialize, Serialize};

use super::special::{quick_exp, quick_ln};

/// A law of growth.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) enum Law {
    /// The same amount every cycle.
    Linear,
    /// With the square root of the cycles: fast first.
    Root,
    /// With the power 3/2.
    Faster,
    /// With the square.
    Square,
    /// With the cube.
    Cube,
    /// By the same factor every cycle, by three e-foldings in a life.
    Exponential,
    /// The same with five.
    SteepExponential,
    /// The same with eight.
    SteepestExponential,
}

/// Powers begin a little before the first cycle, so that their slope there is
/// neither zero nor infinite.
const BEFORE: f64 = 0.03;

impl Law {
    /// Severity and its derivative by the coordinate; the tangent below zero.
    #[inline]
    pub(crate) fn severity(self, u: f64) -> (f64, f64) {
        let at = u.max(0.0);
        let (value, slope) = match self {
            Self::Linear => return (u, 1.0),
            Self::Root => power(0.5, at),
            Self::Faster => power(1.5, at),
            Self::Square => power(2.0, at),
            Self::Cube => power(3.0, at),
            Self::Exponential => exponential(3.0, at),
            Self::SteepExponential => exponential(5.0, at),
            Self::SteepestExponential => exponential(8.0, at),
        };
        (value + slope * (u - at), slope)
    }
}

impl Law {
    /// The coordinate of a severity, by halving.
    pub(crate) fn coordinate(self, severity: f64) -> f64 {
        if self == Self::Linear || severity == 1.0 {
            return severity;
        }
        let (mut low, mut high) = (0.0, 2.0);
        for _ in 0..40 {
            let middle = f64::midpoint(low, high);
            if self.severity(middle).0 < severity {
                low = middle;
            } else {
                high = middle;
            }
        }
        high
    }
}

fn power(exponent: f64, u: f64) -> (f64, f64) {
    let raised = |x: f64| quick_exp(exponent * quick_ln(x));
    let (first, last) = (raised(BEFORE), raised(1.0 + BEFORE));
    let now = raised(u + BEFORE);
    ((now - first) / (last - first), exponent * now / ((u + BEFORE) * (last - first)))
}

fn exponential(folds: f64, u: f64) -> (f64, f64) {
    let whole = folds.exp_m1();
    let grown = (folds * u.min(2.0)).exp();
    ((grown - 1.0) / whole, folds * grown / whole)
}
