//! The table of one fault.

use crate::curve::CurveError;
use crate::error::RowError;
use crate::fault::{Fault, Stroke};
use crate::timing::TimingCurve;

/// The stroke times at one leak area.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LeakPoint {
    /// Geometric leak area in m2.
    pub leak_area_m2: f64,
    /// Closing time in s; none if the valve does not close within the cycle.
    pub close_time_s: Option<f64>,
    /// Opening time in s; none if the valve does not open within the cycle.
    pub open_time_s: Option<f64>,
}

impl LeakPoint {
    /// The time of one of the strokes.
    pub fn time_s(&self, stroke: Stroke) -> Option<f64> {
        match stroke {
            Stroke::Close => self.close_time_s,
            Stroke::Open => self.open_time_s,
        }
    }
}

/// Stroke times over the area of one kind of leak.
///
/// The areas rise strictly. Each time is strictly monotone in the area from
/// the first row to the last at which the stroke is finished; from some area on
/// it may be missing, which means that the valve does not get there.
#[derive(Clone, Debug, PartialEq)]
pub struct LeakTable {
    fault: Fault,
    points: Vec<LeakPoint>,
    close: TimingCurve,
    open: TimingCurve,
}

impl LeakTable {
    /// A table through the given points.
    ///
    /// # Errors
    /// If an area is negative or does not rise, a time is not a positive
    /// number, a time is present again after a missing one, a column has fewer
    /// than two times or is not strictly monotone. The error names the row.
    pub fn new(fault: Fault, points: Vec<LeakPoint>) -> Result<Self, RowError> {
        for (row, point) in points.iter().enumerate() {
            let area = point.leak_area_m2;
            if !(area.is_finite() && area >= 0.0) {
                return Err(RowError::Area { row, found_m2: area });
            }
            if row > 0 && area <= points[row - 1].leak_area_m2 {
                let previous_m2 = points[row - 1].leak_area_m2;
                return Err(RowError::AreaOrder { row, found_m2: area, previous_m2 });
            }
        }
        let close = column(&points, Stroke::Close)?;
        let open = column(&points, Stroke::Open)?;
        Ok(Self { fault, points, close, open })
    }

    /// The kind of leak.
    pub fn fault(&self) -> Fault {
        self.fault
    }

    /// The points as given.
    pub fn points(&self) -> &[LeakPoint] {
        &self.points
    }

    /// First and last leak area of the table in m2.
    pub fn range_m2(&self) -> (f64, f64) {
        // `column` has refused tables with fewer than two points.
        (self.points[0].leak_area_m2, self.points[self.points.len() - 1].leak_area_m2)
    }

    /// The time of one stroke over the leak area.
    #[inline]
    pub fn curve(&self, stroke: Stroke) -> &TimingCurve {
        match stroke {
            Stroke::Close => &self.close,
            Stroke::Open => &self.open,
        }
    }
}

/// Checks one column and makes a curve of the rows at which it has a time.
fn column(points: &[LeakPoint], stroke: Stroke) -> Result<TimingCurve, RowError> {
    let finished = points.iter().take_while(|p| p.time_s(stroke).is_some()).count();
    if let Some(row) = (finished..points.len()).find(|&row| points[row].time_s(stroke).is_some()) {
        return Err(RowError::TimeAfterGap { row, stroke });
    }
    let times: Vec<f64> = points.iter().filter_map(|p| p.time_s(stroke)).collect();
    if let Some(row) = times.iter().position(|t| !(t.is_finite() && *t >= 0.0)) {
        return Err(RowError::Time { row, stroke, found_s: times[row] });
    }
    let areas = points[..finished].iter().map(|p| p.leak_area_m2).collect();
    let not_reached_from_m2 = points.get(finished).map(|p| p.leak_area_m2);
    TimingCurve::new(areas, times.clone(), not_reached_from_m2).map_err(|error| match error {
        CurveError::NotMonotone { index: row } => {
            RowError::NotMonotone { row, stroke, found_s: times[row], previous_s: times[row - 1] }
        }
        // Areas and times have been checked above, so that a short column is
        // the only complaint left.
        _ => RowError::TooFew { stroke, found: finished },
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fault::Direction;
    use crate::timing::{AreaAt, TimeAt};

    fn point(area_mm2: f64, close: Option<f64>, open: Option<f64>) -> LeakPoint {
        LeakPoint { leak_area_m2: area_mm2 * 1e-6, close_time_s: close, open_time_s: open }
    }

    fn rows() -> Vec<LeakPoint> {
        vec![
            point(0.0, Some(1.0), Some(2.0)),
            point(0.1, Some(1.5), Some(1.6)),
            point(0.2, Some(2.5), Some(1.3)),
            point(0.3, None, Some(1.1)),
        ]
    }

    #[test]
    fn says_where_it_knows_and_where_it_does_not() {
        let table = LeakTable::new(Fault::Atmosphere, rows()).expect("rows are monotone");
        let close = table.curve(Stroke::Close);
        assert_eq!(close.direction(), Direction::Rising);
        assert_eq!(table.curve(Stroke::Open).direction(), Direction::Falling);
        assert_eq!(close.time_at(0.2e-6), TimeAt::Within(2.5));
        assert_eq!(close.time_at(-0.01e-6), TimeAt::BelowRange);
        assert_eq!(close.time_at(0.25e-6), TimeAt::AboveRange);
        assert_eq!(close.time_at(0.3e-6), TimeAt::NotReached);
        assert_eq!(table.curve(Stroke::Open).time_at(0.31e-6), TimeAt::AboveRange);
        assert_eq!(close.area_at(0.9), AreaAt::BelowRange);
        assert_eq!(close.area_at(2.6), AreaAt::AboveRange);
        assert!(matches!(close.area_at(1.5), AreaAt::Within(a) if (a - 0.1e-6).abs() < 1e-20));
    }

    #[test]
    fn refuses_rows_that_are_no_table() {
        let refuse = |change: &dyn Fn(&mut Vec<LeakPoint>)| {
            let mut rows = rows();
            change(&mut rows);
            LeakTable::new(Fault::Atmosphere, rows).expect_err("is no table")
        };
        let stroke = Stroke::Close;
        assert_eq!(
            refuse(&|r| r[3].close_time_s = Some(2.5)),
            RowError::NotMonotone { row: 3, stroke, found_s: 2.5, previous_s: 2.5 }
        );
        assert_eq!(refuse(&|r| r[1].close_time_s = None), RowError::TimeAfterGap { row: 2, stroke });
        assert_eq!(refuse(&|r| r.truncate(1)), RowError::TooFew { stroke, found: 1 });
        assert!(matches!(refuse(&|r| r[0].close_time_s = Some(f64::NAN)), RowError::Time { row: 0, .. }));
        assert!(matches!(refuse(&|r| r.swap(1, 2)), RowError::AreaOrder { row: 2, .. }));
        assert!(matches!(refuse(&|r| r[0].leak_area_m2 = -1e-9), RowError::Area { row: 0, .. }));
    }
}
