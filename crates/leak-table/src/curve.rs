//! Monotone cubic interpolation and its exact inverse.
//!
//! Piecewise cubic Hermite interpolation with slopes from the derivative of
//! the polynomial through the five nearest points, limited so that every piece
//! stays strictly monotone: J. M. Hyman, "Accurate monotonicity preserving
//! cubic interpolation", SIAM J. Sci. Stat. Comput. 4 (1983) 645. Where the
//! data are smooth the limiter does not act and the error falls with the
//! fourth power of the spacing.

use thiserror::Error;

/// Number of points from which a slope is estimated.
const STENCIL: usize = 5;
/// Largest slope at a knot, in units of the flatter neighbouring secant. Three
/// would still be monotone (de Boor and Swartz 1977) but lets a piece become
/// flat in its middle, where an inverse loses digits.
const STEEPEST: f64 = 2.5;
/// Smallest slope at a knot, in units of the flatter neighbouring secant.
const FLATTEST: f64 = 0.05;
/// Iterations after which the inverse is accepted as it is. Newton's method
/// needs three to five; every one of them also halves the bracket or better.
const MAX_ITERATIONS: usize = 60;

/// Why a set of points is not a monotone curve.
#[derive(Clone, Copy, Debug, PartialEq, Error)]
pub enum CurveError {
    /// Fewer than two points.
    #[error("found {found} points, expected at least 2")]
    TooFew {
        /// Number of points given.
        found: usize,
    },
    /// The lists of abscissae and ordinates differ in length.
    #[error("found {x} abscissae and {y} ordinates, expected as many")]
    Lengths {
        /// Number of abscissae.
        x: usize,
        /// Number of ordinates.
        y: usize,
    },
    /// A value is not finite.
    #[error("point {index} is not a finite number")]
    NotFinite {
        /// Index of the point, from 0.
        index: usize,
    },
    /// The abscissae do not rise strictly.
    #[error("the abscissa of point {index} is not above the one before it")]
    NotSorted {
        /// Index of the point, from 0.
        index: usize,
    },
    /// The ordinates do not keep rising or falling strictly.
    #[error("the ordinate of point {index} does not continue the direction of the points before it")]
    NotMonotone {
        /// Index of the point, from 0.
        index: usize,
    },
}

/// A strictly monotone, once continuously differentiable function of one
/// variable through given points, with its inverse.
#[derive(Clone, Debug, PartialEq)]
pub struct MonotoneCubic {
    x: Vec<f64>,
    y: Vec<f64>,
    slope: Vec<f64>,
    rising: bool,
}

impl MonotoneCubic {
    /// The curve through the points `(x[i], y[i])`.
    ///
    /// # Errors
    /// If there are fewer than two points, `x` does not rise strictly or `y`
    /// is not strictly monotone.
    pub fn new(x: Vec<f64>, y: Vec<f64>) -> Result<Self, CurveError> {
        if x.len() != y.len() {
            return Err(CurveError::Lengths { x: x.len(), y: y.len() });
        }
        if x.len() < 2 {
            return Err(CurveError::TooFew { found: x.len() });
        }
        if let Some(index) = (0..x.len()).find(|&i| !(x[i].is_finite() && y[i].is_finite())) {
            return Err(CurveError::NotFinite { index });
        }
        let rising = y[1] > y[0];
        for index in 1..x.len() {
            if x[index] <= x[index - 1] {
                return Err(CurveError::NotSorted { index });
            }
            let step = y[index] - y[index - 1];
            if step == 0.0 || (step > 0.0) != rising {
                return Err(CurveError::NotMonotone { index });
            }
        }
        let slope = (0..x.len()).map(|i| knot_slope(&x, &y, i)).collect();
        Ok(Self { x, y, slope, rising })
    }

    /// Whether the function rises.
    pub fn is_rising(&self) -> bool {
        self.rising
    }

    /// The abscissae of the points.
    pub fn x(&self) -> &[f64] {
        &self.x
    }

    /// The ordinates of the points.
    pub fn y(&self) -> &[f64] {
        &self.y
    }

