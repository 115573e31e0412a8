//! Measured pressures that drive the model, as fine as their noise allows.
//!
//! Flow goes with the root of a pressure difference. Where that is small, as in a valve that its own weight moves, the noise of
//! a sensor makes the mean flow of a model that follows every row far too small; and to follow a thousand rows a second costs as
//! much as the simulation. So the model is driven by straight lines through the means of stretches of rows, long ones where the
//! pressure is straight and ever shorter ones where it departs from that by more than noise does, down to single rows.

use std::ops::Range;
use std::sync::Arc;

use valve_model::prescribed::Prescribed;

/// The most rows that one mean is taken of.
const MOST_ROWS: usize = 64;

/// A stretch is halved where the mean of one of its halves departs from the line by this many standard deviations. Of noise
/// alone three in a thousand do, which costs little; to wait for more would leave bends out.
const DEPARTS: f64 = 3.0;

/// Measured pressures that drive the model.
#[derive(Debug, Clone, PartialEq)]
pub struct Driving {
    /// As they were recorded.
    pub recorded: Arc<Prescribed>,
    /// Through means of as many rows as their noise allows.
    pub smooth: Arc<Prescribed>,
    /// The same with another draw of the noise: through the means of half of the same rows. Stretches of less than four rows
    /// have none.
    pub redrawn: Arc<Prescribed>,
}

/// Measured pressures made ready to drive; `noise_pa` tells the noise of a channel's samples.
pub fn smoothed(recorded: Prescribed, noise_pa: impl Fn(&[f64]) -> f64) -> Driving {
    let Prescribed { time_s, pipe_pressure_pa, chamber_pressure_pa, supply_pressure_pa } = &recorded;
    let times = Sums::of(time_s);
    let measured = [pipe_pressure_pa, chamber_pressure_pa, supply_pressure_pa].into_iter().flatten();
    let channels: Vec<(Sums, f64)> = measured.map(|samples| (Sums::of(samples), noise_pa(samples))).collect();
    let first = (0..time_s.len()).step_by(MOST_ROWS).map(|row| row..(row + MOST_ROWS).min(time_s.len()));
    let mut stretches: Vec<Range<usize>> = first.collect();
    loop {
        let bent = |at: usize| channels.iter().any(|(sums, noise_pa)| is_bent(&times, sums, *noise_pa, &stretches, at));
        let halved: Vec<Range<usize>> = (0..stretches.len())
            .flat_map(|at| {
                let Range { start, end } = stretches[at];
                let middle = if bent(at) { usize::midpoint(start, end) } else { start };
                [start..middle, middle..end].into_iter().filter(|stretch| !stretch.is_empty())
            })
            .collect();
        if halved.len() == stretches.len() {
            break;
        }
        stretches = halved;
    }
    let means = |values: &Vec<f64>| -> Vec<f64> {
        let sums = Sums::of(values);
        stretches.iter().map(|stretch| sums.mean(stretch)).collect()
    };
    // The record is known from its first row to its last.
    let mut times_s = means(time_s);
    if let ([first, .., last], [first_s, .., last_s]) = (times_s.as_mut_slice(), time_s.as_slice()) {
        (*first, *last) = (*first_s, *last_s);
    }
    let halves = |values: &Vec<f64>| stretches.iter().map(|stretch| half_mean(&values[stretch.clone()])).collect();
    let of = |through: &dyn Fn(&Vec<f64>) -> Vec<f64>| {
        Arc::new(Prescribed {
            time_s: times_s.clone(),
            pipe_pressure_pa: pipe_pressure_pa.as_ref().map(through),
            chamber_pressure_pa: chamber_pressure_pa.as_ref().map(through),
            supply_pressure_pa: supply_pressure_pa.as_ref().map(through),
        })
    };
    let (smooth, redrawn) = (of(&means), of(&halves));
    Driving { recorded: Arc::new(recorded), smooth, redrawn }
}

/// The mean of the first and the fourth row of every four, which lie about the middle of them: it misses the mean of all by as
/// much as that misses the truth, of independent noise. What is left over counts in full.
fn half_mean(values: &[f64]) -> f64 {
    let fours = values.chunks_exact(4);
    let left: f64 = fours.remainder().iter().sum();
    let sum: f64 = fours.map(|four| 2.0 * (four[0] + four[3])).sum();
    (sum + left) / values.len() as f64
}

