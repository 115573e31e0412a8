//! Measured pressures that drive the model, as fine as their noise allows.
//!
//! Flow goes with the root of a pressure difference. Where that is small, as in a valve that its own weight moves, the noise of
//! a sensor makes the mean flow of a model that follows every row far too small; and to follow a thousand rows a second costs as
//! much as the simulation. So the model is driven by the straight lines that fit the rows best between knots: far apart where the
//! pressure is straight, ever closer where it departs from that by more than noise does, down to single rows. What a least-squares
//! line leaves has no mean over it (lines through means of rows have, wherever the pressure is curved): motion adds a pressure up, so
//! that an error far below the noise that lasts does what the noise does not.

use std::sync::Arc;

use valve_model::prescribed::Prescribed;

/// The most rows from one knot to the next.
const MOST_ROWS: usize = 64;

/// A line gets a knot in its middle where what it leaves has a shape that stands out by this many standard deviations. Of noise
/// alone eight in a thousand do, which costs little; to wait for more would leave bends out.
const DEPARTS: f64 = 3.0;

/// Measured pressures that drive the model.
#[derive(Debug, Clone, PartialEq)]
pub struct Driving {
    /// As they were recorded.
    pub recorded: Arc<Prescribed>,
    /// The lines that fit them, as fine as their noise allows.
    pub smooth: Arc<Prescribed>,
    /// The same with another draw of the noise: fitted to half of the rows. Lines over less than four rows have none.
    pub redrawn: Arc<Prescribed>,
}

/// Measured pressures made ready to drive; `noise_pa` tells the noise of a channel's samples.
pub fn smoothed(recorded: Prescribed, noise_pa: impl Fn(&[f64]) -> f64) -> Driving {
    let Prescribed { time_s, pipe_pressure_pa, chamber_pressure_pa, supply_pressure_pa } = &recorded;
    let measured = [pipe_pressure_pa, chamber_pressure_pa, supply_pressure_pa].into_iter().flatten();
    let channels: Vec<(&[f64], f64)> = measured.map(|samples| (samples.as_slice(), noise_pa(samples))).collect();
    let last = time_s.len().saturating_sub(1);
    let mut knots: Vec<usize> = (0..last).step_by(MOST_ROWS).chain(last..time_s.len()).collect();
    loop {
        let fitted: Vec<Vec<f64>> =
            channels.iter().map(|(samples, _)| lines(time_s, samples, &knots, |_, _| 1.0)).collect();
        let is_bent = |at: usize| {
            let left = |(fitted, (samples, noise_pa)): (&Vec<f64>, &(&[f64], f64))| {
                stands_out(&residuals(time_s, samples, &knots, fitted, at)) > DEPARTS * noise_pa
            };
            fitted.iter().zip(&channels).any(left)
        };
        let between = knots.windows(2).enumerate().filter(|(at, ends)| ends[1] - ends[0] > 1 && is_bent(*at));
        let middles: Vec<usize> = between.map(|(_, ends)| usize::midpoint(ends[0], ends[1])).collect();
        if middles.is_empty() {
            break;
        }
        knots.extend(middles);
        knots.sort_unstable();
    }
    let of = |weight: fn(usize, usize) -> f64| {
        let through = |samples: &Vec<f64>| {
            // A line beside a jump may pass what was recorded, and no gas has less than no pressure.
            let least = samples.iter().copied().fold(f64::INFINITY, f64::min);
            let passes = |value: f64| if value > 0.0 { value } else { least };
            lines(time_s, samples, &knots, weight).into_iter().map(passes).collect()
        };
        Arc::new(Prescribed {
            time_s: knots.iter().map(|row| time_s[*row]).collect(),
            pipe_pressure_pa: pipe_pressure_pa.as_ref().map(through),
            chamber_pressure_pa: chamber_pressure_pa.as_ref().map(through),
            supply_pressure_pa: supply_pressure_pa.as_ref().map(through),
        })
    };
    let (smooth, redrawn) = (of(|_, _| 1.0), of(half));
    Driving { recorded: Arc::new(recorded), smooth, redrawn }
}

/// The weight of a row in a draw of half of them, by its place among the rows from a knot to the next: the first and the fourth of
/// every four, which lie about the middle of them. Lines fitted to these miss those fitted to all by as much as those miss the
/// truth, of independent noise. What is left over counts in full.
fn half(place: usize, of: usize) -> f64 {
    match place % 4 {
        _ if place >= of - of % 4 => 1.0,
        0 | 3 => 2.0,
        _ => 0.0,
    }
}

/// Where between the knots around it a row lies, from 0 to 1; at the first of two at the same time.
fn share(time_s: &[f64], (left, right): (usize, usize), row: usize) -> f64 {
    let between_s = time_s[right] - time_s[left];
    if between_s > 0.0 { (time_s[row] - time_s[left]) / between_s } else { 0.0 }
}

