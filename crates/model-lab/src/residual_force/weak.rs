//! Force and flow that the model lacks, averaged over short windows in weak form.
//!
//! With a bump phi that vanishes with its slope at both ends, the integrals of phi m v' and of phi r v
//! are integrals of m phi'' x and of -r phi' x: the recorded position is weighted, never differentiated
//! (the weak form of Messenger and Bortz, Multiscale Modeling and Simulation 19(3), 2021). What noise
//! does to such a weighted sum is known exactly, so its band is honest.

use core::f64::consts::PI;

use super::along::{Along, between};
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

/// The windows of one stroke, a quarter of their length apart.
pub fn windows(span: &Span, (times, samples): (&[f64], &[f64]), along: &Along, with: &Mechanics) -> Vec<Missing> {
    let mut found = Vec::new();
    let mut start = span.from_s;
    while start + WINDOW_S <= span.to_s {
        found.extend(window(span, start, (times, samples), along, with));
        start += APART * WINDOW_S;
    }
    if !with.gas_is_measured {
        flows(&mut found, with);
    }
    found
}

fn window(
    span: &Span,
    start: f64,
    (times, samples): (&[f64], &[f64]),
    along: &Along,
    with: &Mechanics,
) -> Option<Missing> {
    let from = times.partition_point(|time| *time < start);
    let to = times.partition_point(|time| *time <= start + WINDOW_S);
    let readings: Vec<(f64, f64)> =
        (from..to).filter(|index| samples[*index].is_finite()).map(|index| (times[index], samples[index])).collect();
    let count = readings.len();
    if count < FEWEST || readings.windows(2).any(|pair| pair[1].0 - pair[0].0 > LARGEST_GAP * WINDOW_S) {
        return None;
    }
    // The straight part of the motion is known exactly under the integral; the bump weighs the rest.
    let centre = start + 0.5 * WINDOW_S;
    let mean_t = readings.iter().map(|(time, _)| time - centre).sum::<f64>() / count as f64;
    let mean_x = readings.iter().map(|(_, x)| x).sum::<f64>() / count as f64;
    let spread: f64 = readings.iter().map(|(time, _)| (time - centre - mean_t).powi(2)).sum();
    let slope = readings.iter().map(|(time, x)| (time - centre - mean_t) * (x - mean_x)).sum::<f64>() / spread;
    let (mut norm, mut inertia, mut bend, mut model, mut noise) = (0.0, 0.0, 0.0, 0.0, 0.0);
    let (mut pressure, mut gas, mut inflow, mut squares) = (0.0, 0.0, 0.0, 0.0);
    for (index, (time, x)) in readings.iter().enumerate() {
        let before = if index > 0 { readings[index - 1].0 } else { start };
        let after = if index + 1 < count { readings[index + 1].0 } else { start + WINDOW_S };
        let weight = 0.5 * (after - before);
        let angle = PI * (time - start) / WINDOW_S;
        let (phi, rate) = (angle.sin().powi(2), PI / WINDOW_S);
        let (first, second) = (rate * (2.0 * angle).sin(), 2.0 * rate * rate * (2.0 * angle).cos());
        let rest = x - mean_x - slope * (time - centre - mean_t);
        norm += weight * phi;
        inertia += weight * with.mass_kg * second * rest;
        bend -= weight * first * rest;
        model += weight * phi * between(&along.time_s, &along.force_n, *time);
        let chamber = between(&along.time_s, &along.chamber_pressure_pa, *time);
        pressure += weight * phi * chamber;
        gas -= weight * first * between(&along.time_s, &along.gas_kg, *time);
        inflow += weight * phi * between(&along.time_s, &along.inflow_kg_per_s, *time);
        noise += (weight * (with.mass_kg * second - with.viscous * first)).powi(2);
        squares += (weight * phi).powi(2);
    }
    let velocity = slope + bend / norm;
    let position = mean_x - slope * mean_t;
    let chamber = pressure / norm;
    // Noise of the position also moves spring and, where it is simulated, gas.
    let volume = with.closed_volume_m3 - with.area_m2 * position;
    let rigidity = match with.pressure_noise_pa {
        Some(_) => with.stiffness,
        None => with.stiffness + chamber * with.area_m2 * with.area_m2 / volume,
    };
    let gas_noise = with.pressure_noise_pa.unwrap_or(0.0) * with.area_m2;
    let variance = with.noise_m.powi(2) * (noise + rigidity * rigidity * squares) + gas_noise * gas_noise * squares;
    Some(Missing {
        run: span.run,
        direction: span.direction,
        since_command_s: centre - span.command_s,
        position_m: position,
        velocity_m_per_s: velocity,
        chamber_pressure_pa: chamber,
        force_n: inertia / norm + with.viscous * velocity - model / norm,
        force_error_n: variance.sqrt() / norm,
        flow_kg_per_s: with.gas_is_measured.then(|| (gas - inflow) / norm),
    })
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
