//! The force and the flow that the model lacks, read from the recorded motion.
//!
//! A picture, not a judge: where the pressures are simulated, an error of the flow shows as a force. The
//! judge is the forward simulation. Windows lie away from the stops, because what the stops do within
//! some 20 ms is not in the record.

mod along;
mod bins;
mod signature;
mod weak;

use rayon::prelude::*;
use valve_file::Tolerance;
use valve_model::equations::Equations;
use valve_model::{Conditions, Valve};

pub use bins::{Axis, Bin, Profile};
pub use signature::Signature;
pub use weak::{Missing, WINDOW_S};

use self::along::Measured;
use self::weak::{Mechanics, Span, Windows};
use crate::crossing::{Direction, Smoothed};
use crate::data::{Channel, Dataset, RunData};

/// Time between a stop and the first window, s; its middle is half a window further.
const AWAY_S: f64 = 5e-3;

/// Standard deviations of the position's noise, and share of the stroke, by which a piston away from a stop differs from it.
const MARGIN_SIGMAS: f64 = 5.0;
const MARGIN_SHARE: f64 = 0.005;

/// Bins of closing and opening are at the same place up to this, m, and this share of the position.
const SAME_PLACE_M: f64 = 1e-3;
const SAME_PLACE_SHARE: f64 = 0.02;

/// Missing force and flow of a campaign.
#[derive(Debug, Clone)]
pub struct ResidualForce {
    /// Every window of every stroke.
    pub windows: Vec<Missing>,
    /// Means along each axis, closing and opening.
    pub profiles: Vec<Profile>,
    /// Pressure against travel at the most usual conditions.
    pub signature: Option<Signature>,
    /// Whether the chamber pressure was measured in every run.
    pub pressure_is_measured: bool,
}

/// Missing force at one place of the stroke, taken apart by how it acts.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ForceAt {
    /// Position, m.
    pub position_m: f64,
    /// The part that opposes the motion both ways, N: missing friction.
    pub friction_n: f64,
    /// The part that acts alike both ways, N, + opens.
    pub push_n: f64,
    /// Standard error of either, N.
    pub standard_error_n: f64,
}

impl ResidualForce {
    /// The force and flow that a valve lacks on a dataset; nothing without traces. `tolerances` widen
    /// the band by what the parameters may be off.
    pub fn new(data: &Dataset, valve: &Valve, tolerances: &[Tolerance]) -> Option<Self> {
        let mut valves = vec![valve.clone()];
        valves.extend(tolerances.iter().filter_map(|tolerance| {
            let mut parameters = valve.parameters().clone();
            parameters.set(tolerance.parameter, parameters.get(tolerance.parameter) * (1.0 + tolerance.relative_sigma));
            Valve::new(parameters, valve.switches(), valve.effects().to_vec(), valve.custom().to_vec()).ok()
        }));
        let smoothed: Vec<Option<(Smoothed, Windows)>> =
            data.runs.iter().enumerate().map(|(index, run)| spans(index, run, valve.parameters().stroke_m)).collect();
        let all: Vec<Vec<Missing>> = valves
            .par_iter()
            .map(|valve| {
                let runs = data.runs.iter().zip(&smoothed);
                runs.filter_map(|(run, smoothed)| of_run(run, smoothed.as_ref()?, valve)).flatten().collect()
            })
            .collect();
        let (first, shifted) = all.split_first()?;
        if first.is_empty() || shifted.iter().any(|moved| moved.len() != first.len()) {
            return None;
        }
        let stroke_m = valve.parameters().stroke_m;
        let profiles = Axis::ALL
            .into_iter()
            .flat_map(|axis| Direction::ALL.map(|direction| bins::profile(first, shifted, axis, direction, stroke_m)))
            .collect();
        let pressure_is_measured = data.runs.iter().all(|run| Measured::of(run, Channel::ChamberPressure).is_some());
        Some(Self {
            signature: usual_signature(data, valve, first, pressure_is_measured),
            windows: first.clone(),
            profiles,
            pressure_is_measured,
        })
    }

    /// The profile of a direction along an axis.
    pub fn profile(&self, axis: Axis, direction: Direction) -> &[Bin] {
        self.profiles
            .iter()
            .find(|profile| profile.axis == axis && profile.direction == direction)
            .map_or(&[], |profile| &profile.bins)
    }

    /// Missing friction and missing push along the stroke, where both directions have a bin.
    pub fn along_stroke(&self) -> Vec<ForceAt> {
        let closing = self.profile(Axis::Position, Direction::Closing);
        let opening = self.profile(Axis::Position, Direction::Opening);
        closing
            .iter()
            .filter_map(|closing| {
                let near = |bin: &&Bin| (bin.at - closing.at).abs();
                let opening = opening.iter().min_by(|a, b| near(a).total_cmp(&near(b)))?;
                (near(&opening) < SAME_PLACE_M + SAME_PLACE_SHARE * closing.at).then(|| ForceAt {
                    position_m: 0.5 * (closing.at + opening.at),
                    friction_n: 0.5 * (closing.force_n - opening.force_n),
                    push_n: 0.5 * (closing.force_n + opening.force_n),
                    standard_error_n: 0.5 * closing.standard_error_n.hypot(opening.standard_error_n),
                })
            })
            .collect()
    }
}

/// How far a piston must be from a stop to be away from it, m.
fn margin_m(noise_m: f64, stroke_m: f64) -> f64 {
    (MARGIN_SIGMAS * noise_m).max(MARGIN_SHARE * stroke_m)
}

