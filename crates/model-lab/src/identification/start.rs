//! Where a record begins: at rest on a stop, or in the midst of a motion.

use campaign::CommandEdge;
use nalgebra::{DMatrix, DVector};
use valve_model::Parameters;

/// How a record begins.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Beginning {
    /// At rest, open and vented.
    Open,
    /// Open, closing or closed, with the command on since some time before the record.
    Filling,
    /// At rest, closed and filled.
    Closed,
    /// At rest, open, before it is vented: it came there just before the record.
    Venting {
        /// Pressure of pipe and chamber at the first row, Pa.
        pressure_pa: f64,
        /// One standard deviation of it, Pa.
        pressure_sigma_pa: f64,
    },
    /// Moving, or at rest between the stops.
    Moving {
        /// Position at the first row, m.
        position_m: f64,
        /// One standard deviation of the position, m.
        position_sigma_m: f64,
        /// Speed there, m/s.
        velocity_m_per_s: f64,
        /// One standard deviation of the speed, m/s.
        velocity_sigma_m_per_s: f64,
        /// Acceleration there, m/s²; zero where the record shows none.
        acceleration_m_per_s2: f64,
        /// One standard deviation of the acceleration, m/s².
        acceleration_sigma_m_per_s2: f64,
    },
}

impl Beginning {
    /// Whether the simulation begins with the state that the record begins with.
    pub fn is_moving(self) -> bool {
        matches!(self, Self::Moving { .. } | Self::Venting { .. })
    }

    /// The same of a record whose pressure tells that an open valve is not vented yet: it falls, and is above the atmosphere's by more
    /// than a share of the supply's gauge pressure, which sensors are not off by. A pressure that stays is that of a valve at rest, such as
    /// one that leaks from the supply.
    #[must_use]
    pub fn with_pressure(
        self,
        times_s: &[f64],
        pressure_pa: &[f64],
        noise_pa: f64,
        commands: &[CommandEdge],
        (ambient_pa, supply_pa): (f64, f64),
    ) -> Self {
        let Some(first) = commands.first().filter(|first| self == Self::Open && first.close) else { return self };
        let before: Vec<(f64, f64)> = times_s
            .iter()
            .copied()
            .zip(pressure_pa.iter().copied())
            .take_while(|(time, _)| *time < first.time_s)
            .filter(|(_, pressure)| pressure.is_finite())
            .collect();
        if before.len() < 3 {
            return self;
        }
        let all = Line::through(&before);
        let falls = all.slope < -CLEAR * all.white_sigma(&before, noise_pa);
        let rows = &before[..before.len().min(FEWEST_ROWS)];
        let line = Line::through(rows);
        let pressure_pa = line.mean_x + line.slope * (times_s[0] - line.mean_t);
        let span_pa = (supply_pa - ambient_pa).abs();
        let error = line.error(rows, noise_pa);
        let sigma =
            (error / (rows.len() as f64).sqrt()).hypot(line.white_sigma(rows, noise_pa) * (line.mean_t - times_s[0]));
        if !falls || pressure_pa - ambient_pa < (UNVENTED * span_pa).max(CLEAR * sigma) {
            return self;
        }
        Self::Venting { pressure_pa, pressure_sigma_pa: sigma.hypot(SENSOR_SHARE * span_pa) }
    }
}

/// An open valve is not vented where its pressure is higher than the atmosphere's by this share of the supply's gauge pressure.
const UNVENTED: f64 = 0.05;

/// What a pressure sensor may be off by, as a share of that.
const SENSOR_SHARE: f64 = 0.01;

/// The beginning of a record is judged over this time at least, s, and over this share of a stroke's travel.
const WINDOW: (f64, f64) = (0.03, 0.03);

/// How long the beginning of a record is looked at, s.
pub fn window_s(travel_s: f64) -> f64 {
    WINDOW.0.max(WINDOW.1 * travel_s)
}

