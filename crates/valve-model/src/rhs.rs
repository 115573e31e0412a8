//! The equations of motion: base model and catalogue, one source for scalars and lanes.
//!
//! Kulkarni et al. 2014, section 3, with its slips put right: the spring force is k (L - x + x0),
//! filling closes the valve, and the choked test of a flow that runs back uses the inverted ratio.

use crate::coefficients::{Coefficients, Equations, LEAST_FRICTION_N, Terms, groups};
use crate::custom::{CustomEffect, CustomTarget, Variables};
use crate::orifice::{Blend, Pressure};
use crate::real::Real;

/// The state of a valve.
#[derive(Debug, Clone, Copy)]
pub struct State<R> {
    /// Position x, m: 0 closed, L open.
    pub x: R,
    /// Velocity, m/s.
    pub v: R,
    /// Gas in the chamber, kg.
    pub chamber_mass: R,
    /// Gas in the pipe, kg.
    pub pipe_mass: R,
    /// Gas temperature in the chamber, K.
    pub chamber_temperature: R,
    /// Gas temperature in the pipe, K.
    pub pipe_temperature: R,
    /// Pressure of the supply line, Pa.
    pub line_pressure: R,
    /// Deflection of the friction bristles, m.
    pub bristle: R,
}

impl State<f64> {
    /// All zero: a rate of change before any is known.
    pub(crate) const ZERO: Self = State {
        x: 0.0,
        v: 0.0,
        chamber_mass: 0.0,
        pipe_mass: 0.0,
        chamber_temperature: 0.0,
        pipe_temperature: 0.0,
        line_pressure: 0.0,
        bristle: 0.0,
    };
}

impl<R: Real> State<R> {
    /// The same state in every lane.
    pub fn splat(from: &State<f64>) -> Self {
        State {
            x: R::splat(from.x),
            v: R::splat(from.v),
            chamber_mass: R::splat(from.chamber_mass),
            pipe_mass: R::splat(from.pipe_mass),
            chamber_temperature: R::splat(from.chamber_temperature),
            pipe_temperature: R::splat(from.pipe_temperature),
            line_pressure: R::splat(from.line_pressure),
            bristle: R::splat(from.bristle),
        }
    }

    /// Puts a state into a lane.
    pub fn set_lane(&mut self, lane: usize, from: &State<f64>) {
        self.x.set_lane(lane, from.x);
        self.v.set_lane(lane, from.v);
        self.chamber_mass.set_lane(lane, from.chamber_mass);
        self.pipe_mass.set_lane(lane, from.pipe_mass);
        self.chamber_temperature.set_lane(lane, from.chamber_temperature);
        self.pipe_temperature.set_lane(lane, from.pipe_temperature);
        self.line_pressure.set_lane(lane, from.line_pressure);
        self.bristle.set_lane(lane, from.bristle);
    }

    /// The state in a lane.
    pub fn lane(&self, lane: usize) -> State<f64> {
        State {
            x: self.x.lane(lane),
            v: self.v.lane(lane),
            chamber_mass: self.chamber_mass.lane(lane),
            pipe_mass: self.pipe_mass.lane(lane),
            chamber_temperature: self.chamber_temperature.lane(lane),
            pipe_temperature: self.pipe_temperature.lane(lane),
            line_pressure: self.line_pressure.lane(lane),
            bristle: self.bristle.lane(lane),
        }
    }

    /// `self + factor * rate`, of the states in use.
    #[inline(always)]
    pub(crate) fn advanced<const GROUPS: u8>(&self, rate: &Self, factor: R) -> Self {
        let mut next = State {
            x: factor.mul_add(rate.x, self.x),
            v: factor.mul_add(rate.v, self.v),
            chamber_mass: factor.mul_add(rate.chamber_mass, self.chamber_mass),
            pipe_mass: factor.mul_add(rate.pipe_mass, self.pipe_mass),
            ..*self
        };
        if GROUPS & groups::HEATING != 0 {
            next.chamber_temperature = factor.mul_add(rate.chamber_temperature, self.chamber_temperature);
            next.pipe_temperature = factor.mul_add(rate.pipe_temperature, self.pipe_temperature);
        }
        if GROUPS & groups::LINE != 0 {
            next.line_pressure = factor.mul_add(rate.line_pressure, self.line_pressure);
        }
        if GROUPS & groups::FRICTION != 0 {
            next.bristle = factor.mul_add(rate.bristle, self.bristle);
        }
        next
    }
}

