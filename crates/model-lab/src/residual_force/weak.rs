//! Force and flow that the model lacks, averaged over short windows in weak form.
//!
//! With a bump phi that vanishes with its slope at both ends, the integrals of phi m v' and of phi r v
//! are integrals of m phi'' x and of -r phi' x: the recorded position is weighted, never differentiated
//! (the weak form of Messenger and Bortz, Multiscale Modeling and Simulation 19(3), 2021). What noise
//! does to such a weighted sum is known exactly, so its band is honest.

use core::f64::consts::PI;

use super::along::Along;
use crate::crossing::Direction;

/// Length of a window, s.
pub const WINDOW_S: f64 = 40e-3;

/// Windows begin this share of their length apart: they overlap, as the bumps that weigh them are small at both ends.
const APART: f64 = 0.25;

/// Longest gap between readings, share of a window.
const LARGEST_GAP: f64 = 0.15;

/// Fewest readings in a window.
const FEWEST: usize = 10;

/// The numbers of a valve that the windows need.
#[derive(Debug, Clone, Copy)]
pub struct Mechanics {
    /// Moving mass, kg.
    pub mass_kg: f64,
    /// Viscous friction, N s/m.
    pub viscous: f64,
    /// Piston area, m².
    pub area_m2: f64,
    /// Spring stiffness, N/m.
    pub stiffness: f64,
    /// Chamber volume at x = 0, m³.
    pub closed_volume_m3: f64,
    /// Z R T, J/kg.
    pub zrt: f64,
    /// Noise of the position, m.
    pub noise_m: f64,
    /// Noise of a measured chamber pressure, Pa, if it is measured.
    pub pressure_noise_pa: Option<f64>,
    /// Whether both pressures are measured, so that gas can be counted.
    pub gas_is_measured: bool,
}

/// What is missing in one window.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Missing {
    /// Index of the run.
    pub run: usize,
    /// Which way the stroke goes.
    pub direction: Direction,
    /// Time since the command, s.
    pub since_command_s: f64,
    /// Position, m.
    pub position_m: f64,
    /// Velocity, m/s.
    pub velocity_m_per_s: f64,
    /// Chamber pressure, Pa.
    pub chamber_pressure_pa: f64,
    /// Force that the model lacks, N, + opens.
    pub force_n: f64,
    /// One standard deviation of it from the sensors' noise, N.
    pub force_error_n: f64,
    /// Flow into pipe and chamber that the model lacks, kg/s, + fills; not at the ends of a stroke.
    pub flow_kg_per_s: Option<f64>,
}

/// A stroke away from its stops.
#[derive(Debug, Clone, Copy)]
pub struct Span {
    /// Index of the run.
    pub run: usize,
    /// Which way it goes.
    pub direction: Direction,
    /// Its command, s.
    pub command_s: f64,
    /// From when windows may begin, s.
    pub from_s: f64,
    /// By when they end, s.
    pub to_s: f64,
}

/// Recorded positions in one window, weighed by its bump: all that does not depend on a valve.
#[derive(Debug, Clone)]
struct Window {
    span: Span,
    /// Its middle, s.
    centre_s: f64,
    /// The first of its readings.
    first: usize,
    /// How much each reading counts, s: by the bump, and by its slope, 1.
    weights: Vec<(f64, f64)>,
    /// The integral of the bump, s.
    norm_s: f64,
    /// The integral of its second derivative with the position, m/s.
    inertia_m_per_s: f64,
    position_m: f64,
    velocity_m_per_s: f64,
    /// Sums of squares of the weights, and of those by the bump's derivatives: second, second with first, first.
    squares: f64,
    bent: [f64; 3],
}

/// Windows of the strokes of a run, a quarter of their length apart, and the readings in them.
#[derive(Debug, Clone, Default)]
pub struct Windows {
    /// Times of the readings, s.
    times_s: Vec<f64>,
    /// The windows, stroke by stroke.
    strokes: Vec<Vec<Window>>,
}

impl Windows {
    /// Of some strokes of a recorded position.
    pub fn new(spans: &[Span], times_s: &[f64], samples: &[f64]) -> Self {
        let readings: Vec<(f64, f64)> =
            times_s.iter().copied().zip(samples.iter().copied()).filter(|(_, sample)| sample.is_finite()).collect();
        let of_span = |span: &Span| {
            let starts = std::iter::successors(Some(span.from_s), |start| Some(start + APART * WINDOW_S));
            let starts = starts.take_while(|start| start + WINDOW_S <= span.to_s);
            starts.filter_map(|start| Window::new(span, start, &readings)).collect()
        };
        let strokes = spans.iter().map(of_span).collect();
        Self { times_s: readings.iter().map(|(time, _)| *time).collect(), strokes }
    }

    /// What is missing in each of them, by what a model says along the recorded motion.
    pub fn missing(&self, along: &Along, with: &Mechanics) -> Vec<Missing> {
        let said = along.at(&self.times_s);
        let of_stroke = |stroke: &Vec<Window>| {
            let mut found: Vec<Missing> = stroke.iter().map(|window| window.missing(&said, with)).collect();
            if !with.gas_is_measured {
                flows(&mut found, with);
            }
            found
        };
        self.strokes.iter().flat_map(of_stroke).collect()
    }
}

