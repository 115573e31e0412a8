//! From sums to the posterior of growth and end of life.
//!
//! The likelihood of the growth is a Student t for every view of the start; its
//! prior is log-normal. What remains is one integral over the growth: closed
//! where the data pin it down, a sum over a fixed number of nodes where they do
//! not.

use super::special::{quick_exp, quick_ln, t_quantile_95};
use super::sums::Sums;
use super::view::{Common, GrowthPrior, NoisePrior, View, ViewFit, ln_sum};
use super::wide::summed;

/// Relative width of the growth's likelihood below which the closed form is
/// used. There the log-normal prior is close to exponential over the width.
const NARROW: f64 = 0.08;

/// Three quantiles of a distribution.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Quantiles {
    /// 5 %.
    pub p05: f64,
    /// 50 %.
    pub p50: f64,
    /// 95 %.
    pub p95: f64,
}

/// Posterior under one fault hypothesis. Leaks in units of the limit.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Posterior {
    /// Logarithm of the probability of the data.
    pub ln_evidence: f64,
    /// Leak at phi = 0, its best estimate.
    pub start: f64,
    /// Growth, its best estimate.
    pub growth: f64,
    /// Covariance of start and growth in units of the noise variance.
    pub cov: [f64; 3],
    /// Estimated noise variance in s2.
    pub sigma2: f64,
    /// Value of phi at end of life.
    pub eol_phi: Quantiles,
    /// Best single estimate of phi at end of life: the one with the smallest
    /// expected relative error of the remaining life.
    pub life_phi: f64,
}

/// Logarithm of the probability of the data if the leak stays what it is at
/// the start.
///
/// The sums are of the same timings with the slopes of either fault, each of
/// which may be the kind of the leak with half of the probability.
pub(crate) fn ln_evidence_without_growth(sums: &[Sums; 2], views: &[View], noise: &NoisePrior, sigma2: f64) -> f64 {
    let common = Common::new(&sums[0], noise);
    let terms = sums.iter().flat_map(|sums| {
        let common = &common;
        views.iter().map(move |view| ViewFit::new(sums, view, noise, sigma2, common).ln_at(0.0))
    });
    ln_sum(terms) - std::f64::consts::LN_2
}

/// The posterior of a growing leak. If its evidence is certainly below `floor`
/// only a bound of it is given, and a point instead of a distribution.
pub(crate) fn posterior(
    sums: &Sums,
    views: &[View],
    noise: &NoisePrior,
    prior: &GrowthPrior,
    sigma2: f64,
    phi: f64,
    floor: f64,
) -> Posterior {
    let mut fits = [ViewFit::default(); 3];
    let count = views.len().min(fits.len());
    let common = Common::new(sums, noise);
    for (fit, view) in fits.iter_mut().zip(views) {
        *fit = ViewFit::new(sums, view, noise, sigma2, &common);
    }
    let fits = &fits[..count];
    let narrow = |fit: &ViewFit| fit.centre > 0.0 && fit.scale() < NARROW * fit.centre;
    // The view that the data like best decides how the integral is done.
    let best =
        fits.iter().max_by(|x, y| x.ln_area.total_cmp(&y.ln_area)).expect("there is at least one view of the start");
    // The prior integrates to one, so that the likelihood's largest value is
    // a bound of the evidence. A hypothesis that is out by far is not worth
    // more than its bound.
    let bound = fits.iter().map(|fit| fit.ln_at(fit.centre.max(0.0))).fold(f64::MIN, f64::max);
    if bound + (fits.len() as f64).ln() < floor {
        let mut out = Posterior { ln_evidence: bound, ..Posterior::default() };
        out.set_point(best, best.centre.clamp(0.0, 1.0));
        let rate = out.growth.max(1e-9) / (1.0 - out.start).max(1e-9);
        out.life_phi = 1.0 / rate;
        out.eol_phi = Quantiles { p05: 1.0 / rate, p50: 1.0 / rate, p95: 1.0 / rate };
        return out;
    }
    if narrow(best) { closed(fits, prior) } else { summed(fits, prior, phi) }
}

/// The peak of the likelihood of the view that the data like best, growth kept
/// inside its prior: enough to linearise about.
pub(crate) fn most_likely(
    sums: &Sums,
    views: &[View],
    noise: &NoisePrior,
    prior: &GrowthPrior,
    sigma2: f64,
) -> Posterior {
    let mut out = Posterior::default();
    let mut best = f64::NEG_INFINITY;
    let common = Common::new(sums, noise);
    for view in views {
        let fit = ViewFit::new(sums, view, noise, sigma2, &common);
        let ln_area = fit.ln_area;
        if ln_area > best || best == f64::NEG_INFINITY {
            best = ln_area;
            let highest = (prior.ln_median + 4.0 * prior.ln_sd).exp();
            out.set_point(&fit, fit.centre.clamp(0.0, highest));
        }
    }
    out
}

/// All views narrow in g: shift each by the slope of the prior and match the
/// moments of 1/life, in which the distributions are close to symmetric.
fn closed(fits: &[ViewFit], prior: &GrowthPrior) -> Posterior {
    let mut out = Posterior::default();
    let mut ln_weights = [f64::NEG_INFINITY; 3];
    let mut shapes = [(0.0, 0.0, 0.0); 3];
    for ((fit, ln_weight), shape) in fits.iter().zip(&mut ln_weights).zip(&mut shapes) {
        if fit.centre <= 0.0 {
            continue;
        }
        let u = quick_ln(fit.centre);
        let variance = fit.scale().powi(2);
        *ln_weight = fit.ln_area + prior.ln_density(u) - u;
        // d ln(prior density of g) / dg at the centre.
        let pull = (-(u - prior.ln_median) / (prior.ln_sd * prior.ln_sd) - 1.0) / fit.centre;
        let g = fit.centre + variance * pull;
        let start = fit.start_0 - fit.start_g * g;
        let room = 1.0 - start;
        let rate = g / room;
        // Variance of the leak at end of life, over room squared.
        let sigma2 = fit.sigma2(g);
        let along = 1.0 - fit.start_g * rate;
        let spread = (variance * along * along + fit.start_var * sigma2 * rate * rate) / (room * room);
        *shape = (g, rate, spread);
    }
    out.ln_evidence = ln_sum(ln_weights.iter().copied());
    let (mut rate, mut square, mut dof, mut best) = (0.0, 0.0, 0.0, 0);
    for i in 0..fits.len() {
        let p = quick_exp((ln_weights[i] - out.ln_evidence).min(0.0));
        rate += p * shapes[i].1;
        square += p * (shapes[i].1.powi(2) + shapes[i].2);
        dof += p * fits[i].dof();
        if ln_weights[i] > ln_weights[best] {
            best = i;
        }
    }
    let half_width = t_quantile_95(dof) * (square - rate * rate).max(0.0).sqrt();
    out.eol_phi =
        Quantiles { p05: 1.0 / (rate + half_width), p50: 1.0 / rate, p95: 1.0 / (rate - half_width).max(1e-12) };
    out.life_phi = 1.0 / rate;
    out.set_point(&fits[best], shapes[best].0);
    out
}

impl Posterior {
    pub(super) fn set_point(&mut self, fit: &ViewFit, growth: f64) {
        self.growth = growth;
        self.start = fit.start_0 - fit.start_g * growth;
        self.sigma2 = fit.sigma2(growth);
        let g_var = 1.0 / fit.kappa;
        self.cov = [fit.start_var + fit.start_g * fit.start_g * g_var, -fit.start_g * g_var, g_var];
    }
}