/// The smoothed motion of a run and the windows of its strokes away from the stops.
fn spans(index: usize, run: &RunData, stroke_m: f64) -> Option<(Smoothed, Windows)> {
    let position = run.channels.iter().find(|channel| channel.channel == Channel::Position)?;
    let smoothed = Smoothed::new(&run.times_s, &position.samples, &position.samples);
    let margin = margin_m(position.noise, stroke_m);
    let mut found = Vec::new();
    for (number, command) in run.run.commands.iter().enumerate() {
        let until = run.run.commands.get(number + 1).map_or(run.run.end_s, |next| next.time_s);
        let direction = Direction::of(command.closes());
        let (leave, arrive) = if command.closes() { (stroke_m - margin, margin) } else { (margin, stroke_m - margin) };
        let cross = |level: f64| smoothed.crossing(command.time_s, until, level, command.closes());
        // A stroke that begins between the stops has no stop to leave.
        let Some(left) = cross(leave) else { continue };
        let arrived = cross(arrive).map_or(until, |crossing| crossing.time_s);
        found.push(Span {
            run: index,
            direction,
            command_s: command.time_s,
            from_s: left.time_s + AWAY_S,
            to_s: arrived - AWAY_S,
        });
    }
    let windows = Windows::new(&found, &run.times_s, &position.samples);
    Some((smoothed, windows))
}

/// A recorded motion away from the stops, whichever way it goes, for a model to be held against.
#[derive(Debug, Clone)]
pub struct Free {
    run: RunData,
    motion: (Smoothed, Windows),
}

impl Free {
    /// Of a run; nothing where the piston is never away from the stops for long.
    pub fn new(run: RunData, stroke_m: f64) -> Option<Self> {
        let position = run.channels.iter().find(|channel| channel.channel == Channel::Position)?;
        let smoothed = Smoothed::new(&run.times_s, &position.samples, &position.samples);
        let margin = margin_m(position.noise, stroke_m);
        let is_free = |x: &f64| *x > margin && *x < stroke_m - margin;
        let mut spans: Vec<Span> = Vec::new();
        let mut was_free = false;
        for (time, x) in smoothed.time_s.iter().zip(&smoothed.position_m) {
            let free = is_free(x);
            match spans.last_mut() {
                Some(span) if free && was_free => span.to_s = time - AWAY_S,
                _ if free => spans.push(Span {
                    run: 0,
                    direction: Direction::Closing,
                    command_s: 0.0,
                    from_s: time + AWAY_S,
                    to_s: *time,
                }),
                _ => {}
            }
            was_free = free;
        }
        spans.retain(|span| span.to_s >= span.from_s + WINDOW_S);
        if spans.is_empty() {
            return None;
        }
        let windows = Windows::new(&spans, &run.times_s, &position.samples);
        Some(Self { run, motion: (smoothed, windows) })
    }

    /// The force that a valve lacks in each window; nothing where the run cannot be followed. Which windows there are is up
    /// to the run alone.
    pub fn missing(&self, valve: &Valve) -> Option<Vec<Missing>> {
        of_run(&self.run, &self.motion, valve).filter(|missing| !missing.is_empty())
    }

    /// How long it is, s.
    pub fn duration_s(&self) -> f64 {
        self.run.run.end_s
    }
}

fn of_run(run: &RunData, (smoothed, windows): &(Smoothed, Windows), valve: &Valve) -> Option<Vec<Missing>> {
    let along = along::follow(valve, run, smoothed)?;
    let position = run.channels.iter().find(|channel| channel.channel == Channel::Position)?;
    Some(windows.missing(&along, &mechanics(run, valve, position.noise)))
}

fn mechanics(run: &RunData, valve: &Valve, noise_m: f64) -> Mechanics {
    let c = Equations::new(valve, &run.run.conditions, along::STEP_S).coefficients;
    let measured = |channel| Measured::of(run, channel).is_some();
    let noise =
        run.channels.iter().find(|data| data.channel == Channel::ChamberPressure).map_or(0.0, |data| data.noise);
    Mechanics {
        mass_kg: valve.parameters().moving_mass_kg,
        viscous: c.viscous,
        area_m2: c.piston_area,
        stiffness: c.stiffness,
        closed_volume_m3: c.closed_volume,
        zrt: c.zrt,
        noise_m,
        pressure_noise_pa: measured(Channel::ChamberPressure).then_some(noise),
        gas_is_measured: measured(Channel::ChamberPressure) && measured(Channel::PipePressure),
    }
}

/// The signature of the runs without leaks at the supply pressure in the middle.
fn usual_signature(data: &Dataset, valve: &Valve, windows: &[Missing], is_measured: bool) -> Option<Signature> {
    let leaks = |conditions: &Conditions| conditions.leak_to_atmosphere_m2 + conditions.leak_from_supply_m2;
    let mut supplies: Vec<f64> = data
        .runs
        .iter()
        .filter(|run| leaks(&run.run.conditions) == 0.0)
        .map(|run| run.run.conditions.supply_pressure_pa)
        .collect();
    supplies.sort_by(f64::total_cmp);
    let middle = *supplies.get(supplies.len() / 2)?;
    let usual = |run: &RunData| leaks(&run.run.conditions) == 0.0 && run.run.conditions.supply_pressure_pa == middle;
    let chosen: Vec<Missing> = windows.iter().filter(|window| usual(&data.runs[window.run])).copied().collect();
    let run = data.runs.iter().find(|run| usual(run))?;
    let with = mechanics(run, valve, 0.0);
    let parameters = valve.parameters();
    signature::signature(&chosen, &with, (parameters.stroke_m, parameters.ambient_pressure_pa), is_measured)
}