/// Whether a half of a stretch departs from the lines through the means of the stretches by more than noise does.
fn is_bent(times: &Sums, values: &Sums, noise_pa: f64, stretches: &[Range<usize>], at: usize) -> bool {
    let whole = &stretches[at];
    if whole.len() < 2 {
        return false;
    }
    let middle = usize::midpoint(whole.start, whole.end);
    let neighbours = [at.checked_sub(1).map(|before| &stretches[before]), stretches.get(at + 1)];
    [whole.start..middle, middle..whole.end].into_iter().zip(neighbours).any(|(half, neighbour)| {
        // Beyond the first and the last mean the pressure is held.
        let neighbour = neighbour.unwrap_or(whole);
        let (own_s, other_s) = (times.mean(whole), times.mean(neighbour));
        let share = if own_s == other_s { 1.0 } else { (times.mean(&half) - other_s) / (own_s - other_s) };
        let line = share * values.mean(whole) + (1.0 - share) * values.mean(neighbour);
        // The half is part of the mean that it is held against.
        let [rows, all, others] = [half.len(), whole.len(), neighbour.len()].map(|rows| rows as f64);
        let variance = (1.0 - share * rows / all).powi(2) / rows
            + share * share * (all - rows) / (all * all)
            + (1.0 - share).powi(2) / others;
        (values.mean(&half) - line).abs() > DEPARTS * noise_pa * variance.sqrt()
    })
}

/// Sums of the first values, so that the mean of any stretch of them is at hand.
struct Sums(Vec<f64>);

impl Sums {
    fn of(values: &[f64]) -> Self {
        let sums = values.iter().scan(0.0, |sum, value| {
            *sum += value;
            Some(*sum)
        });
        Self(std::iter::once(0.0).chain(sums).collect())
    }

    fn mean(&self, stretch: &Range<usize>) -> f64 {
        (self.0[stretch.end] - self.0[stretch.start]) / stretch.len() as f64
    }
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
        Prescribed { time_s, pipe_pressure_pa: Some(values), ..Prescribed::default() }
    }

    /// How many rows are kept, and by how much lines through them miss the motion: anywhere, and root mean square.
    fn kept(motion: impl Fn(f64) -> f64) -> (usize, f64, f64) {
        let smooth = smoothed(record(&motion), |_| NOISE_PA).smooth;
        let (knots_s, knots) = (&smooth.time_s, smooth.pipe_pressure_pa.as_ref().unwrap());
        let missed: Vec<f64> = (100..19_900)
            .map(|row| {
                let time_s = f64::from(row) * 1e-3;
                let right = knots_s.partition_point(|knot| *knot <= time_s).clamp(1, knots.len() - 1);
                let share = (time_s - knots_s[right - 1]) / (knots_s[right] - knots_s[right - 1]);
                (knots[right - 1] + share * (knots[right] - knots[right - 1]) - 5e5 - motion(time_s)).abs()
            })
            .collect();
        let rms = (missed.iter().map(|one| one * one).sum::<f64>() / missed.len() as f64).sqrt();
        (knots_s.len(), missed.into_iter().fold(0.0, f64::max), rms)
    }

    #[test]
    fn a_steady_pressure_keeps_few_rows_and_loses_its_noise() {
        let (rows, most, rms) = kept(|_| 0.0);
        assert!(rows <= 20_000 / 32, "{rows}");
        assert!(most < NOISE_PA && rms < NOISE_PA / 5.0, "{most} {rms} Pa");
    }

    #[test]
    fn what_moves_is_followed_where_it_moves_and_nowhere_else() {
        let dip = |depth: f64, time_s: f64| move |t: f64| -depth * (-((t - 10.0) / time_s).powi(2)).exp();
        for (motion, most_rows) in [(dip(2e4, 1.0), 1_500), (dip(2e4, 0.05), 800), (dip(2e5, 5e-3), 700)] {
            let (rows, most, rms) = kept(motion);
            assert!(rows <= most_rows, "{rows}");
            assert!(most < 4.0 * NOISE_PA && rms < NOISE_PA / 3.0, "{most} {rms} Pa");
        }
        // A jump is not rounded off but within a row.
        let (rows, _, rms) = kept(|t| if t < 10.0 { 0.0 } else { 3e6 });
        assert!(rows <= 20_000 / 32 && rms < 3e6 / 20_000_f64.sqrt(), "{rows} {rms}");
    }

    #[test]
    fn half_of_the_rows_miss_the_mean_as_the_mean_misses_the_truth() {
        let Driving { smooth, redrawn, .. } = smoothed(record(|t| 1e3 * t), |_| NOISE_PA);
        let (all, half) = (smooth.pipe_pressure_pa.as_ref().unwrap(), redrawn.pipe_pressure_pa.as_ref().unwrap());
        let rms = |of: &dyn Fn(usize) -> f64| {
            ((0..all.len()).map(|at| of(at).powi(2)).sum::<f64>() / all.len() as f64).sqrt()
        };
        let (between, missed) = (rms(&|at| half[at] - all[at]), rms(&|at| all[at] - 5e5 - 1e3 * smooth.time_s[at]));
        assert!(between > 0.5 * missed && between < 2.0 * missed, "{between} and {missed} Pa");
    }
}
