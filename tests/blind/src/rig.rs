//! The test rig: one valve, one set of conditions, stepped through time.
//!
//! Explicit midpoint steps of at most 20 microseconds, cut at the corners of the spool's travel;
//! the bristles of dry friction relax exactly within a step, so that they may be far stiffer than
//! the step. Slow and stiff valves go through [`crate::adaptive`] instead.

use crate::body;
use crate::bristle::Bristle;
use crate::hidden::{Hidden, Outside};
use crate::orifice::{Gas, Outflow};
use crate::spool::{Edge, Travel};
use crate::valve::{AMBIENT_PA, FLOW_COEFFICIENT, GAMMA, GAS_CONSTANT, PSI_PA, TEMPERATURE_K, Valve};

/// Longest step.
pub const STEP_S: f64 = 20e-6;

/// What is set for one recorded stroke.
#[derive(Debug, Clone, PartialEq)]
pub struct Conditions {
    /// Supply pressure, gauge, in psi.
    pub supply_psig: f64,
    /// Leak opened on purpose from the pipe to the atmosphere, geometric.
    pub leak_to_atmosphere_m2: f64,
    /// Leak opened on purpose from the supply into the pipe, geometric.
    pub leak_from_supply_m2: f64,
}

/// What is around a valve beyond what was set for it.
#[derive(Debug, Clone, PartialEq)]
pub struct Surroundings {
    /// Temperature of walls, supply and atmosphere.
    pub temperature_k: f64,
    /// How the supply pressure gives way.
    pub sag: Option<Sag>,
}

impl Default for Surroundings {
    fn default() -> Self {
        Self { temperature_k: TEMPERATURE_K, sag: None }
    }
}

/// A supply that sags while valves fill and recovers while they vent.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sag {
    /// Share of the gauge pressure that is lost in the end.
    pub depth: f64,
    /// Time constant of sagging and of recovering.
    pub time_s: f64,
}

/// Everything that moves or changes.
#[derive(Debug, Clone, Copy)]
pub(crate) struct State {
    pub x: f64,
    pub v: f64,
    pub bristle: f64,
    pub chamber_kg: f64,
    pub pipe_kg: f64,
    pub chamber_k: f64,
    pub pipe_k: f64,
    pub chamber_wall_k: f64,
    pub pipe_wall_k: f64,
    pub line_pa: f64,
    pub silencer_pa: f64,
    /// What the position sensor shows.
    pub seen: f64,
    /// Logarithm of the time at rest, less what sliding wore off.
    pub rest_age: f64,
}

/// Rates of change of [`State`], but for the position.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Rates {
    pub v: f64,
    pub bristle: f64,
    pub chamber_kg: f64,
    pub pipe_kg: f64,
    pub chamber_k: f64,
    pub pipe_k: f64,
    pub chamber_wall_k: f64,
    pub pipe_wall_k: f64,
    pub line_pa: f64,
    pub silencer_pa: f64,
    pub seen: f64,
    pub rest_age: f64,
}

/// A valve under test.
#[derive(Debug, Clone)]
pub(crate) struct Rig {
    pub valve: Valve,
    pub hidden: Hidden,
    around: Surroundings,
    edges: Vec<Edge>,
    pub travel: Travel,
    outflow: Outflow,
    pub bristle: Option<Bristle>,
    supply_pa: f64,
    leak_out_m2: f64,
    leak_in_m2: f64,
    step_s: f64,
    pub state: State,
    pub time_s: f64,
}

impl Rig {
    /// A valve at rest in the open, vented state at the time `start_s`, before the first edge.
    pub fn new(valve: &Valve, hidden: &Hidden, conditions: &Conditions, edges: &[Edge], start_s: f64) -> Self {
        Self::around(valve, hidden, conditions, Surroundings::default(), edges, start_s)
    }

