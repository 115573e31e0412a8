//! From sums to the posterior of growth and end of life.
//!
//! Given the sums, the likelihood of start a0 and growth g is Gaussian with an
//! unknown common variance. With an inverse gamma prior of that variance it
//! integrates to a Student t in g for every prior of the start (a *view*: no
//! leak at all, a small one, any). The prior of g is log-normal, and what
//! remains is one integral over g: closed where the data pin g down, a sum
//! over a fixed number of nodes where they do not.

use super::special::{ln_gamma, quick_exp, quick_ln, t_quantile_95};
use super::sums::Sums;

/// Nodes of the integral over the growth while it is wide.
const NODES: usize = 24;
/// Relative width of the growth's likelihood below which the closed form is
/// used. There the log-normal prior is close to exponential over the width.
const NARROW: f64 = 0.08;
/// Half of the integration range in standard deviations of the likelihood.
const REACH: f64 = 9.0;
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
        Self {
            ln_median,
            ln_sd,
            inverse_sd: 1.0 / ln_sd,
            ln_scale: -ln_sd.ln() - 0.5 * LN_TAU,
        }
    }

    /// Logarithm of the density of ln g at u = ln g.
    fn ln_density(&self, u: f64) -> f64 {
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
}

/// The growth's likelihood under one view:
/// `exp(ln_peak) (1 + kappa (g - centre)^2 / (2 b))^-a`.
#[derive(Clone, Copy, Debug, Default)]
struct ViewFit {
    ln_peak: f64,
    /// Logarithm of the integral of the likelihood over all g.
    ln_area: f64,
    centre: f64,
    kappa: f64,
    a: f64,
    b: f64,
    /// Mean of the start given g is `start_0 - start_g g`.
    start_0: f64,
    start_g: f64,
    /// Variance of the start given g, in units of the noise variance.
    start_var: f64,
}

/// What all views have in common.
struct Common {
    /// Shape of the noise variance's posterior.
    a: f64,
    /// Part of the evidence that does not depend on the view.
    ln_rest: f64,
    /// ln gamma(a - 1/2) - ln gamma(a).
    ln_gamma_step: f64,
}

impl Common {
    fn new(sums: &Sums, noise: &NoisePrior) -> Self {
        let a = noise.a + 0.5 * sums.n;
        let ln_gamma_a = ln_gamma(a);
        Self {
            a,
            ln_rest: sums.ln_extra + ln_gamma_a - ln_gamma(noise.a) + noise.a * quick_ln(noise.b)
                - 0.5 * sums.n * LN_TAU,
            ln_gamma_step: ln_gamma(a - 0.5) - ln_gamma_a,
        }
    }
}

