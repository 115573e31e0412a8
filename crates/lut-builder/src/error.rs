//! Why a table cannot be built, and what to know about one that was.

use leak_table::{ConditionsError, RowError, Stroke, TableError};
use thiserror::Error;
use valve_model::ParameterError;

/// Why a table cannot be built.
#[derive(Debug, Error)]
pub enum BuildError {
    /// An option is impossible.
    #[error("{name}: found {found}, expected {expected}")]
    Option {
        /// The option.
        name: &'static str,
        /// Its value.
        found: f64,
        /// What would be right.
        expected: &'static str,
    },
    /// Schedule or limits are impossible.
    #[error(transparent)]
    Parameter(#[from] ParameterError),
    /// The valve does not stroke although it is sound.
    #[error(
        "the {stroke} stroke of the sound valve is not finished within the {window_s} s that the cycle gives it, expected a valve that strokes while healthy; check its parameters or give the cycle more time"
    )]
    HealthyNotFinished {
        /// The stroke.
        stroke: Stroke,
        /// The time from its command to the next, s.
        window_s: f64,
    },
    /// The valve is beyond a limit although it is sound.
    #[error(
        "the {stroke} stroke of the sound valve takes {found_s:.4} s, expected at most the limit of {limit_s} s: the valve is at its end of life already; raise the limit or check the parameters"
    )]
    HealthyBeyondLimit {
        /// The stroke.
        stroke: Stroke,
        /// Its time, s.
        found_s: f64,
        /// Its limit, s.
        limit_s: f64,
    },
    /// Nothing takes the valve to a limit.
    #[error(
        "fault \"{fault}\": up to {largest} the valve closes in {close_time_s:.4} s and opens in {open_time_s:.4} s, expected that a limit is crossed before; give limits below these times"
    )]
    LimitNotReached {
        /// The id of what wears.
        fault: String,
        /// The largest severity simulated, in words.
        largest: String,
        /// The closing time there, s.
        close_time_s: f64,
        /// The opening time there, s.
        open_time_s: f64,
    },
    /// A stroke time is no monotone function of the severity.
    #[error(
        "fault \"{fault}\": the {stroke} time turns at {at} (found {found_s:.6} s, {moved_ms:+.2e} ms from that at {previous}), expected it to keep rising or falling up to the limit: such a time does not tell how worn the valve is; check the valve's effects, or state limits under [limits] that are reached before",
        moved_ms = 1e3 * (.found_s - .previous_s)
    )]
    NotMonotone {
        /// The id of what wears.
        fault: String,
        /// The stroke.
        stroke: Stroke,
        /// The severity at which it turns, in words.
        at: String,
        /// The time there, s.
        found_s: f64,
        /// The severity before it, in words.
        previous: String,
        /// The time there, s.
        previous_s: f64,
    },
    /// The cycle does not repeat itself.
    #[error(
        "fault \"{fault}\": at {at} the stroke times still change after {cycles} cycles, expected the cycle to repeat itself; give it more time between the strokes"
    )]
    NotPeriodic {
        /// The id of what wears.
        fault: String,
        /// The severity, in words.
        at: String,
        /// Cycles simulated.
        cycles: usize,
    },
    /// The simulation failed.
    #[error(
        "fault \"{fault}\": at {at} the simulation gives a {stroke} time of {found_s} s, expected a number of at least 0; the parameters are too stiff for the integrator"
    )]
    NotFinite {
        /// The id of what wears.
        fault: String,
        /// The stroke.
        stroke: Stroke,
        /// The severity, in words.
        at: String,
        /// The time found, s.
        found_s: f64,
    },
    /// The user's own formula is no number on the way.
    #[error(
        "fault \"{fault}\": at {at} the formula of a custom effect is no number {time_s:.3} s after the start of the cycle, expected one wherever the worn valve goes"
    )]
    NoNumber {
        /// The id of what wears.
        fault: String,
        /// The severity, in words.
        at: String,
        /// When the simulation stopped, s.
        time_s: f64,
    },
    /// A severity makes the valve an impossible one.
    #[error("fault \"{fault}\": at {at} the valve is impossible: {source}")]
    Worn {
        /// The id of what wears.
        fault: String,
        /// The severity, in words.
        at: String,
        /// What is impossible.
        source: Box<ParameterError>,
    },
    /// The sound valve does not stroke under conditions that were asked for.
    #[error(
        "at a supply pressure of {supply_pressure_pa} Pa absolute and {temperature_k} K the {stroke} stroke of the sound valve is not finished within the cycle, expected conditions under which it strokes; give a range without them"
    )]
    SoundNotFinished {
        /// The stroke.
        stroke: Stroke,
        /// The supply pressure, Pa absolute.
        supply_pressure_pa: f64,
        /// The temperature, K.
        temperature_k: f64,
    },
    /// A table over conditions ends before a limit.
    #[error(
        "fault \"{fault}\": at a supply pressure of {supply_pressure_pa} Pa absolute and {temperature_k} K no limit is crossed in the table over conditions, expected one everywhere; give a smaller range of conditions"
    )]
    LimitOutsideConditions {
        /// The id of what wears.
        fault: String,
        /// The supply pressure, Pa absolute.
        supply_pressure_pa: f64,
        /// The temperature, K.
        temperature_k: f64,
    },
    /// A table over conditions cannot be made as accurate as asked.
    #[error(
        "fault \"{fault}\": found stroke times that are no smooth function of pressure and temperature, expected one that a table can follow; give a smaller range of conditions: at {supply_pressure_pa} Pa absolute and {temperature_k} K a stroke is not finished any more with {:.0} % of what stalls the valve under its own conditions",
        100.0 * least_share
    )]
    NotSmooth {
        /// The id of what wears.
        fault: String,
        /// Where the valve bears least: the supply pressure, Pa absolute.
        supply_pressure_pa: f64,
        /// The temperature there, K.
        temperature_k: f64,
        /// What it bears there, as a share of what it bears under its own conditions.
        least_share: f64,
    },
    /// The times over conditions do not make a table.
    #[error("fault \"{fault}\": {source}")]
    Grid {
        /// The id of what wears.
        fault: String,
        /// What is wrong.
        source: Box<RowError>,
    },
    /// The range of conditions is none.
    #[error(transparent)]
    Conditions(#[from] ConditionsError),
    /// The curve needs too many points.
    #[error(
        "fault \"{fault}\": found a curve that needs more than {most} points, expected fewer; allow a larger error"
    )]
    TooManyPoints {
        /// The id of what wears.
        fault: String,
        /// The number allowed.
        most: usize,
    },
    /// The rows do not make a bundle.
    #[error(transparent)]
    Table(#[from] TableError),
}

