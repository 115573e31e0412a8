//! Points where the curve bends.
//!
//! Every gap between two points is simulated at three severities. Where the interpolation misses one of
//! them, that one becomes a point, and the two new gaps are measured in turn. Whatever was simulated
//! and is no point measures the error of the table in the end.
//!
//! A time that jumps on its way to the limit, as friction that holds the piston a moment longer lets it,
//! tells the severity at the jump all the better: it becomes two points that cannot be closer, and a notice.
//! Beyond the limit it ends the table.

use std::collections::BTreeMap;

use leak_table::{
    CurveError, FaultInfo, InterpolationError, MonotoneCubic, RowError, SeverityPoint, SeverityTable, Stroke,
    StrokeInfo, TableError,
};

use crate::FaultTable;
use crate::error::{BuildError, Notice};
use crate::levelled::{NARROW, falls, levelled};
use crate::limit::LimitTicks;
use crate::progress::Stage;
use crate::range::{Range, STALL_RESOLUTION};
use crate::simulation::stored;
use crate::sweep::Sweep;
use crate::ticks::Ticks;

/// Points placed to start with are at least this share of the range apart.
const FIRST_SPACING: u64 = 24;
/// Where in a gap it is measured: any sample from the first to the last share will do, else one is
/// simulated at the share in the middle.
const ZONES: [[f64; 3]; 3] = [[0.15, 0.27, 0.4], [0.4, 0.5, 0.6], [0.6, 0.73, 0.85]];
/// The share of the tolerance that measured errors may use.
const MARGIN: f64 = 0.5;
/// Gaps narrower than this share of the range are not cut: a curve that needs it jumps, and the table with it.
const NARROWEST: f64 = 1e-7;

/// The points so far.
struct Refinement<'a> {
    sweep: Sweep<'a>,
    range: Range,
    limits: LimitTicks,
    notices: Vec<Notice>,
    knots: Vec<Ticks>,
    /// Points that a stroke time jumps after, to the next one.
    jumps: BTreeMap<Ticks, Stroke>,
}

/// A stroke time that turns back, which no table can hold.
struct Turn {
    /// Points up to this one are sound.
    sound: Ticks,
    /// The next one, which is not.
    at: Ticks,
    stroke: Stroke,
    error: Box<BuildError>,
}

/// By how much the interpolation misses one simulated time.
#[derive(Clone, Copy)]
struct Miss {
    stroke: Stroke,
    /// As a share of the tolerance.
    share: f64,
}

/// Places points until the table is as accurate as asked.
pub(crate) fn refine(
    sweep: Sweep<'_>,
    range: Range,
    limits: LimitTicks,
    notices: Vec<Notice>,
) -> Result<(FaultTable, Sweep<'_>), BuildError> {
    let mut refinement = Refinement { sweep, range, limits, notices, knots: Vec::new(), jumps: BTreeMap::new() };
    refinement.place_first();
    loop {
        let curves = match refinement.curves() {
            Ok(curves) => curves,
            Err(turn) if refinement.is_beyond_limit(&turn) => {
                refinement.end_at(turn.sound, turn.stroke);
                continue;
            }
            Err(turn) => return Err(*turn.error),
        };
        if refinement.measure()? {
            continue;
        }
        match refinement.cut(&curves) {
            Ok(false) => return refinement.finish(&curves),
            Ok(true) => {}
            Err((sound, stroke)) => refinement.end_at(sound, stroke),
        }
        if refinement.knots.len() > refinement.sweep.simulation.options.most_points {
            let (fault, most) = (refinement.sweep.simulation.id(), refinement.sweep.simulation.options.most_points);
            return Err(BuildError::TooManyPoints { fault, most });
        }
    }
}

impl<'a> Refinement<'a> {
    /// The ends, the limits, and samples at hand that are well apart from them and from each other.
    fn place_first(&mut self) {
        let last = self.range.last;
        self.knots = [Some(0), Some(last), self.limits.close, self.limits.open].into_iter().flatten().collect();
        let apart = last / FIRST_SPACING;
        for (&ticks, _) in self.sweep.samples().range(..=last) {
            if self.knots.iter().all(|knot| knot.abs_diff(ticks) > apart) {
                self.knots.push(ticks);
            }
        }
        self.knots.sort_unstable();
        self.knots.dedup();
    }

