//! What an effect may add to the equations of motion, and the numbers it does that with.

use core::marker::PhantomData;

use super::Variants;
use crate::coefficients::Coefficients;
use crate::real::Real;
use crate::state::{Flows, State};

/// What a term may depend on at one instant.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Moment<'a, R> {
    /// The numbers of the base equations.
    pub base: &'a Coefficients<R>,
    /// The state.
    pub state: &'a State<R>,
    /// Chamber pressure, Pa.
    pub chamber: R,
    /// Pipe pressure, Pa.
    #[allow(dead_code, reason = "for effects to come, which have to change nothing here")]
    pub pipe: R,
    /// Which forms the laws take.
    pub variants: Variants,
}

/// The terms of an effect: it writes those that it has. Each takes what the effects before it have summed up, and
/// gives that with its own added; one that an effect does not write costs nothing.
///
/// A term is evaluated only where its group is in use (see [`crate::terms::Terms`]), which the effect says where it
/// is added to the equations. There it is evaluated for every valve in the lanes, so that it must add 0 with the
/// numbers of an effect that is absent.
#[expect(unused_variables, reason = "what is not written adds nothing")]
pub(crate) trait Term<R: Real> {
    /// The spring's force, N: may scale it. Group: forces.
    #[inline(always)]
    fn spring(&self, at: &Moment<'_, R>, force: R) -> R {
        force
    }

    /// A force on the piston, N, positive opens. Group: forces.
    #[inline(always)]
    fn force(&self, at: &Moment<'_, R>, sum: R) -> R {
        sum
    }

    /// A damping c of the piston, N s/m, which acts as the force -c v; it may be so large that inertia no longer
    /// counts. Group: forces.
    #[inline(always)]
    fn damping(&self, at: &Moment<'_, R>, sum: R) -> R {
        sum
    }

    /// The size of a dry friction during steady sliding, N; bristles make of it what holds at rest. Group: friction.
    #[inline(always)]
    fn friction(&self, at: &Moment<'_, R>, sum: R) -> R {
        sum
    }

    /// A flow into the pipe, kg/s, negative out of it. Group: flows.
    #[inline(always)]
    fn pipe_flow(&self, at: &Moment<'_, R>, sum: R) -> R {
        sum
    }

    /// A flow into the chamber, kg/s, negative out of it. Group: flows.
    #[inline(always)]
    fn chamber_flow(&self, at: &Moment<'_, R>, sum: R) -> R {
        sum
    }

    /// What the flow through the vent is multiplied by, at a relative pressure difference across it; the orifices choke
    /// from `widest` on. Group: flows.
    #[inline(always)]
    fn vent(&self, difference: R, widest: R, factor: R) -> R {
        factor
    }

    /// The flow from the supply into its line, kg/s, at these pressures, Pa. Group: line.
    #[inline(always)]
    fn line_flow(&self, supply: R, line: R, sum: R) -> R {
        sum
    }

    /// The rates of the gas temperatures, K/s, once those of the masses are in place. Group: heating.
    #[inline(always)]
    fn warm(&self, at: &Moment<'_, R>, flows: &Flows<R>, rate: &mut State<R>) {}
}

/// The numbers of an effect that has no term: it only changes those of the base equations, the solenoid or what is
/// recorded.
#[derive(Debug, Clone, Copy)]
pub struct NoTerm<R>(PhantomData<R>);

impl NoTerm<f64> {
    pub(super) const ABSENT: Self = Self(PhantomData);
}

#[expect(clippy::trivially_copy_pass_by_ref, clippy::unused_self, reason = "as the numbers of other effects have it")]
impl<R: Real> NoTerm<R> {
    pub(super) fn splat(_: &NoTerm<f64>) -> Self {
        Self(PhantomData)
    }

    pub(super) fn set_lane(&mut self, _: usize, _: &NoTerm<f64>) {}
}

impl<R: Real> Term<R> for NoTerm<R> {}

/// The numbers of an effect's term, each with its value where the effect is absent.
macro_rules! numbers {
    ($( $(#[$doc:meta])* $field:ident: $absent:expr, )*) => {
        /// The numbers of the law, for one valve or for several in lanes.
        #[derive(Debug, Clone, Copy)]
        pub struct Law<R> { $( $(#[$doc])* $field: R, )* }

        impl Law<f64> {
            pub(super) const ABSENT: Self = Self { $( $field: $absent, )* };
        }

        impl<R: $crate::real::Real> Law<R> {
            pub(super) fn splat(from: &Law<f64>) -> Self {
                Self { $( $field: R::splat(from.$field), )* }
            }

            pub(super) fn set_lane(&mut self, lane: usize, from: &Law<f64>) {
                $( self.$field.set_lane(lane, from.$field); )*
            }
        }
    };
}

pub(super) use numbers;
