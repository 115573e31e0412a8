//! The model along a prescribed motion: pressures and forces where the piston really was.

use std::borrow::Cow;
use std::cell::Cell;

use valve_model::command::Segment;
use valve_model::equations::Equations;
use valve_model::orifice::Laminar;
use valve_model::rhs::System;
use valve_model::state::{Inputs, State};
use valve_model::terms::groups;
use valve_model::{Prepared, Valve};

use crate::crossing::Smoothed;
use crate::data::{Channel, RunData};

/// Longest step along the motion, s.
pub(super) const STEP_S: f64 = 1e-3;

/// Pressure step with which the effective mass is found, Pa.
const PROBE_PA: f64 = 1e3;

/// Least gas in a volume, kg: a rounding below nothing is none.
const LEAST_GAS_KG: f64 = 1e-9;

/// What the model says along a recorded motion, at rising times.
#[derive(Debug, Clone, Default)]
pub struct Along {
    /// Time, s.
    pub time_s: Vec<f64>,
    /// Chamber pressure, Pa: measured where it was, else simulated.
    pub chamber_pressure_pa: Vec<f64>,
    /// Force of the model but inertia and viscous friction, N, + opens.
    pub force_n: Vec<f64>,
    /// Gas in pipe and chamber together, kg.
    pub gas_kg: Vec<f64>,
    /// What the model lets flow into both together, kg/s.
    pub inflow_kg_per_s: Vec<f64>,
}

impl Along {
    /// The same at other times, rising as well: between those at hand, held beyond the ends.
    pub fn at(&self, times_s: &[f64]) -> Self {
        let mut place = Place::default();
        let mut at = Self { time_s: times_s.to_vec(), ..Self::default() };
        for time in times_s {
            place.go_to(&self.time_s, *time);
            at.chamber_pressure_pa.push(place.of(&self.chamber_pressure_pa));
            at.force_n.push(place.of(&self.force_n));
            at.gas_kg.push(place.of(&self.gas_kg));
            at.inflow_kg_per_s.push(place.of(&self.inflow_kg_per_s));
        }
        at
    }
}

/// A place between samples at rising times, for times that follow one another.
#[derive(Debug, Clone, Copy, Default)]
struct Place {
    /// The first sample that is later.
    right: usize,
    /// How far it lies from the one before, share of what is between them.
    share: f64,
}

impl Place {
    fn go_to(&mut self, times: &[f64], time_s: f64) {
        while self.right < times.len() && times[self.right] <= time_s {
            self.right += 1;
        }
        while self.right > 0 && times[self.right - 1] > time_s {
            self.right -= 1;
        }
        self.share = match (self.right.checked_sub(1), times.get(self.right)) {
            (Some(left), Some(right)) => (time_s - times[left]) / (right - times[left]),
            _ => 0.0,
        };
    }

    /// A value there, held beyond the ends; 0 without any.
    fn of(&self, values: &[f64]) -> f64 {
        match (self.right.checked_sub(1).map(|left| values[left]), values.get(self.right)) {
            (Some(left), Some(right)) => left + self.share * (right - left),
            (Some(left), None) => left,
            (None, right) => right.copied().unwrap_or(0.0),
        }
    }
}

/// A measured pressure, and where in it the motion was looked at last.
pub struct Measured<'a> {
    times_s: Cow<'a, [f64]>,
    values_pa: Cow<'a, [f64]>,
    place: Cell<Place>,
}

