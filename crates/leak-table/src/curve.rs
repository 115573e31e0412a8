//! Monotone cubic interpolation and its exact inverse.
//!
//! Piecewise cubic Hermite interpolation with slopes from the derivative of
//! the polynomial through the five nearest points, limited so that every piece
//! stays strictly monotone: J. M. Hyman, "Accurate monotonicity preserving
//! cubic interpolation", SIAM J. Sci. Stat. Comput. 4 (1983) 645. Where the
//! data are smooth the limiter does not act and the error falls with the
//! fourth power of the spacing.

use thiserror::Error;

use crate::stencil::STENCIL;

/// Largest slope at a knot, in units of the flatter neighbouring secant. Three
/// would still be monotone (de Boor and Swartz 1977) but lets a piece become
/// flat in its middle, where an inverse loses digits.
const STEEPEST: f64 = 2.5;
/// Smallest slope at a knot, in units of the flatter neighbouring secant.
const FLATTEST: f64 = 0.05;
/// An inverse is accepted when it misses its value by no more than this share
/// of its piece's height: a few units of the last digit.
const SETTLED: f64 = 4e-15;
/// Iterations after which the safe inverse is accepted as it is. Newton's method
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

/// A monotone, once continuously differentiable function of one variable
/// through given points, with its inverse.
#[derive(Clone, Debug, PartialEq)]
pub struct MonotoneCubic {
    x: Vec<f64>,
    y: Vec<f64>,
    slope: Vec<f64>,
    pieces: Vec<Piece>,
    rising: bool,
}

impl MonotoneCubic {
    /// The curve through the points `(x[i], y[i])`.
    ///
    /// # Errors
    /// If there are fewer than two points, `x` does not rise strictly or `y`
    /// is not strictly monotone.
    pub fn new(x: Vec<f64>, y: Vec<f64>) -> Result<Self, CurveError> {
        Self::checked(x, y, |step| step != 0.0)
    }

    /// As [`new`](Self::new), for ordinates that may also stay as they are.
    pub fn with_level_pieces(x: Vec<f64>, y: Vec<f64>) -> Result<Self, CurveError> {
        Self::checked(x, y, |_| true)
    }

    fn checked(x: Vec<f64>, y: Vec<f64>, moves_enough: impl Fn(f64) -> bool) -> Result<Self, CurveError> {
        if x.len() != y.len() {
            return Err(CurveError::Lengths { x: x.len(), y: y.len() });
        }
        if x.len() < 2 {
            return Err(CurveError::TooFew { found: x.len() });
        }
        if let Some(index) = (0..x.len()).find(|&i| !(x[i].is_finite() && y[i].is_finite())) {
            return Err(CurveError::NotFinite { index });
        }
        // The direction is that of the first step that is one.
        let rising = y.iter().find(|other| **other != y[0]).is_none_or(|other| *other > y[0]);
        for index in 1..x.len() {
            if x[index] <= x[index - 1] {
                return Err(CurveError::NotSorted { index });
            }
            let step = y[index] - y[index - 1];
            if !moves_enough(step) || (step != 0.0 && (step > 0.0) != rising) {
                return Err(CurveError::NotMonotone { index });
            }
        }
        let slope: Vec<f64> = (0..x.len()).map(|i| knot_slope(&x, &y, i, rising)).collect();
        let pieces = (0..x.len() - 1).map(|i| Piece::new([x[i], x[i + 1]], [y[i], y[i + 1]], [slope[i], slope[i + 1]]));
        let pieces = pieces.collect();
        Ok(Self { x, y, slope, pieces, rising })
    }

    /// Whether the function rises.
    pub fn is_rising(&self) -> bool {
        self.rising
    }

    /// Whether the function has one value everywhere.
    pub fn is_level(&self) -> bool {
        self.y[0] == self.y[self.y.len() - 1]
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
        let piece = &self.pieces[i];
        let u = (x - self.x[i]) / piece.width;
        (piece.value(u), piece.derivative(u) / piece.width)
    }