/// Rows that a speed is taken from, at least.
const FEWEST_ROWS: usize = 25;

/// Standard deviations from which a speed is one.
const CLEAR: f64 = 5.0;

/// The least speed of a motion, in strokes a travel time: ten times what a position sensor makes of a stop that drifts by half a percent
/// of the stroke within ten travel times. (A piston that still comes to rest on a soft stop, while its chamber vents, moves at 0.015.)
const SLOWEST: f64 = 0.005;

/// So often the window in which the beginning is looked at is doubled.
const DOUBLINGS: usize = 3;

/// A piston this close to a stop is on it, as a share of the stroke.
pub(super) const ON_STOP: f64 = 0.05;

/// Reads how a record begins.
pub fn beginning(
    times_s: &[f64],
    position_m: &[f64],
    noise_m: f64,
    commands: &[CommandEdge],
    stroke_m: f64,
    travel_s: f64,
) -> Beginning {
    let window = window_s(travel_s);
    // A slow recorder has few rows before the first command, and those after it tell of that command.
    let until_s = commands.iter().map(|edge| edge.time_s).find(|time| *time > 0.0).unwrap_or(f64::INFINITY);
    let rows: Vec<(f64, f64)> = times_s
        .iter()
        .copied()
        .zip(position_m.iter().copied())
        .filter(|(time, position)| *time < until_s && position.is_finite())
        .enumerate()
        .take_while(|(index, (time, _))| *index < FEWEST_ROWS || *time <= window)
        .map(|(_, row)| row)
        .filter(|(time, _)| *time <= 10.0 * window)
        .collect();
    if rows.is_empty() {
        return Beginning::Open;
    }
    let line = Line::through(&rows);
    // Of two rows a line tells nothing: whatever the speed is, it is at most that of a stroke.
    let (velocity, sigma) = if rows.len() < 3 {
        (0.0, stroke_m / travel_s)
    } else {
        (line.slope, line.sigma(&rows, noise_m, (times_s, position_m, stroke_m)))
    };
    let to_mean_s = times_s[0] - line.mean_t;
    let position = line.mean_x + velocity * to_mean_s;
    let position_sigma = (line.error(&rows, noise_m) / (rows.len() as f64).sqrt()).hypot(sigma * to_mean_s);
    let is_clear = |slope: f64, sigma: f64| slope.abs() > (CLEAR * sigma).max(SLOWEST * stroke_m / travel_s);
    // A piston that settles slowly shows its motion only over a longer time.
    let before: Vec<(f64, f64)> = times_s
        .iter()
        .copied()
        .zip(position_m.iter().copied())
        .take_while(|(time, _)| *time < until_s)
        .filter(|(_, position)| position.is_finite())
        .collect();
    let longer = std::iter::successors(Some(2 * rows.len()), |count| Some(2 * count));
    let moves = is_clear(velocity, sigma)
        || longer.take_while(|count| *count <= before.len()).take(DOUBLINGS).any(|count| {
            let rows = &before[..count];
            let line = Line::through(rows);
            line.slope * velocity > 0.0
                && is_clear(line.slope, line.sigma(rows, noise_m, (times_s, position_m, stroke_m)))
        });
    let is_energised = commands.first().is_some_and(|edge| edge.close && edge.time_s <= 0.0);
    let opens_first = commands.first().is_some_and(|edge| !edge.close);
    // A valve whose command was on before the record is one whose past can be simulated.
    if is_energised && !(moves && velocity > 0.0) {
        return Beginning::Filling;
    }
    if !moves && position > (1.0 - ON_STOP) * stroke_m {
        return Beginning::Open;
    }
    if !moves && position < ON_STOP * stroke_m && opens_first {
        return Beginning::Closed;
    }
    let line = Motion {
        position,
        position_sigma,
        velocity,
        velocity_sigma: sigma,
        acceleration: 0.0,
        acceleration_sigma: 0.0,
    };
    let motion = Motion::at(&rows, times_s[0], noise_m).unwrap_or(line);
    // Errors of rows that hang together are not seen in how these lie about a curve.
    Beginning::Moving {
        position_m: motion.position,
        position_sigma_m: motion.position_sigma.max(position_sigma),
        velocity_m_per_s: motion.velocity,
        velocity_sigma_m_per_s: motion.velocity_sigma.max(sigma),
        acceleration_m_per_s2: motion.acceleration,
        acceleration_sigma_m_per_s2: motion.acceleration_sigma,
    }
}

