//! The estimate of one valve: hypotheses, memory, and what to do when the
//! assumption fails.

use leak_table::{Fault, TableBundle};
use serde::Serialize;

use super::change::{Change, LN_RARE, Suspicion, Watch};
use super::config::{BayesConfig, GrowthLaw, Noise, StartPrior};
use super::history::{History, RECENT};
use super::hypotheses::{Hypotheses, LastView, Shape, StartViews};
use super::model::FaultModel;
use super::posterior::{GrowthPrior, NoisePrior, Posterior, Quantiles, View};
use super::sums::GlitchModel;
use super::track::Priors;
use crate::reading::Reading;

/// Rates of exponential growth tried, per cycle.
const RATES: [f64; 8] = [0.01, 0.02, 0.04, 0.06, 0.09, 0.14, 0.2, 0.3];
/// Largest product of rate and cycles.
const MOST_FOLDS: f64 = 50.0;
/// Multiples of the best of them that are tried as well.
const CLOSER: [f64; 4] = [0.8, 0.9, 1.1, 1.25];
/// Cycles after which an exponential rate is looked for again.
const RATE_EVERY: u64 = 4;
/// Logarithm of the odds at which exponential growth replaces linear growth.
const LN_EXPONENTIAL: f64 = 9.0;
/// Readings before the law of growth is questioned.
const LAW_FROM: u64 = 10;
/// Numbers of readings at which all of them are fitted together, from scratch;
/// between and after them the estimate is recursive.
const REFIT_AT: [u64; 6] = [1, 2, 3, 4, 6, RECENT as u64];
/// Those at which they are fitted without a guess and with every start.
const THOROUGH_AT: [u64; 2] = [1, 4];
/// Among the first readings: probability of being a proper reading below which
/// all of them are fitted together again.
const DOUBTFUL: f64 = 0.9;
/// Probability of no fault from which on the median stands for the end of life.
const GROWTH_IN_DOUBT: f64 = 0.75;
/// Numbers of last readings to which a change is fitted.
const CHANGE_WINDOWS: [usize; 2] = [3, RECENT];

/// Probability of each hypothesis.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct FaultProbability {
    /// The leak does not grow.
    pub none: f64,
    /// A growing leak to atmosphere.
    pub atmosphere: f64,
    /// A growing leak from the supply.
    pub supply: f64,
}

impl FaultProbability {
    /// The probability of one fault.
    pub fn of(&self, fault: Fault) -> f64 {
        match fault {
            Fault::Atmosphere => self.atmosphere,
            Fault::Supply => self.supply,
        }
    }
}

/// The estimate after a cycle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BayesEstimate {
    /// Probability of each hypothesis.
    pub probability: FaultProbability,
    /// The more probable of the two faults; leak, rate and end of life hold
    /// given it.
    pub leading: Fault,
    /// Leak area now, in m2.
    pub leak_area_m2: f64,
    /// Growth of the leak area now, in m2 per cycle.
    pub leak_rate_m2: f64,
    /// Best single estimate of the cycle at end of life: the one with the
    /// smallest expected relative error of the remaining life, or the median
    /// as long as it is likely that there is no fault.
    pub eol_cycle: f64,
    /// The distribution of the cycle at end of life.
    pub eol: Quantiles,
    /// Estimated standard deviation of the timings' noise, in s.
    pub noise_sd_s: f64,
    /// Probability that the closing and the opening time of this cycle were
    /// proper readings.
    pub inlier: [f64; 2],
    /// Residuals of this cycle's times against what was expected of them, in
    /// expected standard deviations.
    pub surprise: [Option<f64>; 2],
    /// The same residuals in s.
    pub residual_s: [Option<f64>; 2],
    /// What has changed at this cycle.
    pub change: Option<Change>,
    /// Whether the leak is taken to grow exponentially.
    pub exponential: bool,
}

/// The recursive estimate of one valve. Its size does not grow.
#[derive(Clone, Debug)]
pub struct BayesEstimator {
    priors: Priors,
    starts: StartViews,
    restart: StartViews,
    growth: GrowthLaw,
    history: History,
    watch: Watch,
    all: Option<Hypotheses>,
}

