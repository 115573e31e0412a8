//! Noise that goes on from one cycle to the next.
//!
//! Each hypothesis asks whether what it leaves unexplained is correlated: over a few
//! correlations with a prior, by the probability of a residual given the one
//! before. Where noise goes on, n readings tell of a level or a slow trend as
//! much as n (1 - r)/(1 + r) independent ones, and so a reading counts as that
//! much noisier.

#![expect(clippy::needless_range_loop, reason = "numbers side by side")]

use std::f64::consts::{PI, TAU};

use super::special::{quick_exp, quick_ln};

/// Correlations tried.
pub(crate) const CORRELATIONS: [f64; 3] = [0.0, 0.6, 0.85];
/// Probability of each beforehand.
pub(crate) const PRIOR: [f64; 3] = [0.9, 0.05, 0.05];
/// No correlation is ever given up altogether.
const LEAST: f64 = 1e-4;
/// Probability of no correlation from which on it is counted as none.
const SURELY_WHITE: f64 = 0.999;
/// Logarithms of (1 + r)/(1 - r).
const LN_INFLATION: [f64; 3] = [0.0, 1.386_294_361_119_890_6, 2.512_305_623_976_115_4];

/// What a hypothesis knows of its noise.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct NoiseState {
    /// Probability of each correlation.
    pub weight: [f64; 3],
    /// What was left unexplained of the last times, s; not a number where there was none.
    pub left_s: [f64; 2],
}

impl Default for NoiseState {
    fn default() -> Self {
        Self { weight: PRIOR, left_s: [f64::NAN; 2] }
    }
}

impl NoiseState {
    /// By how much the variance of a reading counts as larger.
    pub(crate) fn inflation(&self) -> f64 {
        if self.weight[0] > SURELY_WHITE {
            return 1.0;
        }
        quick_exp(self.weight.iter().zip(LN_INFLATION).map(|(weight, ln)| weight * ln).sum())
    }

    /// The same, expected: what a reading may yet turn out to count for.
    pub(crate) fn expected_inflation(&self) -> f64 {
        self.weight.iter().zip(CORRELATIONS).map(|(weight, r)| weight * (1.0 + r) / (1.0 - r)).sum()
    }

    /// Several states as one, by their shares.
    pub(crate) fn mix(&mut self, other: &Self, share: f64) {
        for i in 0..3 {
            self.weight[i] += share * other.weight[i];
        }
        for (mine, theirs) in self.left_s.iter_mut().zip(other.left_s) {
            *mine += share * theirs;
        }
    }
}

/// Innovations of some hypotheses side by side, for the processor's wide registers.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Innovations<const N: usize> {
    innovation_s: [f64; N],
    /// Spread of the innovation beside its noise.
    model_spread: [f64; N],
    /// Scale of the inverse gamma, s2.
    scale: [f64; N],
    left_s: [f64; N],
}

/// How likely innovations are.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Densities<const N: usize> {
    /// Density of each under each correlation.
    correlated: [[f64; N]; 3],
    /// Gaussian density of a time that strays.
    stray: [f64; N],
}

impl<const N: usize> Innovations<N> {
    /// Of none yet, whose places may stay as they are.
    #[inline(always)]
    pub(crate) fn new() -> Self {
        Self { innovation_s: [0.0; N], model_spread: [0.0; N], scale: [1.0; N], left_s: [0.0; N] }
    }

    /// Puts one in its place.
    #[inline(always)]
    pub(crate) fn set(&mut self, place: usize, innovation_s: f64, model_spread: f64, scale: f64, left_s: f64) {
        self.innovation_s[place] = innovation_s;
        self.model_spread[place] = model_spread;
        self.scale[place] = scale;
        self.left_s[place] = left_s;
    }

    /// Density of each, given what was left of the last cycle. `shape` is that of the inverse gamma, `stray_variance` the
    /// variance of a stray in that of the noise.
    #[inline(always)]
    pub(crate) fn densities(&self, shape: f64, stray_variance: f64) -> Densities<N> {
        let norm = (1.0 - 0.125 / shape).powi(2);
        let (mut fresh, mut left, mut square_of_norm) = ([false; N], [0.0; N], [0.0; N]);
        // Loops and not maps: those of arrays are not made wide.
        for k in 0..N {
            fresh[k] = self.left_s[k].is_nan();
            left[k] = if fresh[k] { 0.0 } else { self.left_s[k] };
            square_of_norm[k] = shape / (PI * (2.0 * self.scale[k])) * norm;
        }
        let mut out = Densities { correlated: [[0.0; N]; 3], stray: [0.0; N] };
        for (value, r) in out.correlated.iter_mut().zip(CORRELATIONS) {
            for k in 0..N {
                let off = self.innovation_s[k] - r * left[k];
                let spread = self.model_spread[k] + 1.0 - if fresh[k] { 0.0 } else { r * r };
                let ratio = off * off / (spread * (2.0 * self.scale[k]));
                let exponent = -(shape + 0.5) * quick_ln(1.0 + ratio);
                value[k] = quick_exp(exponent) * (square_of_norm[k] / spread).sqrt();
            }
        }
        for k in 0..N {
            let innovation = self.innovation_s[k];
            let far = (self.model_spread[k] + stray_variance) * self.scale[k] / shape;
            let spread = square_of_norm[k] * far * TAU;
            out.stray[k] = quick_exp(-0.5 * innovation * innovation / far) * (square_of_norm[k] / spread).sqrt();
        }
        out
    }
}

impl<const N: usize> Densities<N> {
    /// Density of the innovation in a place, and that of a time that strays. It speaks for correlations.
    #[inline(always)]
    pub(crate) fn tell(&self, place: usize, noise: &mut NoiseState, stroke: usize) -> (f64, f64) {
        let [white, medium, strong] = &self.correlated;
        let (value, stray) = ([white[place], medium[place], strong[place]], self.stray[place]);
        if noise.left_s[stroke].is_nan() {
            return (value[0], stray);
        }
        let mut after = [0.0; 3];
        for i in 0..3 {
            after[i] = noise.weight[i] * value[i];
        }
        let density: f64 = after.iter().sum();
        if density > 0.0 {
            let by_total = 1.0 / (density * (1.0 + 2.0 * LEAST));
            for (weight, after) in noise.weight.iter_mut().zip(after) {
                *weight = (after + LEAST * density) * by_total;
            }
            noise.weight[0] -= noise.weight.iter().sum::<f64>() - 1.0;
        }
        (density, stray)
    }
}
