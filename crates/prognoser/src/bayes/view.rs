//! Priors, and the likelihood of the growth under a prior of the start.
//!
//! Given the sums, the likelihood of start a0 and growth g is Gaussian with an
//! unknown common variance. With an inverse gamma prior of that variance it
//! integrates to a Student t in g for every prior of the start (a *view*: no
//! leak at all, a small one, any).

use super::special::{ln_gamma, quick_exp, quick_ln};
use super::sums::Sums;

/// ln(2 pi).
const LN_TAU: f64 = 1.837_877_066_409_345_3;

/// A prior of the leak at the first cycle.
#[derive(Clone, Copy, Debug)]
pub(crate) struct View {
    /// Logarithm of its prior probability.
    pub ln_weight: f64,
    /// Mean, as a fraction of the limit.
    pub mean: f64,
    /// Standard deviation; zero for a leak known exactly.
    pub sd: f64,
}

/// Log-normal prior of the growth in fractions of the limit per cycle.
#[derive(Clone, Copy, Debug)]
pub(crate) struct GrowthPrior {
    pub ln_median: f64,
    pub ln_sd: f64,
    inverse_sd: f64,
    ln_scale: f64,
}

impl GrowthPrior {
    pub(crate) fn new(ln_median: f64, ln_sd: f64) -> Self {
        Self { ln_median, ln_sd, inverse_sd: 1.0 / ln_sd, ln_scale: -ln_sd.ln() - 0.5 * LN_TAU }
    }

    /// Logarithm of the density of ln g at u = ln g.
    pub(super) fn ln_density(&self, u: f64) -> f64 {
        let z = (u - self.ln_median) * self.inverse_sd;
        self.ln_scale - 0.5 * z * z
    }
}

/// Inverse gamma prior of the variance of the noise.
#[derive(Clone, Copy, Debug)]
pub(crate) struct NoisePrior {
    /// Shape.
    pub a: f64,
    /// Scale in s2.
    pub b: f64,
    /// Logarithm of its norm, b^a / gamma(a).
    ln_norm: f64,
}

impl NoisePrior {
    pub(crate) fn new(a: f64, b: f64) -> Self {
        Self { a, b, ln_norm: a * quick_ln(b) - ln_gamma(a) }
    }
}

/// The growth's likelihood under one view:
/// `exp(ln_peak) (1 + kappa (g - centre)^2 / (2 b))^-a`.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct ViewFit {
    pub(super) ln_peak: f64,
    /// Logarithm of the integral of the likelihood over all g.
    pub(super) ln_area: f64,
    pub(super) centre: f64,
    pub(super) kappa: f64,
    pub(super) a: f64,
    pub(super) b: f64,
    /// Mean of the start given g is `start_0 - start_g g`.
    pub(super) start_0: f64,
    pub(super) start_g: f64,
    /// Variance of the start given g, in units of the noise variance.
    pub(super) start_var: f64,
}

/// What all views have in common.
pub(super) struct Common {
    /// Shape of the noise variance's posterior.
    a: f64,
    /// Part of the evidence that does not depend on the view.
    ln_rest: f64,
    /// ln gamma(a - 1/2) - ln gamma(a).
    ln_gamma_step: f64,
}

impl Common {
    pub(super) fn new(sums: &Sums, noise: &NoisePrior) -> Self {
        let a = noise.a + 0.5 * sums.n;
        let ln_gamma_a = ln_gamma(a);
        Self {
            a,
            ln_rest: sums.ln_extra + ln_gamma_a + noise.ln_norm - 0.5 * sums.n * LN_TAU,
            ln_gamma_step: ln_gamma(a - 0.5) - ln_gamma_a,
        }
    }
}

impl ViewFit {
    pub(super) fn new(sums: &Sums, view: &View, noise: &NoisePrior, sigma2: f64, common: &Common) -> Self {
        let a = common.a;
        let (s0, b0, c, occam) = if view.sd > 0.0 {
            let lambda = sigma2 / (view.sd * view.sd);
            let s0 = sums.s0 + lambda;
            let b0 = sums.b0 + lambda * view.mean;
            (s0, b0, sums.c + lambda * view.mean * view.mean, 0.5 * quick_ln(lambda / s0))
        } else {
            (f64::INFINITY, 0.0, sums.c, 0.0)
        };
        let start_0 = b0 / s0;
        let start_g = sums.s1 / s0;
        let kappa = (sums.s2 - sums.s1 * start_g).max(f64::MIN_POSITIVE);
        let centre = (sums.b1 - sums.s1 * start_0) / kappa;
        let rss = (c - b0 * start_0 - kappa * centre * centre).max(0.0);
        let b = noise.b + 0.5 * rss;
        let ln_peak = view.ln_weight + occam + common.ln_rest - a * quick_ln(b);
        let ln_area = ln_peak + 0.5 * quick_ln(std::f64::consts::TAU * b / kappa) + common.ln_gamma_step;
        Self { ln_peak, ln_area, centre, kappa, a, b, start_0, start_g, start_var: 1.0 / s0 }
    }

    pub(super) fn ln_at(&self, g: f64) -> f64 {
        let miss = g - self.centre;
        self.ln_peak - self.a * quick_ln(1.0 + self.kappa * miss * miss / (2.0 * self.b))
    }

    pub(super) fn dof(&self) -> f64 {
        2.0 * self.a - 1.0
    }

    /// Scale of the Student t in g.
    pub(super) fn scale(&self) -> f64 {
        (2.0 * self.b / (self.kappa * self.dof())).sqrt()
    }

    pub(super) fn sigma2(&self, g: f64) -> f64 {
        let miss = g - self.centre;
        (self.b + 0.5 * self.kappa * miss * miss) / self.a
    }
}

/// Logarithm of a sum of exponentials.
pub(crate) fn ln_sum(terms: impl Iterator<Item = f64> + Clone) -> f64 {
    let top = terms.clone().fold(f64::NEG_INFINITY, f64::max);
    if top == f64::NEG_INFINITY {
        return top;
    }
    top + quick_ln(terms.map(|t| quick_exp(t - top)).sum::<f64>())
}