impl<'a> Measured<'a> {
    /// A pressure that drives the model along a run, or was recorded beside it.
    pub fn of(run: &'a RunData, channel: Channel) -> Option<Self> {
        let placed = |times_s, values_pa| Self { times_s, values_pa, place: Cell::default() };
        let drives = run.run.prescribed.as_ref().and_then(|prescribed| {
            let values = match channel {
                Channel::ChamberPressure => prescribed.chamber_pressure_pa.as_ref(),
                Channel::PipePressure => prescribed.pipe_pressure_pa.as_ref(),
                Channel::Position => None,
            };
            Some(placed(Cow::Borrowed(&prescribed.time_s[..]), Cow::Borrowed(&values?[..])))
        });
        drives.or_else(|| {
            let samples = &run.channels.iter().find(|data| data.channel == channel)?.samples;
            let valid: Vec<usize> = (0..samples.len()).filter(|index| samples[*index].is_finite()).collect();
            let times = valid.iter().map(|index| run.times_s[*index]).collect();
            Some(placed(times, valid.iter().map(|index| samples[*index]).collect()))
        })
    }

    fn at(&self, time_s: f64) -> f64 {
        let mut place = self.place.get();
        place.go_to(&self.times_s, time_s);
        self.place.set(place);
        place.of(&self.values_pa)
    }
}

/// The motion that is prescribed.
struct Motion<'a> {
    smoothed: &'a Smoothed,
}

impl Motion<'_> {
    /// Position and velocity at a time; `left` remembers where the last call was.
    fn at(&self, time_s: f64, left: &mut usize) -> (f64, f64) {
        let (times, x) = (&self.smoothed.time_s, &self.smoothed.position_m);
        let last = times.len() - 1;
        while *left + 1 < last && times[*left + 1] <= time_s {
            *left += 1;
        }
        if time_s <= times[0] || last == 0 || time_s >= times[last] {
            return (if time_s <= times[0] { x[0] } else { x[last] }, 0.0);
        }
        let slope = (x[*left + 1] - x[*left]) / (times[*left + 1] - times[*left]);
        let (from, to) = (left.saturating_sub(4), (*left + 5).min(last));
        let velocity = (x[to] - x[from]) / (times[to] - times[from]);
        (x[*left] + slope * (time_s - times[*left]), velocity)
    }
}

/// Follows the pneumatics of a valve along the smoothed motion of a run. Nothing where the run has no
/// motion to follow.
pub fn follow(valve: &Valve, run: &RunData, smoothed: &Smoothed) -> Option<Along> {
    if smoothed.time_s.len() < 10 {
        return None;
    }
    let mut equations = Equations::new(valve, &run.run.conditions, STEP_S);
    let pipe = Measured::of(run, Channel::PipePressure);
    let chamber = Measured::of(run, Channel::ChamberPressure);
    equations.terms.prescribed_pipe = pipe.is_some();
    equations.terms.prescribed_chamber = chamber.is_some();
    let control = equations.step_control(STEP_S);
    equations.coefficients.port_laminar = Laminar::new(control.port_laminar);
    equations.coefficients.line_laminar = Laminar::new(control.line_laminar.max(control.laminar));
    equations.coefficients.laminar = Laminar::new(control.laminar);
    let mut pressed = equations.clone();
    pressed.terms.prescribed_chamber = true;
    let (system, probe) = (System::new(&equations), System::new(&pressed));
    let follower = Follower { system, probe, motion: Motion { smoothed }, pipe, chamber };
    let mut state = *Prepared::new(valve, &run.run, STEP_S).initial();
    let mut along = Along::default();
    let mut left = 0;
    for segment in run.run.segments(valve) {
        let length = segment.end_s - segment.start_s;
        let steps = (length / control.step_s.min(STEP_S)).ceil().max(1.0);
        let h = length / steps;
        // A count of steps of a record; far below what a u32 holds.
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a count of steps")]
        let count = steps as u32;
        for step in 0..count {
            let time_s = segment.start_s + f64::from(step) * h;
            let here = follower.placed(&state, time_s, &mut left);
            let inputs = follower.inputs(&segment, time_s);
            let rates = follower.system.rates::<{ groups::ANY }>(&here, &inputs);
            follower.note(&here, &inputs, &rates, time_s, &mut along);
            state = follower.step(&state, &rates, &segment, time_s, h, left);
        }
    }
    Some(along)
}

