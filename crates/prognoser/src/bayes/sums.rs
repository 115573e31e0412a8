//! Least-squares sums of timings linearised about a leak trajectory.
//!
//! A timing y taken when the leak is a0 + g phi is linearised about some leak
//! a: d = y - T(a) + T'(a) a = T'(a) (a0 + g phi) + noise. Everything that a
//! posterior of (a0, g) and of the noise needs are the sums below.

use super::special::{quick_exp, quick_ln};

/// Sums over all timings so far, each counted with its probability of being a
/// proper reading.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Sums {
    /// Effective number of timings.
    pub n: f64,
    /// Sum of T'^2.
    pub s0: f64,
    /// Sum of T'^2 phi.
    pub s1: f64,
    /// Sum of T'^2 phi^2.
    pub s2: f64,
    /// Sum of T' d.
    pub b0: f64,
    /// Sum of T' d phi.
    pub b1: f64,
    /// Sum of d^2.
    pub c: f64,
    /// Logarithm of the probability of everything that is not in the
    /// Gaussian part: glitches, and strokes that did not finish.
    pub ln_extra: f64,
}

impl Sums {
    /// Adds one timing.
    #[inline]
    pub(crate) fn add(&mut self, phi: f64, lin: &Linearised, inlier: f64) {
        let d = lin.residual + lin.slope * lin.leak;
        let weight = inlier * lin.slope * lin.slope;
        let moment = inlier * lin.slope * d;
        self.n += inlier;
        self.s0 += weight;
        self.s1 += weight * phi;
        self.s2 += weight * phi * phi;
        self.b0 += moment;
        self.b1 += moment * phi;
        self.c += inlier * d * d;
    }
}

/// A timing linearised about a leak.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Linearised {
    /// The leak, as a fraction of the limit.
    pub leak: f64,
    /// Timing minus table at that leak, in s.
    pub residual: f64,
    /// Derivative of the time by the leak, in s.
    pub slope: f64,
}

/// How glitches are told from readings: a share of the timings is spread
/// evenly over the window of the stroke.
#[derive(Clone, Copy, Debug)]
pub(crate) struct GlitchModel {
    /// Prior share of glitches.
    pub share: f64,
}

impl GlitchModel {
    /// Probability that a timing is a proper reading, given its residual, the
    /// variance expected of it and the stroke's window; and the logarithm of
    /// what the two kinds are worth beyond the Gaussian itself.
    ///
    /// With densities d of a reading, g of a glitch and p = d/(d + g), the
    /// evidence bound p ln(d/p) + (1 - p) ln(g/(1 - p)) is ln(d + g).
    #[inline]
    pub(crate) fn inlier(self, residual: f64, variance: f64, window_s: f64) -> (f64, f64) {
        let glitch = self.share / window_s;
        // The logarithm of one minus the small share of glitches is minus that share.
        let ln_gauss = -0.5 * (residual * residual / variance + quick_ln(std::f64::consts::TAU * variance));
        let density = quick_exp(ln_gauss - self.share);
        let total = density + glitch;
        let p = density / total;
        (p, quick_ln(total) - p * ln_gauss)
    }
}