    /// The same among given surroundings.
    pub fn around(
        valve: &Valve,
        hidden: &Hidden,
        conditions: &Conditions,
        around: Surroundings,
        edges: &[Edge],
        start_s: f64,
    ) -> Self {
        let supply_pa = conditions.supply_psig * PSI_PA + AMBIENT_PA;
        let temperature_k = around.temperature_k;
        let mut rig = Self {
            valve: valve.clone(),
            hidden: hidden.clone(),
            around,
            edges: edges.to_vec(),
            travel: Travel::new(edges, hidden.solenoid),
            outflow: Outflow::new(GAMMA, GAS_CONSTANT, hidden.critical_ratio, hidden.laws.perry_share),
            bristle: None,
            supply_pa,
            leak_out_m2: conditions.leak_to_atmosphere_m2 + hidden.leak_to_atmosphere_m2,
            leak_in_m2: conditions.leak_from_supply_m2 + hidden.leak_from_supply_m2,
            step_s: STEP_S,
            state: State {
                x: valve.stroke_m,
                v: 0.0,
                bristle: 0.0,
                chamber_kg: 0.0,
                pipe_kg: 0.0,
                chamber_k: temperature_k,
                pipe_k: temperature_k,
                chamber_wall_k: temperature_k,
                pipe_wall_k: temperature_k,
                line_pa: supply_pa,
                silencer_pa: AMBIENT_PA + hidden.back_pressure_pa,
                seen: 0.0,
                rest_age: 0.0,
            },
            time_s: start_s,
        };
        rig.bristle = rig.bristles();
        rig.settle();
        rig
    }

    /// Longest step of this rig, for studies of convergence.
    #[cfg(test)]
    fn set_step(&mut self, step_s: f64) {
        self.step_s = step_s;
    }

    /// From here on the valve, what it hides and the gauge pressure of its supply are others, as they are from
    /// one stroke to the next. The gas stays where it is.
    pub fn vary(&mut self, valve: &Valve, hidden: &Hidden, supply_psig: f64) {
        self.valve = valve.clone();
        self.hidden = hidden.clone();
        self.supply_pa = supply_psig * PSI_PA + AMBIENT_PA;
    }

    /// Absolute pressures of chamber and pipe.
    pub fn pressures_pa(&self) -> (f64, f64) {
        self.pressures(&self.state)
    }

    /// Absolute pressures of chamber and pipe in a state.
    pub fn pressures(&self, s: &State) -> (f64, f64) {
        let volume = self.valve.dead_volume_m3 + self.valve.piston_area_m2 * (self.valve.stroke_m - s.x);
        (
            s.chamber_kg * GAS_CONSTANT * s.chamber_k / volume,
            s.pipe_kg * GAS_CONSTANT * s.pipe_k / self.valve.pipe_volume_m3,
        )
    }

    /// The bristles, when there is any dry friction at all.
    fn bristles(&self) -> Option<Bristle> {
        let full = 0.6 * self.supply_pa;
        let mut largest: f64 = 0.0;
        for part in 0..=200 {
            let x = self.valve.stroke_m * f64::from(part) / 200.0;
            let grip = body::grip(&self.valve, &self.hidden, x, -1.0, full + AMBIENT_PA, 7.0);
            largest = largest.max(grip.holding_n);
        }
        let stribeck = self.hidden.dry_friction.map_or(self.hidden.seal_stribeck_m_per_s, |dry| dry.stribeck_m_per_s);
        (largest > 0.0).then(|| Bristle::new(self.hidden.bristles, largest, self.valve.mass_kg, stribeck))
    }

    /// Puts pipe and chamber where leaks and vent balance, and the piston where the forces do.
    fn settle(&mut self) {
        let outside_pa = AMBIENT_PA + self.hidden.back_pressure_pa;
        let (mut low, mut high) = (AMBIENT_PA, self.supply_pa);
        for _ in 0..200 {
            let middle = 0.5 * (low + high);
            let pipe = self.warm(middle);
            let vent = self.flow(self.valve.solenoid_area_m2 * self.hidden.vent_factor, pipe, self.warm(outside_pa));
            let out = self.flow(self.leak_out_m2, pipe, self.warm(AMBIENT_PA));
            let into = self.flow(self.leak_in_m2, self.warm(self.supply_pa), pipe);
            if into - vent - out > 0.0 {
                low = middle;
            } else {
                high = middle;
            }
        }
        let pressure = 0.5 * (low + high);
        let reach = 0.1 * self.valve.stroke_m;
        let (mut low, mut high) = (self.valve.stroke_m - reach, self.valve.stroke_m + reach);
        for _ in 0..200 {
            let middle = 0.5 * (low + high);
            if body::driving_force(&self.valve, &self.hidden, middle, 0.0, pressure) > 0.0 {
                low = middle;
            } else {
                high = middle;
            }
        }
        let gas_k = self.around.temperature_k;
        let s = &mut self.state;
        s.x = 0.5 * (low + high);
        s.seen = s.x;
        let volume = self.valve.dead_volume_m3 + self.valve.piston_area_m2 * (self.valve.stroke_m - s.x);
        s.chamber_kg = pressure * volume / (GAS_CONSTANT * gas_k);
        s.pipe_kg = pressure * self.valve.pipe_volume_m3 / (GAS_CONSTANT * gas_k);
        // The valve has stood for a minute before its first stroke.
        for effect in &self.hidden.outside {
            if let Outside::DwellFriction { onset_s, .. } = effect {
                s.rest_age = (60.0 / onset_s).ln_1p();
            }
        }
    }

