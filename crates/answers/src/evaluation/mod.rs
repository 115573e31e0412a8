//! How good the prognosis of a valve is, over many lives whose ends are known.

mod truth;

use leak_table::{Fault, TableBundle};
use prognoser::Method;
use prognoser::bayes::{BayesConfig, StartPrior};
use prognoser::study::{PAPER, StudyConfig, StudyResult, run_study};
use report::figures::{StudyFigure, StudyPoint, StudySeries};
use serde::Serialize;
use valve_file::ValveFile;

use self::truth::Truth;
use crate::SCHEMA;
use crate::tables::{fault_name, hash_of};

/// What is printed for programs.
#[derive(Serialize)]
pub struct Study {
    /// Version of the document.
    schema: u32,
    /// The valve.
    pub valve: String,
    /// Cycles of each life.
    pub end_cycle: f64,
    /// Lives for each fault and noise.
    pub seeds: u64,
    /// Half width of the accuracy cone.
    pub alpha: f64,
    /// It is the valve that the paper's numbers are of.
    #[serde(skip)]
    pub is_paper: bool,
    /// The valve is known healthy at cycle 0.
    pub results: Vec<StudyResult>,
    /// Nothing is known of the leak at cycle 0.
    pub results_unknown_start: Vec<StudyResult>,
}

impl Study {
    /// Runs the lives of a valve with its tables; `progress` is told the share that is done and what comes next.
    pub fn run(file: &ValveFile, tables: &TableBundle, config: &StudyConfig, progress: &dyn Fn(f64, &str)) -> Self {
        let truth = Truth::new(file);
        let times = |fault, area_m2| truth.times_s(fault, area_m2);
        let unknown = BayesConfig { start: StartPrior::Unknown, ..BayesConfig::default() };
        let unknown = StudyConfig { methods: vec![Method::Bayes(unknown)], ..config.clone() };
        Self {
            schema: SCHEMA,
            valve: file.name().to_owned(),
            end_cycle: config.end_cycle,
            seeds: config.seeds,
            alpha: config.alpha,
            is_paper: hash_of(&crate::samples::reference_valve()) == hash_of(file),
            results: in_steps(config, |part, share| {
                progress(0.6 * share, "lives from a healthy start");
                run_study(tables, &times, part)
            }),
            results_unknown_start: in_steps(&unknown, |part, share| {
                progress(0.6 + 0.4 * share, "lives from an unknown start");
                run_study(tables, &times, part)
            }),
        }
    }

    /// The paper's own number for a fault and a noise, if it has one of this valve.
    pub fn paper(&self, fault: Fault, noise_variance_s2: f64) -> Option<f64> {
        let value = PAPER.iter().find(|value| self.is_paper && value.noise_variance_s2 == noise_variance_s2)?;
        Some(match fault {
            Fault::Atmosphere => value.atmosphere,
            Fault::Supply => value.supply,
        })
    }

    /// The accuracy over the noise.
    pub fn figure(&self) -> StudyFigure {
        let series = |fault, method: &str, name: &str| {
            let points = self.results.iter().filter(|result| result.fault == fault && result.method == method);
            let points = points.map(|result| StudyPoint {
                noise_variance_s2: result.noise_variance_s2,
                median: result.relative_accuracy.p50,
                bounds: Some([result.relative_accuracy.p10, result.relative_accuracy.p90]),
            });
            StudySeries { name: name.to_owned(), points: points.collect() }
        };
        let from_paper = |fault| {
            let levels = self.results.iter().filter(|result| result.fault == fault && result.method == "ols");
            let points = levels.filter_map(|result| {
                let median = self.paper(fault, result.noise_variance_s2)?;
                Some(StudyPoint { noise_variance_s2: result.noise_variance_s2, median, bounds: None })
            });
            StudySeries { name: "the paper's one run".to_owned(), points: points.collect() }
        };
        let faults = Fault::ALL.map(|fault| {
            let mut all = vec![series(fault, "bayes", "Bayesian estimate"), series(fault, "ols", "least squares")];
            if self.is_paper {
                all.push(from_paper(fault));
            }
            (fault_name(fault).to_owned(), all)
        });
        StudyFigure {
            title: "Relative accuracy of the predicted remaining life".to_owned(),
            subtitle: format!(
                "{}: {} lives of {} cycles each; median and 10 to 90 %",
                self.valve, self.seeds, self.end_cycle
            ),
            faults: faults.into(),
        }
    }
}

/// Runs a study fault by fault and noise by noise; the results are those of the whole, in the same order. Each step is
/// given the share of them that is done.
fn in_steps(config: &StudyConfig, mut step: impl FnMut(&StudyConfig, f64) -> Vec<StudyResult>) -> Vec<StudyResult> {
    let count = config.faults.len() * config.noise_variances_s2.len();
    let mut results = Vec::new();
    for (index, fault) in config.faults.iter().enumerate() {
        for (inner, variance) in config.noise_variances_s2.iter().enumerate() {
            let done = index * config.noise_variances_s2.len() + inner;
            let part = StudyConfig { faults: vec![*fault], noise_variances_s2: vec![*variance], ..config.clone() };
            results.extend(step(&part, done as f64 / count as f64));
        }
    }
    results
}
