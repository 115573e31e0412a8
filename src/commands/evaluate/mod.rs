//! `valve evaluate`: how good is the prognosis of this valve?

mod own_log;
mod scenarios;
mod text;
mod world;

use answers::evaluation::Study;
use anyhow::Context;
use prognoser::study::StudyConfig;
use valve_file::ValveFile;

use super::tables;
use crate::cli::{EvaluateArgs, Format};
use crate::failure::Answer;
use crate::output::{self, Outputs, PlotFile, ProgressLine};

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
    let config = StudyConfig {
        end_cycle: args.cycles,
        noise_variances_s2: args.noise_variance.clone(),
        seeds: args.seeds,
        first_seed: args.first_seed,
        alpha: args.alpha,
        ..StudyConfig::default()
    };
    let line = ProgressLine::new("lives from a healthy start");
    let study = Study::run(&file, &bundle, &config, &|share, what| line.show(share, what));
    drop(line);
    match args.format {
        Format::Text => output::print_text(&text::render(&study))?,
        Format::Json => output::print_json(&study)?,
    }
    if let Some(plot) = plot {
        plot.write(&study.figure().figure())?;
    }
    Ok(Answer::Fine)
}
