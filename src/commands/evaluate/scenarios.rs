//! `valve evaluate --scenarios`: how the prognosis does in worlds that are not
//! as assumed.

use std::sync::Arc;

use answers::SCHEMA;
use leak_table::{ConditionRange, TableBundle};
use lut_builder::{Request, Wear};
use prognoser::Method;
use prognoser::study::scenario::{Scenario, ScenarioConfig, ScenarioResult, run_scenarios};
use serde::Serialize;
use valve_file::ValveFile;

use super::world::{SUPPLY_SPAN, SimulatedWorld, TEMPERATURE_SPAN_K};
use crate::cli::{EvaluateArgs, Format};
use crate::commands::tables;
use crate::failure::{Answer, Hinted};
use crate::output::{self, Align, ProgressLine, TextTable};

/// One-sigma noises of the times, s.
const NOISES_S: [f64; 2] = [0.01, 0.0316];

/// The results for programs.
#[derive(Serialize)]
struct ScenariosDocument<'a> {
    schema: u32,
    valve: &'a str,
    first_seed: u64,
    scenarios: &'a [ScenarioResult],
}

/// Simulates the world, builds the tables, runs the lives, prints.
pub fn run(args: &EvaluateArgs, file: &ValveFile) -> anyhow::Result<Answer> {
    let wanted = |scenario: &Scenario| args.only.as_ref().is_none_or(|part| scenario.name.contains(part.as_str()));
    let scenarios: Vec<Scenario> = Scenario::ALL.into_iter().filter(wanted).collect();
    if scenarios.is_empty() {
        let names: Vec<&str> = Scenario::ALL.iter().map(|scenario| scenario.name).collect();
        return Err(Hinted::error("no world has this in its name", format!("the worlds are: {}", names.join("; "))));
    }
    let (bundle, scenarios) = tables_for(file, scenarios)?;
    let line = ProgressLine::new("simulating the worlds");
    let world = SimulatedWorld::new(file, &scenarios)?;
    drop(line);
    let config = ScenarioConfig {
        scenarios,
        noises_s: NOISES_S.to_vec(),
        lives: args.seeds,
        first_seed: args.first_seed,
        method: Method::default(),
    };
    let line = ProgressLine::new("lives in other worlds");
    let mut results = Vec::new();
    let count = config.noises_s.len() * config.scenarios.len();
    for noise_s in &config.noises_s {
        for scenario in &config.scenarios {
            line.show(results.len() as f64 / count as f64, scenario.name);
            let part = ScenarioConfig { scenarios: vec![*scenario], noises_s: vec![*noise_s], ..config.clone() };
            results.extend(run_scenarios(&world, &bundle, &part));
        }
    }
    drop(line);
    match args.format {
        Format::Text => output::print_text(&table(&results, args))?,
        Format::Json => {
            let (valve, first_seed) = (file.name(), args.first_seed);
            let document = ScenariosDocument { schema: SCHEMA, valve, first_seed, scenarios: &results };
            output::print_document(&document)?;
        }
    }
    Ok(Answer::Fine)
}

/// Tables for these worlds. A valve that does not stroke in all the weather of some is given the others alone, which is said.
fn tables_for(file: &ValveFile, scenarios: Vec<Scenario>) -> anyhow::Result<(Arc<TableBundle>, Vec<Scenario>)> {
    let parameters = file.valve().parameters();
    // Tables over what no scenario varies would take a minute for nothing.
    let [varies_supply, varies_temperature] = [Scenario::varies_supply, Scenario::varies_temperature]
        .map(|varies: fn(&Scenario) -> bool| scenarios.iter().any(varies));
    let span = |varies: bool, span: f64| if varies { span } else { 0.0 };
    let supply = span(varies_supply, SUPPLY_SPAN);
    let warmer_k = span(varies_temperature, TEMPERATURE_SPAN_K);
    let conditions = ConditionRange {
        supply_pressure_pa: (
            (1.0 - supply) * parameters.supply_pressure_pa,
            (1.0 + supply) * parameters.supply_pressure_pa,
        ),
        temperature_k: (parameters.temperature_k - warmer_k, parameters.temperature_k + warmer_k),
    };
    let conditions = (varies_supply || varies_temperature).then_some(conditions);
    let request = Request { wears: Wear::catalogue(), conditions, both_leaks: true };
    match tables::build_and_tell(file, &request) {
        Ok(built) => Ok((Arc::new(built.bundle), scenarios)),
        Err(error) if request.conditions.is_some() && error.is_of_conditions() => {
            let steady = |scenario: &Scenario| !scenario.varies_supply() && !scenario.varies_temperature();
            let steady: Vec<Scenario> = scenarios.into_iter().filter(steady).collect();
            if steady.is_empty() {
                return Err(error.into());
            }
            output::note(&format!("note: without the worlds whose supply or temperature changes: {error}"));
            tables_for(file, steady)
        }
        Err(error) => Err(error.into()),
    }
}

fn table(results: &[ScenarioResult], args: &EvaluateArgs) -> String {
    let mut table = TextTable::new(&[
        ("world, noise", Align::Left),
        ("relative accuracy", Align::Right),
        ("90 % holds", Align::Right),
        ("named wrongly", Align::Right),
        ("named rightly", Align::Right),
        ("called other", Align::Right),
        ("ended early", Align::Right),
        ("failed in service", Align::Right),
        ("life given away", Align::Right),
        ("us a row (elapsed)", Align::Right),
    ]);
    let number = |value: Option<f64>| value.map_or_else(|| "-".to_owned(), |value| format!("{value:.3}"));
    for one in results {
        table.row(vec![
            // Together, so that the parts of a table that is wider than the screen say which row is which.
            format!("{}, {:.1} ms", one.scenario, 1e3 * one.noise_s),
            number(one.relative_accuracy),
            number(one.coverage_90),
            number(Some(one.named_wrongly)),
            number(Some(one.named_rightly)),
            number(Some(one.called_other)),
            number(Some(one.ended_early)),
            number(one.failed_in_service),
            number(one.life_given_away),
            format!("{:.1}", 1e6 * one.row_s),
        ]);
    }
    format!(
        "Worlds that are not as assumed: {} lives each, seeds from {}; replaced at a risk of 5 %\n\n{}",
        args.seeds,
        args.first_seed,
        table.render()
    )
}
