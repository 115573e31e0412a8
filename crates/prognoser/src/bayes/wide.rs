//! The posterior while the data do not pin the growth down: a sum over nodes.

use super::posterior::{Posterior, Quantiles};
use super::special::{quick_exp, quick_ln};
use super::view::{GrowthPrior, ViewFit};

/// Nodes of the integral over the growth.
const NODES: usize = 24;
/// Half of the integration range in standard deviations of the likelihood.
const REACH: f64 = 9.0;

/// Some view wide in g: a sum over nodes evenly spaced in ln g.
pub(super) fn summed(fits: &[ViewFit], prior: &GrowthPrior, phi: f64) -> Posterior {
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
    let low = if low > 0.0 { low.ln().max(lowest) } else { lowest };
    let high = if high > 0.0 { high.ln().min(highest) } else { lowest };
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
    let mean: f64 = weights.iter().zip(&growths).map(|(weight, growth)| weight * growth).sum();
    let best = (0..fits.len()).max_by(|&x, &y| by_view[x].total_cmp(&by_view[y])).unwrap_or(0);
    let mut out = Posterior { ln_evidence: top + quick_ln(total * step), ..Posterior::default() };
    // A long life is a small growth: the quantiles run against each other.
    let life_at = |share: f64, weights: &[f64; NODES], total: f64| {
        let mut below = 0.0;
        for i in (0..NODES).rev() {
            let next = below + weights[i];
            if next >= share * total {
                // The cumulative weight at the middle of a node.
                let into = if weights[i] > 0.0 { (share * total - below) / weights[i] } else { 0.5 };
                let j = if into < 0.5 { (i + 1).min(NODES - 1) } else { i.saturating_sub(1) };
                let t = (into - 0.5).abs();
                return lives[i] * quick_exp(t * quick_ln(lives[j] / lives[i]));
            }
            below = next;
        }
        lives[0]
    };
    let quantile = |share| life_at(share, &weights, total);
    out.eol_phi = Quantiles { p05: quantile(0.05), p50: quantile(0.5), p95: quantile(0.95) };
    out.life_phi = life_at(0.5, &urgency, rate);
    out.set_point(&fits[best], mean / total);
    out
}
