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

pub mod custom;
pub mod effects;
pub mod params;
pub mod real;

pub use effects::{Effect, EffectKind};
pub use params::{Limits, Orientation, ParameterError, ParameterId, Parameters, Schedule, Switches, Valve};
