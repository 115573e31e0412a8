//! Noise that goes on from one cycle to the next.
//!
//! Each hypothesis asks whether what it leaves unexplained is correlated: over a few
//! correlations with a prior, by the probability of a residual given the one
//! before. Where noise goes on, n readings tell of a level or a slow trend as
//! much as n (1 - r)/(1 + r) independent ones, and so a reading counts as that
//! much noisier.

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

    /// Density of an innovation, given what was left of the last cycle, and the
    /// correlations it speaks for; beside it the Gaussian density of a time that strays.
    /// `model_spread` is the spread of the innovation beside its noise, whose unit `scale` is
    /// (2 b of the inverse gamma), `shape` its shape, `far` the variance of a stray, in s2.
    #[inline(always)]
    pub(crate) fn densities(
        &mut self,
        stroke: usize,
        innovation: f64,
        model_spread: f64,
        scale: f64,
        shape: f64,
        far: f64,
    ) -> (f64, f64) {
        let left = self.left_s[stroke];
        let fresh = left.is_nan();
        let left = if fresh { 0.0 } else { left };
        let square_of_norm = shape / (PI * scale) * (1.0 - 0.125 / shape).powi(2);
        // The correlations and the stray side by side, for the processor's wide registers.
        let (mut spread, mut ratio) = ([0.0; 4], [0.0; 4]);
        for (i, r) in CORRELATIONS.into_iter().enumerate() {
            let off = innovation - r * left;
            spread[i] = model_spread + 1.0 - if fresh { 0.0 } else { r * r };
            ratio[i] = off * off / (spread[i] * scale);
        }
        spread[3] = square_of_norm * far * TAU;
        // Loops and not maps: those of arrays are not made wide.
        let mut exponent = [0.0; 4];
        for i in 0..4 {
            exponent[i] = -(shape + 0.5) * quick_ln(1.0 + ratio[i]);
        }
        exponent[3] = -0.5 * innovation * innovation / far;
        let mut value = [0.0; 4];
        for i in 0..4 {
            value[i] = quick_exp(exponent[i]) * (square_of_norm / spread[i]).sqrt();
        }
        if fresh {
            return (value[0], value[3]);
        }
        let mut after = [0.0; 3];
        for i in 0..3 {
            after[i] = self.weight[i] * value[i];
        }
        let density: f64 = after.iter().sum();
        if density > 0.0 {
            let by_total = 1.0 / (density * (1.0 + 2.0 * LEAST));
            for (weight, after) in self.weight.iter_mut().zip(after) {
                *weight = (after + LEAST * density) * by_total;
            }
            self.weight[0] -= self.weight.iter().sum::<f64>() - 1.0;
        }
        (density, value[3])
    }
}