struct Follower<'a> {
    system: System<'a, f64>,
    /// The same with a chamber pressure that is given.
    probe: System<'a, f64>,
    motion: Motion<'a>,
    pipe: Option<Measured<'a>>,
    chamber: Option<Measured<'a>>,
}

impl Follower<'_> {
    fn inputs(&self, segment: &Segment, time_s: f64) -> Inputs<f64> {
        let value = |channel: &Option<Measured<'_>>| channel.as_ref().map_or(0.0, |measured| measured.at(time_s));
        Inputs {
            spool: segment.spool + segment.spool_rate * (time_s - segment.start_s),
            since_command: time_s - segment.last_command_s,
            pipe_pressure: value(&self.pipe),
            chamber_pressure: value(&self.chamber),
            supply_pressure: self.system.coefficients.supply,
        }
    }

    fn placed(&self, state: &State<f64>, time_s: f64, left: &mut usize) -> State<f64> {
        let (x, v) = self.motion.at(time_s, left);
        State { x, v, ..*state }
    }

    /// One step of Heun's method for all states but the motion, which is prescribed, from the rates at its beginning.
    fn step(
        &self,
        state: &State<f64>,
        first: &State<f64>,
        segment: &Segment,
        time_s: f64,
        h: f64,
        mut left: usize,
    ) -> State<f64> {
        let guess = self.placed(&moved(state, first, h), time_s + h, &mut left);
        let second = self.system.rates::<{ groups::ANY }>(&guess, &self.inputs(segment, time_s + h));
        moved(&moved(state, first, 0.5 * h), &second, 0.5 * h)
    }

    fn note(&self, here: &State<f64>, inputs: &Inputs<f64>, rates: &State<f64>, time_s: f64, along: &mut Along) {
        let c = &self.system.coefficients;
        let (chamber_gas, pipe_gas) = self.system.gas::<{ groups::ANY }>(here, inputs);
        let (chamber, pipe) = (chamber_gas.pa, pipe_gas.pa);
        let inverse_mass =
            if self.system.terms.forces { self.effective_inverse_mass(here, inputs, chamber) } else { c.inverse_mass };
        along.time_s.push(time_s);
        along.chamber_pressure_pa.push(chamber);
        along.force_n.push(rates.v / inverse_mass + c.viscous * here.v);
        let volume = c.closed_volume - c.piston_area * here.x;
        along.gas_kg.push(chamber * volume / c.zrt + pipe / c.pipe_gain);
        along.inflow_kg_per_s.push(rates.pipe_mass + rates.chamber_mass);
    }

    /// Acceleration per force; a cushion makes the piston seem heavier to the model.
    fn effective_inverse_mass(&self, state: &State<f64>, inputs: &Inputs<f64>, chamber: f64) -> f64 {
        let at = |pressure: f64| {
            self.probe.rates::<{ groups::ANY }>(state, &Inputs { chamber_pressure: pressure, ..*inputs }).v
        };
        let difference = at(chamber) - at(chamber + PROBE_PA);
        let found = difference / (PROBE_PA * self.system.coefficients.piston_area);
        if found > 0.0 { found } else { self.system.coefficients.inverse_mass }
    }
}

/// A state some time later, its motion left to the caller.
fn moved(state: &State<f64>, rate: &State<f64>, h: f64) -> State<f64> {
    State {
        chamber_mass: (state.chamber_mass + h * rate.chamber_mass).max(LEAST_GAS_KG),
        pipe_mass: (state.pipe_mass + h * rate.pipe_mass).max(LEAST_GAS_KG),
        chamber_temperature: state.chamber_temperature + h * rate.chamber_temperature,
        pipe_temperature: state.pipe_temperature + h * rate.pipe_temperature,
        line_pressure: state.line_pressure + h * rate.line_pressure,
        bristle: state.bristle + h * rate.bristle,
        ..*state
    }
}