    fn warm(&self, pressure_pa: f64) -> Gas {
        Gas { pressure_pa, temperature_k: self.around.temperature_k }
    }

    fn flow(&self, geometric_m2: f64, a: Gas, b: Gas) -> f64 {
        if geometric_m2 == 0.0 {
            return 0.0;
        }
        self.outflow.mass_flow(FLOW_COEFFICIENT * geometric_m2, a, b)
    }

    /// The supply before the line's resistance.
    pub fn source_pa(&self, t: f64) -> f64 {
        let mut pressure = self.supply_pa;
        if let Some(Sag { depth, time_s }) = self.around.sag {
            // How far it sagged: towards 1 after each edge that fills, towards 0 after each that vents.
            let (mut sagged, mut goal, mut from) = (0.0, 0.0, f64::NEG_INFINITY);
            for edge in self.edges.iter().take_while(|edge| edge.at_s <= t) {
                sagged = goal + (sagged - goal) * (-(edge.at_s - from) / time_s).exp();
                goal = if edge.close { 1.0 } else { 0.0 };
                from = edge.at_s;
            }
            sagged = goal + (sagged - goal) * (-(t - from) / time_s).exp();
            pressure -= depth * sagged * (self.supply_pa - AMBIENT_PA);
        }
        for effect in &self.hidden.outside {
            if let Outside::SupplyRipple { amplitude_pa, frequency_hz, phase_rad } = *effect {
                pressure += amplitude_pa * (std::f64::consts::TAU * frequency_hz * t + phase_rad).sin();
            }
        }
        pressure
    }

    /// Whether the rates depend on the time itself between two corners.
    pub fn is_timed(&self) -> bool {
        let swings = |effect: &Outside| matches!(effect, Outside::SupplyRipple { .. });
        self.around.sag.is_some() || self.hidden.outside.iter().any(swings)
    }

