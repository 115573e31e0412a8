//! The slope at a knot as a sum over the knots around it.

use std::array;

/// Number of points from which a slope is estimated.
pub(crate) const STENCIL: usize = 5;

/// Weights of a few neighbouring ordinates in the slope at one knot.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Stencil {
    /// The first knot used.
    pub first: usize,
    /// How many are used.
    pub count: usize,
    weights: [f64; STENCIL],
}

impl Stencil {
    /// For the derivative at each knot of the polynomial through the nearest ones.
    pub(crate) fn all(x: &[f64]) -> Vec<Self> {
        (0..x.len()).map(|knot| Self::at(x, knot)).collect()
    }

    fn at(x: &[f64], knot: usize) -> Self {
        let count = x.len().min(STENCIL);
        let first = knot.saturating_sub(count / 2).min(x.len() - count);
        let near = &x[first..first + count];
        let at = knot - first;
        let mut weights = [0.0; STENCIL];
        for j in (0..count).filter(|&j| j != at) {
            let others = (0..count).filter(|&m| m != j && m != at);
            weights[j] = others.fold(1.0 / (near[j] - near[at]), |w, m| w * (near[at] - near[m]) / (near[j] - near[m]));
            weights[at] -= weights[j];
        }
        Self { first, count, weights }
    }

    /// The slope, from the ordinates.
    #[inline]
    pub(crate) fn sum(&self, ordinate: impl Fn(usize) -> f64) -> f64 {
        let parts: [f64; STENCIL] =
            array::from_fn(|j| if j < self.count { self.weights[j] * ordinate(self.first + j) } else { 0.0 });
        parts.into_iter().sum()
    }
}
