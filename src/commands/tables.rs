//! Tables built with a line of progress.

use std::path::Path;
use std::sync::Mutex;

use leak_table::{Condition, ConditionRange};
use lut_builder::{BuildError, Built, Progress, Request, Wear};
use valve_file::ValveFile;

use super::log_input::LogInput;
use crate::cli::LogColumnArgs;
use crate::output::ProgressLine;

/// Builds the tables of both kinds of leak.
pub fn build(file: &ValveFile) -> Result<Built, BuildError> {
    build_what(file, &Request::default())
}

/// Builds what is asked for.
pub fn build_what(file: &ValveFile, request: &Request) -> Result<Built, BuildError> {
    let line = ProgressLine::new("building tables");
    let shares = Mutex::new(vec![0.0; request.wears.len()]);
    answers::tables::build(file, request, &|progress: Progress| {
        let Ok(mut shares) = shares.lock() else { return };
        shares[progress.place] = progress.share;
        line.show(shares.iter().sum::<f64>() / shares.len() as f64, progress.stage.name());
    })
}

/// All wears, over the conditions that the rows of a log and the valve file state, from end to end.
///
/// # Errors
/// If the log cannot be read.
pub fn for_log(file: &ValveFile, path: &Path, columns: &LogColumnArgs) -> anyhow::Result<Request> {
    let parameters = file.valve().parameters();
    let own = |value: f64| (value, value);
    let mut range = ConditionRange {
        supply_pressure_pa: own(parameters.supply_pressure_pa),
        temperature_k: own(parameters.temperature_k),
    };
    let reach = |ends: &mut (f64, f64), value: f64| *ends = (ends.0.min(value), ends.1.max(value));
    let mut log = LogInput::open(path, columns, false)?;
    while let Some(row) = log.next_row()? {
        if let Some(pa) = row.reading.supply_pressure_pa {
            reach(&mut range.supply_pressure_pa, pa);
        }
        if let Some(k) = row.reading.temperature_k {
            reach(&mut range.temperature_k, k);
        }
    }
    let vary = [Condition::SupplyPressure, Condition::Temperature].into_iter().any(|one| range.varies(one));
    Ok(Request { wears: Wear::catalogue(), conditions: vary.then_some(range), both_leaks: true })
}