impl State<f64> {
    /// Whether every state but the velocity differs from another's by at most this share.
    pub(crate) fn is_within(&self, other: &Self, share: f64) -> bool {
        let near = |a: f64, b: f64, scale: f64| (a - b).abs() <= share * scale;
        near(self.x, other.x, self.x.abs().max(1e-3))
            && near(self.bristle, other.bristle, 1e-3)
            && near(self.chamber_mass, other.chamber_mass, other.chamber_mass)
            && near(self.pipe_mass, other.pipe_mass, other.pipe_mass)
            && near(self.chamber_temperature, other.chamber_temperature, other.chamber_temperature)
            && near(self.pipe_temperature, other.pipe_temperature, other.pipe_temperature)
            && near(self.line_pressure, other.line_pressure, other.line_pressure)
    }
}

/// What acts from outside at one instant.
#[derive(Debug, Clone, Copy, Default)]
pub struct Inputs<R> {
    /// Spool position: 1 joins the supply, 0 the exhaust.
    pub spool: R,
    /// Time since the last command edge, s (for custom formulas).
    pub since_command: R,
    /// Measured pipe pressure, Pa, where it drives the model.
    pub pipe_pressure: R,
    /// Measured chamber pressure, Pa, where it drives the model.
    pub chamber_pressure: R,
    /// Measured supply pressure, Pa, where it drives the model.
    pub supply_pressure: R,
}

/// The equations of one valve or of several in lanes.
#[derive(Debug)]
pub struct System<'a, R> {
    /// Their numbers.
    pub coefficients: Coefficients<R>,
    /// The groups of terms in use, the same in all lanes.
    pub terms: Terms,
    /// The same as bits.
    groups: u8,
    /// Custom effects, the same in all lanes but for their parameters.
    pub custom: &'a [CustomEffect],
    /// The parameters of each custom effect, lane by lane.
    pub custom_operands: Vec<Vec<R>>,
    supply: Pressure<R>,
    ambient: Pressure<R>,
    exhaust: Pressure<R>,
    /// Whether any lane leaks in, or out; a leak without area adds 0 and can be left out.
    leaks_in: bool,
    leaks_out: bool,
}

/// The flows into and out of the pipe, kg/s.
struct Flows<R> {
    /// From the supply; 0 where the solenoid joins one side at a time and no line has to know.
    filled: R,
    /// To the exhaust, negative where gas leaves; with the flow from the supply where that is 0.
    vented: R,
    leaked_in: R,
    leaked_out: R,
    /// From the pipe to the chamber.
    through_port: R,
}

/// Contributions of the custom effects.
struct Custom<R> {
    force: R,
    friction: R,
    pipe_flow: R,
    chamber_flow: R,
}

impl<'a, R: Real> System<'a, R> {
    /// The equations with these numbers.
    pub fn new(
        coefficients: Coefficients<R>,
        terms: Terms,
        custom: &'a [CustomEffect],
        custom_operands: Vec<Vec<R>>,
    ) -> Self {
        let c = &coefficients;
        let any = |leak: &R| (0..R::LANES).any(|lane| leak.lane(lane) != 0.0);
        Self {
            supply: Pressure::of(c.supply),
            ambient: Pressure::of(c.ambient),
            exhaust: Pressure::of(c.exhaust),
            leaks_in: any(&c.leak_in),
            leaks_out: any(&c.leak_out),
            coefficients,
            terms,
            groups: terms.groups(),
            custom,
            custom_operands,
        }
    }

    /// Whether a group of terms takes part: known where the loop is compiled, unless that is for any.
    #[inline(always)]
    fn has<const GROUPS: u8>(&self, group: u8) -> bool {
        if GROUPS == groups::ANY { self.groups & group != 0 } else { GROUPS & group != 0 }
    }

