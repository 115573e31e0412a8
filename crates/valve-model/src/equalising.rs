//! Pipe and chamber find one pressure through the port, in the end faster than a step can follow.
//!
//! At a relative pressure difference g the rate of that goes as 1/sqrt(g). Where it is beyond what the step can follow,
//! the flow through the port is changed by so much that the *difference* of the two pressures moves at a share of its
//! rate, `port_ease` sqrt(g). No gas comes or goes by that, and where the difference stands still nothing changes at all:
//! it settles to what it would settle to, only no faster than in a step or so. A law that is regularised over a
//! wider difference would be as stable, but bias the difference wherever gas flows.

use crate::effects::Moment;
use crate::real::Real;
use crate::rhs::System;
use crate::state::{Flows, State};
use crate::terms::groups;

impl<R: Real> System<'_, R> {
    /// Slows how pipe and chamber find one pressure down to what the step can follow, at rates of all states that are
    /// known otherwise.
    #[inline(always)]
    pub(crate) fn equalise<const GROUPS: u8>(&self, at: &Moment<'_, R>, flows: &Flows<R>, rate: &mut State<R>) {
        let one = R::splat(1.0);
        let kept = self.coefficients.port_ease * flows.port_root;
        if kept.any_lt(one) {
            let lost = one - kept.min(one);
            let more = lost * self.holding_flow::<GROUPS>(at, flows, rate);
            *rate = self.with_more_through_port::<GROUPS>(at, flows, rate, more);
        }
    }

    /// How much more must flow through the port so that the difference of the pressures stands still, kg/s; 0 where
    /// both of them are measured.
    #[inline(always)]
    fn holding_flow<const GROUPS: u8>(&self, at: &Moment<'_, R>, flows: &Flows<R>, rate: &State<R>) -> R {
        let c = &self.coefficients;
        let volume = c.closed_volume - c.piston_area * at.state.x;
        let here = self.parting::<GROUPS>(at, rate, volume);
        if self.has::<GROUPS>(groups::HEATING) {
            // All rates are linear in a flow that keeps its direction.
            let zero = R::splat(0.0);
            let large = c.port * at.pipe;
            let trial = flows.through_port.select_lt(zero, -large, large);
            let there = self.with_more_through_port::<GROUPS>(at, flows, rate, trial);
            let per_trial = here - self.parting::<GROUPS>(at, &there, volume);
            if self.has::<GROUPS>(groups::PRESCRIBED) && self.terms.prescribed_pipe && self.terms.prescribed_chamber {
                return zero;
            }
            return here * trial / per_trial;
        }
        let mut per_flow = volume * (volume + c.pipe_volume);
        if self.has::<GROUPS>(groups::PRESCRIBED) {
            if self.terms.prescribed_pipe {
                per_flow = volume * c.pipe_volume;
            }
            if self.terms.prescribed_chamber {
                per_flow = volume * volume;
            }
        }
        here / per_flow
    }

    /// How fast the pressures part, pipe over chamber, times V_p V² / (Z R T), or / (Z R) where gas warms; a measured
    /// pressure counts as standing still.
    #[inline(always)]
    fn parting<const GROUPS: u8>(&self, at: &Moment<'_, R>, rate: &State<R>, volume: R) -> R {
        let (c, state) = (&self.coefficients, at.state);
        let (mut pipe, mut chamber, mut held) = (rate.pipe_mass, rate.chamber_mass, state.chamber_mass);
        if self.has::<GROUPS>(groups::HEATING) {
            let (t_pipe, t_chamber) = (state.pipe_temperature, state.chamber_temperature);
            pipe = pipe.mul_add(t_pipe, state.pipe_mass * rate.pipe_temperature);
            chamber = chamber.mul_add(t_chamber, state.chamber_mass * rate.chamber_temperature);
            held = held * t_chamber;
        }
        let mut pipe = volume * volume * pipe;
        let squeezed = held * (c.piston_area * state.v);
        let mut chamber = c.pipe_volume * volume.mul_add(chamber, squeezed);
        if self.has::<GROUPS>(groups::PRESCRIBED) {
            let zero = R::splat(0.0);
            if self.terms.prescribed_pipe {
                pipe = zero;
            }
            if self.terms.prescribed_chamber {
                chamber = zero;
            }
        }
        pipe - chamber
    }

    /// The rates with more flow through the port.
    #[inline(always)]
    fn with_more_through_port<const GROUPS: u8>(
        &self,
        at: &Moment<'_, R>,
        flows: &Flows<R>,
        rate: &State<R>,
        more: R,
    ) -> State<R> {
        let mut with = State { pipe_mass: rate.pipe_mass - more, chamber_mass: rate.chamber_mass + more, ..*rate };
        if self.has::<GROUPS>(groups::HEATING) {
            let flows = Flows { through_port: flows.through_port + more, ..*flows };
            self.laws.warm(at, &flows, &mut with);
        }
        with
    }
}
