//! `valve learn`: what the logs of sister valves teach of the next one.

use std::sync::Arc;

use answers::SCHEMA;
use leak_table::TableBundle;
use prognoser::bayes::{BayesConfig, Noise};
use prognoser::{Learned, Learner, PRIOR_VALVES, Repeated};
use serde::Serialize;

use super::log_input::LogInput;
use crate::cli::{Format, LearnArgs};
use crate::failure::{Answer, Hinted};
use crate::output::{self, Outputs, ProgressLine, next_step};

/// What was learnt, for programs.
#[derive(Serialize)]
struct LearnDocument<'a> {
    schema: u32,
    #[serde(flatten)]
    learned: &'a Learned,
}

/// Reads all logs, writes the prior.
pub fn run(args: &LearnArgs) -> anyhow::Result<Answer> {
    let tables = Arc::new(TableBundle::read(&args.tables)?);
    let out = Outputs::new(args.force).reads(&args.logs).reads([&args.tables]).file(&args.out)?;
    let mut learner = Learner::new(tables);
    for (index, path) in args.logs.iter().enumerate() {
        let mut log = LogInput::open(path, &args.columns, false)?;
        log.announce();
        log.each(|row| learner.push(index, row))?;
    }
    refuse_repeated(&learner, args)?;
    let line = ProgressLine::new("learning");
    let learned = learner.finish();
    drop(line);
    let text = toml_edit::ser::to_string_pretty(&learned)?;
    let head = "# What the logs of sister valves have taught; for `valve prognose --prior`.\n";
    out.write_whole(format!("{head}{text}").as_bytes())?;
    match args.format {
        Format::Text => {
            let (tables, out) = (args.tables.display().to_string(), args.out.display().to_string());
            let next = next_step(
                "read the log of the next valve with it, by its name for log.csv",
                &["prognose", "log.csv", "--tables", &tables, "--prior", &out],
            );
            output::print_text(&(sentences(&learned) + &next))?;
        }
        Format::Json => output::print_json(&LearnDocument { schema: SCHEMA, learned: &learned })?,
    }
    Ok(Answer::Fine)
}

/// One life given twice would count as two.
fn refuse_repeated(learner: &Learner, args: &LearnArgs) -> anyhow::Result<()> {
    let places: Vec<_> = args.logs.iter().map(|log| log.canonicalize().unwrap_or_else(|_| log.clone())).collect();
    if let Some(again) = (1..places.len()).find(|log| places[..*log].contains(&places[*log])) {
        return Err(Hinted::error(
            format!("{}: given twice; expected each life once", args.logs[again].display()),
            "leave one of the two out",
        ));
    }
    let Some(Repeated { valves, logs }) = learner.repeated() else { return Ok(()) };
    let [first, second] = logs.map(|log| args.logs[log].display().to_string());
    let [of_first, of_second] = valves;
    Err(Hinted::error(
        format!(
            "{second}: valve {of_second} has the readings of valve {of_first} in {first}, one for one; expected each life once"
        ),
        "leave one of the two out",
    ))
}

fn sentences(learned: &Learned) -> String {
    let default = BayesConfig::default();
    let known = match default.noise {
        Noise::Known { sd_s } | Noise::Estimated { prior_sd_s: sd_s, .. } => sd_s,
    };
    let ends = |median: f64, ln_sd: f64| [-1.645, 1.645].map(|sigmas: f64| median * (sigmas * ln_sd).exp());
    let [shortest, longest] = ends(default.life_median_cycles, default.life_ln_sd);
    let defaults = format!(
        "Started from the default, which counts as {PRIOR_VALVES:.0} valves: a life of {:.0} cycles ({shortest:.0} to {longest:.0}), healthy times \
         {:.1} % apart, noise of\n{:.1} ms; {:.0} % curved, {:.0} % varying; wear begins once in {:.0} cycles.\n",
        default.life_median_cycles,
        100.0 * default.unit_sd,
        1e3 * known,
        100.0 * default.growth_prior.curved(),
        100.0 * default.growth_prior.rough,
        1.0 / default.growth_prior.onset,
    );
    let valves = if learned.valves == 1 { "1 valve".to_owned() } else { format!("{} valves", learned.valves) };
    let [shortest, longest] = ends(learned.life_median_cycles, learned.life_ln_sd);
    format!(
        "{valves}, {} of them worn.\n\
         Life from health to the limit: {:.0} cycles (90 % of valves: {shortest:.0} to {longest:.0}).\n\
         Healthy times differ by {:.1} % from valve to valve; noise of a time {:.1} ms.\n\
         Growth: {:.0} % curved, {:.0} % varying, the rest steady; wear begins once in {:.0} cycles.\n{defaults}",
        learned.worn,
        learned.life_median_cycles,
        100.0 * learned.unit_sd,
        1e3 * learned.noise_sd_s,
        100.0 * learned.curved,
        100.0 * learned.rough,
        1.0 / learned.onset,
    )
}