    /// Puts another valve, or other conditions, with the same groups of terms into a lane.
    pub fn set_lane(&mut self, lane: usize, equations: &Equations) {
        let c = &equations.coefficients;
        self.coefficients.set_lane(lane, c);
        self.supply.set_lane(lane, Pressure::of(c.supply));
        self.ambient.set_lane(lane, Pressure::of(c.ambient));
        self.exhaust.set_lane(lane, Pressure::of(c.exhaust));
        self.leaks_in |= c.leak_in != 0.0;
        self.leaks_out |= c.leak_out != 0.0;
        for (packed, values) in self.custom_operands.iter_mut().zip(equations.custom_operands()) {
            for (pack, value) in packed.iter_mut().zip(values) {
                pack.set_lane(lane, value);
            }
        }
    }

    /// Pressure in the chamber and in the pipe, with their inverses: one quotient gives all of them.
    #[inline(always)]
    pub fn gas<const GROUPS: u8>(&self, state: &State<R>, inputs: &Inputs<R>) -> (Pressure<R>, Pressure<R>) {
        let c = &self.coefficients;
        let volume = c.closed_volume - c.piston_area * state.x;
        let mut energy = state.chamber_mass * c.zrt;
        let mut pipe = state.pipe_mass * c.pipe_gain;
        if self.has::<GROUPS>(groups::HEATING) {
            energy = energy * (state.chamber_temperature * c.inverse_temperature);
            pipe = pipe * (state.pipe_temperature * c.inverse_temperature);
        }
        let (energy_pipe, volume_pipe, volume_energy) = (energy * pipe, volume * pipe, volume * energy);
        let quotient = R::splat(1.0) / (volume_energy * pipe);
        let mut chamber_gas =
            Pressure { pa: energy * energy_pipe * quotient, inverse: volume * volume_pipe * quotient };
        let mut pipe_gas = Pressure { pa: pipe, inverse: volume_energy * quotient };
        if self.has::<GROUPS>(groups::DRIVEN) && self.terms.driven_chamber {
            chamber_gas = Pressure::of(inputs.chamber_pressure);
        }
        if self.has::<GROUPS>(groups::DRIVEN) && self.terms.driven_pipe {
            pipe_gas = Pressure::of(inputs.pipe_pressure);
        }
        (chamber_gas, pipe_gas)
    }

    /// The pressure of the supply: that of the run, or the measured one.
    #[inline(always)]
    fn supply<const GROUPS: u8>(&self, inputs: &Inputs<R>) -> Pressure<R> {
        if self.has::<GROUPS>(groups::DRIVEN) && self.terms.driven_supply {
            return Pressure::of(inputs.supply_pressure);
        }
        self.supply
    }

    /// The rates of change at a state.
    #[inline(always)]
    pub fn rates<const GROUPS: u8>(&self, state: &State<R>, inputs: &Inputs<R>) -> State<R> {
        let c = &self.coefficients;
        let zero = R::splat(0.0);
        let (chamber_gas, pipe_gas) = self.gas::<GROUPS>(state, inputs);
        let (chamber, pipe) = (chamber_gas.pa, pipe_gas.pa);

        // Forces on the piston, positive opens.
        let beyond_open = (state.x - c.stroke).max(zero);
        let beyond_closed = state.x.min(zero);
        let mut spring = c.stiffness * (c.free_length - state.x);
        if self.has::<GROUPS>(groups::FORCES) {
            spring = spring * c.hardening.mul_add(c.stroke - state.x, R::splat(1.0));
        }
        let resisting = c.viscous.mul_add(state.v, c.contact.mul_add(beyond_open + beyond_closed, c.weight));
        let mut net = spring - (chamber - c.ambient).mul_add(c.piston_area, resisting);

        let Flows { filled, vented, leaked_in, leaked_out, through_port } =
            self.flows::<GROUPS>(state, inputs, pipe_gas, chamber_gas);
        let mut bristle_rate = zero;
        let mut inverse_mass = c.inverse_mass;
        let mut pipe_rate = filled + vented + leaked_in - leaked_out - through_port;
        let mut chamber_rate = through_port;
        let mut custom_pipe = zero;
        let mut custom_chamber = zero;
        let mut custom = Custom { force: zero, friction: zero, pipe_flow: zero, chamber_flow: zero };
        if self.has::<GROUPS>(groups::CUSTOM) {
            custom = self.custom::<GROUPS>(state, inputs, chamber, pipe);
            custom_pipe = custom.pipe_flow;
            custom_chamber = custom.chamber_flow;
            pipe_rate = pipe_rate + custom_pipe;
            chamber_rate = chamber_rate + custom_chamber;
            net = net + custom.force;
        }
        if self.has::<GROUPS>(groups::FORCES) {
            let (force, damping) = self.added_forces(state);
            net = net + force;
            // A cushion that brakes faster than anything else moves: inertia no longer counts.
            inverse_mass = R::splat(1.0) / c.mass.max(damping * c.quickest);
        }
        if self.has::<GROUPS>(groups::FRICTION) {
            let (friction, bristle) = self.friction(state, chamber, custom.friction);
            net = net - friction;
            bristle_rate = bristle;
        }
        let mut rate = State {
            x: state.v,
            v: net * inverse_mass,
            chamber_mass: chamber_rate,
            pipe_mass: pipe_rate,
            chamber_temperature: zero,
            pipe_temperature: zero,
            line_pressure: zero,
            bristle: bristle_rate,
        };
        if self.has::<GROUPS>(groups::LINE) {
            let supply = self.supply::<GROUPS>(inputs).pa;
            rate.line_pressure =
                c.line_gain * ((supply - state.line_pressure) * c.line_conductance - filled - leaked_in);
        }
        if self.has::<GROUPS>(groups::HEATING) {
            let incoming = [filled, vented, leaked_in, -leaked_out, custom_pipe];
            self.heating(state, &mut rate, &incoming, through_port, custom_chamber, chamber);
        }
        rate
    }

