//! The table of one degradation.

use crate::curve::CurveError;
use crate::degradation::Degradation;
use crate::error::RowError;
use crate::stroke::Stroke;
use crate::timing::TimingCurve;

/// The stroke times at one severity.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SeverityPoint {
    /// The severity, SI: a geometric area in m2 for a leak.
    pub severity: f64,
    /// Closing time in s; none if the valve does not close within the cycle.
    pub close_time_s: Option<f64>,
    /// Opening time in s; none if the valve does not open within the cycle.
    pub open_time_s: Option<f64>,
}

impl SeverityPoint {
    /// The time of one of the strokes.
    pub fn time_s(&self, stroke: Stroke) -> Option<f64> {
        match stroke {
            Stroke::Close => self.close_time_s,
            Stroke::Open => self.open_time_s,
        }
    }
}

/// Stroke times over the severity of one degradation.
///
/// The severities rise strictly from 0 or more. Each time that the degradation
/// moves is strictly monotone in the severity from the first row to the last at
/// which the stroke is finished; any other may also stay as it is. From some
/// severity on a time may be missing, which means that the valve does not get
/// there.
#[derive(Clone, Debug, PartialEq)]
pub struct SeverityTable {
    degradation: Degradation,
    points: Vec<SeverityPoint>,
    close: TimingCurve,
    open: TimingCurve,
}

impl SeverityTable {
    /// A table through the given points.
    ///
    /// # Errors
    /// If a severity is negative or does not rise, a time is not a positive
    /// number, a time is present again after a missing one, a column has fewer
    /// than two times or is not monotone. The error names the row.
    pub fn new(degradation: &Degradation, points: Vec<SeverityPoint>) -> Result<Self, RowError> {
        let what = &degradation.severity;
        for (row, point) in points.iter().enumerate() {
            let severity = point.severity;
            if !(severity.is_finite() && severity >= 0.0) {
                return Err(RowError::Severity {
                    row,
                    quantity: what.quantity.to_string(),
                    found: what.text(severity),
                });
            }
            if row > 0 && severity <= points[row - 1].severity {
                return Err(RowError::SeverityOrder {
                    row,
                    quantity: what.quantity.to_string(),
                    found: what.text(severity),
                    previous: what.text(points[row - 1].severity),
                });
            }
        }
        let close = column(degradation, &points, Stroke::Close)?;
        let open = column(degradation, &points, Stroke::Open)?;
        Ok(Self { degradation: degradation.clone(), points, close, open })
    }

    /// What wears.
    pub fn degradation(&self) -> &Degradation {
        &self.degradation
    }

    /// The points as given.
    pub fn points(&self) -> &[SeverityPoint] {
        &self.points
    }

    /// First and last severity of the table.
    pub fn range(&self) -> (f64, f64) {
        // `column` has refused tables with fewer than two points.
        (self.points[0].severity, self.points[self.points.len() - 1].severity)
    }

    /// The time of one stroke over the severity.
    #[inline]
    pub fn curve(&self, stroke: Stroke) -> &TimingCurve {
        match stroke {
            Stroke::Close => &self.close,
            Stroke::Open => &self.open,
        }
    }
}

