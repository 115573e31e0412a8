//! `valve evaluate --log`: how the prognosis did on valves that ran to their end.

use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Arc;

use answers::SCHEMA;
use prognoser::{Method, Prognoser, Prognosis};
use serde::Serialize;
use valve_file::ValveFile;

use crate::cli::{EvaluateArgs, Format};
use crate::commands::log_input::LogInput;
use crate::commands::tables;
use crate::failure::{Answer, Hinted};
use crate::output::{self, Align, TextTable};

/// Cycles before predictions count.
const FIRST_CYCLES: u64 = 2;

/// Cycles before the first reading beyond a limit from which on predictions tell the end of a valve under the reference.
const ABOUT_CYCLES: u64 = 3;

/// What is kept of a valve: its predictions, the first cycle with a reading beyond a
/// limit, and the first of the last run of them.
#[derive(Default)]
struct Life {
    rows: Vec<Prognosis>,
    first_over: Option<u64>,
    end_cycle: Option<u64>,
    /// Whether its rows state conditions.
    stated: bool,
}

/// How the prognosis did on one valve.
#[derive(Serialize)]
struct Score {
    valve: String,
    end_cycle: u64,
    fault: &'static str,
    relative_accuracy: f64,
    coverage_90: Option<f64>,
    replaced_at: Option<u64>,
}

/// The scores for programs.
#[derive(Serialize)]
struct OwnLogDocument<'a> {
    schema: u32,
    /// Valves in the log, whether they reached their end or not.
    valves: usize,
    lives: &'a [Score],
}

/// Reads the log, scores every valve that reached its end.
pub fn run(args: &EvaluateArgs, file: &ValveFile, path: &Path) -> anyhow::Result<Answer> {
    let request = tables::for_log(file, path, &args.columns)?;
    let bundle = Arc::new(tables::build_and_tell(file, &request)?.bundle);
    let limits = bundle.manifest().limits;
    let mut log = LogInput::open(path, &args.columns, false)?;
    log.announce();
    let mut prognoser = Prognoser::new(Arc::clone(&bundle), Method::default());
    let mut lives: BTreeMap<String, Life> = BTreeMap::new();
    log.each(|row| {
        let reading = row.reading;
        let over = reading.stalled.contains(&true)
            || reading.close_time_s.is_some_and(|time| time > limits.close_within_s)
            || reading.open_time_s.is_some_and(|time| time > limits.open_within_s);
        let life = lives.entry(row.valve.to_owned()).or_default();
        life.end_cycle = if over { life.end_cycle.or(Some(reading.cycle)) } else { None };
        life.first_over = life.first_over.or(Some(reading.cycle).filter(|_| over));
        life.stated |= reading.supply_pressure_pa.is_some() || reading.temperature_k.is_some();
        life.rows.push(prognoser.push(row));
    })?;
    let valves = lives.len();
    let scores: Vec<Score> = lives.into_iter().filter_map(|(valve, life)| score(valve, &life)).collect();
    if scores.is_empty() {
        return Err(Hinted::error(
            match valves {
                1 => format!("{}: its only valve did not reach its end of life", path.display()),
                _ => format!("{}: none of {valves} valves reached its end of life", path.display()),
            },
            "a valve has reached it when its last readings are beyond a limit or stalled",
        ));
    }
    match args.format {
        Format::Text => output::print_text(&render(&scores, valves))?,
        Format::Json => output::print_document(&OwnLogDocument { schema: SCHEMA, valves, lives: &scores })?,
    }
    Ok(Answer::Fine)
}

fn score(valve: String, life: &Life) -> Option<Score> {
    // The limit was crossed somewhere in the cycle before.
    let end_cycle = life.end_cycle?;
    let crossed = |cycle: u64| cycle as f64 - 0.5;
    // Under low pressure a valve is beyond it early, under high pressure late. Its end under the reference is what the
    // corrected readings about that time say.
    let about = life.first_over?.saturating_sub(ABOUT_CYCLES);
    let mut said: Vec<f64> =
        life.rows.iter().filter(|one| one.cycle >= about).filter_map(|one| one.eol_cycle).collect();
    said.sort_by(f64::total_cmp);
    let corrected = said.get(said.len() / 2).copied().filter(|_| life.stated);
    let end = corrected.unwrap_or(crossed(end_cycle));
    let first = life.rows.first()?.cycle + FIRST_CYCLES;
    let rows: Vec<&Prognosis> = life.rows.iter().filter(|one| one.cycle >= first && (one.cycle as f64) < end).collect();
    let accuracy = |one: &&Prognosis| {
        let left = end - one.cycle as f64;
        one.rul_cycles.map_or(0.0, |rul| (1.0 - (left - rul).abs() / left).max(0.0))
    };
    let held = rows.iter().filter_map(|one| {
        let left = end - one.cycle as f64;
        // Half a cycle to either side is within what the log tells.
        Some(one.rul_p05? <= left + 0.5 && left - 0.5 <= one.rul_p95?)
    });
    let held: Vec<bool> = held.collect();
    let replaced = rows.iter().find(|one| one.replace_by_cycle.is_some_and(|by| by <= one.cycle));
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a cycle")]
    Some(Score {
        end_cycle: end.max(0.0).ceil() as u64,
        fault: life.rows.last()?.fault.name(),
        relative_accuracy: rows.iter().map(accuracy).sum::<f64>() / rows.len().max(1) as f64,
        coverage_90: (!held.is_empty()).then(|| held.iter().filter(|held| **held).count() as f64 / held.len() as f64),
        replaced_at: replaced.map(|one| one.cycle),
        valve,
    })
}

fn render(scores: &[Score], valves: usize) -> String {
    let mut table = TextTable::new(&[
        ("valve", Align::Left),
        ("end (cycle)", Align::Right),
        ("fault", Align::Left),
        ("relative accuracy", Align::Right),
        ("90 % holds", Align::Right),
        ("replaced at", Align::Right),
    ]);
    for one in scores {
        table.row(vec![
            one.valve.clone(),
            one.end_cycle.to_string(),
            one.fault.to_owned(),
            format!("{:.3}", one.relative_accuracy),
            one.coverage_90.map_or_else(|| "-".to_owned(), |share| format!("{share:.3}")),
            one.replaced_at.map_or_else(|| "too late".to_owned(), |cycle| cycle.to_string()),
        ]);
    }
    let failed = scores.iter().filter(|one| one.replaced_at.is_none()).count();
    format!(
        "{} of {valves} valve{} reached {} end of life; {failed} would have failed in service\n\n{}",
        scores.len(),
        if valves == 1 { "" } else { "s" },
        if valves == 1 { "its" } else { "their" },
        table.render()
    )
}
