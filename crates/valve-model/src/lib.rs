//! Physics of a pneumatic valve: checked parameters in, strokes out.
//!
//! The model is that of Kulkarni, Daigle, Gorospe and Goebel, "Application of
//! Model-Based Prognostics to a Pneumatic Valves Testbed", IEEE Aerospace
//! Conference 2014: a normally-open valve with a linear cylinder, a spring, a
//! pipe and a three-way solenoid, with a catalogue of further physical
//! [`effects`] that can be added one by one.
//!
//! This crate is pure: it reads no files, starts no threads, prints nothing
//! and uses neither clock nor random numbers. All quantities are SI, pressures
//! are absolute and areas are geometric (the flow coefficient multiplies them).

mod bristles;
pub mod coefficients;
pub mod command;
pub mod conditions;
pub mod custom;
pub mod cycle;
mod demand;
pub mod dispatch;
pub mod effects;
mod equalising;
pub mod equations;
pub mod equilibrium;
pub mod fidelity;
mod integrator;
pub mod measurement;
pub mod orifice;
pub mod params;
pub mod prescribed;
pub mod real;
pub mod rhs;
pub mod simulate;
pub mod stability;
pub mod start;
pub mod state;
pub mod stroke;
pub mod terms;
pub mod trajectory;
pub mod valve;

pub use command::CommandEdge;
pub use conditions::Conditions;
pub use effects::{Effect, EffectKind};
pub use fidelity::Fidelity;
pub use measurement::Measurement;
pub use params::{Limits, Orientation, ParameterError, ParameterId, Parameters, Schedule, Switches};
pub use simulate::{Prepared, Run, RunError, simulate};
pub use start::{ChamberStart, Start};
pub use trajectory::{Outcome, Trajectory};
pub use valve::Valve;
