//! Tables built with a line of progress.

use std::path::Path;
use std::sync::Mutex;

use leak_table::{Condition, ConditionRange};
use lut_builder::{BuildError, Built, Progress, Request, Wear};
use valve_file::ValveFile;

use super::log_input::LogInput;
use crate::cli::LogColumnArgs;
use crate::output::{self, ProgressLine};

/// Builds the tables of both kinds of leak.
pub fn build(file: &ValveFile) -> Result<Built, BuildError> {
    build_what(file, &Request::default())
}

/// Builds what is asked for, and says what there is to know about it.
pub fn build_and_tell(file: &ValveFile, request: &Request) -> Result<Built, BuildError> {
    let built = build_what(file, request)?;
    for notice in &built.notices {
        output::note(&format!("note: {notice}"));
    }
    Ok(built)
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

/// Of the readings of a condition the share at each end that may be mistyped.
const MISTYPED: f64 = 0.01;

/// Room beyond the readings, of a supply pressure as a share of it, and of a temperature, K: a limit is not met to the last digit.
const ROOM: (f64, f64) = (0.002, 0.1);

/// All wears, over the conditions that the rows of a log and the valve file state, from end to end.
///
/// # Errors
/// If the log cannot be read.
pub fn for_log(file: &ValveFile, path: &Path, columns: &LogColumnArgs) -> anyhow::Result<Request> {
    let parameters = file.valve().parameters();
    let (mut supply_pa, mut temperature_k) = (Vec::new(), Vec::new());
    LogInput::open(path, columns, false)?.each(|row| {
        supply_pa.extend(row.reading.supply_pressure_pa);
        temperature_k.extend(row.reading.temperature_k);
    })?;
    let range = ConditionRange {
        supply_pressure_pa: reached(supply_pa, parameters.supply_pressure_pa, ROOM.0 * parameters.supply_pressure_pa),
        temperature_k: reached(temperature_k, parameters.temperature_k, ROOM.1),
    };
    let vary = [Condition::SupplyPressure, Condition::Temperature].into_iter().any(|one| range.varies(one));
    Ok(Request { wears: Wear::catalogue(), conditions: vary.then_some(range), both_leaks: true })
}

/// From the least to the most of some readings and of the valve's own value. What lies farther beyond most of them than these lie
/// apart is a slip of whoever wrote it down, and not what tables are built for.
fn reached(mut readings: Vec<f64>, own: f64, room: f64) -> (f64, f64) {
    readings.sort_by(f64::total_cmp);
    let (Some(least), Some(most)) = (readings.first(), readings.last()) else { return (own, own) };
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a place among the readings")]
    let beside = (MISTYPED * readings.len() as f64).ceil() as usize;
    let (low, high) = (readings[beside.min(readings.len() - 1)], readings[readings.len().saturating_sub(1 + beside)]);
    let (low, high) = (low.min(high).min(own), low.max(high).max(own));
    let (low, high) = (least.max(low - (high - low)), most.min(high + (high - low)));
    let (low, high) = (low.min(own), high.max(own));
    if low < high { (low - room, high + room) } else { (own, own) }
}

#[cfg(test)]
mod tests {
    use super::reached;

    #[test]
    fn tables_are_built_for_what_a_log_holds_and_not_for_a_slip() {
        let is = |readings: &[f64], (low, high): (f64, f64)| {
            let found = reached(readings.to_vec(), 75.0, 0.1);
            assert!((found.0 - low).abs() < 1e-9 && (found.1 - high).abs() < 1e-9, "{readings:?}: {found:?}");
        };
        assert_eq!(reached(Vec::new(), 75.0, 0.1), (75.0, 75.0));
        is(&[72.0, 74.0, 78.0, 76.0], (71.9, 78.1));
        is(&[72.0, 74.0, 78.0, 76.0, 750.0], (71.9, 82.1));
        is(&[76.0], (74.9, 76.1));
        is(&[75.0; 9], (75.0, 75.0));
    }
}
