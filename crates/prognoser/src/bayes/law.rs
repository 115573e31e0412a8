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
            Self::Root => ROOT.severity(at),
            Self::Faster => FASTER.severity(at),
            Self::Square => SQUARE.severity(at),
            Self::Cube => CUBE.severity(at),
            Self::Exponential => EXPONENTIAL.severity(at),
            Self::SteepExponential => STEEP_EXPONENTIAL.severity(at),
            Self::SteepestExponential => STEEPEST_EXPONENTIAL.severity(at),
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

/// A power law of growth, with what is the same at every coordinate.
struct Power {
    exponent: f64,
    /// The power where growth begins, and by how much it rises up to the limit.
    first: f64,
    rise: f64,
}

impl Power {
    const fn new(exponent: f64) -> Self {
        let first = raised(BEFORE, exponent);
        Self { exponent, first, rise: raised(1.0 + BEFORE, exponent) - first }
    }

    #[inline]
    fn severity(&self, u: f64) -> (f64, f64) {
        let now = raised(u + BEFORE, self.exponent);
        ((now - self.first) / self.rise, self.exponent * now / ((u + BEFORE) * self.rise))
    }
}

const fn raised(x: f64, exponent: f64) -> f64 {
    quick_exp(exponent * quick_ln(x))
}

const ROOT: Power = Power::new(0.5);
const FASTER: Power = Power::new(1.5);
const SQUARE: Power = Power::new(2.0);
const CUBE: Power = Power::new(3.0);

/// A law of growth by some e-foldings in a life, with by how much the exponential rises up to the limit.
struct Exponential {
    folds: f64,
    rise: f64,
}

impl Exponential {
    #[inline]
    fn severity(&self, u: f64) -> (f64, f64) {
        let grown = (self.folds * u.min(2.0)).exp();
        ((grown - 1.0) / self.rise, self.folds * grown / self.rise)
    }
}

const EXPONENTIAL: Exponential = Exponential { folds: 3.0, rise: 19.085_536_923_187_668 };
const STEEP_EXPONENTIAL: Exponential = Exponential { folds: 5.0, rise: 147.413_159_102_576_6 };
const STEEPEST_EXPONENTIAL: Exponential = Exponential { folds: 8.0, rise: 2_979.957_987_041_728_3 };

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn exponentials_rise_as_their_foldings_say() {
        for law in [EXPONENTIAL, STEEP_EXPONENTIAL, STEEPEST_EXPONENTIAL] {
            let rise = law.folds.exp_m1();
            assert!((law.rise / rise - 1.0).abs() < 1e-15, "{} foldings: {rise}", law.folds);
        }
    }

    #[test]
    fn every_law_goes_from_none_to_the_limit() {
        let all = [
            Law::Linear,
            Law::Root,
            Law::Faster,
            Law::Square,
            Law::Cube,
            Law::Exponential,
            Law::SteepExponential,
            Law::SteepestExponential,
        ];
        for law in all {
            let (first, last) = (law.severity(0.0).0, law.severity(1.0).0);
            assert!(first.abs() < 1e-12 && (last - 1.0).abs() < 1e-12, "{law:?}: {first} to {last}");
        }
    }
}