    /// The flows into and out of the pipe.
    #[inline(always)]
    fn flows<const GROUPS: u8>(
        &self,
        state: &State<R>,
        inputs: &Inputs<R>,
        pipe_gas: Pressure<R>,
        chamber_gas: Pressure<R>,
    ) -> Flows<R> {
        let c = &self.coefficients;
        let (zero, half) = (R::splat(0.0), R::splat(0.5));
        let has_line = self.has::<GROUPS>(groups::LINE);
        let source = if has_line { Pressure::of(state.line_pressure) } else { self.supply::<GROUPS>(inputs) };
        let fed = if has_line { c.line_blend } else { c.blend };
        // Gas that is not at the run's temperature T flows as sqrt(T/T upstream).
        let one = R::splat(1.0);
        let (run, mut from_pipe, mut from_chamber) = (one, one, one);
        if self.has::<GROUPS>(groups::HEATING) {
            let both = c.temperature / (state.pipe_temperature * state.chamber_temperature);
            from_pipe = (both * state.chamber_temperature).sqrt();
            from_chamber = (both * state.pipe_temperature).sqrt();
        }
        let (filled, vented);
        if self.has::<GROUPS>(groups::SPOOL) {
            filled = self.flow::<GROUPS>(source, pipe_gas, c.fill * inputs.spool, run, from_pipe, fed);
            let closed = one - inputs.spool;
            vented = self.flow::<GROUPS>(self.exhaust, pipe_gas, c.vent * closed, run, from_pipe, c.blend);
        } else {
            let upstream = Pressure {
                pa: half.select_lt(inputs.spool, source.pa, self.exhaust.pa),
                inverse: half.select_lt(inputs.spool, source.inverse, self.exhaust.inverse),
            };
            let coefficient = half.select_lt(inputs.spool, c.fill, c.vent);
            let mut blend = c.blend;
            if has_line {
                blend.width = half.select_lt(inputs.spool, fed.width, blend.width);
                blend.inverse = half.select_lt(inputs.spool, fed.inverse, blend.inverse);
            }
            let flow = self.flow::<GROUPS>(upstream, pipe_gas, coefficient, run, from_pipe, blend);
            if has_line {
                filled = half.select_lt(inputs.spool, flow, zero);
                vented = half.select_lt(inputs.spool, zero, flow);
            } else {
                (filled, vented) = (zero, flow);
            }
        }
        let (mut leaked_in, mut leaked_out) = (zero, zero);
        if self.leaks_in {
            leaked_in = self.flow::<GROUPS>(source, pipe_gas, c.leak_in, run, from_pipe, fed);
        }
        if self.leaks_out {
            leaked_out = self.flow::<GROUPS>(pipe_gas, self.ambient, c.leak_out, from_pipe, run, c.blend);
        }
        let through_port = self.flow::<GROUPS>(pipe_gas, chamber_gas, c.port, from_pipe, from_chamber, c.port_blend);
        Flows { filled, vented, leaked_in, leaked_out, through_port }
    }