/// The motion at the first of some rows: of the polynomial in time that they ask for, and how unsure the next one is. A piston that is
/// thrown back or swings on its gas changes its speed within the rows, and a line through them does not know by how much.
struct Motion {
    position: f64,
    position_sigma: f64,
    velocity: f64,
    velocity_sigma: f64,
    acceleration: f64,
    acceleration_sigma: f64,
}

/// Rows that each coefficient of such a polynomial needs, at least, and its highest power.
const ROWS_A_COEFFICIENT: usize = 4;
const HIGHEST_POWER: u8 = 5;

impl Motion {
    /// Nothing where the rows are too few for more than a line.
    fn at(rows: &[(f64, f64)], at_s: f64, noise_m: f64) -> Option<Self> {
        let has_rows = |power: &u8| rows.len() >= ROWS_A_COEFFICIENT * (usize::from(*power) + 1);
        let powers = (1..=HIGHEST_POWER).take_while(has_rows);
        let fits: Vec<Polynomial> = powers.map_while(|power| Polynomial::through(rows, at_s, noise_m, power)).collect();
        let (_, below) = fits.split_last()?;
        let more = below.windows(2).take_while(|pair| pair[1].information < pair[0].information).count();
        // The next power is not ruled out by being the less likely one.
        let (asked, next) = (below.get(more)?, &fits[more + 1]);
        // The n-th derivative, and how unsure it is by the next power.
        let value = |n: usize, factorial: f64| factorial * asked.coefficients.get(n).copied().unwrap_or(0.0);
        let sigma = |n: usize, factorial: f64| {
            (factorial * next.sigmas[n]).hypot(factorial * next.coefficients[n] - value(n, factorial))
        };
        Some(Self {
            position: value(0, 1.0),
            position_sigma: sigma(0, 1.0),
            velocity: value(1, 1.0),
            velocity_sigma: sigma(1, 1.0),
            acceleration: value(2, 2.0),
            acceleration_sigma: sigma(2, 2.0),
        })
    }
}

/// A polynomial through rows of (time, position), by least squares, in powers of the time since a moment.
struct Polynomial {
    coefficients: Vec<f64>,
    sigmas: Vec<f64>,
    /// Bayesian information criterion (Schwarz, Annals of Statistics 6(2), 1978).
    information: f64,
}

impl Polynomial {
    fn through(rows: &[(f64, f64)], at_s: f64, noise_m: f64, power: u8) -> Option<Self> {
        let terms = usize::from(power) + 1;
        // In units of the rows' span: powers of seconds differ by orders.
        let span_s = rows.iter().map(|(time, _)| (time - at_s).abs()).fold(0.0, f64::max);
        let powers = |time: f64| (0..=power).map(move |k| ((time - at_s) / span_s).powi(i32::from(k)));
        let matrix = DMatrix::from_row_iterator(rows.len(), terms, rows.iter().flat_map(|row| powers(row.0)));
        let positions = DVector::from_iterator(rows.len(), rows.iter().map(|row| row.1));
        let inverse = (matrix.transpose() * &matrix).try_inverse()?;
        let scaled = &inverse * (matrix.transpose() * &positions);
        let left = (&positions - matrix * &scaled).norm_squared();
        let count = rows.len() as f64;
        let error = (left / (count - terms as f64)).sqrt().max(noise_m);
        let per_time = (0..=power).map(|k| span_s.powi(-i32::from(k)));
        let sigma = |k: usize| error * inverse[(k, k)].max(0.0).sqrt();
        let (coefficients, sigmas) =
            per_time.enumerate().map(|(k, per_time)| (scaled[k] * per_time, sigma(k) * per_time)).unzip();
        let likely = left.max(count * noise_m * noise_m);
        Some(Self { coefficients, sigmas, information: count * likely.ln() + f64::from(power) * count.ln() })
    }
}