    /// Value and derivative at `x`; beyond the points along the straight line
    /// with the slope of the end.
    #[inline]
    pub fn value_and_slope(&self, x: f64) -> (f64, f64) {
        let last = self.x.len() - 1;
        if x <= self.x[0] {
            return (self.y[0] + self.slope[0] * (x - self.x[0]), self.slope[0]);
        }
        if x >= self.x[last] {
            return (self.y[last] + self.slope[last] * (x - self.x[last]), self.slope[last]);
        }
        // Saturates for a NaN only, which then comes out as it went in.
        let i = self.x.partition_point(|&knot| knot <= x).saturating_sub(1);
        let piece = self.piece(i);
        let u = (x - self.x[i]) / piece.width;
        (piece.value(u), piece.derivative(u) / piece.width)
    }

    /// Value at `x`, as [`value_and_slope`](Self::value_and_slope).
    pub fn value(&self, x: f64) -> f64 {
        self.value_and_slope(x).0
    }

    /// The abscissa at which the function has the value `y`: the exact inverse
    /// of [`value`](Self::value), the straight lines beyond the ends included.
    #[inline]
    pub fn inverse(&self, y: f64) -> f64 {
        let last = self.x.len() - 1;
        let before = |a: f64, b: f64| if self.rising { a <= b } else { a >= b };
        if before(y, self.y[0]) {
            return self.x[0] + (y - self.y[0]) / self.slope[0];
        }
        if before(self.y[last], y) {
            return self.x[last] + (y - self.y[last]) / self.slope[last];
        }
        let i = self.y.partition_point(|&knot| before(knot, y)).saturating_sub(1);
        let piece = self.piece(i);
        self.x[i] + piece.width * piece.solve(y)
    }

    #[inline]
    fn piece(&self, i: usize) -> Piece {
        let width = self.x[i + 1] - self.x[i];
        let rise = self.y[i + 1] - self.y[i];
        let start = self.slope[i] * width;
        let end = self.slope[i + 1] * width;
        Piece {
            width,
            rise,
            c0: self.y[i],
            c1: start,
            c2: 3.0 * rise - 2.0 * start - end,
            c3: start + end - 2.0 * rise,
        }
    }
}

/// One cubic over u in 0..1: c0 + c1 u + c2 u^2 + c3 u^3.
struct Piece {
    width: f64,
    rise: f64,
    c0: f64,
    c1: f64,
    c2: f64,
    c3: f64,
}

impl Piece {
    #[inline]
    fn value(&self, u: f64) -> f64 {
        self.c0 + u * (self.c1 + u * (self.c2 + u * self.c3))
    }

    #[inline]
    fn derivative(&self, u: f64) -> f64 {
        self.c1 + u * (2.0 * self.c2 + u * 3.0 * self.c3)
    }

    /// The u in 0..1 at which the piece has the value `y`: Newton's method,
    /// kept inside a shrinking bracket.
    #[inline]
    fn solve(&self, y: f64) -> f64 {
        let target = (y - self.c0) / self.rise;
        let (mut low, mut high) = (0.0_f64, 1.0_f64);
        let mut u = target.clamp(0.0, 1.0);
        for _ in 0..MAX_ITERATIONS {
            let miss = u * (self.c1 + u * (self.c2 + u * self.c3)) / self.rise - target;
            if miss == 0.0 {
                break;
            }
            if miss > 0.0 {
                high = u;
            } else {
                low = u;
            }
            let newton = u - miss * self.rise / self.derivative(u);
            let next = if newton > low && newton < high { newton } else { 0.5 * (low + high) };
            let step = (next - u).abs();
            u = next;
            if step < 1e-15 {
                break;
            }
        }
        u
    }
}

/// Slope at knot `i`: the derivative of the polynomial through the nearest
/// points, limited against the neighbouring secants.
fn knot_slope(x: &[f64], y: &[f64], i: usize) -> f64 {
    let count = x.len().min(STENCIL);
    let first = i.saturating_sub(count / 2).min(x.len() - count);
    let raw = lagrange_slope(&x[first..first + count], &y[first..first + count], i - first);
    let secant = |j: usize| (y[j + 1] - y[j]) / (x[j + 1] - x[j]);
    let flatter = match (i.checked_sub(1), i + 1 < x.len()) {
        (Some(left), true) => secant(left).abs().min(secant(i).abs()),
        (Some(left), false) => secant(left).abs(),
        (None, _) => secant(0).abs(),
    };
    let sign = (y[1] - y[0]).signum();
    sign * (raw * sign).clamp(FLATTEST * flatter, STEEPEST * flatter)
}

