//! The prior of the growth: log-normal, hence never negative, put in place of
//! the wide Gaussian that the hypotheses carry while data come in.

use super::config::BayesConfig;
use super::ending::SMALLEST_GROWTH;
use super::hypothesis::Mode;
use super::special::{normal_tail, quick_exp, quick_ln};
use super::wide::{Wide, widely};

/// The wide Gaussian, per cycle.
#[derive(Clone, Copy, Debug)]
pub(crate) struct WideGrowth {
    pub mean: f64,
    pub sd: f64,
}

impl WideGrowth {
    /// Of growth at any pace.
    pub(crate) const ANY: Self = Self { mean: 0.02, sd: 0.06 };
    /// Of growth at a slow pace. A cycle of growth as wide as any would bury it.
    const SLOW: Self = Self { mean: 0.002, sd: 0.005 };

    /// Of a mode.
    pub(crate) fn of(mode: Mode) -> Self {
        if mode == Mode::Slow { Self::SLOW } else { Self::ANY }
    }
}

/// Paces of late growth below this are rather slow, those above rather not:
/// the prior is shared out smoothly among the two.
pub(crate) const SLOW_BELOW: f64 = 0.006;
/// Relative width of the growth up to which two terms of a series do.
const NARROW: f64 = 0.12;
/// Nodes of the integral where it is wider.
pub(crate) const NODES: usize = 12;
/// Standard deviations that the nodes reach to either side.
const REACH: f64 = 3.2;
/// Beyond six of its standard deviations the wide Gaussian is not divided out.
const FARTHEST: f64 = 18.0;
/// Share of the largest growth below which the smallest is so near zero that nodes lie evenly in the logarithm.
const NEAR_ZERO: f64 = 0.05;
/// The first of those nodes, share of the largest growth.
const FIRST_NODE: f64 = 2e-3;
/// Logarithm of the square root of 2 pi.
const LN_SQRT_TAU: f64 = 0.918_938_533_204_672_7;

/// The prior.
#[derive(Clone, Copy, Debug)]
pub(crate) struct RatePrior {
    ln_median: f64,
    ln_sd: f64,
    /// Share of late growth that is slow.
    pub slow_share: f64,
}

/// A growth with its weight.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Node {
    pub growth: f64,
    pub weight: f64,
}

/// What the log-normal prior makes of a Gaussian growth.
#[derive(Clone, Copy)]
pub(crate) enum Corrected {
    /// Still nearly Gaussian, its mean shifted.
    Narrow { ln_factor: f64, mean: f64 },
    /// Nodes, whose weights sum to 1.
    Wide { ln_factor: f64, nodes: [Node; NODES] },
}

impl Corrected {
    /// Logarithm of the factor by which the evidence of a hypothesis changes.
    pub(crate) fn ln_factor(&self) -> f64 {
        match self {
            Self::Narrow { ln_factor, .. } | Self::Wide { ln_factor, .. } => *ln_factor,
        }
    }
}

impl RatePrior {
    /// For paces in so many cycles.
    pub(crate) fn new(config: &BayesConfig, unit: f64) -> Self {
        let life = if config.life_is_stated { config.life_median_cycles / unit } else { config.life_median_cycles };
        let (ln_median, ln_sd) = (-life.ln(), config.life_ln_sd);
        Self { ln_median, ln_sd, slow_share: normal_tail((ln_median - SLOW_BELOW.ln()) / ln_sd).clamp(0.01, 0.99) }
    }

    /// Logarithm of the prior over the wide Gaussian, and its derivative.
    #[inline]
    fn ln_ratio(&self, growth: f64, mode: Mode) -> (f64, f64) {
        let wide = WideGrowth::of(mode);
        let ln = quick_ln(growth);
        let z = (ln - self.ln_median) / self.ln_sd;
        let w = (growth - wide.mean) / wide.sd;
        let value = -0.5 * z * z - ln + (0.5 * w * w).min(FARTHEST) + quick_ln(wide.sd / self.ln_sd);
        let slope = -(z / self.ln_sd + 1.0) / growth + w / wide.sd;
        let slowness = 1.0 / (1.0 + (growth / SLOW_BELOW).powi(2));
        match mode {
            Mode::Slow => (value + quick_ln(slowness / self.slow_share), slope - 2.0 * (1.0 - slowness) / growth),
            Mode::Late => {
                let share = (1.0 - slowness) / (1.0 - self.slow_share);
                (value + quick_ln(share), slope + 2.0 * slowness / growth)
            }
            _ => (value, slope),
        }
    }

