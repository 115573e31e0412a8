//! `valve evaluate`: how good is the prognosis of this valve?

mod own_log;
mod scenarios;
mod text;
mod truth;
mod world;

use anyhow::Context;
use prognoser::Method;
use prognoser::bayes::{BayesConfig, StartPrior};
use prognoser::study::{PAPER, StudyConfig, StudyResult, run_study};
use report::figures::{StudyFigure, StudyPoint, StudySeries};
use serde::Serialize;
use valve_file::ValveFile;

use self::truth::Truth;
use super::demo::reference_valve;
use super::tables;
use crate::cli::{EvaluateArgs, Format};
use crate::failure::Answer;
use crate::output::{self, Outputs, PlotFile, ProgressLine};

/// What is printed for programs.
#[derive(Serialize)]
pub struct Study {
    valve: String,
    end_cycle: f64,
    seeds: u64,
    alpha: f64,
    /// It is the valve that the paper's numbers are of.
    #[serde(skip)]
    is_paper: bool,
    /// The valve is known healthy at cycle 0.
    results: Vec<StudyResult>,
    /// Nothing is known of the leak at cycle 0.
    results_unknown_start: Vec<StudyResult>,
}

/// Builds the tables, runs the lives, prints.
pub fn run(args: &EvaluateArgs) -> anyhow::Result<Answer> {
    let file = ValveFile::read(&args.valve)?;
    if args.scenarios {
        return scenarios::run(args, &file);
    }
    if let Some(log) = &args.log {
        return own_log::run(args, &file, log);
    }
    let plot = PlotFile::create(&mut Outputs::new(args.force).reads([&args.valve]), args.plot.as_deref())?;
    let bundle = tables::build(&file).with_context(|| file.file_name().to_owned())?.bundle;
    let truth = Truth::new(&file);
    let times = |fault, area_m2| truth.times_s(fault, area_m2);
    let config = StudyConfig {
        end_cycle: args.cycles,
        noise_variances_s2: args.noise_variance.clone(),
        seeds: args.seeds,
        first_seed: args.first_seed,
        alpha: args.alpha,
        ..StudyConfig::default()
    };
    let unknown = BayesConfig { start: StartPrior::Unknown, ..BayesConfig::default() };
    let unknown = StudyConfig { methods: vec![Method::Bayes(unknown)], ..config.clone() };
    let line = ProgressLine::new("lives from a healthy start");
    let study = Study {
        valve: file.name().to_owned(),
        end_cycle: args.cycles,
        seeds: args.seeds,
        alpha: args.alpha,
        is_paper: tables::hash_of(&file) == tables::hash_of(&reference_valve()?),
        results: in_steps(&config, |part, share| {
            line.show(0.6 * share, "lives from a healthy start");
            run_study(&bundle, &times, part)
        }),
        results_unknown_start: in_steps(&unknown, |part, share| {
            line.show(0.6 + 0.4 * share, "lives from an unknown start");
            run_study(&bundle, &times, part)
        }),
    };
    drop(line);
    match args.format {
        Format::Text => output::print_text(&text::render(&study))?,
        Format::Json => output::print_json(&study)?,
    }
    if let Some(plot) = plot {
        plot.write(&figure(&study).figure())?;
    }
    Ok(Answer::Fine)
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

impl Study {
    /// The paper's own number for a fault and a noise, if it has one of this valve.
    fn paper(&self, fault: leak_table::Fault, noise_variance_s2: f64) -> Option<f64> {
        let value = PAPER.iter().find(|value| self.is_paper && value.noise_variance_s2 == noise_variance_s2)?;
        Some(match fault {
            leak_table::Fault::Atmosphere => value.atmosphere,
            leak_table::Fault::Supply => value.supply,
        })
    }
}

fn figure(study: &Study) -> StudyFigure {
    let series = |fault, method: &str, name: &str| {
        let points = study.results.iter().filter(|result| result.fault == fault && result.method == method);
        let points = points.map(|result| StudyPoint {
            noise_variance_s2: result.noise_variance_s2,
            median: result.relative_accuracy.p50,
            bounds: Some([result.relative_accuracy.p10, result.relative_accuracy.p90]),
        });
        StudySeries { name: name.to_owned(), points: points.collect() }
    };
    let from_paper = |fault| {
        let levels = study.results.iter().filter(|result| result.fault == fault && result.method == "ols");
        let points = levels.filter_map(|result| {
            let median = study.paper(fault, result.noise_variance_s2)?;
            Some(StudyPoint { noise_variance_s2: result.noise_variance_s2, median, bounds: None })
        });
        StudySeries { name: "the paper's one run".to_owned(), points: points.collect() }
    };
    let faults = leak_table::Fault::ALL.map(|fault| {
        let mut all = vec![series(fault, "bayes", "Bayesian estimate"), series(fault, "ols", "least squares")];
        if study.is_paper {
            all.push(from_paper(fault));
        }
        (tables::fault_name(fault).to_owned(), all)
    });
    StudyFigure {
        title: "Relative accuracy of the predicted remaining life".to_owned(),
        subtitle: format!(
            "{}: {} lives of {} cycles each; median and 10 to 90 %",
            study.valve, study.seeds, study.end_cycle
        ),
        faults: faults.into(),
    }
}