/// The values at the knots of the straight lines between them that fit the rows best; `weight` of a row tells by its place after
/// the knot before it how much it counts, and by how many there are.
fn lines(time_s: &[f64], samples: &[f64], knots: &[usize], weight: impl Fn(usize, usize) -> f64) -> Vec<f64> {
    // Normal equations of hat functions: tridiagonal, and positive definite since every knot is a row that counts.
    let (mut diagonal, mut beside, mut sums) = (vec![0.0; knots.len()], vec![0.0; knots.len()], vec![0.0; knots.len()]);
    let mut add = |at: usize, share: f64, value: f64, weight: f64| {
        diagonal[at] += weight * (1.0 - share).powi(2);
        sums[at] += weight * (1.0 - share) * value;
        if share > 0.0 {
            beside[at] += weight * (1.0 - share) * share;
            diagonal[at + 1] += weight * share * share;
            sums[at + 1] += weight * share * value;
        }
    };
    for (at, ends) in knots.windows(2).enumerate() {
        let (left, right) = (ends[0], ends[1]);
        for (row, value) in samples.iter().enumerate().take(right).skip(left) {
            add(at, share(time_s, (left, right), row), *value, weight(row - left, right - left));
        }
    }
    let Some(last) = knots.last() else { return sums };
    add(knots.len() - 1, 0.0, samples[*last], 1.0);
    for at in 1..knots.len() {
        let factor = beside[at - 1] / diagonal[at - 1];
        diagonal[at] -= factor * beside[at - 1];
        sums[at] -= factor * sums[at - 1];
    }
    for at in (0..knots.len()).rev() {
        let next = sums.get(at + 1).map_or(0.0, |next| beside[at] * next);
        sums[at] = (sums[at] - next) / diagonal[at];
    }
    sums
}

/// What the line from a knot to the next leaves of its rows.
fn residuals(time_s: &[f64], samples: &[f64], knots: &[usize], fitted: &[f64], at: usize) -> Vec<f64> {
    let ends = (knots[at], knots[at + 1]);
    let line = |row: usize| {
        let share = share(time_s, ends, row);
        (1.0 - share) * fitted[at] + share * fitted[at + 1]
    };
    (ends.0..ends.1).map(|row| samples[row] - line(row)).collect()
}

/// The most that residuals are like one of the shapes of two levels with one, two or three changes of sign at their quarters; of
/// white noise as much as one of its values.
fn stands_out(residuals: &[f64]) -> f64 {
    let mut quarters = [0.0; 4];
    for (place, residual) in residuals.iter().enumerate() {
        quarters[4 * place / residuals.len()] += residual;
    }
    let [a, b, c, d] = quarters;
    let shapes = [a + b - c - d, a - b - c + d, a - b + c - d];
    shapes.into_iter().fold(0.0, |most: f64, shape| most.max(shape.abs())) / (residuals.len() as f64).sqrt()
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
    fn what_lines_leave_of_a_bend_has_no_mean() {
        // A hundred bends the same way, followed only roughly: what is missed adds up to nothing all the same.
        let swing = |t: f64| 1.5e3 * (std::f64::consts::TAU * t / 0.4).sin().abs();
        let Driving { recorded, smooth, .. } = smoothed(record(swing), |_| NOISE_PA);
        let (knots_s, knots) = (&smooth.time_s, smooth.pipe_pressure_pa.as_ref().unwrap());
        let rows = recorded.pipe_pressure_pa.as_ref().unwrap();
        let missed = recorded.time_s.iter().zip(rows).map(|(time_s, row)| {
            let right = knots_s.partition_point(|knot| knot <= time_s).clamp(1, knots.len() - 1);
            let share = (time_s - knots_s[right - 1]) / (knots_s[right] - knots_s[right - 1]);
            row - knots[right - 1] - share * (knots[right] - knots[right - 1])
        });
        let mean = missed.sum::<f64>() / rows.len() as f64;
        assert!(mean.abs() < 1e-6, "{mean} Pa");
    }

    #[test]
    fn a_record_of_no_row_one_or_two_at_the_same_time_is_as_it_is() {
        let of = |time_s: Vec<f64>, values: Vec<f64>| {
            let record = Prescribed { time_s, pipe_pressure_pa: Some(values), ..Prescribed::default() };
            (smoothed(record.clone(), |_| NOISE_PA).smooth.as_ref().clone(), record)
        };
        for (time_s, values) in [(vec![], vec![]), (vec![1.0], vec![2e5]), (vec![1.0, 1.0], vec![2e5, 3e5])] {
            let (smooth, record) = of(time_s, values);
            assert_eq!(smooth, record);
        }
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
