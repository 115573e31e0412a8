//! A timing log, by rows.

use prognoser::TimingLog;

/// Looks at an input.
pub fn look(bytes: &[u8]) {
    let Ok(mut log) = TimingLog::new("log.csv", bytes) else { return };
    loop {
        match log.next_row() {
            Ok(None) => return,
            Ok(Some(row)) => {
                assert!(!row.valve.is_empty() && !row.valve.contains(char::is_control));
                let times = [row.reading.close_time_s, row.reading.open_time_s];
                assert!(times.into_iter().flatten().all(|time_s| (0.0..=86_400.0).contains(&time_s)));
            }
            Err(error) => {
                assert!(!error.to_string().contains(char::is_control));
                if !error.kind.is_row() {
                    return;
                }
            }
        }
    }
}