/// Derivative at `x[at]` of the polynomial through all points given.
fn lagrange_slope(x: &[f64], y: &[f64], at: usize) -> f64 {
    let mut slope = 0.0;
    for j in (0..x.len()).filter(|&j| j != at) {
        let mut weight = 1.0 / (x[j] - x[at]);
        for m in (0..x.len()).filter(|&m| m != j && m != at) {
            weight *= (x[at] - x[m]) / (x[j] - x[m]);
        }
        slope += weight * (y[j] - y[at]);
    }
    slope
}

#[cfg(test)]
mod tests {
    use super::*;

    fn tangent_like() -> MonotoneCubic {
        let x: Vec<f64> = (0..40).map(|i| f64::from(i) * 0.035).collect();
        let y = x.iter().map(|x| x.tan()).collect();
        MonotoneCubic::new(x, y).expect("tan is monotone below pi/2")
    }

    #[test]
    fn inverse_undoes_value_inside_and_beyond_the_points() {
        let curve = tangent_like();
        for i in -100..1700 {
            let x = f64::from(i) * 0.001_003;
            let back = curve.inverse(curve.value(x));
            assert!((back - x).abs() < 1e-12, "{x} came back as {back}");
        }
    }

    #[test]
    fn passes_through_the_points_and_has_a_continuous_slope() {
        let curve = tangent_like();
        for (&x, &y) in curve.x().iter().zip(curve.y()) {
            assert!((curve.value(x) - y).abs() < 1e-14 * y.max(1.0));
            let (_, below) = curve.value_and_slope(x - 1e-9);
            let (_, above) = curve.value_and_slope(x + 1e-9);
            assert!((below - above).abs() < 1e-4 * above);
        }
    }

    #[test]
    fn error_falls_with_the_fourth_power_of_the_spacing() {
        let worst = |n: u32| {
            let x: Vec<f64> = (0..=n).map(|i| f64::from(i) / f64::from(n)).collect();
            let y = x.iter().map(|x| x.exp()).collect();
            let curve = MonotoneCubic::new(x, y).expect("exp is monotone");
            (0..1000).map(|i| f64::from(i) * 1e-3).map(|x| (curve.value(x) - x.exp()).abs()).fold(0.0, f64::max)
        };
        let ratio = worst(10) / worst(20);
        assert!(ratio > 13.0, "halving the spacing gained a factor of {ratio} only");
    }

    #[test]
    fn stays_monotone_across_a_kink() {
        let curve = MonotoneCubic::new(vec![0.0, 1.0, 2.0, 3.0, 4.0, 5.0], vec![0.0, 0.01, 0.02, 5.0, 5.01, 9.0])
            .expect("rises throughout");
        let mut before = f64::NEG_INFINITY;
        for i in 0..=5000 {
            let y = curve.value(f64::from(i) * 1e-3);
            assert!(y > before);
            before = y;
        }
    }

    #[test]
    fn not_a_number_stays_what_it_is() {
        let curve = tangent_like();
        assert!(curve.value(f64::NAN).is_nan());
        assert!(curve.inverse(f64::NAN).is_nan());
    }

    #[test]
    fn refuses_what_is_not_a_curve() {
        let new = |x: &[f64], y: &[f64]| MonotoneCubic::new(x.to_vec(), y.to_vec()).unwrap_err();
        assert_eq!(new(&[0.0], &[1.0]), CurveError::TooFew { found: 1 });
        assert_eq!(new(&[0.0, 0.0], &[1.0, 2.0]), CurveError::NotSorted { index: 1 });
        assert_eq!(new(&[0.0, 1.0, 2.0], &[1.0, 2.0, 1.5]), CurveError::NotMonotone { index: 2 });
        assert_eq!(new(&[0.0, 1.0], &[1.0, f64::NAN]), CurveError::NotFinite { index: 1 });
    }
}
