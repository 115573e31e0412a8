//! One stroke's time over the severity of a degradation.

use crate::curve::{CurveError, MonotoneCubic};
use crate::stroke::Monotone;

/// The time of a stroke at some severity.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum TimeAt {
    /// The valve gets there after so many seconds.
    Within(f64),
    /// The valve does not get there within the cycle.
    NotReached,
    /// The severity is below the first of the table; the table says nothing.
    BelowRange,
    /// The severity is above the last at which the table has a time, and not yet
    /// at one where it says that the valve does not get there.
    AboveRange,
}

/// The severity at some time of a stroke.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum SeverityAt {
    /// So much, SI.
    Within(f64),
    /// The time belongs to a severity below the table's first: the valve is
    /// healthier than healthy.
    BelowRange,
    /// The time belongs to a severity above the last one at which the table
    /// has a time.
    AboveRange,
    /// The time does not tell: it is the same at many severities.
    Untold,
}

/// One column of a table: the time of a stroke over the severity, both ways.
/// Severities are SI: m2 for a leak, N for a friction, a share for a loss.
#[derive(Clone, Debug, PartialEq)]
pub struct TimingCurve {
    curve: MonotoneCubic,
    not_reached_from: Option<f64>,
}

impl TimingCurve {
    /// From the severities at which the valve gets there, their times, and the
    /// first severity of the table at which it does not. A time that need not
    /// move may stay as it is; any other must rise or fall strictly.
    pub(crate) fn new(
        severities: Vec<f64>,
        times_s: Vec<f64>,
        not_reached_from: Option<f64>,
        moves: bool,
    ) -> Result<Self, CurveError> {
        let curve = if moves { MonotoneCubic::new } else { MonotoneCubic::with_level_pieces };
        curve(severities, times_s).map(|curve| Self { curve, not_reached_from })
    }

    /// Which way the time goes as the severity grows; none if it is the same throughout.
    pub fn direction(&self) -> Option<Monotone> {
        let direction = if self.curve.is_rising() { Monotone::Rising } else { Monotone::Falling };
        (!self.curve.is_level()).then_some(direction)
    }

    /// First and last severity at which the table has a time.
    pub fn range(&self) -> (f64, f64) {
        let x = self.curve.x();
        (x[0], x[x.len() - 1])
    }

    /// The times at the two ends of [`range`](Self::range), in s.
    pub fn end_times_s(&self) -> (f64, f64) {
        let y = self.curve.y();
        (y[0], y[y.len() - 1])
    }

    /// The first severity of the table at which the stroke is not finished within
    /// the cycle; none if it always is.
    pub fn not_reached_from(&self) -> Option<f64> {
        self.not_reached_from
    }

    /// The time at a severity.
    pub fn time_at(&self, severity: f64) -> TimeAt {
        let (first, last) = self.range();
        if severity < first {
            TimeAt::BelowRange
        } else if severity <= last {
            TimeAt::Within(self.curve.value(severity))
        } else if self.not_reached_from.is_some_and(|from| severity >= from) {
            TimeAt::NotReached
        } else {
            TimeAt::AboveRange
        }
    }

    /// The severity at a time.
    pub fn severity_at(&self, time_s: f64) -> SeverityAt {
        let severity = self.curve.inverse(time_s);
        let (first, last) = self.range();
        if severity.is_infinite() || (severity.is_nan() && !time_s.is_nan()) {
            SeverityAt::Untold
        } else if severity < first {
            SeverityAt::BelowRange
        } else if severity <= last {
            SeverityAt::Within(severity)
        } else {
            SeverityAt::AboveRange
        }
    }

    /// Time in s and its derivative by the severity.
    ///
    /// Beyond the range the curve goes on along the straight line with the
    /// slope of its end. That is no statement about the valve: it lets an
    /// estimator see noise around a healthy valve as a severity slightly below
    /// zero instead of losing it. Use [`time_at`](Self::time_at) to tell.
    #[inline]
    pub fn extrapolated_time_and_slope(&self, severity: f64) -> (f64, f64) {
        self.curve.value_and_slope(severity)
    }

    /// The severity at a time: the inverse of
    /// [`extrapolated_time_and_slope`](Self::extrapolated_time_and_slope),
    /// straight lines beyond the range included.
    ///
    /// Finite wherever the time moves. Where it stays as it is, it is the last
    /// severity with this time; at and beyond a level end, infinite or not a number.
    #[inline]
    pub fn extrapolated_severity(&self, time_s: f64) -> f64 {
        self.curve.inverse(time_s)
    }
}