    /// The curve of each stroke through the points.
    fn curves(&self) -> Result<[MonotoneCubic; 2], Turn> {
        Ok([self.curve(Stroke::Close)?, self.curve(Stroke::Open)?])
    }

    fn curve(&self, stroke: Stroke) -> Result<MonotoneCubic, Turn> {
        let time = |ticks: &Ticks| self.sweep.at(*ticks).time_s(stroke).unwrap_or(f64::NAN);
        let x: Vec<f64> = self.knots.iter().map(|ticks| self.sweep.simulation.si(*ticks)).collect();
        let y: Vec<f64> = self.knots.iter().map(time).collect();
        let curve = if self.moves(stroke) {
            let even = self.sweep.simulation.evened(&x, &y, None);
            MonotoneCubic::new(x, even).map_err(|error| match error {
                CurveError::NotMonotone { index } => index.max(1),
                _ => 1,
            })
        } else {
            match levelled(&y, falls(&y), self.level_tolerance_s()) {
                (level, many) if many == y.len() => MonotoneCubic::with_level_pieces(x, level).map_err(|_| 1),
                (_, many) => Err(many.max(1)),
            }
        };
        curve.map_err(|index| {
            let (previous, at) = (self.knots[index - 1], self.knots[index]);
            let error = BuildError::NotMonotone {
                fault: self.sweep.simulation.id(),
                stroke,
                at: self.sweep.simulation.named(at),
                found_s: time(&at),
                previous: self.sweep.simulation.named(previous),
                previous_s: time(&previous),
            };
            Turn { sound: previous, at, stroke, error: Box::new(error) }
        })
    }

    /// Whether the degradation moves a stroke's time, so that the time must tell the severity.
    fn moves(&self, stroke: Stroke) -> bool {
        self.sweep.simulation.wear.degradation.moves.stroke(stroke).is_some()
    }

    /// How far a time that need not move may go back and still count as staying.
    fn level_tolerance_s(&self) -> f64 {
        MARGIN * self.sweep.simulation.options.tolerance_up_to_limit_s
    }

