//! Points where the curve bends.
//!
//! Every gap between two points is simulated at three areas. Where the interpolation misses one of
//! them, that one becomes a point, and the two new gaps are measured in turn. Whatever was simulated
//! and is no point measures the error of the table in the end.

use leak_table::{CurveError, TableError};
use leak_table::{FaultInfo, InterpolationError, LeakPoint, LeakTable, MonotoneCubic, RowError, Stroke, StrokeInfo};

use crate::FaultTable;
use crate::area::{self, Area};
use crate::error::{BuildError, Notice};
use crate::limit::LimitAreas;
use crate::progress::Stage;
use crate::range::Range;
use crate::sweep::Sweep;

/// Points placed to start with are at least this share of the range apart.
const FIRST_SPACING: u64 = 24;
/// Where in a gap it is measured: any sample from the first to the last share will do, else one is
/// simulated at the share in the middle.
const ZONES: [[f64; 3]; 3] = [[0.15, 0.27, 0.4], [0.4, 0.5, 0.6], [0.6, 0.73, 0.85]];
/// The share of the tolerance that measured errors may use.
const MARGIN: f64 = 0.5;
/// Gaps narrower than this share of the range are not cut: a curve that needs it jumps.
const NARROWEST: f64 = 1e-7;

/// The points so far.
struct Refinement<'a> {
    sweep: Sweep<'a>,
    range: Range,
    limits: LimitAreas,
    notices: Vec<Notice>,
    knots: Vec<Area>,
}

/// A stroke time that no table can hold, between two points or at one.
struct Obstacle {
    /// Points up to this one are sound.
    sound: Area,
    /// The area of the trouble.
    at: Area,
    stroke: Stroke,
    error: BuildError,
}

/// By how much the interpolation misses one simulated time.
#[derive(Clone, Copy)]
struct Miss {
    stroke: Stroke,
    /// As a share of the tolerance.
    share: f64,
    error_s: f64,
}

/// Places points until the table is as accurate as asked.
pub(crate) fn refine(
    sweep: Sweep<'_>,
    range: Range,
    limits: LimitAreas,
    notices: Vec<Notice>,
) -> Result<FaultTable, BuildError> {
    let mut refinement = Refinement { sweep, range, limits, notices, knots: Vec::new() };
    refinement.place_first();
    loop {
        let curves = match refinement.curves() {
            Ok(curves) => curves,
            Err(obstacle) => {
                refinement.end_before(obstacle)?;
                continue;
            }
        };
        if refinement.measure()? {
            continue;
        }
        match refinement.cut(&curves) {
            Ok(false) => return refinement.finish(&curves),
            Ok(true) => {}
            Err(obstacle) => refinement.end_before(obstacle)?,
        }
        if refinement.knots.len() > refinement.sweep.options.most_points {
            let (fault, most) = (refinement.sweep.fault, refinement.sweep.options.most_points);
            return Err(BuildError::TooManyPoints { fault, most });
        }
    }
}

