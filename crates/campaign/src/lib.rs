//! Measurement campaigns: recorded strokes and stroke times, read and checked.
//!
//! [`Campaign::read`] takes a `campaign.toml` and the CSV files that it names
//! and gives strokes in SI: time from the first row, position from the closed
//! stop, absolute pressures, command edges. What cannot be used is an error with
//! file and line; what can be used but looks wrong is a [`Warning`].
//!
//! Units convert here, through `quantity`, when a column is read: the unit comes
//! from `[columns]` or from the end of the column's name (`position_mm`).

mod columns;
mod conditions;
mod error;
pub mod guess;
mod levels;
mod noise;
mod outliers;
mod plausibility;
mod reader;
mod stated_noise;
mod time_column;
mod timing_doubts;
mod timing_noise;
mod timings;
mod trace;
mod types;
mod uncertainty;
mod warning;
mod words;

pub use error::{CampaignError, DataError, DataProblem};
pub use noise::{estimate_noise, estimate_position_noise_m, estimate_resolution, pooled_noise};
pub use timing_noise::TimingScatter;
pub use types::{
    Campaign, CommandEdge, Inputs, Outlier, PlannedRun, Run, RunConditions, Sensors, TimingRow, Trace, ValveFacts,
};
pub use uncertainty::Uncertainty;
pub use warning::{Doubt, Warning};