impl BayesEstimator {
    /// An estimator that has seen nothing.
    pub fn new(config: &BayesConfig) -> Self {
        let a = match config.noise {
            Noise::Known { .. } => 1e6,
            Noise::Estimated { prior_readings, .. } => 0.5 * prior_readings,
        };
        let (Noise::Known { sd_s }
        | Noise::Estimated {
            prior_sd_s: sd_s, ..
        }) = config.noise;
        let noise = NoisePrior {
            a,
            b: a * sd_s * sd_s,
        };
        let growth = GrowthPrior::new(-config.life_median_cycles.ln(), config.life_ln_sd);
        let healthy = |weight: f64| {
            let view = |share: f64, sd| View {
                ln_weight: (weight * share).ln(),
                mean: 0.0,
                sd,
            };
            vec![
                view(config.no_start_leak, 0.0),
                view(1.0 - config.no_start_leak, config.start_sd),
            ]
        };
        let any = |weight: f64| {
            vec![View {
                ln_weight: weight.ln(),
                mean: 0.4,
                sd: 0.4,
            }]
        };
        let none = healthy(1.0);
        let starts = match config.start {
            StartPrior::Healthy => StartViews {
                healthy: healthy(1.0 - config.wrong_start),
                unknown: any(config.wrong_start),
                none: none.clone(),
            },
            StartPrior::Unknown => StartViews {
                healthy: Vec::new(),
                unknown: any(1.0),
                none: none.clone(),
            },
        };
        Self {
            priors: Priors {
                noise,
                growth,
                glitch: GlitchModel {
                    share: config.outlier_share,
                },
                ln_none: config.no_fault.ln(),
                ln_fault: (0.5 * (1.0 - config.no_fault)).ln(),
            },
            starts,
            restart: StartViews {
                healthy: healthy(0.5),
                unknown: any(0.5),
                none,
            },
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
        let readings: Vec<Reading> = self
            .history
            .recent()
            .iter()
            .map(|entry| entry.reading)
            .collect();
        let all = match &self.all {
            Some(all) if !thorough => all.fit_on(models, &readings, &self.starts, &self.priors),
            _ => Hypotheses::fit(models, &readings, origin, shape, &self.starts, &self.priors),
        };
        self.all = Some(all);
    }

    /// Looks for a story that explains the last readings better than the one
    /// followed so far, and follows it if there is one.
    fn explain(&mut self, models: &[FaultModel; 2], suspicion: Suspicion) -> Option<Change> {
        if suspicion.law
            && self.growth == GrowthLaw::Auto
            && self.history.seen() >= LAW_FROM
            && self.try_exponential(models)
        {
            return Some(Change::Exponential);
        }
        if !suspicion.change {
            return None;
        }
        let all = self.all.as_ref()?;
        let (mut best, mut best_gain) = (None, LN_RARE);
        for window in CHANGE_WINDOWS {
            let entries = self.history.recent();
            let entries = &entries[entries.len().saturating_sub(window)..];
            let present: f64 = entries.iter().map(|entry| entry.ln_predicted).sum();
            let readings: Vec<Reading> = entries.iter().map(|entry| entry.reading).collect();
            let from = readings[0].cycle;
            let known = |views: &[View]| StartViews {
                healthy: views.to_vec(),
                unknown: Vec::new(),
                none: self.restart.none.clone(),
            };
            let any = StartViews {
                healthy: Vec::new(),
                ..self.restart.clone()
            };
            for (kind, origin, starts) in [
                (Change::Reread, all.origin, &self.starts),
                (Change::Repaired, from, &known(&self.restart.healthy)),
                (Change::Broken, from, &any),
            ] {
                // A few readings alone cannot speak against all before them.
                if kind == Change::Reread && window < RECENT {
                    continue;
                }
                let shape = if kind == Change::Reread {
                    all.shape
                } else {
                    Shape::Linear
                };
                let fit = Hypotheses::fit(models, &readings, origin, shape, starts, &self.priors);
                let gain = fit.ln_total() - present;
                if gain > best_gain {
                    best_gain = gain;
                    best = Some((kind, readings.len(), fit));
                }
            }
        }
        let (kind, keep, fit) = best?;
        self.all = Some(fit);
        self.history.restart(keep);
        if kind != Change::Reread {
            self.starts = self.restart.clone();
        }
        Some(kind)
    }

    /// Compares linear with exponential growth on the sample of the past.
    fn try_exponential(&mut self, models: &[FaultModel; 2]) -> bool {
        let Some(all) = &self.all else { return false };
        let (origin, noise) = (all.origin, all.tracks[all.leading() as usize].state.sigma2);
        let sample = self.history.sample();
        let fit =
            |shape| Hypotheses::fit(models, &sample, origin, shape, &self.starts, &self.priors);
        let linear = fit(Shape::Linear).ln_total();
        let best = self.best_exponential(models);
        // A step fits no exponential: the noise would have to be larger.
        let quiet = best.tracks[best.leading() as usize].state.sigma2 < 2.0 * noise;
        if quiet && best.ln_total() > linear + LN_EXPONENTIAL && best.shape != all.shape {
            self.all = Some(best);
            return true;
        }
        false
    }

    /// The most probable rate: the best of a coarse list, then of its closer
    /// neighbours.
    fn best_exponential(&self, models: &[FaultModel; 2]) -> Hypotheses {
        let sample = self.history.sample();
        let origin = self.all.as_ref().map_or(0, |all| all.origin);
        let fit = |rate: f64| {
            let shape = Shape::Exponential { rate };
            let all = Hypotheses::fit(models, &sample, origin, shape, &self.starts, &self.priors);
            (rate, all)
        };
        let better = |a: (f64, Hypotheses), b: (f64, Hypotheses)| {
            if b.1.ln_total() > a.1.ln_total() {
                b
            } else {
                a
            }
        };
        // Beyond so many e-foldings the start would have been too small to be
        // one.
        let span = sample
            .last()
            .map_or(0.0, |last| last.cycle.saturating_sub(origin) as f64);
        let slowest = RATES[0].min(MOST_FOLDS / span.max(1.0));
        let coarse = RATES
            .iter()
            .skip(1)
            .filter(|rate| **rate * span <= MOST_FOLDS)
            .map(|rate| fit(*rate))
            .fold(fit(slowest), better);
        let rate = coarse.0;
        CLOSER
            .iter()
            .map(|factor| fit(rate * factor))
            .fold(coarse, better)
            .1
    }

    /// Once growth is exponential, or with such growth asked for, its rate is
    /// found again from the sample every few cycles.
    fn follow_exponential(&mut self, models: &[FaultModel; 2]) {
        let seen = self.history.seen();
        let asked = self.growth == GrowthLaw::Exponential && seen >= 3;
        let known = self
            .all
            .as_ref()
            .is_some_and(|all| all.shape != Shape::Linear);
        if (asked || known) && (seen <= RECENT as u64 || seen.is_multiple_of(RATE_EVERY)) {
            self.all = Some(self.best_exponential(models));
        }
    }

    fn estimate(
        &self,
        models: &[FaultModel; 2],
        reading: &Reading,
        change: Option<Change>,
    ) -> BayesEstimate {
        let all = self.all.as_ref().expect("an update makes the hypotheses");
        let total = all.ln_total();
        let [none, atmosphere, supply] = all.ln.map(|value| (value - total).exp());
        let leading = all.leading();
        let limit_m2 = models[leading as usize].limit_m2();
        let track = &all.tracks[leading as usize];
        let Posterior {
            start,
            growth,
            eol_phi,
            life_phi,
            ..
        } = track.state;
        let LastView {
            inlier,
            surprise,
            residual_s,
            sigma2,
        } = all.view_of_last();
        let cycles = reading.cycle.saturating_sub(all.origin) as f64;
        let at = |phi: f64| all.origin as f64 + all.shape.cycles(phi);
        BayesEstimate {
            probability: FaultProbability {
                none,
                atmosphere,
                supply,
            },
            leading,
            leak_area_m2: (start + growth * all.shape.phi(cycles)) * limit_m2,
            leak_rate_m2: growth * all.shape.rate_at(cycles) * limit_m2,
            eol_cycle: at(if cycles > 0.0 && none < GROWTH_IN_DOUBT {
                life_phi
            } else {
                eol_phi.p50
            }),
            eol: Quantiles {
                p05: at(eol_phi.p05),
                p50: at(eol_phi.p50),
                p95: at(eol_phi.p95),
            },
            noise_sd_s: sigma2.sqrt(),
            inlier,
            surprise,
            residual_s,
            change,
            exponential: all.shape != Shape::Linear,
        }
    }
}
