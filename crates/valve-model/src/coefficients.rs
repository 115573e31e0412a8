//! The numbers of the base equations.

use crate::orifice::{Laminar, OrificeLaw};
use crate::real::Real;

macro_rules! coefficients {
    ($( $(#[$doc:meta])* $field:ident, )*) => {
        /// The numbers of the base equations, for one valve or for several in lanes.
        #[derive(Debug, Clone, Copy)]
        pub struct Coefficients<R> {
            $( $(#[$doc])* pub $field: R, )*
            /// The law of all orifices.
            pub law: OrificeLaw<R>,
            /// How it is regularised at the port.
            pub port_laminar: Laminar<R>,
            /// How it is regularised at the solenoid and at leaks.
            pub laminar: Laminar<R>,
            /// How it is regularised where a supply line of its own pressure feeds them.
            pub line_laminar: Laminar<R>,
        }

        impl<R: Real> Coefficients<R> {
            /// Puts one valve's numbers into a lane.
            pub fn set_lane(&mut self, lane: usize, from: &Coefficients<f64>) {
                $( self.$field.set_lane(lane, from.$field); )*
                for (power, root) in self.law.root.iter_mut().enumerate() {
                    root.set_lane(lane, from.law.root[power]);
                }
                for (power, discharge) in self.law.discharge.iter_mut().enumerate() {
                    discharge.set_lane(lane, from.law.discharge[power]);
                }
                self.law.scale.set_lane(lane, from.law.scale);
                self.law.widest.set_lane(lane, from.law.widest);
                self.port_laminar.set_lane(lane, from.port_laminar);
                self.laminar.set_lane(lane, from.laminar);
                self.line_laminar.set_lane(lane, from.line_laminar);
            }

            /// The same valve in every lane.
            pub fn splat(from: &Coefficients<f64>) -> Self {
                let law = &from.law;
                Self {
                    $( $field: R::splat(from.$field), )*
                    law: OrificeLaw {
                        root: core::array::from_fn(|power| R::splat(law.root[power])),
                        scale: R::splat(law.scale),
                        widest: R::splat(law.widest),
                        discharge: law.discharge.map(R::splat),
                    },
                    port_laminar: Laminar::splat(from.port_laminar),
                    laminar: Laminar::splat(from.laminar),
                    line_laminar: Laminar::splat(from.line_laminar),
                }
            }
        }
    };
}

coefficients! {
    /// Moving mass m, kg.
    mass,
    /// 1/m, 1/kg.
    inverse_mass,
    /// Spring stiffness k, N/m.
    stiffness,
    /// L + x0: the spring force is k (free_length - x), m.
    free_length,
    /// Stroke L, m.
    stroke,
    /// 1/L, 1/m.
    inverse_stroke,
    /// Piston area A_p, m².
    piston_area,
    /// Viscous friction r, N s/m.
    viscous,
    /// Weight in the closing direction, N.
    weight,
    /// Stop stiffness, N/m.
    contact,
    /// Stop damping, N s/m.
    stop_damping,
    /// Ambient pressure, Pa.
    ambient,
    /// Supply pressure, Pa.
    supply,
    /// Exhaust pressure, Pa.
    exhaust,
    /// Chamber volume at x = 0, m³.
    closed_volume,
    /// Z R T, J/kg.
    zrt,
    /// Z R, J/(kg K).
    zr,
    /// Z R T / V_p, Pa/kg.
    pipe_gain,
    /// Pipe volume V_p, m³.
    pipe_volume,
    /// C A / sqrt(Z R T) of the solenoid's supply port, kg/(s Pa).
    fill,
    /// The same of its vent port.
    vent,
    /// The same of the cylinder port.
    port,
    /// The same of a leak to atmosphere.
    leak_out,
    /// The same of a leak from the supply.
    leak_in,
    /// How much of the rate at which pipe and chamber find one pressure is kept, over the root of their relative
    /// difference; all of it where that is 1 or more (see `equalising.rs`).
    port_ease,
    /// The same of the rate at which the pipe finds the pressure at which as much comes in as goes out, over the root of
    /// its relative difference from the other end of the orifices.
    pipe_ease,
    /// Run temperature, K.
    temperature,
    /// 1 over it, 1/K.
    inverse_temperature,
    /// Ratio of specific heats.
    gamma,
    /// 1/c_v = (gamma - 1)/R, kg K/J.
    work_gain,
    /// Z R T / V of a supply line with a pressure of its own, Pa/kg; 0 without one.
    line_gain,
    /// Stiffness of the friction bristles, N/m.
    bristle_stiffness,
    /// Their damping, N s/m.
    bristle_damping,
    /// Time in which the fastest rate that effects bring in settles, s.
    quickest,
}