    /// The prior put in place for a Gaussian growth.
    pub(crate) fn correct(&self, mean: f64, sd: f64, mode: Mode) -> Corrected {
        if mean > SMALLEST_GROWTH && sd < NARROW * mean {
            let (value, slope) = self.ln_ratio(mean, mode);
            let shift = (sd * sd * slope).clamp(-sd, sd);
            return Corrected::Narrow { ln_factor: value + 0.5 * (sd * slope).powi(2).min(1.0), mean: mean + shift };
        }
        widely(Nodes { prior: self, mean, sd, mode })
    }
}

/// The prior put in place for a Gaussian growth that is wide.
struct Nodes<'a> {
    prior: &'a RatePrior,
    mean: f64,
    sd: f64,
    mode: Mode,
}

impl Wide for Nodes<'_> {
    type Out = Corrected;

    #[inline(always)]
    fn run(self) -> Corrected {
        let Self { prior, mean, sd, mode } = self;
        let low = (mean - REACH * sd).max(SMALLEST_GROWTH);
        let high = (mean + REACH * sd).max(low + 0.5 * sd);
        // Evenly in the growth where it is bounded away from zero, evenly in
        // its logarithm where it is not.
        let spread = low < NEAR_ZERO * high;
        let first = if spread { (high * FIRST_NODE).max(SMALLEST_GROWTH) } else { low };
        let step = if spread { quick_ln(high / first) } else { high - first } / NODES as f64;
        let wide = WideGrowth::of(mode);
        let (mut growth, mut ln_growth) = ([0.0; NODES], [0.0; NODES]);
        if spread {
            let (ratio, ln_first) = (quick_exp(step), quick_ln(first));
            let mut next = first * quick_exp(0.5 * step);
            for i in 0..NODES {
                growth[i] = next;
                ln_growth[i] = ln_first + (i as f64 + 0.5) * step;
                next *= ratio;
            }
        } else {
            for i in 0..NODES {
                growth[i] = first + (i as f64 + 0.5) * step;
                ln_growth[i] = quick_ln(growth[i]);
            }
        }
        let (by_prior, by_wide, by_sd) = (1.0 / prior.ln_sd, 1.0 / wide.sd, 1.0 / sd);
        let mut ln = [0.0; NODES];
        for i in 0..NODES {
            let off = (ln_growth[i] - prior.ln_median) * by_prior;
            let flat = (growth[i] - wide.mean) * by_wide;
            let own = (growth[i] - mean) * by_sd;
            // Of a width that grows with the growth the logarithm takes that of the log-normal density away.
            let width = if spread { 0.0 } else { -ln_growth[i] };
            ln[i] = width - 0.5 * (off * off + own * own) + (0.5 * flat * flat).min(FARTHEST);
        }
        let top = ln.into_iter().fold(f64::NEG_INFINITY, f64::max);
        let mut weight = [0.0; NODES];
        for i in 0..NODES {
            weight[i] = quick_exp(ln[i] - top);
        }
        if matches!(mode, Mode::Slow | Mode::Late) {
            for i in 0..NODES {
                let slowness = 1.0 / (1.0 + (growth[i] * (1.0 / SLOW_BELOW)).powi(2));
                weight[i] *= if mode == Mode::Slow {
                    slowness / prior.slow_share
                } else {
                    (1.0 - slowness) / (1.0 - prior.slow_share)
                };
            }
        }
        let total: f64 = weight.iter().sum();
        let by_total = 1.0 / total;
        let mut nodes = [Node::default(); NODES];
        for i in 0..NODES {
            nodes[i] = Node { growth: growth[i], weight: weight[i] * by_total };
        }
        // The widths of nodes and wide Gaussian, and the Gaussians' own factors.
        let widths = step * by_sd * wide.sd * by_prior;
        let top = top + quick_ln(widths) - LN_SQRT_TAU;
        Corrected::Wide { ln_factor: top + quick_ln(total), nodes }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn registers_of_any_width_give_the_same_bits() {
        let prior = RatePrior::new(&BayesConfig::default(), 1.0);
        for (mean, sd) in [(0.02, 0.06), (-0.01, 0.02), (0.03, 0.005), (0.001, 0.01), (0.5, 0.2)] {
            for mode in [Mode::Steady, Mode::Slow, Mode::Late] {
                let nodes = || Nodes { prior: &prior, mean, sd, mode };
                let bits = |told: Corrected| match told {
                    Corrected::Wide { ln_factor, nodes } => {
                        (ln_factor.to_bits(), nodes.map(|node| [node.growth, node.weight].map(f64::to_bits)))
                    }
                    Corrected::Narrow { .. } => panic!("{mean} by {sd} is wide"),
                };
                assert_eq!(bits(nodes().run()), bits(widely(nodes())), "{mean} by {sd}, {mode:?}");
            }
        }
    }
}