impl Refinement<'_> {
    /// The ends, the limits, and samples at hand that are well apart from them and from each other.
    fn place_first(&mut self) {
        let last = self.range.last;
        self.knots = [Some(0), Some(last), self.limits.close, self.limits.open].into_iter().flatten().collect();
        let apart = last / FIRST_SPACING;
        for (&area, _) in self.sweep.samples().range(..=last) {
            if self.knots.iter().all(|knot| knot.abs_diff(area) > apart) {
                self.knots.push(area);
            }
        }
        self.knots.sort_unstable();
        self.knots.dedup();
    }

    /// The curve of each stroke through the points.
    fn curves(&self) -> Result<[MonotoneCubic; 2], Obstacle> {
        Ok([self.curve(Stroke::Close)?, self.curve(Stroke::Open)?])
    }

    fn curve(&self, stroke: Stroke) -> Result<MonotoneCubic, Obstacle> {
        let time = |area: &Area| self.sweep.at(*area).time_s(stroke).unwrap_or(f64::NAN);
        let x = self.knots.iter().map(|area| area::m2(*area)).collect();
        let y = self.knots.iter().map(time).collect();
        MonotoneCubic::new(x, y).map_err(|error| {
            let index = match error {
                CurveError::NotMonotone { index } => index.max(1),
                _ => 1,
            };
            let (previous, at) = (self.knots[index - 1], self.knots[index]);
            let error = BuildError::NotMonotone {
                fault: self.sweep.fault,
                stroke,
                area_m2: area::m2(at),
                found_s: time(&at),
                previous_m2: area::m2(previous),
                previous_s: time(&previous),
            };
            Obstacle { sound: previous, at, stroke, error }
        })
    }

    /// Simulates what is missing to measure every gap; says whether anything was.
    fn measure(&mut self) -> Result<bool, BuildError> {
        let mut missing = Vec::new();
        for gap in self.knots.windows(2) {
            let (low, width) = (gap[0], (gap[1] - gap[0]) as f64);
            if width < self.narrowest() {
                continue;
            }
            let at = |share: f64| low + area::nearest(share * width * area::m2(1));
            for [from, middle, to] in ZONES {
                if self.sweep.samples().range(at(from)..=at(to)).next().is_none() {
                    missing.push(at(middle));
                }
            }
        }
        if missing.is_empty() {
            return Ok(false);
        }
        let measured = self.sweep.samples().len() as f64;
        let share = 0.2 + 0.8 * measured / (measured + missing.len() as f64);
        self.sweep.simulate(&missing, Stage::Points, share.min(0.99))?;
        Ok(true)
    }

    fn narrowest(&self) -> f64 {
        (NARROWEST * self.range.last as f64).max(16.0)
    }

    /// Makes a point of the worst sample of each gap that is not met; says whether there was one.
    fn cut(&mut self, curves: &[MonotoneCubic; 2]) -> Result<bool, Obstacle> {
        let mut points = Vec::new();
        for gap in self.knots.windows(2) {
            let inside = self.sweep.samples().range(gap[0] + 1..gap[1]);
            let misses: Vec<_> = inside.map(|(area, point)| (*area, self.miss(curves, *area, point))).collect();
            let worst = |misses: &mut dyn Iterator<Item = &(Area, Miss)>| {
                misses.max_by(|a, b| a.1.share.total_cmp(&b.1.share)).copied()
            };
            let Some((area, miss)) = worst(&mut misses.iter()).filter(|(_, miss)| miss.share > MARGIN) else {
                continue;
            };
            let width = gap[1] - gap[0];
            if (width as f64) < self.narrowest() {
                let Miss { stroke, error_s, .. } = miss;
                let error = BuildError::Jump { fault: self.sweep.fault, stroke, area_m2: area::m2(area), error_s };
                return Err(Obstacle { sound: gap[0], at: area, stroke, error });
            }
            // A point next to an old one would leave the gap as wide as it was.
            let central = |(area, _): &&(Area, Miss)| (*area - gap[0]).min(gap[1] - *area) > width / 7;
            let area = worst(&mut misses.iter().filter(central)).map_or(area, |(area, _)| area);
            points.push(area);
        }
        let cut = !points.is_empty();
        self.knots.extend(points);
        self.knots.sort_unstable();
        Ok(cut)
    }

    /// By how much the interpolation misses a sample, of the worse stroke.
    fn miss(&self, curves: &[MonotoneCubic; 2], area: Area, point: &LeakPoint) -> Miss {
        let options = self.sweep.options;
        let up_to_limit = self.limits.first().is_some_and(|limit| area <= limit);
        let tolerance_s = if up_to_limit { options.tolerance_up_to_limit_s } else { options.tolerance_beyond_s };
        let tolerance_s = tolerance_s.max(2.0 * self.sweep.wandering_s());
        let miss = |stroke: Stroke| {
            let time_s = point.time_s(stroke).unwrap_or(f64::NAN);
            let error_s = (curves[stroke as usize].value(point.leak_area_m2) - time_s).abs();
            Miss { stroke, share: error_s / tolerance_s, error_s }
        };
        let (close, open) = (miss(Stroke::Close), miss(Stroke::Open));
        if close.share >= open.share { close } else { open }
    }

    /// Ends the table before an obstacle, if the limit is not beyond it.
    fn end_before(&mut self, obstacle: Obstacle) -> Result<(), BuildError> {
        let limit = self.limits.first().unwrap_or(Area::MAX);
        if obstacle.sound < limit || obstacle.at <= limit {
            return Err(obstacle.error);
        }
        let end = obstacle.sound;
        self.sweep.forget_beyond(end);
        self.knots.retain(|knot| *knot <= end);
        self.range = Range { last: end, stall: None };
        self.limits.close = self.limits.close.filter(|area| *area <= end);
        self.limits.open = self.limits.open.filter(|area| *area <= end);
        self.notices.retain(|notice| !matches!(notice, Notice::EndsEarly { .. }));
        let (fault, stroke) = (self.sweep.fault, obstacle.stroke);
        self.notices.push(Notice::EndsEarly { fault, stroke, area_m2: area::m2(end) });
        Ok(())
    }

    /// The table, with one row more where the valve stalls.
    fn finish(mut self, curves: &[MonotoneCubic; 2]) -> Result<FaultTable, BuildError> {
        let interpolation_error = self.measured_error(curves);
        let mut rows: Vec<LeakPoint> = self.knots.iter().map(|area| *self.sweep.at(*area)).collect();
        let stall = self.range.stall.map(|stall| *self.sweep.at(stall));
        let fault = self.sweep.fault;
        let as_table = |rows: Vec<LeakPoint>| LeakTable::new(fault, rows).map_err(row_error);
        let table = match stall {
            // The stroke that still finishes may have turned there; the row is then left out.
            Some(stall) if LeakTable::new(fault, [rows.clone(), vec![stall]].concat()).is_ok() => {
                rows.push(stall);
                as_table(rows)?
            }
            _ => as_table(rows)?,
        };
        let info = |stroke: Stroke, limit: Option<Area>| StrokeInfo {
            limit_area_m2: limit.map(area::m2),
            stall_area_m2: stall.filter(|point| point.time_s(stroke).is_none()).map(|point| point.leak_area_m2),
        };
        let info = FaultInfo {
            close: info(Stroke::Close, self.limits.close),
            open: info(Stroke::Open, self.limits.open),
            interpolation_error,
        };
        self.sweep.simulate(&[], Stage::Points, 1.0)?;
        Ok(FaultTable { table, info, notices: self.notices, simulated_areas: self.sweep.simulated_areas() })
    }

    /// The largest difference between interpolation and simulation at the samples.
    fn measured_error(&self, curves: &[MonotoneCubic; 2]) -> InterpolationError {
        let mut error = InterpolationError::default();
        let limit = self.limits.first().unwrap_or(Area::MAX);
        for (area, point) in self.sweep.samples().range(..=self.range.last) {
            for stroke in Stroke::ALL {
                let Some(time_s) = point.time_s(stroke) else { continue };
                let miss_s = (curves[stroke as usize].value(point.leak_area_m2) - time_s).abs();
                let worst = if *area <= limit { &mut error.up_to_limit_s } else { &mut error.beyond_limit_s };
                *worst = worst.max(miss_s);
            }
        }
        error
    }
}

/// Rows that have passed the curves' own checks can only fail as a table would.
fn row_error(source: RowError) -> BuildError {
    let line = source.row().map_or(1, |row| row + 2);
    BuildError::Table(TableError::Rows { path: "(table being built)".into(), line, source })
}