impl Window {
    /// A window that begins at a time; nothing where it has too few readings.
    fn new(span: &Span, start: f64, readings: &[(f64, f64)]) -> Option<Self> {
        let from = readings.partition_point(|(time, _)| *time < start);
        let to = readings.partition_point(|(time, _)| *time <= start + WINDOW_S);
        let readings = &readings[from..to];
        let count = readings.len();
        if count < FEWEST || readings.windows(2).any(|pair| pair[1].0 - pair[0].0 > LARGEST_GAP * WINDOW_S) {
            return None;
        }
        // The straight part of the motion is known exactly under the integral; the bump weighs the rest.
        let centre_s = start + 0.5 * WINDOW_S;
        let mean_t = readings.iter().map(|(time, _)| time - centre_s).sum::<f64>() / count as f64;
        let mean_x = readings.iter().map(|(_, x)| x).sum::<f64>() / count as f64;
        let spread: f64 = readings.iter().map(|(time, _)| (time - centre_s - mean_t).powi(2)).sum();
        let slope = readings.iter().map(|(time, x)| (time - centre_s - mean_t) * (x - mean_x)).sum::<f64>() / spread;
        let mut weights = Vec::with_capacity(count);
        let (mut norm_s, mut inertia_m_per_s, mut bend, mut squares, mut bent) = (0.0, 0.0, 0.0, 0.0, [0.0; 3]);
        for (index, (time, x)) in readings.iter().enumerate() {
            let before = if index > 0 { readings[index - 1].0 } else { start };
            let after = if index + 1 < count { readings[index + 1].0 } else { start + WINDOW_S };
            let weight = 0.5 * (after - before);
            let angle = PI * (time - start) / WINDOW_S;
            let (phi, rate) = (angle.sin().powi(2), PI / WINDOW_S);
            let (sine, cosine) = (2.0 * angle).sin_cos();
            let (first, second) = (weight * rate * sine, weight * 2.0 * rate * rate * cosine);
            let rest = x - mean_x - slope * (time - centre_s - mean_t);
            norm_s += weight * phi;
            inertia_m_per_s += second * rest;
            bend -= first * rest;
            squares += (weight * phi).powi(2);
            bent[0] += second * second;
            bent[1] += second * first;
            bent[2] += first * first;
            weights.push((weight * phi, first));
        }
        Some(Self {
            span: *span,
            centre_s,
            first: from,
            weights,
            norm_s,
            inertia_m_per_s,
            position_m: mean_x - slope * mean_t,
            velocity_m_per_s: slope + bend / norm_s,
            squares,
            bent,
        })
    }

    /// What is missing in it, by what a model says at the readings.
    fn missing(&self, said: &Along, with: &Mechanics) -> Missing {
        let (mut model, mut pressure, mut gas, mut inflow) = (0.0, 0.0, 0.0, 0.0);
        for (at, (weight, first)) in (self.first..).zip(&self.weights) {
            model += weight * said.force_n[at];
            pressure += weight * said.chamber_pressure_pa[at];
            gas -= first * said.gas_kg[at];
            inflow += weight * said.inflow_kg_per_s[at];
        }
        let chamber = pressure / self.norm_s;
        // Noise of the position also moves spring and, where it is simulated, gas.
        let volume = with.closed_volume_m3 - with.area_m2 * self.position_m;
        let rigidity = match with.pressure_noise_pa {
            Some(_) => with.stiffness,
            None => with.stiffness + chamber * with.area_m2 * with.area_m2 / volume,
        };
        let gas_noise = with.pressure_noise_pa.unwrap_or(0.0) * with.area_m2;
        let (mass, viscous) = (with.mass_kg, with.viscous);
        let moved = mass * mass * self.bent[0] - 2.0 * mass * viscous * self.bent[1] + viscous * viscous * self.bent[2];
        let variance =
            with.noise_m.powi(2) * (moved + rigidity * rigidity * self.squares) + gas_noise * gas_noise * self.squares;
        let inertia = mass * self.inertia_m_per_s;
        Missing {
            run: self.span.run,
            direction: self.span.direction,
            since_command_s: self.centre_s - self.span.command_s,
            position_m: self.position_m,
            velocity_m_per_s: self.velocity_m_per_s,
            chamber_pressure_pa: chamber,
            force_n: inertia / self.norm_s + viscous * self.velocity_m_per_s - model / self.norm_s,
            force_error_n: variance.sqrt() / self.norm_s,
            flow_kg_per_s: with.gas_is_measured.then(|| (gas - inflow) / self.norm_s),
        }
    }
}

/// Where pressures are not measured, the missing force read as gas: the flow that would bring it.
fn flows(windows: &mut [Missing], with: &Mechanics) {
    let mass: Vec<f64> = windows
        .iter()
        .map(|one| {
            let volume = with.closed_volume_m3 - with.area_m2 * one.position_m;
            -one.force_n / with.area_m2 * volume / with.zrt
        })
        .collect();
    // Neighbours that share no reading.
    for index in 4..windows.len().saturating_sub(4) {
        let gap = windows[index + 4].since_command_s - windows[index - 4].since_command_s;
        if (gap - 2.0 * WINDOW_S).abs() < 1e-6 {
            windows[index].flow_kg_per_s = Some((mass[index + 4] - mass[index - 4]) / gap);
        }
    }
}