    /// Rates of change at the time `t` with the spool at `spool`.
    pub fn rates(&self, t: f64, spool: f64, s: &State) -> Rates {
        let (valve, hidden) = (&self.valve, &self.hidden);
        let around_k = self.around.temperature_k;
        let (chamber_pa, pipe_pa) = self.pressures(s);
        let chamber = Gas { pressure_pa: chamber_pa, temperature_k: s.chamber_k };
        let pipe = Gas { pressure_pa: pipe_pa, temperature_k: s.pipe_k };
        let source_pa = self.source_pa(t);
        let supply = self.warm(if hidden.supply_droop.is_some() { s.line_pa } else { source_pa });
        let air = self.warm(AMBIENT_PA);
        let exhaust = self.warm(if hidden.laws.silencer.is_some() {
            s.silencer_pa
        } else {
            AMBIENT_PA + hidden.back_pressure_pa
        });

        let fill = self.flow(spool * valve.solenoid_area_m2, supply, pipe);
        let vent_m2 = (1.0 - spool) * valve.solenoid_area_m2 * hidden.vent_factor;
        let vent = self.flow(vent_m2, pipe, exhaust);
        let leak_out = self.flow(self.leak_out_m2, pipe, air);
        let leak_in = self.flow(self.leak_in_m2, supply, pipe);
        let port = self.flow(valve.port_area_m2, pipe, chamber);
        let escape =
            if hidden.outside.is_empty() { 0.0 } else { self.flow(body::chamber_leak_m2(hidden, s.x), chamber, air) };

        let mut rates =
            Rates { chamber_kg: port - escape, pipe_kg: fill + leak_in - vent - leak_out - port, ..Rates::default() };
        let mut force = body::driving_force(valve, hidden, s.x, s.v, chamber_pa);
        if let Some(bristle) = &self.bristle {
            let lean = s.bristle + 1e-5 * s.v;
            let grip = body::grip(valve, hidden, s.x, lean, chamber_pa, s.rest_age);
            force += bristle.force(grip, s.bristle, s.v);
            rates.bristle = bristle.rate(grip, s.bristle, s.v);
        }
        rates.v = force / valve.mass_kg;
        if let Some(conductance) = hidden.wall_conductance_w_per_k {
            // Enthalpy that comes in, per c_p: flow times the temperature of where it comes from.
            let carried = |flow: f64, from: f64, to: f64| flow * if flow >= 0.0 { from } else { to };
            let through_port = carried(port, s.pipe_k, s.chamber_k);
            let pipe_in = carried(fill, around_k, s.pipe_k) + carried(leak_in, around_k, s.pipe_k)
                - carried(vent, s.pipe_k, around_k)
                - carried(leak_out, s.pipe_k, around_k)
                - through_port;
            let chamber_in = through_port - carried(escape, s.chamber_k, around_k);
            let (cv, cp) = (GAS_CONSTANT / (GAMMA - 1.0), GAS_CONSTANT * GAMMA / (GAMMA - 1.0));
            let work = chamber_pa * -valve.piston_area_m2 * s.v;
            rates.chamber_k = (cp * chamber_in - work - rates.chamber_kg * cv * s.chamber_k
                + conductance * (s.chamber_wall_k - s.chamber_k))
                / (s.chamber_kg * cv);
            rates.pipe_k = (cp * pipe_in - rates.pipe_kg * cv * s.pipe_k + conductance * (s.pipe_wall_k - s.pipe_k))
                / (s.pipe_kg * cv);
            if let Some(time_s) = hidden.laws.wall_time_s {
                rates.chamber_wall_k = (s.chamber_k - s.chamber_wall_k) / time_s;
                rates.pipe_wall_k = (s.pipe_k - s.pipe_wall_k) / time_s;
            }
        }
        if let Some((pores_m2, volume)) = hidden.laws.silencer {
            let out = self.flow(pores_m2, exhaust, self.warm(AMBIENT_PA + hidden.back_pressure_pa));
            rates.silencer_pa = (vent - out) * GAS_CONSTANT * around_k / volume;
        }
        if let Some((resistance, volume)) = hidden.supply_droop {
            let inflow = (source_pa - s.line_pa) / resistance;
            rates.line_pa = (inflow - fill - leak_in) * GAS_CONSTANT * around_k / volume;
        }
        if hidden.sensor_lag_s > 0.0 {
            rates.seen = (s.x - s.seen) / hidden.sensor_lag_s;
        }
        for effect in &hidden.outside {
            if let Outside::DwellFriction { onset_s, distance_m, .. } = *effect {
                rates.rest_age = (-s.rest_age).exp() / onset_s - s.v.abs() * s.rest_age / distance_m;
            }
        }
        rates
    }

    /// `s` after `h` at the given rates, with the speed `v` of the step.
    fn moved(&self, s: &State, rates: &Rates, v: f64, h: f64) -> State {
        let mut next = *s;
        next.x += h * v;
        next.v += h * rates.v;
        next.chamber_kg += h * rates.chamber_kg;
        next.pipe_kg += h * rates.pipe_kg;
        next.chamber_k += h * rates.chamber_k;
        next.pipe_k += h * rates.pipe_k;
        next.chamber_wall_k += h * rates.chamber_wall_k;
        next.pipe_wall_k += h * rates.pipe_wall_k;
        next.line_pa += h * rates.line_pa;
        next.silencer_pa += h * rates.silencer_pa;
        next.rest_age += h * rates.rest_age;
        if self.hidden.sensor_lag_s > 0.0 {
            next.seen += h * rates.seen;
        } else {
            next.seen = next.x;
        }
        next
    }

    fn relaxed(&self, at: &State, from: f64, v: f64, h: f64) -> f64 {
        self.bristle.as_ref().map_or(0.0, |bristle| {
            let (chamber_pa, _) = self.pressures(at);
            let grip = body::grip(&self.valve, &self.hidden, at.x, from + 1e-5 * v, chamber_pa, at.rest_age);
            bristle.relax(grip, from, v, h)
        })
    }

    fn step(&mut self, h: f64, spool: f64, spool_rate: f64) {
        let start = self.state;
        let first = self.rates(self.time_s, spool, &start);
        let mut middle = self.moved(&start, &first, start.v, 0.5 * h);
        middle.bristle = self.relaxed(&start, start.bristle, start.v, 0.5 * h);
        let second = self.rates(self.time_s + 0.5 * h, spool + 0.5 * h * spool_rate, &middle);
        let mut end = self.moved(&start, &second, middle.v, h);
        end.bristle = self.relaxed(&middle, start.bristle, middle.v, h);
        self.state = end;
        self.time_s += h;
    }

