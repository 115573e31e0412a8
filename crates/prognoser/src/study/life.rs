//! One life, from health to the limit, seen by one method.

use leak_table::{Fault, Stroke, TableBundle};

use super::bound::cycles_below;
use super::noise::NoiseSource;
use super::run::TruthTimes;
use crate::bayes::{BayesConfig, BayesEstimator};
use crate::fault_call::FaultCall;
use crate::ols::OlsEstimator;
use crate::output::named;
use crate::prognoser::Method;
use crate::reading::Reading;

/// Glitches added to the timings of a study.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Outliers {
    /// Share of the timings that get one.
    pub share: f64,
    /// What is added to them, in s.
    pub size_s: f64,
}

/// The truth of a life.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LifeTruth {
    /// The fault; none for a valve that stays healthy.
    pub fault: Option<Fault>,
    /// Leak area at cycle 0 as a fraction of the limit.
    pub start: f64,
    /// Cycle at which the leak reaches the limit (or, for a healthy valve, at
    /// which the study stops looking).
    pub end_cycle: f64,
    /// Variance of the timings' noise in s2.
    pub noise_variance_s2: f64,
    /// Glitches, if any.
    pub outliers: Option<Outliers>,
    /// Seed of the noise.
    pub seed: u64,
}

/// What a method said after a cycle.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Prediction {
    pub cycle: f64,
    /// Remaining cycles, not clipped.
    pub remaining: Option<f64>,
    /// Real-valued end of life.
    pub end: Option<f64>,
    /// Whether the 5 to 95 % interval holds the true end.
    pub covered: Option<bool>,
    /// Whether the right fault is isolated.
    pub isolated: bool,
    /// Whether a fault is named that is not there.
    pub false_call: bool,
}

/// Runs one life through one method.
pub(crate) fn run_life(
    tables: &TableBundle,
    times: &TruthTimes<'_>,
    truth: &LifeTruth,
    method: &Method,
) -> Vec<Prediction> {
    let stream = truth.fault.map_or(2, |fault| fault as u64) + 3 * truth.noise_variance_s2.to_bits();
    let mut noise = NoiseSource::new(truth.seed, stream);
    let sd = truth.noise_variance_s2.sqrt();
    let mut estimator = Estimator::new(method);
    cycles_below(truth.end_cycle)
        .map(|cycle| {
            let life = cycle as f64 / truth.end_cycle;
            let fault = truth.fault.unwrap_or(Fault::Atmosphere);
            let growing = if truth.fault.is_some() { (1.0 - truth.start) * life } else { 0.0 };
            let leak = (truth.start + growing) * tables.limit_area_m2(fault);
            let clean = times(fault, leak);
            let mut read = |stroke: Stroke| {
                let glitch = truth.outliers.filter(|o| noise.uniform() < o.share);
                let error = sd * noise.normal() + glitch.map_or(0.0, |o| o.size_s);
                clean[stroke as usize].map(|time| (time + error).max(0.0))
            };
            let reading = Reading {
                cycle,
                close_time_s: read(Stroke::Close),
                open_time_s: read(Stroke::Open),
                ..Reading::default()
            };
            estimator.predict(tables, &reading, truth)
        })
        .collect()
}

enum Estimator {
    Bayes(Box<BayesEstimator>, Box<BayesConfig>),
    Ols(OlsEstimator),
}

impl Estimator {
    fn new(method: &Method) -> Self {
        match method {
            Method::Bayes(config) => Self::Bayes(Box::new(BayesEstimator::new(config)), Box::new(*config)),
            Method::Ols => Self::Ols(OlsEstimator::new()),
        }
    }

    fn predict(&mut self, tables: &TableBundle, reading: &Reading, truth: &LifeTruth) -> Prediction {
        let cycle = reading.cycle as f64;
        match self {
            Self::Bayes(estimator, config) => {
                let estimate = estimator.update(tables, reading);
                let p = estimate.probability;
                let right = |fault: &FaultCall| fault.fault() == truth.fault && truth.fault.is_some();
                let (call, group) = named(&estimate, config);
                let end = estimate.end;
                Prediction {
                    cycle,
                    remaining: end.map(|end| end.cycle - cycle),
                    end: end.map(|end| end.cycle),
                    covered: end
                        .map(|end| end.quantiles.p05 <= truth.end_cycle && truth.end_cycle <= end.quantiles.p95),
                    isolated: truth.fault.is_some_and(|fault| p.of(fault.into()) > 0.95),
                    false_call: call.wears() && !right(&call) && !group.iter().any(right),
                }
            }
            Self::Ols(estimator) => {
                let estimate = estimator.update(tables, reading);
                Prediction {
                    cycle,
                    remaining: estimate.rul_cycles,
                    end: estimate.eol_cycle,
                    covered: None,
                    isolated: estimate.fault.is_some() && estimate.fault == truth.fault,
                    false_call: estimate.fault.is_some() && estimate.fault != truth.fault,
                }
            }
        }
    }
}