/// A straight line through rows of (time, position), by least squares.
struct Line {
    mean_t: f64,
    mean_x: f64,
    /// Sum of squares of the times about their mean, s2.
    spread: f64,
    slope: f64,
}

impl Line {
    fn through(rows: &[(f64, f64)]) -> Self {
        let count = rows.len() as f64;
        let (mean_t, mean_x) = rows.iter().fold((0.0, 0.0), |sum, row| (sum.0 + row.0 / count, sum.1 + row.1 / count));
        let spread: f64 = rows.iter().map(|(t, _)| (t - mean_t).powi(2)).sum::<f64>().max(1e-18);
        let slope = rows.iter().map(|(t, x)| (t - mean_t) * (x - mean_x)).sum::<f64>() / spread;
        Self { mean_t, mean_x, spread, slope }
    }

    /// One standard deviation of the slope, m/s: what independent errors of the rows make of it, and what errors that hang
    /// together make of as many rows where the piston rests.
    fn sigma(&self, rows: &[(f64, f64)], noise_m: f64, (times_s, position_m, stroke_m): (&[f64], &[f64], f64)) -> f64 {
        self.white_sigma(rows, noise_m).max(slope_of_rest(times_s, position_m, rows.len(), stroke_m))
    }

    /// One standard deviation of the slope if the rows' errors are independent, m/s.
    fn white_sigma(&self, rows: &[(f64, f64)], noise_m: f64) -> f64 {
        self.error(rows, noise_m) / self.spread.sqrt()
    }

    /// Root mean square distance of the rows from the line, at least their noise, m.
    fn error(&self, rows: &[(f64, f64)], noise_m: f64) -> f64 {
        let left: f64 = rows.iter().map(|(t, x)| (x - self.mean_x - self.slope * (t - self.mean_t)).powi(2)).sum();
        (left / (rows.len() as f64 - 2.0).max(1.0)).sqrt().max(noise_m)
    }
}

/// The slope, m/s, that as many rows show where the piston rests: errors of rows that hang together (hum, drift, a
/// coloured noise) give a resting piston a speed that independent errors would not. The median over all stretches of rest
/// of how slopes differ a few stretches on: one that creeps keeps its slope that long.
fn slope_of_rest(times_s: &[f64], position_m: &[f64], count: usize, stroke_m: f64) -> f64 {
    let rows: Vec<(f64, f64)> =
        times_s.iter().copied().zip(position_m.iter().copied()).filter(|(_, position)| position.is_finite()).collect();
    let lines: Vec<Line> = rows.chunks_exact(count).map(Line::through).collect();
    let rests = |about: &&[Line]| {
        let (low, high) = about.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), line| {
            (low.min(line.mean_x), high.max(line.mean_x))
        });
        high - low < REST_SHARE * stroke_m
    };
    let apart = |about: &[Line]| (about[REST_STRETCHES - 1].slope - about[0].slope).abs();
    let mut slopes: Vec<f64> = lines.windows(REST_STRETCHES).filter(rests).map(apart).collect();
    if slopes.len() < FEWEST_RESTS {
        return 0.0;
    }
    slopes.sort_by(f64::total_cmp);
    // The median of a normal deviate's size is 0.6745 of its standard deviation; a difference has two of them.
    slopes[slopes.len() / 2] / 0.6745 * std::f64::consts::FRAC_1_SQRT_2
}

