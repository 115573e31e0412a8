//! The equations of motion: base model and catalogue, one source for scalars and lanes.
//!
//! Kulkarni et al. 2014, section 3, with its slips put right: the spring force is k (L - x + x0),
//! filling closes the valve, and the choked test of a flow that runs back uses the inverted ratio.

use crate::bristles;
use crate::coefficients::Coefficients;
use crate::custom::{CustomEffect, CustomTarget, Variables};
use crate::effects::{Laws, Moment};
use crate::equations::Equations;
use crate::orifice::{Laminar, Pressure};
use crate::real::Real;
use crate::state::{Flows, Inputs, State};
use crate::terms::{Terms, groups};

/// The equations of one valve or of several in lanes.
#[derive(Debug)]
pub struct System<'a, R> {
    /// The numbers of the base equations.
    pub coefficients: Coefficients<R>,
    /// Those of the effects of the catalogue.
    pub(crate) laws: Laws<R>,
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

/// Contributions of the custom effects.
struct Custom<R> {
    force: R,
    friction: R,
    pipe_flow: R,
    chamber_flow: R,
}

impl<'a, R: Real> System<'a, R> {
    /// The equations of one valve, in every lane.
    pub fn new(equations: &'a Equations) -> Self {
        let c = &equations.coefficients;
        let in_lanes = |values: Vec<f64>| values.into_iter().map(R::splat).collect();
        Self {
            supply: Pressure::of(R::splat(c.supply)),
            ambient: Pressure::of(R::splat(c.ambient)),
            exhaust: Pressure::of(R::splat(c.exhaust)),
            leaks_in: c.leak_in != 0.0,
            leaks_out: c.leak_out != 0.0,
            coefficients: Coefficients::splat(c),
            laws: Laws::splat(&equations.laws),
            terms: equations.terms,
            groups: equations.terms.groups(),
            custom: &equations.custom,
            custom_operands: equations.custom_operands().into_iter().map(in_lanes).collect(),
        }
    }

    /// Whether a group of terms takes part: known where the loop is compiled, unless that is for any.
    #[inline(always)]
    pub(crate) fn has<const GROUPS: u8>(&self, group: u8) -> bool {
        if GROUPS == groups::ANY { self.groups & group != 0 } else { GROUPS & group != 0 }
    }

    /// Puts another valve, or other conditions, with the same groups of terms into a lane.
    pub fn set_lane(&mut self, lane: usize, equations: &Equations) {
        let c = &equations.coefficients;
        self.coefficients.set_lane(lane, c);
        self.laws.set_lane(lane, &equations.laws);
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
        if self.has::<GROUPS>(groups::PRESCRIBED) && self.terms.prescribed_chamber {
            chamber_gas = Pressure::of(inputs.chamber_pressure);
        }
        if self.has::<GROUPS>(groups::PRESCRIBED) && self.terms.prescribed_pipe {
            pipe_gas = Pressure::of(inputs.pipe_pressure);
        }
        (chamber_gas, pipe_gas)
    }