    /// Value at `x`, as [`value_and_slope`](Self::value_and_slope).
    pub fn value(&self, x: f64) -> f64 {
        self.value_and_slope(x).0
    }

    /// The abscissa at which the function has the value `y`: the exact inverse
    /// of [`value`](Self::value), the straight lines beyond the ends included.
    ///
    /// Where several abscissae have this value it is the last of them, and
    /// where none has one of its own, at a level end and beyond it, it is infinite
    /// or not a number.
    #[inline]
    pub fn inverse(&self, y: f64) -> f64 {
        let last = self.x.len() - 1;
        let before = |a: f64, b: f64| if self.rising { a <= b } else { a >= b };
        if before(self.y[last], y) {
            return self.x[last] + (y - self.y[last]) / self.slope[last];
        }
        if !before(self.y[0], y) {
            return self.x[0] + (y - self.y[0]) / self.slope[0];
        }
        let above = if self.rising {
            self.y.partition_point(|&knot| knot <= y)
        } else {
            self.y.partition_point(|&knot| knot >= y)
        };
        let i = above.saturating_sub(1);
        let piece = &self.pieces[i];
        self.x[i] + piece.width * piece.solve(y)
    }
}

/// One cubic over u in 0..1: c0 + c1 u + c2 u^2 + c3 u^3.
#[derive(Clone, Debug, PartialEq)]
struct Piece {
    width: f64,
    rise: f64,
    /// One over the rise.
    per_rise: f64,
    c0: f64,
    c1: f64,
    c2: f64,
    c3: f64,
    /// The inverse, roughly, by rising powers of t = (y - c0) / rise from t on: right at both ends, with slope and
    /// bend.
    rough: [f64; 5],
}

impl Piece {
    #[inline]
    fn new(x: [f64; 2], y: [f64; 2], slope: [f64; 2]) -> Self {
        let width = x[1] - x[0];
        let rise = y[1] - y[0];
        let (start, end) = (slope[0] * width, slope[1] * width);
        let (c2, c3) = (3.0 * rise - 2.0 * start - end, start + end - 2.0 * rise);
        // At a level end the inverse has no slope; whatever stands in leads to the safe way.
        let inverse_slope = |slope: f64| if slope == 0.0 { 0.0 } else { rise / slope };
        let (g0, g1) = (inverse_slope(start), inverse_slope(end));
        let bend = |by_u: f64, slope: f64| if rise == 0.0 { 0.0 } else { -by_u / rise * slope * slope * slope };
        let (h0, h1) = (bend(2.0 * c2, g0), bend(2.0 * c2 + 6.0 * c3, g1));
        let rough = [
            g0,
            0.5 * h0,
            10.0 - 6.0 * g0 - 4.0 * g1 - 1.5 * h0 + 0.5 * h1,
            -15.0 + 8.0 * g0 + 7.0 * g1 + 1.5 * h0 - h1,
            6.0 - 3.0 * g0 - 3.0 * g1 - 0.5 * h0 + 0.5 * h1,
        ];
        let per_rise = if rise == 0.0 { 0.0 } else { 1.0 / rise };
        Self { width, rise, per_rise, c0: y[0], c1: start, c2, c3, rough }
    }

    #[inline]
    fn value(&self, u: f64) -> f64 {
        self.c0 + u * (self.c1 + u * (self.c2 + u * self.c3))
    }

    #[inline]
    fn derivative(&self, u: f64) -> f64 {
        self.c1 + u * (2.0 * self.c2 + u * 3.0 * self.c3)
    }

    /// How far the piece at `u` is from being `above` higher than its start.
    #[inline]
    fn miss(&self, u: f64, above: f64) -> f64 {
        u * (self.c1 + u * (self.c2 + u * self.c3)) - above
    }