/// A piston rests where it moves by less than this share of the stroke over so many stretches: a fifteenth of the speed of
/// a stroke, and more than instruments that are fit for their purpose add.
const REST_SHARE: f64 = 0.01;
const REST_STRETCHES: usize = 5;

/// Stretches of rest from which their slopes are judged, at least.
const FEWEST_RESTS: usize = 5;

/// How far the chamber's pressure may be from balance at the start of a record that begins in motion, Pa: a share of what
/// holds spring and weight, half the weight, and what an unknown acceleration takes.
pub fn balance_sigma_pa(parameters: &Parameters, position_m: f64, acceleration_sigma_m_per_s2: f64) -> f64 {
    let weight = parameters.moving_mass_kg * valve_model::params::STANDARD_GRAVITY_M_PER_S2;
    let spring =
        parameters.spring_stiffness_n_per_m * (parameters.stroke_m - position_m + parameters.preload_compression_m);
    let held_n = spring - parameters.orientation.closing_share() * weight;
    let inertia_n = parameters.moving_mass_kg * acceleration_sigma_m_per_s2;
    (UNSURE * held_n.abs() + 0.5 * weight).hypot(inertia_n) / parameters.piston_area_m2
}

/// How far the chamber's pressure may be off at the start, as a share of the gauge pressure that balances.
const UNSURE: f64 = 0.1;

#[cfg(test)]
mod tests {
    use super::*;

    fn record(position: impl Fn(f64) -> f64) -> (Vec<f64>, Vec<f64>) {
        let times: Vec<f64> = (0..500).map(|row| f64::from(row) * 1e-3).collect();
        // A rounded reading: 0.2 mm.
        let positions = times.iter().map(|time| (position(*time) / 2e-4).round() * 2e-4).collect();
        (times, positions)
    }

    #[test]
    fn rest_and_motion_are_told_apart_under_rounding() {
        let edge = [CommandEdge { time_s: 0.2, close: true }];
        let (times, rest) = record(|_| 0.0255);
        assert_eq!(beginning(&times, &rest, 6e-5, &edge, 0.0254, 1.0), Beginning::Open);
        let (times, fall) = record(|time| (0.014 + 0.08 * time).min(0.0254));
        match beginning(&times, &fall, 6e-5, &edge, 0.0254, 1.0) {
            Beginning::Moving { velocity_m_per_s, position_m, .. } => {
                assert!((velocity_m_per_s - 0.08).abs() < 0.01, "{velocity_m_per_s}");
                assert!((position_m - 0.014).abs() < 2e-4, "{position_m}");
            }
            other => panic!("{other:?}"),
        }
    }

    #[test]
    fn an_error_that_hangs_together_is_no_motion() {
        let edge = [CommandEdge { time_s: 0.2, close: true }];
        // A slow hum of 0.03 mm on a recorder that is quiet from row to row.
        let times: Vec<f64> = (0..2000).map(|row| f64::from(row) * 1e-3).collect();
        let rest: Vec<f64> = times.iter().map(|time| 0.0254 + 3e-5 * (14.0 * time).sin()).collect();
        assert_eq!(beginning(&times, &rest, 2e-6, &edge, 0.0254, 1.0), Beginning::Open);
        // The same sensor with a piston that arrives: 0.5 mm in the first 30 ms.
        let arrives: Vec<f64> =
            times.iter().zip(&rest).map(|(time, rest)| rest - 0.017 * (0.03 - time).max(0.0)).collect();
        assert!(beginning(&times, &arrives, 2e-6, &edge, 0.0254, 1.0).is_moving());
    }

