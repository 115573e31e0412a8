//! A timing log, by rows: as a plain one, and by its columns.

use log_columns::{ColumnLog, Wanted};
use prognoser::{LogRow, TimingLog};

/// Looks at an input.
pub fn look(bytes: &[u8]) {
    by_columns(bytes, &Wanted::default());
    by_columns(bytes, &Wanted { valve: Some("V".to_owned()), ..Wanted::default() });
    plain(bytes);
}

fn by_columns(bytes: &[u8], wanted: &Wanted) {
    let Ok(mut log) = ColumnLog::read(bytes, "log.csv", wanted) else { return };
    // What is no row ends such a log.
    while let Ok(Some(row)) = log.next_row() {
        check(&row);
    }
}

fn check(row: &LogRow<'_>) {
    assert!(!row.valve.is_empty() && !row.valve.contains(char::is_control));
    let times = [row.reading.close_time_s, row.reading.open_time_s];
    assert!(times.into_iter().flatten().all(|time_s| (0.0..=86_400.0).contains(&time_s)));
    assert!(row.reading.supply_pressure_pa.is_none_or(|pascal| pascal.is_finite() && pascal > 0.0));
}

fn plain(bytes: &[u8]) {
    let Ok(mut log) = TimingLog::new("log.csv", bytes) else { return };
    loop {
        match log.next_row() {
            Ok(None) => return,
            Ok(Some(row)) => check(&row),
            Err(error) => {
                assert!(!error.to_string().contains(char::is_control));
                if !error.kind.is_row() {
                    return;
                }
            }
        }
    }
}