    /// Flow from one pressure to another; `warmth1` and `warmth2` are sqrt(T/T upstream) of gas that comes from
    /// either side.
    #[inline(always)]
    fn flow<const GROUPS: u8>(
        &self,
        from: Pressure<R>,
        to: Pressure<R>,
        coefficient: R,
        warmth1: R,
        warmth2: R,
        blend: Blend<R>,
    ) -> R {
        let flow = self.coefficients.law.flow_between(from, to, coefficient, blend);
        if self.has::<GROUPS>(groups::HEATING) { flow * from.pa.select_lt(to.pa, warmth2, warmth1) } else { flow }
    }

    /// Dry friction as the deflection z of bristles (Canudas de Wit, Olsson, Åström and Lischinsky, IEEE
    /// Trans. Automatic Control 40(3), 1995): z' = v - s0 |v| z/g(v), F = s0 z + s1 z', with g the
    /// Coulomb, static and Stribeck friction. At rest the bristles hold up to g(0). The rate at which a
    /// sliding bristle settles is bounded, far above anything that a stroke shows.
    #[inline(always)]
    fn friction(&self, state: &State<R>, chamber: R, custom: R) -> (R, R) {
        let c = &self.coefficients;
        let g = self.sliding(state, chamber, custom);
        let grip = c.bristle_stiffness * state.v.abs();
        let settling = grip * c.quickest;
        let rate = state.v.mul_add(g, -(grip * state.bristle)) / g.max(settling).max(R::splat(LEAST_FRICTION_N));
        (c.bristle_stiffness.mul_add(state.bristle, c.bristle_damping * rate), rate)
    }

    /// The friction of steady sliding, N: that of guides, of seals and of custom effects.
    #[inline(always)]
    fn sliding(&self, state: &State<R>, chamber: R, custom: R) -> R {
        let c = &self.coefficients;
        let (zero, one) = (R::splat(0.0), R::splat(1.0));
        let pressing = (chamber - c.ambient).max(zero);
        // The share of the static friction's excess that is left at the velocity at hand (Stribeck).
        let mut slow = zero;
        if self.terms.stribeck {
            let ratio = state.v * c.inverse_stribeck;
            slow = (ratio * ratio).exp_of_negative();
        }
        if self.terms.uneven {
            let dry_way = zero.select_lt(state.v, c.dry_opening, one);
            let seal_way = zero.select_lt(state.v, c.seal_opening, one);
            let place = c.dry_slope.mul_add(state.x, c.dry_closed).max(zero);
            let dry = c.static_excess.mul_add(slow, c.coulomb) * dry_way;
            return dry.mul_add(place, c.seal * pressing * seal_way) + custom.max(zero);
        }
        let coulomb = c.seal.mul_add(pressing, c.coulomb) + custom.max(zero);
        if self.terms.stribeck { c.static_excess.mul_add(slow, coulomb) } else { coulomb }
    }

    /// The friction of steady sliding at a state, N, by its size.
    pub(crate) fn sliding_friction<const GROUPS: u8>(&self, state: &State<R>, inputs: &Inputs<R>) -> R {
        let (chamber, pipe) = self.gas::<GROUPS>(state, inputs);
        let custom = if self.has::<GROUPS>(groups::CUSTOM) {
            self.custom::<GROUPS>(state, inputs, chamber.pa, pipe.pa).friction
        } else {
            R::splat(0.0)
        };
        self.sliding(state, chamber.pa, custom)
    }

