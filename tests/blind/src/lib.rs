//! An emulator of pneumatic valves, written apart from the model it judges.
//!
//! It draws measurement campaigns with hidden effects from a seed. Nothing of the workspace is
//! used here: equations, integrator and file texts are this crate's own, so that a mistake of the
//! model cannot hide in its own mirror. Friction is a carpet of bristles, gas temperatures and the
//! pressure of the supply line are states, the solenoid's spool moves.

mod adaptive;
mod body;
mod bristle;
mod conditions;
mod measure;
mod orifice;
mod rig;
mod spool;

pub mod campaign;
pub mod draw;
pub mod effects;
pub mod hidden;
pub mod record;
pub mod strange;
pub mod truth;
pub mod valve;
pub mod world;

pub use campaign::{Campaign, PRESSURE_NOISE_PA};
pub use draw::{DrawSpec, draw};
pub use measure::INTERVAL_S;
pub use rig::{Conditions, STEP_S};
pub use spool::Edge;