impl ViewFit {
    fn new(sums: &Sums, view: &View, noise: &NoisePrior, sigma2: f64, common: &Common) -> Self {
        let a = common.a;
        let (s0, b0, c, occam) = if view.sd > 0.0 {
            let lambda = sigma2 / (view.sd * view.sd);
            let s0 = sums.s0 + lambda;
            let b0 = sums.b0 + lambda * view.mean;
            (
                s0,
                b0,
                sums.c + lambda * view.mean * view.mean,
                0.5 * quick_ln(lambda / s0),
            )
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
        let ln_area =
            ln_peak + 0.5 * quick_ln(std::f64::consts::TAU * b / kappa) + common.ln_gamma_step;
        Self {
            ln_peak,
            ln_area,
            centre,
            kappa,
            a,
            b,
            start_0,
            start_g,
            start_var: 1.0 / s0,
        }
    }

    fn ln_at(&self, g: f64) -> f64 {
        let miss = g - self.centre;
        self.ln_peak - self.a * quick_ln(1.0 + self.kappa * miss * miss / (2.0 * self.b))
    }

    fn dof(&self) -> f64 {
        2.0 * self.a - 1.0
    }

    /// Scale of the Student t in g.
    fn scale(&self) -> f64 {
        (2.0 * self.b / (self.kappa * self.dof())).sqrt()
    }

    fn sigma2(&self, g: f64) -> f64 {
        let miss = g - self.centre;
        (self.b + 0.5 * self.kappa * miss * miss) / self.a
    }
}

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
pub(crate) fn ln_evidence_without_growth(
    sums: &Sums,
    views: &[View],
    noise: &NoisePrior,
    sigma2: f64,
) -> f64 {
    let common = Common::new(sums, noise);
    ln_sum(
        views
            .iter()
            .map(|view| ViewFit::new(sums, view, noise, sigma2, &common).ln_at(0.0)),
    )
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
    let best = fits
        .iter()
        .max_by(|x, y| x.ln_area.total_cmp(&y.ln_area))
        .expect("there is at least one view of the start");
    // The prior integrates to one, so that the likelihood's largest value is
    // a bound of the evidence. A hypothesis that is out by far is not worth
    // more than its bound.
    let bound = fits
        .iter()
        .map(|fit| fit.ln_at(fit.centre.max(0.0)))
        .fold(f64::MIN, f64::max);
    if bound + (fits.len() as f64).ln() < floor {
        let mut out = Posterior {
            ln_evidence: bound,
            ..Posterior::default()
        };
        out.set_point(best, best.centre.clamp(0.0, 1.0));
        let rate = out.growth.max(1e-9) / (1.0 - out.start).max(1e-9);
        out.life_phi = 1.0 / rate;
        out.eol_phi = Quantiles {
            p05: 1.0 / rate,
            p50: 1.0 / rate,
            p95: 1.0 / rate,
        };
        return out;
    }
    if narrow(best) {
        closed(fits, prior)
    } else {
        summed(fits, prior, phi)
    }
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
        let spread =
            (variance * along * along + fit.start_var * sigma2 * rate * rate) / (room * room);
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
    out.eol_phi = Quantiles {
        p05: 1.0 / (rate + half_width),
        p50: 1.0 / rate,
        p95: 1.0 / (rate - half_width).max(1e-12),
    };
    out.life_phi = 1.0 / rate;
    out.set_point(&fits[best], shapes[best].0);
    out
}

/// Some view wide in g: a sum over nodes evenly spaced in ln g.
fn summed(fits: &[ViewFit], prior: &GrowthPrior, phi: f64) -> Posterior {
    // End of life after less than one cycle is no prognosis.
    let highest = (prior.ln_median + 4.0 * prior.ln_sd).min(0.0);
    let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
    let mut finest = f64::INFINITY;
    for fit in fits {
        let scale = fit.scale();
        finest = finest.min(scale);
        let reach = REACH * scale;
        low = low.min(fit.centre - reach);
        high = high.max(fit.centre + reach);
    }
    // Where the data exclude all but the slowest growth, the range reaches as
    // far down as they can tell it from none.
    let lowest = (prior.ln_median - 4.0 * prior.ln_sd)
        .min(quick_ln((0.1 * finest).max(f64::MIN_POSITIVE)))
        .max(prior.ln_median - 12.0 * prior.ln_sd);
    let low = if low > 0.0 {
        low.ln().max(lowest)
    } else {
        lowest
    };
    let high = if high > 0.0 {
        high.ln().min(highest)
    } else {
        lowest
    };
    let high = high.max(low + 1e-3);
    let step = (high - low) / (NODES - 1) as f64;

    let nodes: [f64; NODES] = std::array::from_fn(|i| low + step * i as f64);
    let growths = nodes.map(quick_exp);
    let ln_prior = nodes.map(|u| prior.ln_density(u));
    // Plain loops over arrays of a fixed size, which compilers turn into
    // vector instructions.
    let mut ln_p = [[f64::NEG_INFINITY; NODES]; 3];
    let mut top = f64::NEG_INFINITY;
    for (row, fit) in ln_p.iter_mut().zip(fits) {
        for i in 0..NODES {
            row[i] = ln_prior[i] + fit.ln_at(growths[i]);
        }
        top = row.iter().fold(top, |top, value| top.max(*value));
    }
    let mut weights = [0.0; NODES];
    let mut rooms = [0.0; NODES];
    let mut by_view = [0.0; 3];
    for ((row, fit), share) in ln_p.iter().zip(fits).zip(&mut by_view) {
        let p = row.map(|value| quick_exp(value - top));
        for i in 0..NODES {
            weights[i] += p[i];
            rooms[i] += p[i] * (1.0 - fit.start_0 + fit.start_g * growths[i]);
        }
        *share = p.iter().sum();
    }
    let mut lives = [0.0; NODES];
    let mut urgency = [0.0; NODES];
    for i in 0..NODES {
        lives[i] = (rooms[i] / (weights[i] * growths[i]).max(f64::MIN_POSITIVE)).max(1e-9);
        urgency[i] = weights[i] / (lives[i] - phi).max(0.25 * lives[i]);
    }
    let total: f64 = weights.iter().sum();
    let rate: f64 = urgency.iter().sum();
    let mean: f64 = weights
        .iter()
        .zip(&growths)
        .map(|(weight, growth)| weight * growth)
        .sum();
    let best = (0..fits.len())
        .max_by(|&x, &y| by_view[x].total_cmp(&by_view[y]))
        .unwrap_or(0);
    let mut out = Posterior {
        ln_evidence: top + quick_ln(total * step),
        ..Posterior::default()
    };
    // A long life is a small growth: the quantiles run against each other.
    let life_at = |share: f64, weights: &[f64; NODES], total: f64| {
        let mut below = 0.0;
        for i in (0..NODES).rev() {
            let next = below + weights[i];
            if next >= share * total {
                // The cumulative weight at the middle of a node.
                let into = if weights[i] > 0.0 {
                    (share * total - below) / weights[i]
                } else {
                    0.5
                };
                let j = if into < 0.5 {
                    (i + 1).min(NODES - 1)
                } else {
                    i.saturating_sub(1)
                };
                let t = (into - 0.5).abs();
                return lives[i] * (lives[j] / lives[i]).powf(t);
            }
            below = next;
        }
        lives[0]
    };
    let quantile = |share| life_at(share, &weights, total);
    out.eol_phi = Quantiles {
        p05: quantile(0.05),
        p50: quantile(0.5),
        p95: quantile(0.95),
    };
    out.life_phi = life_at(0.5, &urgency, rate);
    out.set_point(&fits[best], mean / total);
    out
}

impl Posterior {
    fn set_point(&mut self, fit: &ViewFit, growth: f64) {
        self.growth = growth;
        self.start = fit.start_0 - fit.start_g * growth;
        self.sigma2 = fit.sigma2(growth);
        let g_var = 1.0 / fit.kappa;
        self.cov = [
            fit.start_var + fit.start_g * fit.start_g * g_var,
            -fit.start_g * g_var,
            g_var,
        ];
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