    /// Cushions, seat adhesion and process force, N; and the damping of the cushions, N s/m.
    #[inline(always)]
    fn added_forces(&self, state: &State<R>) -> (R, R) {
        let c = &self.coefficients;
        let (zero, one) = (R::splat(0.0), R::splat(1.0));
        let from_closed = state.x.max(zero);
        let from_open = (c.stroke - state.x).max(zero);
        let closing = c.closing_damping * (-from_closed).mul_add(c.closing_inverse_length, one).max(zero);
        let opening = c.opening_damping * (-from_open).mul_add(c.opening_inverse_length, one).max(zero);
        let adhesion = c.adhesion * (-state.x).mul_add(c.adhesion_inverse_reach, one).max(zero).min(one);
        let shut = (-state.x).mul_add(c.inverse_stroke, one).max(zero);
        let process = if self.terms.power {
            c.process * shut.max(R::splat(1e-300)).power(c.process_exponent)
        } else {
            c.process * shut
        };
        let damping = closing + opening;
        let mut force = (-damping).mul_add(state.v, process - adhesion);
        if self.terms.stop_damping {
            force = force + self.stop_damping(state);
        }
        (force, damping)
    }

    /// The damping of the stops, N: on a piston inside a stop, and with no more than the stop presses where it
    /// would hold the piston back.
    #[inline(always)]
    fn stop_damping(&self, state: &State<R>) -> R {
        let c = &self.coefficients;
        let zero = R::splat(0.0);
        let braking = -(c.stop_damping * state.v);
        let (closed, open) = (c.contact * state.x, c.contact * (state.x - c.stroke));
        let at_closed = state.x.select_lt(zero, braking.max(closed), zero);
        let at_open = c.stroke.select_lt(state.x, braking.min(open), zero);
        at_closed + at_open
    }

    /// Energy balances of pipe and chamber (Carneiro and Almeida 2006, eq. 3), as rates of temperature.
    #[inline(always)]
    fn heating(&self, state: &State<R>, rate: &mut State<R>, incoming: &[R; 5], port: R, custom: R, chamber: R) {
        let c = &self.coefficients;
        let zero = R::splat(0.0);
        let (t_pipe, t_chamber) = (state.pipe_temperature, state.chamber_temperature);
        // Divided by c_v: m T' = sum gamma f T_source - m' T + h/c_v (T_wall - T) - p V'/c_v.
        let mut pipe = zero;
        for flow in incoming {
            pipe = flow.mul_add(flow.select_lt(zero, t_pipe, c.temperature), pipe);
        }
        let carried = port * port.select_lt(zero, t_chamber, t_pipe);
        let added = custom * custom.select_lt(zero, t_chamber, c.temperature);
        // -p V'/c_v with V' = -A_p v.
        let work = chamber * c.piston_area * state.v * c.work_gain;
        let pipe_stored = c.wall.mul_add(c.temperature - t_pipe, -(rate.pipe_mass * t_pipe));
        let chamber_stored = c.wall.mul_add(c.temperature - t_chamber, -(rate.chamber_mass * t_chamber));
        let pipe = c.gamma.mul_add(pipe - carried, pipe_stored);
        let chamber = c.gamma.mul_add(carried + added, chamber_stored) + work;
        // Where the walls hold the gas at their temperature faster than anything else moves, only how far
        // it is from theirs matters, not how fast it gets there.
        let slowest = c.wall * c.quickest;
        let (pipe_mass, chamber_mass) = (state.pipe_mass.max(slowest), state.chamber_mass.max(slowest));
        let quotient = R::splat(1.0) / (pipe_mass * chamber_mass);
        rate.pipe_temperature = pipe * chamber_mass * quotient;
        rate.chamber_temperature = chamber * pipe_mass * quotient;
    }

    #[inline(always)]
    fn custom<const GROUPS: u8>(&self, state: &State<R>, inputs: &Inputs<R>, chamber: R, pipe: R) -> Custom<R> {
        let c = &self.coefficients;
        let supply = self.supply::<GROUPS>(inputs).pa;
        let variables = Variables {
            values: [&state.x, &state.v, &chamber, &pipe, &supply, &c.ambient, &inputs.since_command, &c.stroke],
        };
        let zero = R::splat(0.0);
        let mut sum = Custom { force: zero, friction: zero, pipe_flow: zero, chamber_flow: zero };
        for (effect, parameters) in self.custom.iter().zip(&self.custom_operands) {
            let value = effect.formula().evaluate(&variables, parameters);
            let total = match effect.target() {
                CustomTarget::Force => &mut sum.force,
                CustomTarget::Friction => &mut sum.friction,
                CustomTarget::PipeFlow => &mut sum.pipe_flow,
                CustomTarget::ChamberFlow => &mut sum.chamber_flow,
            };
            *total = *total + value;
        }
        sum
    }
}