/// Checks one column and makes a curve of the rows at which it has a time.
fn column(degradation: &Degradation, points: &[SeverityPoint], stroke: Stroke) -> Result<TimingCurve, RowError> {
    let finished = points.iter().take_while(|p| p.time_s(stroke).is_some()).count();
    if let Some(row) = (finished..points.len()).find(|&row| points[row].time_s(stroke).is_some()) {
        return Err(RowError::TimeAfterGap { row, stroke });
    }
    let times: Vec<f64> = points.iter().filter_map(|p| p.time_s(stroke)).collect();
    if let Some(row) = times.iter().position(|t| !(t.is_finite() && *t >= 0.0)) {
        return Err(RowError::Time { row, stroke, found_s: times[row] });
    }
    let severities = points[..finished].iter().map(|p| p.severity).collect();
    let not_reached_from = points.get(finished).map(|p| p.severity);
    let moves = degradation.moves.stroke(stroke).is_some();
    TimingCurve::new(severities, times.clone(), not_reached_from, moves).map_err(|error| match error {
        CurveError::NotMonotone { index: row } => {
            RowError::NotMonotone { row, stroke, found_s: times[row], previous_s: times[row - 1] }
        }
        // Severities and times have been checked above, so that a short column is
        // the only complaint left.
        _ => RowError::TooFew { stroke, found: finished },
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fault::Fault;
    use crate::stroke::Monotone;
    use crate::timing::{SeverityAt, TimeAt};

    fn point(area_mm2: f64, close: Option<f64>, open: Option<f64>) -> SeverityPoint {
        SeverityPoint { severity: area_mm2 * 1e-6, close_time_s: close, open_time_s: open }
    }

    fn rows() -> Vec<SeverityPoint> {
        vec![
            point(0.0, Some(1.0), Some(2.0)),
            point(0.1, Some(1.5), Some(1.6)),
            point(0.2, Some(2.5), Some(1.3)),
            point(0.3, None, Some(1.1)),
        ]
    }

    #[test]
    fn says_where_it_knows_and_where_it_does_not() {
        let table = SeverityTable::new(Fault::Atmosphere.degradation(), rows()).expect("rows are monotone");
        let close = table.curve(Stroke::Close);
        assert_eq!(close.direction(), Some(Monotone::Rising));
        assert_eq!(table.curve(Stroke::Open).direction(), Some(Monotone::Falling));
        assert_eq!(close.time_at(0.2e-6), TimeAt::Within(2.5));
        assert_eq!(close.time_at(-0.01e-6), TimeAt::BelowRange);
        assert_eq!(close.time_at(0.25e-6), TimeAt::AboveRange);
        assert_eq!(close.time_at(0.3e-6), TimeAt::NotReached);
        assert_eq!(table.curve(Stroke::Open).time_at(0.31e-6), TimeAt::AboveRange);
        assert_eq!(close.severity_at(0.9), SeverityAt::BelowRange);
        assert_eq!(close.severity_at(2.6), SeverityAt::AboveRange);
        assert!(matches!(close.severity_at(1.5), SeverityAt::Within(a) if (a - 0.1e-6).abs() < 1e-20));
    }

    #[test]
    fn a_time_that_need_not_move_may_stay_and_then_does_not_tell() {
        let exhaust = Degradation::from_id("exhaust").expect("of the catalogue");
        let rows = |close: [f64; 4]| {
            let point = |i: usize| point(0.1e6 * i as f64, Some(close[i]), Some(2.0 + i as f64));
            (0..4).map(point).collect::<Vec<_>>()
        };
        let table = SeverityTable::new(exhaust, rows([1.0, 1.0, 1.0, 0.9])).expect("stays, then falls");
        let close = table.curve(Stroke::Close);
        assert_eq!(close.direction(), Some(Monotone::Falling));
        assert_eq!(close.severity_at(1.1), SeverityAt::Untold);
        assert!(matches!(close.severity_at(0.95), SeverityAt::Within(s) if s > 0.2 && s < 0.3));
        let level = SeverityTable::new(exhaust, rows([1.0; 4])).expect("stays");
        assert_eq!(level, level.clone());
        assert_eq!(level.curve(Stroke::Close).direction(), None);
        assert_eq!(level.curve(Stroke::Close).severity_at(1.0), SeverityAt::Untold);
        SeverityTable::new(Fault::Atmosphere.degradation(), rows([1.0; 4])).expect_err("a leak moves both");
    }

    #[test]
    fn refuses_rows_that_are_no_table() {
        let refuse = |change: &dyn Fn(&mut Vec<SeverityPoint>)| {
            let mut rows = rows();
            change(&mut rows);
            SeverityTable::new(Fault::Atmosphere.degradation(), rows).expect_err("is no table")
        };
        let stroke = Stroke::Close;
        assert_eq!(
            refuse(&|r| r[3].close_time_s = Some(2.5)),
            RowError::NotMonotone { row: 3, stroke, found_s: 2.5, previous_s: 2.5 }
        );
        assert_eq!(refuse(&|r| r[1].close_time_s = None), RowError::TimeAfterGap { row: 2, stroke });
        assert_eq!(refuse(&|r| r.truncate(1)), RowError::TooFew { stroke, found: 1 });
        assert!(matches!(refuse(&|r| r[0].close_time_s = Some(f64::NAN)), RowError::Time { row: 0, .. }));
        assert!(matches!(refuse(&|r| r.swap(1, 2)), RowError::SeverityOrder { row: 2, .. }));
        assert!(matches!(refuse(&|r| r[0].severity = -1e-9), RowError::Severity { row: 0, .. }));
    }
}
