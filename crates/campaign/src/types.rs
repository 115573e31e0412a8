//! What a campaign holds, SI.

use crate::{Uncertainty, Warning};

/// What the reader needs to know of the valve.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ValveFacts {
    /// Atmospheric pressure, Pa absolute; gauge pressures count from it.
    pub ambient_pressure_pa: f64,
    /// Supply pressure of runs that do not say theirs, Pa absolute.
    pub supply_pressure_pa: f64,
    /// Temperature of runs that do not say theirs, K.
    pub temperature_k: f64,
    /// Travel between the stops, m; recorded motion is checked against it.
    pub stroke_m: f64,
}

/// Recorded strokes and stroke times of one valve.
#[derive(Debug, Clone, PartialEq)]
pub struct Campaign {
    /// Its name.
    pub name: String,
    /// Noise of the sensors, where it is stated.
    pub sensors: Sensors,
    /// How far instruments and conditions may be off, where it is stated.
    pub uncertainty: Uncertainty,
    /// Measured channels that are to drive the model.
    pub inputs: Inputs,
    /// Recorded runs, in the order of the file.
    pub runs: Vec<Run>,
    /// Runs that are only planned, in the order of the file.
    pub planned: Vec<PlannedRun>,
    /// Stroke times without traces, in the order of their file.
    pub timings: Vec<TimingRow>,
    /// What messages call the file of the stroke times, where there is one.
    pub timings_file: Option<String>,
    /// What looks wrong but can be used.
    pub warnings: Vec<Warning>,
}

/// One standard deviation of each kind of reading; `None` where it is not stated.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Sensors {
    /// Of a position, m.
    pub position_noise_m: Option<f64>,
    /// Of a pressure, Pa.
    pub pressure_noise_pa: Option<f64>,
    /// Of a stroke time, s.
    pub timing_noise_s: Option<f64>,
}

/// Which measured channels are to drive the model; every run then has the channel.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Inputs {
    /// The pipe pressure, in place of the solenoid side.
    pub pipe_pressure: bool,
    /// The chamber pressure, in place of the pneumatics.
    pub chamber_pressure: bool,
}

/// Under what conditions a stroke was made.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RunConditions {
    /// Supply pressure, Pa absolute.
    pub supply_pressure_pa: f64,
    /// Temperature, K.
    pub temperature_k: f64,
    /// Area of a leak to atmosphere opened on purpose, m², 0 for none.
    pub leak_to_atmosphere_m2: f64,
    /// Area of a leak from the supply opened on purpose, m², 0 for none.
    pub leak_from_supply_m2: f64,
}

/// A change of the command.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CommandEdge {
    /// Time from the first row of the trace, s.
    pub time_s: f64,
    /// True: the solenoid is energised, the valve is told to close.
    pub close: bool,
}

/// A recorded run.
#[derive(Debug, Clone, PartialEq)]
pub struct Run {
    /// Its file, as the campaign names it.
    pub file: String,
    /// Its conditions.
    pub conditions: RunConditions,
    /// What was recorded.
    pub trace: Trace,
    /// The command edges, at the time of the first row that has the new value. A command that is
    /// to close in the first row gives an edge at 0 s; a run that begins with the command to open
    /// begins at rest there, without an edge.
    pub commands: Vec<CommandEdge>,
    /// Whether the command was told from another channel by a threshold (`command_from`), so that each edge has a
    /// time error of its own; false where a command was recorded.
    pub commands_inferred: bool,
}

/// A run that has not been made yet.
#[derive(Debug, Clone, PartialEq)]
pub struct PlannedRun {
    /// Its name, or "planned run 1" and so on.
    pub name: String,
    /// Its conditions.
    pub conditions: RunConditions,
    /// The command edges, strictly increasing in time.
    pub commands: Vec<CommandEdge>,
    /// When its recording is to end, s, where it says so.
    pub end_s: Option<f64>,
}

/// Recorded channels; all have the length of `time_s`. A gap is NaN.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Trace {
    /// Time from the first row, s; strictly increasing, not necessarily even.
    pub time_s: Vec<f64>,
    /// Whether the valve is told to close.
    pub command_close: Vec<bool>,
    /// Position from the closed stop, m.
    pub position_m: Vec<f64>,
    /// Chamber pressure, Pa absolute.
    pub chamber_pressure_pa: Option<Vec<f64>>,
    /// Pipe pressure, Pa absolute.
    pub pipe_pressure_pa: Option<Vec<f64>>,
    /// Supply pressure, Pa absolute.
    pub supply_pressure_pa: Option<Vec<f64>>,
    /// Readings that no motion can have made; each of them is NaN in its channel. In the order of the channels above,
    /// then of time.
    pub outliers: Vec<Outlier>,
}

/// A reading that was taken out of a trace.
#[derive(Debug, Clone, PartialEq)]
pub struct Outlier {
    /// The channel: "position", "chamber pressure", "pipe pressure" or "supply pressure".
    pub channel: &'static str,
    /// Its index in `time_s`.
    pub row: usize,
    /// The line in the file, counted from 1.
    pub line: usize,
    /// Its time, as `time_s`, s.
    pub time_s: f64,
    /// What was read, in m or Pa.
    pub value: f64,
}

/// Stroke times of one cycle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TimingRow {
    /// The line in its file, counted from 1.
    pub line: usize,
    /// Its conditions.
    pub conditions: RunConditions,
    /// Closing time, s; `None`: it did not get there within the cycle, or was left out with a warning.
    pub close_time_s: Option<f64>,
    /// Opening time, s; `None` as above.
    pub open_time_s: Option<f64>,
}