    #[test]
    fn a_piston_that_is_thrown_back_begins_with_its_acceleration() {
        let edge = [CommandEdge { time_s: 0.2, close: true }];
        let (times, thrown) = record(|time| 0.008 + 0.08 * time - 1.2 * time * time);
        match beginning(&times, &thrown, 6e-5, &edge, 0.0254, 1.0) {
            Beginning::Moving { velocity_m_per_s, acceleration_m_per_s2, velocity_sigma_m_per_s, .. } => {
                assert!((velocity_m_per_s - 0.08).abs() < 3.0 * velocity_sigma_m_per_s, "{velocity_m_per_s}");
                assert!((acceleration_m_per_s2 + 2.4).abs() < 1.0, "{acceleration_m_per_s2}");
            }
            other => panic!("{other:?}"),
        }
    }

    #[test]
    fn a_piston_that_swings_while_it_creeps_has_a_speed_that_a_line_does_not_know() {
        let edge = [CommandEdge { time_s: 2.0, close: true }];
        let times: Vec<f64> = (0..600).map(|row| f64::from(row) * 5e-3).collect();
        for phase in 0..8 {
            let (turn, rate) = (f64::from(phase) * std::f64::consts::FRAC_PI_4, std::f64::consts::TAU / 0.19);
            // Rounded to 0.1 mm.
            let path = |time: f64| 0.05 + 0.04 * time + 6e-4 * (rate * time + turn).sin();
            let positions: Vec<f64> = times.iter().map(|time| (path(*time) / 1e-4).round() * 1e-4).collect();
            let speed = 0.04 + 6e-4 * rate * turn.cos();
            match beginning(&times, &positions, 3e-5, &edge, 0.1675, 2.8) {
                Beginning::Moving { velocity_m_per_s, velocity_sigma_m_per_s, .. } => {
                    let off = (velocity_m_per_s - speed).abs() / velocity_sigma_m_per_s;
                    assert!(off < 3.0, "{phase}: {velocity_m_per_s} +- {velocity_sigma_m_per_s} for {speed}");
                }
                other => panic!("{other:?}"),
            }
        }
    }

    #[test]
    fn a_pressure_tells_that_an_open_valve_is_not_vented_yet() {
        let close = [CommandEdge { time_s: 0.2, close: true }];
        let (times, _) = record(|_| 0.0254);
        let with = |beginning: Beginning, pressure: &dyn Fn(f64) -> f64, commands: &[CommandEdge]| {
            let pressures: Vec<f64> = times.iter().map(|time| pressure(*time)).collect();
            beginning.with_pressure(&times, &pressures, 1e3, commands, (1e5, 6e5))
        };
        let venting = |time: f64| 1e5 + 1.3e5 * (-time / 0.3).exp();
        match with(Beginning::Open, &venting, &close) {
            Beginning::Venting { pressure_pa, pressure_sigma_pa } => {
                assert!((pressure_pa - 2.3e5).abs() < pressure_sigma_pa, "{pressure_pa} +- {pressure_sigma_pa}");
            }
            other => panic!("{other:?}"),
        }
        // A sensor with a zero of its own; a leak from the supply; a valve that is opened first; one that fills.
        assert_eq!(with(Beginning::Open, &|_| 1.1e5, &close), Beginning::Open);
        assert_eq!(with(Beginning::Open, &|_| 1.6e5, &close), Beginning::Open);
        let open = [CommandEdge { time_s: 0.2, close: false }];
        assert_eq!(with(Beginning::Open, &venting, &open), Beginning::Open);
        assert_eq!(with(Beginning::Filling, &venting, &close), Beginning::Filling);
    }

    #[test]
    fn a_piston_that_settles_slowly_on_its_stop_does_not_rest_yet() {
        let close = [CommandEdge { time_s: 60.0, close: true }];
        let times: Vec<f64> = (0..4000).map(|row| f64::from(row) * 0.02).collect();
        let settles: Vec<f64> = times
            .iter()
            .enumerate()
            .map(|(row, time)| 0.0209 - 4e-4 * (-time / 6.0).exp() + 2e-6 * f64::from(u32::try_from(row % 7).unwrap()))
            .collect();
        assert!(beginning(&times, &settles, 5e-6, &close, 0.021, 21.0).is_moving());
    }

