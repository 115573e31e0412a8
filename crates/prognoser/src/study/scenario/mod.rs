//! What becomes of a prognosis when a plant is not as assumed: whole lives of
//! made-up worlds, each with a known end, through the same prognoser as real
//! logs.
//!
//! The generator shares no code with the estimator: growth, noise and
//! conditions are made here, stroke times come from a [`World`], which is a
//! simulation or whatever else the caller takes for the truth.
//!
//! # Definitions
//! A life counts from two cycles after its wear begins to grow (after its
//! repair, in the world with a repair: what was before it had another end) to
//! the last cycle before its end K.
//!
//! - **Relative accuracy**: as in [`study`](super), of the `rul_cycles` of a
//!   row; a row without one counts as an error of 100 %. Median over the lives.
//! - **Coverage**: share of the rows with an interval whose 5 to 95 % interval
//!   holds the true remaining life.
//! - **Named wrongly**: share of the lives in which a fault is ever named that
//!   is not there, or the valve is said to be healthy while its wear is above
//!   [`SEVERE`] of the limit. A group of faults is right if the true one is in it.
//! - **Named rightly**: share of the lives in which the right fault, or a group
//!   with it, is named in the last row.
//! - **Ended early**: share of the lives with an `eol-reached` more than one
//!   cycle before the end, and before a stroke really takes longer than its limit,
//!   as it may under a supply pressure below that of the reference.
//! - **Failed in service**: share of the lives that end although the valve is
//!   replaced as soon as `replace_by_cycle` says that the next cycle is too late.
//! - **Life given away**: median share of the life that is left at that
//!   replacement.

mod catalogue;
mod life;
mod path;
mod run;
mod score;
mod world;

pub use catalogue::Scenario;
pub use run::{ScenarioConfig, run_scenarios};
pub use score::{SEVERE, ScenarioResult};
pub use world::{ValveState, Wear, World};