    /// The pressure of the supply: that of the run, or the measured one.
    #[inline(always)]
    fn supply<const GROUPS: u8>(&self, inputs: &Inputs<R>) -> Pressure<R> {
        if self.has::<GROUPS>(groups::PRESCRIBED) && self.terms.prescribed_supply {
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
        let at = self.moment(state, chamber, pipe);

        // Forces on the piston, positive opens.
        let beyond_open = (state.x - c.stroke).max(zero);
        let beyond_closed = state.x.min(zero);
        let mut spring = c.stiffness * (c.free_length - state.x);
        if self.has::<GROUPS>(groups::FORCES) {
            spring = self.laws.spring(&at, spring);
        }
        let resisting = c.viscous.mul_add(state.v, c.contact.mul_add(beyond_open + beyond_closed, c.weight));
        let mut net = spring - (chamber - c.ambient).mul_add(c.piston_area, resisting);

        let mut flows = self.flows::<GROUPS>(state, inputs, pipe_gas, chamber_gas);
        let mut bristle_rate = zero;
        let mut inverse_mass = c.inverse_mass;
        let mut pipe_rate = flows.filled + flows.vented + flows.leaked_in - flows.leaked_out - flows.through_port;
        let mut chamber_rate = flows.through_port;
        let mut custom = Custom { force: zero, friction: zero, pipe_flow: zero, chamber_flow: zero };
        if self.has::<GROUPS>(groups::CUSTOM) {
            custom = self.custom::<GROUPS>(state, inputs, chamber, pipe);
            (flows.into_pipe, flows.into_chamber) = (custom.pipe_flow, custom.chamber_flow);
            net = net + custom.force;
        }
        if self.has::<GROUPS>(groups::FLOWS) {
            flows.into_pipe = self.laws.pipe_flow(&at, flows.into_pipe);
            flows.into_chamber = self.laws.chamber_flow(&at, flows.into_chamber);
        }
        if self.has::<GROUPS>(groups::CUSTOM) || self.has::<GROUPS>(groups::FLOWS) {
            flows.into_pipe = flows.into_pipe * flows.kept;
            pipe_rate = pipe_rate + flows.into_pipe;
            chamber_rate = chamber_rate + flows.into_chamber;
        }
        if self.has::<GROUPS>(groups::FORCES) {
            let damping = self.laws.damping(&at, nothing());
            net = net + self.added_force(&at, damping);
            // A cushion that brakes faster than anything else moves: inertia no longer counts.
            inverse_mass = R::splat(1.0) / c.mass.max(damping * c.quickest);
        }
        if self.has::<GROUPS>(groups::FRICTION) {
            let sliding = self.sliding(&at, custom.friction);
            let (stiffness, damping) = (c.bristle_stiffness, c.bristle_damping);
            let (friction, rate) = bristles::friction(stiffness, damping, c.quickest, state.v, state.bristle, sliding);
            net = net - friction;
            bristle_rate = rate;
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
            let fed = self.laws.line_flow(self.supply::<GROUPS>(inputs).pa, state.line_pressure, nothing());
            rate.line_pressure = c.line_gain * (fed - flows.filled - flows.leaked_in);
        }
        if self.has::<GROUPS>(groups::HEATING) {
            self.laws.warm(&at, &flows, &mut rate);
        }
        self.equalise::<GROUPS>(&at, &flows, &mut rate);
        rate
    }

    /// What the terms of effects are evaluated with.
    #[inline(always)]
    fn moment<'b>(&'b self, state: &'b State<R>, chamber: R, pipe: R) -> Moment<'b, R> {
        Moment { base: &self.coefficients, state, chamber, pipe, variants: self.laws.variants }
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
        let fed = if has_line { c.line_laminar } else { c.laminar };
        // Gas that is not at the run's temperature T flows as sqrt(T/T upstream).
        let one = R::splat(1.0);
        let (run, mut from_pipe, mut from_chamber) = (one, one, one);
        if self.has::<GROUPS>(groups::HEATING) {
            let both = c.temperature / (state.pipe_temperature * state.chamber_temperature);
            from_pipe = (both * state.chamber_temperature).sqrt();
            from_chamber = (both * state.pipe_temperature).sqrt();
        }
        let vent_factor = if self.has::<GROUPS>(groups::FLOWS) { self.vent_factor(pipe_gas) } else { one };
        let (mut filled, mut vented, mut root);
        if self.has::<GROUPS>(groups::SPOOL) {
            let (flow, fed_root) = self.flow::<GROUPS>(source, pipe_gas, c.fill * inputs.spool, run, from_pipe, fed);
            let closed = one - inputs.spool;
            let (out, vent_root) =
                self.flow::<GROUPS>(self.exhaust, pipe_gas, c.vent * closed, run, from_pipe, c.laminar);
            (filled, vented) = (flow, if self.has::<GROUPS>(groups::FLOWS) { out * vent_factor } else { out });
            root = half.select_lt(inputs.spool, fed_root, vent_root);
        } else {
            let upstream = Pressure {
                pa: half.select_lt(inputs.spool, source.pa, self.exhaust.pa),
                inverse: half.select_lt(inputs.spool, source.inverse, self.exhaust.inverse),
            };
            let mut coefficient = half.select_lt(inputs.spool, c.fill, c.vent);
            if self.has::<GROUPS>(groups::FLOWS) {
                coefficient = coefficient * half.select_lt(inputs.spool, one, vent_factor);
            }
            let mut laminar = c.laminar;
            if has_line {
                laminar.width = half.select_lt(inputs.spool, fed.width, laminar.width);
                laminar.inverse = half.select_lt(inputs.spool, fed.inverse, laminar.inverse);
            }
            let (flow, flow_root) = self.flow::<GROUPS>(upstream, pipe_gas, coefficient, run, from_pipe, laminar);
            root = flow_root;
            if has_line {
                filled = half.select_lt(inputs.spool, flow, zero);
                vented = half.select_lt(inputs.spool, zero, flow);
            } else {
                (filled, vented) = (zero, flow);
            }
        }
        let (mut leaked_in, mut leaked_out) = (zero, zero);
        if self.leaks_in {
            let (flow, leak_root) = self.flow::<GROUPS>(source, pipe_gas, c.leak_in, run, from_pipe, fed);
            leaked_in = flow;
            root = zero.select_lt(c.leak_in, root.min(leak_root), root);
        }
        if self.leaks_out {
            let (flow, leak_root) = self.flow::<GROUPS>(pipe_gas, self.ambient, c.leak_out, from_pipe, run, c.laminar);
            leaked_out = flow;
            root = zero.select_lt(c.leak_out, root.min(leak_root), root);
        }
        let (through_port, port_root) =
            self.flow::<GROUPS>(pipe_gas, chamber_gas, c.port, from_pipe, from_chamber, c.port_laminar);
        let mut kept = c.pipe_ease * root;
        if kept.any_lt(one) {
            // Where the port is eased as well, the chamber takes part, and nothing is to flow in the end; where it is not,
            // as much as through the port.
            kept = kept.min(one);
            let sustained = through_port * (c.port_ease * port_root).min(one) * (one - kept);
            (filled, vented) = (filled * kept, vented * kept);
            (leaked_in, leaked_out) = (leaked_in * kept, leaked_out * kept);
            if self.has::<GROUPS>(groups::SPOOL) || has_line {
                filled = filled + half.select_lt(inputs.spool, sustained, zero);
                vented = vented + half.select_lt(inputs.spool, zero, sustained);
            } else {
                vented = vented + sustained;
            }
        } else {
            kept = one;
        }
        Flows {
            filled,
            vented,
            leaked_in,
            leaked_out,
            through_port,
            port_root,
            kept,
            into_pipe: zero,
            into_chamber: zero,
        }
    }

    /// What the flow through the vent is multiplied by.
    #[inline(always)]
    pub(crate) fn vent_factor(&self, pipe: Pressure<R>) -> R {
        let (pa, exhaust) = (pipe.pa, self.exhaust);
        let difference = (pa - exhaust.pa).abs() * pa.select_lt(exhaust.pa, exhaust.inverse, pipe.inverse);
        self.laws.vent(difference, self.coefficients.law.widest, R::splat(1.0))
    }

    /// Flow from one pressure to another; `warmth1` and `warmth2` are sqrt(T/T upstream) of gas that comes from
    /// either side. And the root of the relative pressure difference.
    #[inline(always)]
    fn flow<const GROUPS: u8>(
        &self,
        from: Pressure<R>,
        to: Pressure<R>,
        coefficient: R,
        warmth1: R,
        warmth2: R,
        laminar: Laminar<R>,
    ) -> (R, R) {
        let discharge_varies = self.has::<GROUPS>(groups::FLOWS) && self.terms.discharge;
        let (flow, root) = self.coefficients.law.flow_with_root(from, to, coefficient, laminar, discharge_varies);
        let warmth = from.pa.select_lt(to.pa, warmth2, warmth1);
        (if self.has::<GROUPS>(groups::HEATING) { flow * warmth } else { flow }, root)
    }

    /// The friction of steady sliding, N: that of the catalogue and of custom effects.
    #[inline(always)]
    fn sliding(&self, at: &Moment<'_, R>, custom: R) -> R {
        self.laws.friction(at, nothing()) + custom.max(R::splat(0.0))
    }

    /// The friction of steady sliding at a state, N, by its size.
    pub(crate) fn sliding_friction<const GROUPS: u8>(&self, state: &State<R>, inputs: &Inputs<R>) -> R {
        let (chamber, pipe) = self.gas::<GROUPS>(state, inputs);
        let custom = if self.has::<GROUPS>(groups::CUSTOM) {
            self.custom::<GROUPS>(state, inputs, chamber.pa, pipe.pa).friction
        } else {
            R::splat(0.0)
        };
        self.sliding(&self.moment(state, chamber.pa, pipe.pa), custom)
    }

    /// The forces that effects and damped stops add, N, given the damping of the effects.
    #[inline(always)]
    fn added_force(&self, at: &Moment<'_, R>, damping: R) -> R {
        let force = (-damping).mul_add(at.state.v, self.laws.force(at, nothing()));
        if self.terms.stop_damping { force + self.stop_damping(at.state) } else { force }
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

/// What a sum of terms begins with: added to anything it changes no bit, not even the sign of a zero, so that the
/// optimiser leaves it out.
#[inline(always)]
fn nothing<R: Real>() -> R {
    R::splat(-0.0)
}