    #[test]
    fn a_piston_whose_soft_stop_gives_way_while_it_vents_moves_and_one_whose_sensor_drifts_rests() {
        let close = [CommandEdge { time_s: 0.6, close: true }];
        let times: Vec<f64> = (0..3700).map(|row| f64::from(row) * 1e-3).collect();
        let under = |path: &dyn Fn(f64) -> f64| -> Beginning {
            let noise = |row: usize| 1e-5 * f64::from(u32::try_from(row * 7 % 11).unwrap()) / 5.0;
            let positions: Vec<f64> = times.iter().enumerate().map(|(row, time)| path(*time) + noise(row)).collect();
            beginning(&times, &positions, 1e-5, &close, 0.01124, 0.4)
        };
        assert!(under(&|time| 0.0115 - 1.3e-4 * (-time / 0.25).exp()).is_moving());
        assert_eq!(under(&|time| 0.0115 + 5.6e-5 * time / 3.7), Beginning::Open);
    }

    #[test]
    fn a_piston_that_creeps_through_the_end_of_its_stroke_is_no_noise() {
        // Never at rest: it creeps at 28 mm/s and is thrown back once, through what counts as the closed stop.
        let path = |time: f64| if time < 0.1 { 0.05 + 0.028 * time } else { 0.001 + 0.028 * (time - 0.1) };
        let edge = [CommandEdge { time_s: 0.09, close: true }];
        let times: Vec<f64> = (0..1500).map(|row| f64::from(row) * 1e-3).collect();
        let positions: Vec<f64> = times.iter().map(|time| (path(*time) / 2e-4).round() * 2e-4).collect();
        match beginning(&times, &positions, 6e-5, &edge, 0.08, 0.2) {
            Beginning::Moving { velocity_m_per_s, velocity_sigma_m_per_s, .. } => {
                assert!((velocity_m_per_s - 0.028).abs() < 3.0 * velocity_sigma_m_per_s, "{velocity_m_per_s}");
                assert!(velocity_sigma_m_per_s < 0.009, "{velocity_sigma_m_per_s}");
            }
            other => panic!("{other:?}"),
        }
    }

    #[test]
    fn rows_after_the_first_command_tell_nothing_of_the_beginning() {
        // A recorder of 20 Hz.
        let times: Vec<f64> = (0..40).map(|row| f64::from(row) * 0.05).collect();
        let from = |start_m: f64, speed: f64, edge_s: f64| -> Vec<f64> {
            times.iter().map(|time| start_m + speed * (time - edge_s).max(0.0)).collect()
        };
        for edge_s in [0.05, 0.1, 0.2, 0.4] {
            let close = [CommandEdge { time_s: edge_s, close: true }];
            let closing = from(0.0254, -0.01, edge_s);
            assert_eq!(beginning(&times, &closing, 1e-5, &close, 0.0254, 2.0), Beginning::Open, "{edge_s}");
            let open = [CommandEdge { time_s: edge_s, close: false }];
            let opening = from(0.0, 0.01, edge_s);
            assert_eq!(beginning(&times, &opening, 1e-5, &open, 0.0254, 2.0), Beginning::Closed, "{edge_s}");
        }
    }

    #[test]
    fn a_command_in_the_first_row_is_seen_with_where_the_valve_stands() {
        let (times, open) = record(|_| 0.0254);
        let on = [CommandEdge { time_s: 0.0, close: true }];
        assert_eq!(beginning(&times, &open, 6e-5, &on, 0.0254, 1.0), Beginning::Filling);
        let (times, closed) = record(|_| 0.0);
        assert_eq!(beginning(&times, &closed, 6e-5, &on, 0.0254, 1.0), Beginning::Filling);
        let off = [CommandEdge { time_s: 0.1, close: false }];
        assert_eq!(beginning(&times, &closed, 6e-5, &off, 0.0254, 1.0), Beginning::Closed);
    }
}