impl BuildError {
    /// Whether it is the range of conditions that a table cannot be built over.
    #[must_use]
    pub fn is_of_conditions(&self) -> bool {
        matches!(
            self,
            Self::SoundNotFinished { .. }
                | Self::LimitOutsideConditions { .. }
                | Self::NotSmooth { .. }
                | Self::Grid { .. }
                | Self::Conditions(_)
        )
    }
}

/// What to know about tables that were built.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum Notice {
    /// Something else than a leak has no table.
    #[error("no table of \"{fault}\": {reason}")]
    Omitted {
        /// The id of what wears.
        fault: String,
        /// Why.
        reason: String,
    },
    /// Something else than a leak has a table under the valve's own conditions alone.
    #[error(
        "no table of \"{fault}\" over pressure and temperature: {reason}; under others than the valve's own its times are taken to change as those of the sound valve do"
    )]
    NotOverConditions {
        /// The id of what wears.
        fault: String,
        /// Why.
        reason: String,
    },
    /// Times over the conditions are no smooth function of them.
    #[error(
        "fault \"{fault}\": the stroke times turn to and fro over pressure and temperature, as friction that sticks and slips lets them; the table goes through their middle, up to {:.0} ms off at what was simulated between its points",
        1e3 * by_s
    )]
    RoughOverConditions {
        /// The id of what wears.
        fault: String,
        /// How far a time is off up to the limit, at worst, s.
        by_s: f64,
    },
    /// A limit is longer than the cycle gives the stroke.
    #[error(
        "fault \"{fault}\": the {stroke} limit of {limit_s} s is not below the {window_s} s that the cycle gives the stroke; the severity at which the stroke is not finished counts as the end of life"
    )]
    LimitBeyondCycle {
        /// The id of what wears.
        fault: String,
        /// The stroke.
        stroke: Stroke,
        /// Its limit, s.
        limit_s: f64,
        /// The time from its command to the next, s.
        window_s: f64,
    },
    /// Times wander by more than a table is asked to be accurate to.
    #[error(
        "fault \"{fault}\": the stroke times wander by up to {:.1} ms from cycle to cycle and from one severity to the next, as friction that sticks and slips lets them; the table goes through their middle",
        1e3 * by_s
    )]
    Uneven {
        /// The id of what wears.
        fault: String,
        /// By how much, at worst, s.
        by_s: f64,
    },
    /// A stroke time jumps before the limit.
    #[error(
        "fault \"{fault}\": the {stroke} time jumps, by {:+.1} ms at {at}{}; the table has the jumps, and a time within one stands for its severity",
        1e3 * by_s,
        if *.places > 1 { format!(" and by less at {} more", .places - 1) } else { String::new() }
    )]
    Jumps {
        /// The id of what wears.
        fault: String,
        /// The stroke.
        stroke: Stroke,
        /// At how many severities.
        places: usize,
        /// The severity of the widest, in words.
        at: String,
        /// By how much it jumps there, s.
        by_s: f64,
    },
    /// The table ends before the valve stalls.
    #[error(
        "fault \"{fault}\": the table ends at {at}, beyond the limit, since the {stroke} time is not a smooth monotone function from there on"
    )]
    EndsEarly {
        /// The id of what wears.
        fault: String,
        /// The stroke.
        stroke: Stroke,
        /// The last severity of the table, in words.
        at: String,
    },
}
