//! A measured supply that drives the model, as coarse as its noise allows.
//!
//! A recorder writes a thousand rows a second of a supply that hardly moves. To follow every one of them costs as much as the
//! simulation, and feeds it the sensor's noise. Straight lines through the means of equally many rows say the same where no
//! stretch of rows departs from them by more than noise does. The pressure of a pipe or a chamber rises within a few rows, each
//! of which counts: such a record stays as it is.

use valve_model::prescribed::Prescribed;

/// The most rows that one mean is taken of.
const MOST_ROWS: usize = 64;

/// The mean of half a stretch may depart from the line by this many of its standard deviations: of a hundred thousand rows of
/// noise alone hardly one stretch does.
const DEPARTS: f64 = 5.0;

/// A record of the supply alone through means of as many rows as noise allows; `noise_pa` tells that of its samples.
pub fn thinned(prescribed: Prescribed, noise_pa: impl Fn(&[f64]) -> f64) -> Prescribed {
    let Prescribed { time_s, pipe_pressure_pa: None, chamber_pressure_pa: None, supply_pressure_pa: Some(supply_pa) } =
        &prescribed
    else {
        return prescribed;
    };
    let noise_pa = noise_pa(supply_pa);
    let mut halves = std::iter::successors(Some(MOST_ROWS), |rows| Some(rows / 2)).take_while(|rows| *rows > 1);
    let Some(rows) = halves.find(|rows| is_straight(time_s, supply_pa, noise_pa, *rows)) else { return prescribed };
    Prescribed {
        time_s: means(time_s, rows),
        supply_pressure_pa: Some(means(supply_pa, rows)),
        ..Prescribed::default()
    }
}

fn means(values: &[f64], rows: usize) -> Vec<f64> {
    values.chunks(rows).map(|chunk| chunk.iter().sum::<f64>() / chunk.len() as f64).collect()
}

/// Whether lines through the means of so many rows leave nothing but noise in any half of them.
fn is_straight(time_s: &[f64], values: &[f64], noise_pa: f64, rows: usize) -> bool {
    let (knots_s, knots) = (means(time_s, rows), means(values, rows));
    if knots.len() < 2 {
        return false;
    }
    let line = |row: usize| {
        let right = knots_s.partition_point(|knot| *knot <= time_s[row]).clamp(1, knots.len() - 1);
        let share = ((time_s[row] - knots_s[right - 1]) / (knots_s[right] - knots_s[right - 1])).clamp(0.0, 1.0);
        knots[right - 1] + share * (knots[right] - knots[right - 1])
    };
    let half = rows / 2;
    // The mean of half a stretch against a line through means of whole ones.
    let least_pa = DEPARTS * noise_pa * (1.0 / half as f64 + 1.0 / rows as f64).sqrt();
    (0..values.len() / half).all(|stretch| {
        let of_stretch = stretch * half..(stretch + 1) * half;
        let sum: f64 = of_stretch.map(|row| values[row] - line(row)).sum();
        (sum / half as f64).abs() <= least_pa
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    const NOISE_PA: f64 = 300.0;

    /// 20 s at 1 kHz with noise of the size that is told (even, by a rule; it repeats after a while), and a motion.
    fn record(motion: impl Fn(f64) -> f64) -> Prescribed {
        let time_s: Vec<f64> = (0..20_000).map(|row| f64::from(row) * 1e-3).collect();
        let even = |row: usize| (row as f64 * 0.754_877_666 + (row * row) as f64 * 0.569_840_29).fract() - 0.5;
        let noisy = |(row, time): (usize, &f64)| 5e5 + motion(*time) + NOISE_PA * 12_f64.sqrt() * even(row);
        let values = time_s.iter().enumerate().map(noisy).collect();
        Prescribed { time_s, supply_pressure_pa: Some(values), ..Prescribed::default() }
    }

    fn rows_kept(motion: impl Fn(f64) -> f64) -> usize {
        thinned(record(motion), |_| NOISE_PA).time_s.len()
    }

    #[test]
    fn a_steady_pressure_keeps_few_rows_and_its_level() {
        let thin = thinned(record(|_| 0.0), |_| NOISE_PA);
        assert_eq!(thin.time_s.len(), 20_000_usize.div_ceil(MOST_ROWS));
        let far = thin.supply_pressure_pa.unwrap().iter().fold(0.0, |far: f64, p| far.max((p - 5e5).abs()));
        assert!(far < NOISE_PA, "{far} Pa");
    }

    #[test]
    fn what_moves_slowly_is_followed_and_what_moves_fast_keeps_its_rows() {
        let dip = |depth: f64, time_s: f64| move |t: f64| -depth * (-((t - 10.0) / time_s).powi(2)).exp();
        let (slow, fast) = (rows_kept(dip(2e4, 1.0)), rows_kept(dip(2e4, 5e-3)));
        assert!(slow <= 20_000 / 32 + 1, "{slow}");
        assert!(fast >= 20_000 / 4, "{fast}");
        // One jump in 20 s is enough.
        assert!(rows_kept(|t| if t < 10.0 { 0.0 } else { 2e4 }) >= 20_000 / 2);
        assert_eq!(rows_kept(|t| if t < 10.0 { 0.0 } else { 3e6 }), 20_000);
    }
}
