//! How often a piston turned back since its last command.

use identify::{Row, Series};

/// A turn is seen where the piston went back by more than this many deviations of a row's noise, and this share of the stroke: hum,
/// vibration after a stop and slow noise of a sensor stay below.
const SEEN: (f64, f64) = (8.0, 1e-2);

/// Counts the turns before each row of a record; the first series is the position. `edges_s` are the commands, in the time of the rows.
pub(super) fn count_turns(series: &mut [Series], edges_s: &[f64], stroke_m: f64) {
    let Some(position) = series.first() else { return };
    let turns_s = turns(&position.rows, edges_s, stroke_m);
    for row in series.iter_mut().flat_map(|series| &mut series.rows) {
        let edge_s = edges_s.iter().copied().filter(|edge| *edge <= row.time_s).fold(f64::NEG_INFINITY, f64::max);
        row.turns = turns_s.iter().filter(|turn| **turn >= edge_s && **turn < row.time_s).count();
    }
}

/// When it turned, s.
fn turns(rows: &[Row], edges_s: &[f64], stroke_m: f64) -> Vec<f64> {
    let mut turns_s = Vec::new();
    let mut edges = edges_s.iter().copied().peekable();
    // The outermost rows since the last turn, and which way it went.
    let Some(first) = rows.first() else { return turns_s };
    let (mut low, mut high, mut rises) = (first, first, None);
    for row in rows {
        while edges.next_if(|edge| *edge <= row.time_s).is_some() {
            (low, high, rises) = (row, row, None);
        }
        if row.observed < low.observed {
            low = row;
        }
        if row.observed > high.observed {
            high = row;
        }
        let far = |one: &Row| (SEEN.0 * row.sigma.hypot(one.sigma) / std::f64::consts::SQRT_2).max(SEEN.1 * stroke_m);
        if rises != Some(true) && row.observed - low.observed > far(low) {
            if rises.is_some() {
                turns_s.push(low.time_s);
            }
            (high, rises) = (row, Some(true));
        } else if rises != Some(false) && high.observed - row.observed > far(high) {
            if rises.is_some() {
                turns_s.push(high.time_s);
            }
            (low, rises) = (row, Some(false));
        }
    }
    turns_s
}

#[cfg(test)]
mod tests {
    use identify::{Row, Series};

    use super::count_turns;

    /// Positions in mm, a row each 10 ms, with a noise of 0.01 mm.
    fn turns(positions_mm: &[f64], edges_s: &[f64]) -> Vec<usize> {
        let row = |(index, position): (usize, &f64)| Row {
            time_s: 0.01 * index as f64,
            observed: 1e-3 * position,
            sigma: 1e-5,
            activity: 0.05,
            turns: 0,
        };
        let position = Series { rows: positions_mm.iter().enumerate().map(row).collect(), ..Series::default() };
        let mut series = [position.clone(), position];
        count_turns(&mut series, edges_s, 0.05);
        assert_eq!(series[0], series[1]);
        series[0].rows.iter().map(|row| row.turns).collect()
    }

    #[test]
    fn each_rebound_counts_until_the_next_command() {
        let position = [50.0, 50.0, 30.0, 0.0, 2.0, 0.0, 1.0, 0.0, 0.0, 20.0, 50.0, 50.0];
        assert_eq!(turns(&position, &[0.01, 0.075]), [0, 0, 0, 0, 1, 2, 3, 4, 0, 0, 0, 0]);
    }

    #[test]
    fn neither_noise_nor_a_stroke_that_turns_for_a_command_is_a_rebound() {
        let noisy = [50.0, 50.02, 49.98, 30.0, 30.03, 10.0, 0.0, 0.03, 0.0, 0.05, 0.01, 0.0];
        assert!(turns(&noisy, &[0.01]).iter().all(|turns| *turns == 0));
        let called_back = [50.0, 40.0, 30.0, 20.0, 30.0, 40.0, 50.0, 50.0];
        assert!(turns(&called_back, &[0.0, 0.025]).iter().all(|turns| *turns == 0));
    }
}