    /// Simulates what is missing to measure every gap; says whether anything was.
    fn measure(&mut self) -> Result<bool, BuildError> {
        let mut missing = Vec::new();
        for gap in self.knots.windows(2) {
            let (low, width) = (gap[0], (gap[1] - gap[0]) as f64);
            if width < self.narrowest() {
                continue;
            }
            let at = |share: f64| low + self.sweep.simulation.nearest(share * width * self.sweep.simulation.si(1));
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

    /// Makes a point of the worst sample of each gap that is not met; says whether there was one, or the last point before a
    /// jump beyond the limit and the stroke whose time jumps.
    fn cut(&mut self, curves: &[MonotoneCubic; 2]) -> Result<bool, (Ticks, Stroke)> {
        let limit = self.limit();
        let mut points = Vec::new();
        for (index, gap) in self.knots.windows(2).enumerate() {
            let inside = self.sweep.samples().range(gap[0] + 1..gap[1]);
            let misses: Vec<_> = inside.map(|(ticks, point)| (*ticks, self.miss(curves, *ticks, point))).collect();
            let worst = |misses: &mut dyn Iterator<Item = &(Ticks, Miss)>| {
                misses.max_by(|a, b| a.1.share.total_cmp(&b.1.share)).copied()
            };
            let Some((ticks, miss)) = worst(&mut misses.iter()).filter(|(_, miss)| miss.share > MARGIN) else {
                continue;
            };
            let width = gap[1] - gap[0];
            // Where a time turns, what lies closer together than it tells the severity is not told apart.
            let turns =
                [index, index + 1].iter().any(|knot| self.is_evened(&curves[miss.stroke as usize], *knot, miss.stroke));
            let narrowest = if turns { 0.25 * NARROW * gap[1] as f64 } else { 0.0 };
            if (width as f64) < narrowest.max(self.narrowest()) {
                if gap[0] >= limit {
                    return Err((gap[0], miss.stroke));
                }
                self.jumps.insert(gap[0], miss.stroke);
                continue;
            }
            // A point next to an old one would leave the gap as wide as it was.
            let central = |(ticks, _): &&(Ticks, Miss)| (*ticks - gap[0]).min(gap[1] - *ticks) > width / 7;
            let ticks = worst(&mut misses.iter().filter(central)).map_or(ticks, |(ticks, _)| ticks);
            points.push(ticks);
        }
        let cut = !points.is_empty();
        self.knots.extend(points);
        self.knots.sort_unstable();
        Ok(cut)
    }

    /// Whether a point lies beside its simulation, since the time turns there.
    fn is_evened(&self, curve: &MonotoneCubic, knot: usize, stroke: Stroke) -> bool {
        let simulated_s = self.sweep.at(self.knots[knot]).time_s(stroke);
        simulated_s.is_some_and(|time_s| (time_s - curve.y()[knot]).abs() > self.level_tolerance_s())
    }

    /// By how much the interpolation misses a sample, of the worse stroke.
    fn miss(&self, curves: &[MonotoneCubic; 2], ticks: Ticks, point: &SeverityPoint) -> Miss {
        let options = self.sweep.simulation.options;
        let up_to_limit = self.limits.first().is_some_and(|limit| ticks <= limit);
        let tolerance_s = if up_to_limit { options.tolerance_up_to_limit_s } else { options.tolerance_beyond_s };
        let tolerance_s = tolerance_s.max(2.0 * self.sweep.simulation.wandering_s());
        let miss = |stroke: Stroke| {
            let time_s = point.time_s(stroke).unwrap_or(f64::NAN);
            let error_s = (curves[stroke as usize].value(point.severity) - time_s).abs();
            Miss { stroke, share: error_s / tolerance_s }
        };
        let (close, open) = (miss(Stroke::Close), miss(Stroke::Open));
        if close.share >= open.share { close } else { open }
    }

    /// The severity at which the first limit is crossed.
    fn limit(&self) -> Ticks {
        self.limits.first().unwrap_or(Ticks::MAX)
    }

    fn is_beyond_limit(&self, turn: &Turn) -> bool {
        turn.sound >= self.limit() && turn.at > self.limit()
    }

    /// Ends the table at a point beyond the limit, after which the time of a stroke is not to be followed.
    fn end_at(&mut self, end: Ticks, stroke: Stroke) {
        self.sweep.forget_beyond(end);
        self.knots.retain(|knot| *knot <= end);
        self.range = Range { last: end, stall: None };
        self.limits.close = self.limits.close.filter(|ticks| *ticks <= end);
        self.limits.open = self.limits.open.filter(|ticks| *ticks <= end);
        self.notices.retain(|notice| !matches!(notice, Notice::EndsEarly { .. }));
        let (fault, at) = (self.sweep.simulation.id(), self.sweep.simulation.named(end));
        self.notices.push(Notice::EndsEarly { fault, stroke, at });
    }

    /// What is said of the jumps of a stroke's time on the way to the limit. One at the stall itself is the stroke's end.
    fn told_jumps(&self, stroke: Stroke, curve: &MonotoneCubic) -> Option<Notice> {
        let stall = self.range.stall.map_or(f64::INFINITY, |stall| stall as f64 * (1.0 - STALL_RESOLUTION));
        let height_s = |from: &Ticks| {
            let index = self.knots.binary_search(from).ok()?;
            Some(curve.y().get(index + 1)? - curve.y()[index])
        };
        let jumps = self.jumps.iter().filter(|(from, of)| **of == stroke && (**from as f64) < stall);
        let jumps: Vec<(Ticks, f64)> = jumps.filter_map(|(from, _)| Some((*from, height_s(from)?))).collect();
        let (from, by_s) = jumps.iter().copied().max_by(|a, b| a.1.abs().total_cmp(&b.1.abs()))?;
        let (fault, at) = (self.sweep.simulation.id(), self.sweep.simulation.named(from));
        Some(Notice::Jumps { fault, stroke, places: jumps.len(), at, by_s })
    }

    /// The table, with one row more where the valve stalls.
    fn finish(mut self, curves: &[MonotoneCubic; 2]) -> Result<(FaultTable, Sweep<'a>), BuildError> {
        let interpolation_error = self.measured_error(curves);
        let jumps = Stroke::ALL.map(|stroke| self.told_jumps(stroke, &curves[stroke as usize]));
        self.notices.extend(jumps.into_iter().flatten());
        let by_s = self.sweep.simulation.wandering_s();
        if by_s > self.sweep.simulation.options.tolerance_up_to_limit_s {
            self.notices.push(Notice::Uneven { fault: self.sweep.simulation.id(), by_s });
        }
        let row = |(index, ticks): (usize, &Ticks)| {
            let [close, open] = curves;
            let time = |curve: &MonotoneCubic| Some(stored(curve.y()[index]));
            SeverityPoint {
                severity: self.sweep.simulation.si(*ticks),
                close_time_s: time(close),
                open_time_s: time(open),
            }
        };
        let mut rows: Vec<SeverityPoint> = self.knots.iter().enumerate().map(row).collect();
        // Points so close that the file's digits do not tell their times apart are one.
        let is_same = |one: &SeverityPoint, other: &SeverityPoint| {
            let moving = Stroke::ALL.into_iter().filter(|stroke| self.moves(*stroke));
            moving.into_iter().any(|stroke| one.time_s(stroke) == other.time_s(stroke))
        };
        rows.dedup_by(|later, before| is_same(later, before));
        let stall = self.range.stall.map(|stall| *self.sweep.at(stall));
        let degradation = &self.sweep.simulation.wear.degradation;
        let as_table = |rows: Vec<SeverityPoint>| SeverityTable::new(degradation, rows).map_err(row_error);
        let table = match stall {
            // The stroke that still finishes may have turned there; the row is then left out.
            Some(stall) if SeverityTable::new(degradation, [rows.clone(), vec![stall]].concat()).is_ok() => {
                rows.push(stall);
                as_table(rows)?
            }
            _ => as_table(rows)?,
        };
        let info = |stroke: Stroke, limit: Option<Ticks>| StrokeInfo {
            limit_severity: limit.map(|ticks| self.sweep.simulation.si(ticks)),
            stall_severity: stall.filter(|point| point.time_s(stroke).is_none()).map(|point| point.severity),
        };
        let info = FaultInfo {
            close: info(Stroke::Close, self.limits.close),
            open: info(Stroke::Open, self.limits.open),
            interpolation_error,
        };
        let simulated = self.sweep.simulated();
        let fidelity = self.sweep.simulation.fidelity;
        let table = FaultTable { table, info, over_conditions: None, notices: self.notices, simulated, fidelity };
        Ok((table, self.sweep))
    }

    /// The largest difference between interpolation and simulation at the samples.
    fn measured_error(&self, curves: &[MonotoneCubic; 2]) -> InterpolationError {
        let mut error = InterpolationError::default();
        let limit = self.limit();
        let in_a_jump = |ticks: &Ticks| {
            let before = self.knots.partition_point(|knot| knot < ticks).checked_sub(1);
            before.is_some_and(|before| self.jumps.contains_key(&self.knots[before]))
        };
        for (ticks, point) in self.sweep.samples().range(..=self.range.last).filter(|(ticks, _)| !in_a_jump(ticks)) {
            for stroke in Stroke::ALL {
                let Some(time_s) = point.time_s(stroke) else { continue };
                let miss_s = (curves[stroke as usize].value(point.severity) - time_s).abs();
                let worst = if *ticks <= limit { &mut error.up_to_limit_s } else { &mut error.beyond_limit_s };
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