    /// The u in 0..1 at which the piece has the value `y`.
    ///
    /// One step of Halley's method from the rough inverse is all that a smooth piece needs; a second one settles
    /// most others, and the safe way what is left.
    #[inline]
    fn solve(&self, y: f64) -> f64 {
        let above = y - self.c0;
        let t = above * self.per_rise;
        let [a, b, c, d, e] = self.rough;
        let mut u = t * (a + t * (b + t * (c + t * (d + t * e))));
        for _ in 0..2 {
            let miss = self.miss(u, above);
            let slope = self.derivative(u);
            let half_bend = self.c2 + 3.0 * self.c3 * u;
            u -= miss * slope / (slope * slope - miss * half_bend);
            if self.miss(u, above).abs() <= SETTLED * self.rise.abs() && (0.0..=1.0).contains(&u) {
                return u;
            }
        }
        self.solve_safely(y)
    }

    /// Newton's method, kept inside a shrinking bracket.
    #[cold]
    fn solve_safely(&self, y: f64) -> f64 {
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
fn knot_slope(x: &[f64], y: &[f64], i: usize, rising: bool) -> f64 {
    let count = x.len().min(STENCIL);
    let first = i.saturating_sub(count / 2).min(x.len() - count);
    let raw = lagrange_slope(&x[first..first + count], &y[first..first + count], i - first);
    let secant = |j: usize| (y[j + 1] - y[j]) / (x[j + 1] - x[j]);
    let flatter = match (i.checked_sub(1), i + 1 < x.len()) {
        (Some(left), true) => secant(left).abs().min(secant(i).abs()),
        (Some(left), false) => secant(left).abs(),
        (None, _) => secant(0).abs(),
    };
    let sign = if rising { 1.0 } else { -1.0 };
    sign * (raw * sign).clamp(FLATTEST * flatter, STEEPEST * flatter)
}

/// What a slope must be instead of `raw`, in units of the flatter secant beside it; none if it may stay.
#[inline]
pub(crate) fn limited(raw: f64, flatter: f64, rising: bool) -> Option<f64> {
    let sign = if rising { 1.0 } else { -1.0 };
    let (raw, flatter) = (raw * sign, (flatter * sign).max(0.0));
    if raw < FLATTEST * flatter {
        Some(FLATTEST)
    } else if raw > STEEPEST * flatter {
        Some(STEEPEST)
    } else {
        None
    }
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
    fn the_quick_inverse_is_the_safe_one() {
        let curve = tangent_like();
        for piece in &curve.pieces {
            for i in 1..100 {
                let y = piece.value(f64::from(i) * 0.01);
                let (quick, safe) = (piece.solve(y), piece.solve_safely(y));
                assert!((quick - safe).abs() < 1e-13, "{quick}, {safe}");
            }
        }
    }

    #[test]
    fn level_pieces_are_kept_level_and_lead_to_their_last_point() {
        let x = vec![0.0, 1.0, 2.0, 3.0, 4.0, 5.0];
        let y = vec![2.0, 2.0, 2.0, 1.5, 0.5, 0.5];
        assert_eq!(MonotoneCubic::new(x.clone(), y.clone()), Err(CurveError::NotMonotone { index: 1 }));
        let curve = MonotoneCubic::with_level_pieces(x.clone(), y).expect("falls or stays");
        assert!(!curve.is_rising() && !curve.is_level());
        assert_eq!(curve.value_and_slope(1.3), (2.0, 0.0));
        assert_eq!(curve.value_and_slope(-1.0), (2.0, 0.0));
        assert_eq!(curve.inverse(2.0), 2.0);
        for i in 1..200 {
            let inside = 2.0 + f64::from(i) * 0.01;
            assert!((curve.inverse(curve.value(inside)) - inside).abs() < 1e-6);
        }
        assert!(!curve.inverse(2.1).is_finite() && !curve.inverse(0.4).is_finite());
        let level = MonotoneCubic::with_level_pieces(x, vec![1.0; 6]).expect("stays");
        assert!(level.is_level() && !level.inverse(1.0).is_finite() && !level.inverse(1.1).is_finite());
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
