//! The estimate of one valve: hypotheses, memory, and what to do when the
//! assumption fails.

use leak_table::{Fault, TableBundle};

use super::change::{Change, Watch};
use super::config::{BayesConfig, GrowthLaw, Noise, StartPrior};
use super::estimate::{BayesEstimate, FaultProbability};
use super::history::{History, RECENT};
use super::hypotheses::{Hypotheses, LastView, Shape, StartViews};
use super::model::FaultModel;
use super::posterior::{Posterior, Quantiles};
use super::sums::GlitchModel;
use super::track::Priors;
use super::view::{GrowthPrior, NoisePrior, View};
use crate::reading::Reading;

/// Smallest noise that can be stated, in s; a log is rounded more coarsely.
const SMALLEST_NOISE_S: f64 = 1e-6;
/// Numbers of readings at which all of them are fitted together, from scratch;
/// between and after them the estimate is recursive.
const REFIT_AT: [u64; 4] = [1, 2, 4, RECENT as u64];
/// Those at which they are fitted without a guess and with every start.
const THOROUGH_AT: [u64; 2] = [1, 4];
/// Among the first readings: probability of being a proper reading below which
/// all of them are fitted together again.
const DOUBTFUL: f64 = 0.9;
/// Probability of no fault from which on the median stands for the end of life.
const GROWTH_IN_DOUBT: f64 = 0.75;

/// The recursive estimate of one valve. Its size does not grow.
#[derive(Clone, Debug)]
pub struct BayesEstimator {
    pub(super) priors: Priors,
    pub(super) starts: StartViews,
    pub(super) restart: StartViews,
    pub(super) growth: GrowthLaw,
    pub(super) history: History,
    pub(super) watch: Watch,
    pub(super) all: Option<Hypotheses>,
}

impl BayesEstimator {
    /// An estimator that has seen nothing.
    pub fn new(config: &BayesConfig) -> Self {
        let a = match config.noise {
            Noise::Known { .. } => 1e6,
            Noise::Estimated { prior_readings, .. } => 0.5 * prior_readings,
        };
        let (Noise::Known { sd_s } | Noise::Estimated { prior_sd_s: sd_s, .. }) = config.noise;
        let noise = NoisePrior::new(a, a * sd_s.max(SMALLEST_NOISE_S).powi(2));
        let growth = GrowthPrior::new(-config.life_median_cycles.ln(), config.life_ln_sd);
        let healthy = |weight: f64| {
            let view = |share: f64, sd| View { ln_weight: (weight * share).ln(), mean: 0.0, sd };
            vec![view(config.no_start_leak, 0.0), view(1.0 - config.no_start_leak, config.start_sd)]
        };
        let any = |weight: f64| vec![View { ln_weight: weight.ln(), mean: 0.4, sd: 0.4 }];
        let none = healthy(1.0);
        let starts = match config.start {
            StartPrior::Healthy => StartViews {
                healthy: healthy(1.0 - config.wrong_start),
                unknown: any(config.wrong_start),
                none: none.clone(),
            },
            StartPrior::Unknown => StartViews { healthy: Vec::new(), unknown: any(1.0), none: none.clone() },
        };
        Self {
            priors: Priors {
                noise,
                growth,
                glitch: GlitchModel { share: config.outlier_share },
                ln_none: config.no_fault.ln(),
                ln_fault: (0.5 * (1.0 - config.no_fault)).ln(),
            },
            starts,
            restart: StartViews { healthy: healthy(0.5), unknown: any(0.5), none },
            growth: config.growth,
            history: History::default(),
            watch: Watch::default(),
            all: None,
        }
    }

    /// Takes in one cycle and gives the estimate after it. Cycles must rise;
    /// sorting out repeats is the caller's work.
    pub fn update(&mut self, tables: &TableBundle, reading: &Reading) -> BayesEstimate {
        let models = Fault::ALL.map(|fault| FaultModel::new(tables, fault));
        self.history.push(*reading);
        let mut change = None;
        match &mut self.all {
            Some(all) if !REFIT_AT.contains(&self.history.seen()) => {
                let before = all.ln_total();
                all.update(&models, reading, &self.starts, &self.priors);
                self.history.predicted(all.ln_total() - before);
                let first = self.history.seen() <= RECENT as u64;
                if first {
                    if all.view_of_last().inlier.iter().any(|p| *p < DOUBTFUL) {
                        self.fit_first(&models, reading.cycle, true);
                    }
                } else {
                    let suspicion = self.watch.look(all);
                    change = self.explain(&models, suspicion);
                    if change.is_some() {
                        self.watch.reset();
                    }
                }
            }
            _ => {
                let thorough = THOROUGH_AT.contains(&self.history.seen());
                self.fit_first(&models, reading.cycle, thorough);
            }
        }
        self.follow_exponential(&models);
        self.estimate(&models, reading, change)
    }

    /// Fits the first readings together; thoroughly means from scratch.
    fn fit_first(&mut self, models: &[FaultModel; 2], cycle: u64, thorough: bool) {
        let origin = self.all.as_ref().map_or(cycle, |all| all.origin);
        let shape = self.all.as_ref().map_or(Shape::Linear, |all| all.shape);
        let readings: Vec<Reading> = self.history.recent().iter().map(|entry| entry.reading).collect();
        let all = match &self.all {
            Some(all) if !thorough => all.fit_on(models, &readings, &self.starts, &self.priors),
            _ => Hypotheses::fit(models, &readings, origin, shape, &self.starts, &self.priors),
        };
        self.all = Some(all);
    }

    fn estimate(&self, models: &[FaultModel; 2], reading: &Reading, change: Option<Change>) -> BayesEstimate {
        let all = self.all.as_ref().expect("an update makes the hypotheses");
        let total = all.ln_total();
        let [none, atmosphere, supply] = all.ln.map(|value| (value - total).exp());
        let leading = all.leading();
        let limit_m2 = models[leading as usize].limit_m2();
        let track = &all.tracks[leading as usize];
        let Posterior { start, growth, eol_phi, life_phi, .. } = track.state;
        let LastView { inlier, surprise, residual_s, sigma2 } = all.view_of_last();
        let cycles = reading.cycle.saturating_sub(all.origin) as f64;
        let at = |phi: f64| all.origin as f64 + all.shape.cycles(phi);
        BayesEstimate {
            probability: FaultProbability { none, atmosphere, supply },
            leading,
            leak_area_m2: (start + growth * all.shape.phi(cycles)) * limit_m2,
            leak_rate_m2: growth * all.shape.rate_at(cycles) * limit_m2,
            eol_cycle: at(if cycles > 0.0 && none < GROWTH_IN_DOUBT { life_phi } else { eol_phi.p50 }),
            eol: Quantiles { p05: at(eol_phi.p05), p50: at(eol_phi.p50), p95: at(eol_phi.p95) },
            noise_sd_s: sigma2.sqrt(),
            inlier,
            surprise,
            residual_s,
            change,
            exponential: all.shape != Shape::Linear,
        }
    }
}
