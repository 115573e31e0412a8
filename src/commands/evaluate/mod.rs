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
use super::tables;
use crate::cli::{EvaluateArgs, Format};
use crate::failure::Answer;
use crate::output::{self, Outputs, PlotFile};

/// What is printed for programs.
#[derive(Serialize)]
pub struct Study {
    valve: String,
    end_cycle: f64,
    seeds: u64,
    alpha: f64,
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
    let study = Study {
        valve: file.name().to_owned(),
        end_cycle: args.cycles,
        seeds: args.seeds,
        alpha: args.alpha,
        results: run_study(&bundle, &times, &config),
        results_unknown_start: run_study(
            &bundle,
            &times,
            &StudyConfig { methods: vec![Method::Bayes(unknown)], ..config },
        ),
    };
    match args.format {
        Format::Text => output::print_text(&text::render(&study))?,
        Format::Json => output::print_json(&study)?,
    }
    if let Some(plot) = plot {
        plot.write(&figure(&study).figure())?;
    }
    Ok(Answer::Fine)
}

/// The paper's own number for a fault and a noise, if it has one.
fn paper(fault: leak_table::Fault, noise_variance_s2: f64) -> Option<f64> {
    let value = PAPER.iter().find(|value| value.noise_variance_s2 == noise_variance_s2)?;
    Some(match fault {
        leak_table::Fault::Atmosphere => value.atmosphere,
        leak_table::Fault::Supply => value.supply,
    })
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
            let median = paper(fault, result.noise_variance_s2)?;
            Some(StudyPoint { noise_variance_s2: result.noise_variance_s2, median, bounds: None })
        });
        StudySeries { name: "the paper's one run".to_owned(), points: points.collect() }
    };
    let faults = leak_table::Fault::ALL.map(|fault| {
        let all =
            vec![series(fault, "bayes", "Bayesian estimate"), series(fault, "ols", "least squares"), from_paper(fault)];
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
