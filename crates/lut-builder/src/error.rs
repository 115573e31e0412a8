//! Why a table cannot be built, and what to know about one that was.

use leak_table::{Fault, Stroke, TableError, mm2_from_m2};
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
    /// The valve does not stroke although it does not leak.
    #[error(
        "the {stroke} stroke of the valve without an additional leak is not finished within the {window_s} s that the cycle gives it, expected a valve that strokes while healthy; check its parameters or give the cycle more time"
    )]
    HealthyNotFinished {
        /// The stroke.
        stroke: Stroke,
        /// The time from its command to the next, s.
        window_s: f64,
    },
    /// The valve is beyond a limit although it does not leak.
    #[error(
        "the {stroke} stroke of the valve without an additional leak takes {found_s:.4} s, expected at most the limit of {limit_s} s: the valve is at its end of life already; raise the limit or check the parameters"
    )]
    HealthyBeyondLimit {
        /// The stroke.
        stroke: Stroke,
        /// Its time, s.
        found_s: f64,
        /// Its limit, s.
        limit_s: f64,
    },
    /// No leak takes the valve to a limit.
    #[error(
        "fault \"{fault}\": up to a leak of {} mm2 the valve closes in {close_time_s:.4} s and opens in {open_time_s:.4} s, expected a leak at which a limit is crossed; give limits below these times",
        mm2_from_m2(*largest_m2)
    )]
    LimitNotReached {
        /// The fault.
        fault: Fault,
        /// The largest leak simulated, m2.
        largest_m2: f64,
        /// The closing time there, s.
        close_time_s: f64,
        /// The opening time there, s.
        open_time_s: f64,
    },
    /// A stroke time is no monotone function of the leak.
    #[error(
        "fault \"{fault}\": the {stroke} time turns at a leak of {} mm2 (found {found_s:.6} s after {previous_s:.6} s at {} mm2), expected it to keep rising or falling up to the limit: such a time does not tell the leak; check the valve's effects, or give a limit below",
        mm2_from_m2(*area_m2), mm2_from_m2(*previous_m2)
    )]
    NotMonotone {
        /// The fault.
        fault: Fault,
        /// The stroke.
        stroke: Stroke,
        /// The leak at which it turns, m2.
        area_m2: f64,
        /// The time there, s.
        found_s: f64,
        /// The leak before it, m2.
        previous_m2: f64,
        /// The time there, s.
        previous_s: f64,
    },
    /// A stroke time jumps.
    #[error(
        "fault \"{fault}\": the {stroke} time jumps at a leak of {} mm2 (the interpolation misses it by {error_s:.6} s between points that cannot be closer), expected a continuous curve up to the limit; check the valve's effects, or give a limit below",
        mm2_from_m2(*area_m2)
    )]
    Jump {
        /// The fault.
        fault: Fault,
        /// The stroke.
        stroke: Stroke,
        /// The leak, m2.
        area_m2: f64,
        /// The interpolation error there, s.
        error_s: f64,
    },
    /// The cycle does not repeat itself.
    #[error(
        "fault \"{fault}\": at a leak of {} mm2 the stroke times still change after {cycles} cycles, expected the cycle to repeat itself; give it more time between the strokes",
        mm2_from_m2(*area_m2)
    )]
    NotPeriodic {
        /// The fault.
        fault: Fault,
        /// The leak, m2.
        area_m2: f64,
        /// Cycles simulated.
        cycles: usize,
    },
    /// The simulation failed.
    #[error(
        "fault \"{fault}\": at a leak of {} mm2 the simulation gives a {stroke} time of {found_s} s, expected a number of at least 0; the parameters are too stiff for the integrator",
        mm2_from_m2(*area_m2)
    )]
    NotFinite {
        /// The fault.
        fault: Fault,
        /// The stroke.
        stroke: Stroke,
        /// The leak, m2.
        area_m2: f64,
        /// The time found, s.
        found_s: f64,
    },
    /// The curve needs too many points.
    #[error(
        "fault \"{fault}\": found a curve that needs more than {most} points, expected fewer; allow a larger error"
    )]
    TooManyPoints {
        /// The fault.
        fault: Fault,
        /// The number allowed.
        most: usize,
    },
    /// The rows do not make a bundle.
    #[error(transparent)]
    Table(#[from] TableError),
}

/// What to know about tables that were built.
#[derive(Debug, Clone, Copy, PartialEq, Error)]
pub enum Notice {
    /// A limit is longer than the cycle gives the stroke.
    #[error(
        "fault \"{fault}\": the {stroke} limit of {limit_s} s is not below the {window_s} s that the cycle gives the stroke; the leak at which the stroke is not finished counts as the end of life"
    )]
    LimitBeyondCycle {
        /// The fault.
        fault: Fault,
        /// The stroke.
        stroke: Stroke,
        /// Its limit, s.
        limit_s: f64,
        /// The time from its command to the next, s.
        window_s: f64,
    },
    /// The table ends before the valve stalls.
    #[error(
        "fault \"{fault}\": the table ends at {} mm2, beyond the limit, since the {stroke} time is not a smooth monotone function of the leak from there on",
        mm2_from_m2(*area_m2)
    )]
    EndsEarly {
        /// The fault.
        fault: Fault,
        /// The stroke.
        stroke: Stroke,
        /// The last leak of the table, m2.
        area_m2: f64,
    },
}
