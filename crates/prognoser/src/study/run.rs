//! Runs a study in parallel; the result does not depend on the threads.

use leak_table::{Fault, Stroke, TableBundle, TimeAt};
use rayon::prelude::*;

use super::bound::bounds;
use super::life::{LifeTruth, Outliers, Prediction, run_life};
use super::metrics::{Frame, StudyResult};
use crate::prognoser::Method;

/// Where the true times come from: fault and leak area in m2 to closing and
/// opening time in s, none where the stroke does not finish. A simulation, or
/// [`StudyConfig::run`]'s tables.
pub type TruthTimes<'a> = dyn Fn(Fault, f64) -> [Option<f64>; 2] + Sync + 'a;

/// What to study.
#[derive(Clone, Debug, PartialEq)]
pub struct StudyConfig {
    /// The faults.
    pub faults: Vec<Fault>,
    /// Cycles from a healthy valve to end of life.
    pub end_cycle: f64,
    /// Leak at cycle 0, as a fraction of the limit.
    pub start: f64,
    /// Variances of the timings' noise in s2.
    pub noise_variances_s2: Vec<f64>,
    /// Lives per fault and noise.
    pub seeds: u64,
    /// The first seed.
    pub first_seed: u64,
    /// The methods.
    pub methods: Vec<Method>,
    /// Half width of the cone, as a fraction.
    pub alpha: f64,
    /// First cycle whose prediction counts.
    pub first_prediction: u64,
    /// Glitches, if any.
    pub outliers: Option<Outliers>,
}

impl Default for StudyConfig {
    fn default() -> Self {
        Self {
            faults: Fault::ALL.to_vec(),
            end_cycle: 25.0,
            start: 0.0,
            noise_variances_s2: vec![0.0, 1e-4, 1e-3, 1e-2],
            seeds: 300,
            first_seed: 1,
            methods: vec![Method::default(), Method::Ols],
            alpha: 0.1,
            first_prediction: 2,
            outliers: None,
        }
    }
}

impl StudyConfig {
    /// Runs the study with the tables as the truth.
    pub fn run(&self, tables: &TableBundle) -> Vec<StudyResult> {
        let times = |fault: Fault, area_m2: f64| {
            Stroke::ALL.map(|stroke| match tables.table(fault).curve(stroke).time_at(area_m2) {
                TimeAt::Within(time_s) => Some(time_s),
                TimeAt::NotReached | TimeAt::BelowRange | TimeAt::AboveRange => None,
            })
        };
        run_study(tables, &times, self)
    }

    /// Share of healthy lives of `cycles` cycles in which a fault is ever
    /// named, for each noise variance.
    pub fn false_alarms(&self, tables: &TableBundle, method: &Method, cycles: u64) -> Vec<f64> {
        let healthy = |stroke: Stroke| {
            let curve = tables.table(Fault::Atmosphere).curve(stroke);
            Some(curve.extrapolated_time_and_slope(0.0).0)
        };
        let times = |_: Fault, _: f64| [healthy(Stroke::Close), healthy(Stroke::Open)];
        self.noise_variances_s2
            .iter()
            .map(|&noise_variance_s2| {
                let called = (0..self.seeds).into_par_iter().filter(|seed| {
                    let truth = LifeTruth {
                        fault: None,
                        start: 0.0,
                        end_cycle: cycles as f64,
                        noise_variance_s2,
                        outliers: self.outliers,
                        seed: self.first_seed + seed,
                    };
                    run_life(tables, &times, &truth, method).iter().any(|p| p.false_call)
                });
                called.count() as f64 / self.seeds as f64
            })
            .collect()
    }
}

/// Runs a study with given true times. Results come by fault, then noise, then
/// method, in the order of the configuration.
pub fn run_study(tables: &TableBundle, times: &TruthTimes<'_>, config: &StudyConfig) -> Vec<StudyResult> {
    let mut results = Vec::new();
    for &fault in &config.faults {
        for &noise_variance_s2 in &config.noise_variances_s2 {
            let bounds = bounds(tables, fault, config.end_cycle, noise_variance_s2);
            for method in &config.methods {
                let lives: Vec<Vec<Prediction>> = (0..config.seeds)
                    .into_par_iter()
                    .map(|seed| {
                        let truth = LifeTruth {
                            fault: Some(fault),
                            start: config.start,
                            end_cycle: config.end_cycle,
                            noise_variance_s2,
                            outliers: config.outliers,
                            seed: config.first_seed + seed,
                        };
                        run_life(tables, times, &truth, method)
                    })
                    .collect();
                let frame = Frame {
                    fault,
                    noise_variance_s2,
                    method: method.name(),
                    end_cycle: config.end_cycle,
                    alpha: config.alpha,
                    first_prediction: config.first_prediction,
                    bounds: &bounds,
                };
                results.push(StudyResult::of(&lives, &frame));
            }
        }
    }
    results
}

/// What the paper reports for one noise: the relative accuracy of one run.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PaperValue {
    /// Variance of the noise in s2.
    pub noise_variance_s2: f64,
    /// Relative accuracy for the leak from the supply, as a fraction.
    pub supply: f64,
    /// Relative accuracy for the leak to atmosphere, as a fraction.
    pub atmosphere: f64,
}

/// The paper's own numbers (Kulkarni et al. 2014, section 5).
pub const PAPER: [PaperValue; 4] = [
    PaperValue { noise_variance_s2: 0.0, supply: 1.0, atmosphere: 1.0 },
    PaperValue { noise_variance_s2: 1e-4, supply: 0.965, atmosphere: 0.953 },
    PaperValue { noise_variance_s2: 1e-3, supply: 0.796, atmosphere: 0.799 },
    PaperValue { noise_variance_s2: 1e-2, supply: 0.314, atmosphere: 0.344 },
];
