//! One stroke's time over the leak area.

use crate::curve::{CurveError, MonotoneCubic};
use crate::fault::Direction;

/// The time of a stroke at some leak area.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum TimeAt {
    /// The valve gets there after so many seconds.
    Within(f64),
    /// The valve does not get there within the cycle.
    NotReached,
    /// The area is below the first of the table; the table says nothing.
    BelowRange,
    /// The area is above the last at which the table has a time, and not yet
    /// at one where it says that the valve does not get there.
    AboveRange,
}

/// The leak area at some time of a stroke.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum AreaAt {
    /// So many m2.
    Within(f64),
    /// The time belongs to a leak smaller than the table's first: the valve is
    /// healthier than healthy.
    BelowRange,
    /// The time belongs to a leak larger than the last one at which the table
    /// has a time.
    AboveRange,
}

/// One column of a table: the time of a stroke over the leak area, both ways.
#[derive(Clone, Debug, PartialEq)]
pub struct TimingCurve {
    curve: MonotoneCubic,
    not_reached_from_m2: Option<f64>,
}

impl TimingCurve {
    /// From the areas at which the valve gets there, their times, and the
    /// first area of the table at which it does not.
    pub(crate) fn new(
        areas_m2: Vec<f64>,
        times_s: Vec<f64>,
        not_reached_from_m2: Option<f64>,
    ) -> Result<Self, CurveError> {
        MonotoneCubic::new(areas_m2, times_s).map(|curve| Self { curve, not_reached_from_m2 })
    }

    /// Which way the time goes as the leak grows.
    pub fn direction(&self) -> Direction {
        if self.curve.is_rising() { Direction::Rising } else { Direction::Falling }
    }

    /// First and last area at which the table has a time, in m2.
    pub fn range_m2(&self) -> (f64, f64) {
        let x = self.curve.x();
        (x[0], x[x.len() - 1])
    }

    /// The times at the two ends of [`range_m2`](Self::range_m2), in s.
    pub fn end_times_s(&self) -> (f64, f64) {
        let y = self.curve.y();
        (y[0], y[y.len() - 1])
    }

    /// The first area of the table at which the stroke is not finished within
    /// the cycle, in m2; none if it always is.
    pub fn not_reached_from_m2(&self) -> Option<f64> {
        self.not_reached_from_m2
    }

    /// The time at a leak area.
    pub fn time_at(&self, area_m2: f64) -> TimeAt {
        let (first, last) = self.range_m2();
        if area_m2 < first {
            TimeAt::BelowRange
        } else if area_m2 <= last {
            TimeAt::Within(self.curve.value(area_m2))
        } else if self.not_reached_from_m2.is_some_and(|from| area_m2 >= from) {
            TimeAt::NotReached
        } else {
            TimeAt::AboveRange
        }
    }

    /// The leak area at a time.
    pub fn area_at(&self, time_s: f64) -> AreaAt {
        let area_m2 = self.curve.inverse(time_s);
        let (first, last) = self.range_m2();
        if area_m2 < first {
            AreaAt::BelowRange
        } else if area_m2 <= last {
            AreaAt::Within(area_m2)
        } else {
            AreaAt::AboveRange
        }
    }

    /// Time in s and its derivative by the leak area in s/m2.
    ///
    /// Beyond the range the curve goes on along the straight line with the
    /// slope of its end. That is no statement about the valve: it lets an
    /// estimator see noise around a healthy valve as a leak slightly below
    /// zero instead of losing it. Use [`time_at`](Self::time_at) to tell.
    #[inline]
    pub fn extrapolated_time_and_slope(&self, area_m2: f64) -> (f64, f64) {
        self.curve.value_and_slope(area_m2)
    }

    /// The leak area in m2 at a time: the inverse of
    /// [`extrapolated_time_and_slope`](Self::extrapolated_time_and_slope),
    /// straight lines beyond the range included.
    #[inline]
    pub fn extrapolated_area(&self, time_s: f64) -> f64 {
        self.curve.inverse(time_s)
    }
}