    /// Goes on to the time `until_s`; `each` sees the time and state after every step and stops
    /// the rig there by answering false.
    pub fn advance(&mut self, until_s: f64, mut each: impl FnMut(f64, &State) -> bool) {
        while self.time_s < until_s - 1e-12 {
            let stop = match self.travel.next_corner(self.time_s + 1e-12) {
                Some(corner) if corner < until_s => corner,
                _ => until_s,
            };
            let from = self.time_s;
            let count = ((stop - from) / self.step_s - 1e-6).ceil().max(1.0);
            let h = (stop - from) / count;
            // Seen from inside the stretch, so that jumps at its ends do not matter.
            let (near, far) = (from + 0.25 * (stop - from), from + 0.75 * (stop - from));
            let rate = (self.travel.at(far) - self.travel.at(near)) / (far - near);
            let spool_start = self.travel.at(near) - rate * (near - from);
            let mut index = 0.0;
            while index < count {
                self.step(h, spool_start + rate * h * index, rate);
                if !each(self.time_s, &self.state) {
                    return;
                }
                index += 1.0;
            }
            self.time_s = stop;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::hidden::{Bristles, DryFriction, Laws, Spool};

    /// First time at or below the closed stop and the place a second after the vent opens.
    fn stroke(hidden: &Hidden, step_s: f64) -> (f64, f64) {
        let valve = Valve::testbed();
        let edges = [Edge { at_s: 0.0, close: true }, Edge { at_s: 3.0, close: false }];
        let set = Conditions { supply_psig: 75.0, leak_to_atmosphere_m2: 0.0, leak_from_supply_m2: 0.0 };
        let mut rig = Rig::new(&valve, hidden, &set, &edges, 0.0);
        rig.set_step(step_s);
        let (mut closed, mut before) = (f64::NAN, (0.0, rig.state.x));
        rig.advance(4.2, |t, s| {
            if closed.is_nan() && s.x <= 0.0 {
                closed = before.0 + (t - before.0) * before.1 / (before.1 - s.x);
            }
            before = (t, s.x);
            true
        });
        (closed, rig.state.x)
    }

    #[test]
    fn half_the_step_changes_no_timing_by_a_twentieth_of_a_millisecond() {
        for bristles in [Bristles::Compliant, Bristles::Stiff] {
            let hidden = Hidden {
                bristles,
                dry_friction: Some(DryFriction { coulomb_n: 50.0, static_n: 50.0, stribeck_m_per_s: 0.01 }),
                wall_conductance_w_per_k: Some(0.2),
                supply_droop: Some((5e7, 20e-6)),
                solenoid: Spool { energise_s: 0.0213, release_s: 0.017_77, travel_s: 0.033_33 },
                closing_cushion: (4000.0, 5e-3),
                ..Hidden::default()
            };
            let (coarse, fine) = (stroke(&hidden, STEP_S), stroke(&hidden, 0.5 * STEP_S));
            assert!((coarse.0 - fine.0).abs() < 5e-5, "{bristles:?}: {coarse:?} {fine:?}");
            assert!((coarse.1 - fine.1).abs() < 5e-6, "{bristles:?}: {coarse:?} {fine:?}");
        }
    }

    #[test]
    fn gas_that_exchanges_heat_at_once_keeps_the_temperature_of_the_wall() {
        let plain = stroke(&Hidden::default(), STEP_S);
        let quick = Hidden { wall_conductance_w_per_k: Some(200.0), ..Hidden::default() };
        let adiabatic = Hidden { wall_conductance_w_per_k: Some(0.0), ..Hidden::default() };
        assert!((stroke(&quick, STEP_S).0 - plain.0).abs() < 1e-3);
        // Walls that warm with what they take up are heavier the more they take up.
        let warming = Laws { wall_time_s: Some(20.0), ..Laws::default() };
        let warming =
            |exchange| Hidden { wall_conductance_w_per_k: Some(exchange), laws: warming, ..Hidden::default() };
        assert!((stroke(&warming(200.0), STEP_S).0 - plain.0).abs() < 1e-3);
        assert!((stroke(&adiabatic, STEP_S).0 - plain.0).abs() > 5e-2);
    }
}
