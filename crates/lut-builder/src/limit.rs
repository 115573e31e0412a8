//! The severities at which a stroke time crosses its limit, found on the simulation itself.

use leak_table::{MonotoneCubic, Stroke};

use crate::error::{BuildError, Notice};
use crate::progress::Stage;
use crate::range::Range;
use crate::sweep::Sweep;
use crate::ticks::{self, Ticks};

/// Severities simulated at a time inside the bracket of a crossing: with its ends, nine samples.
const INSIDE: u64 = 7;
/// The time at the severity found is this close to the limit, s.
const RESOLUTION_S: f64 = 1e-7;

/// The severity at which each stroke crosses its limit.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(crate) struct LimitTicks {
    pub close: Option<Ticks>,
    pub open: Option<Ticks>,
}

impl LimitTicks {
    /// End of life: the smaller of both.
    pub(crate) fn first(&self) -> Option<Ticks> {
        self.close.into_iter().chain(self.open).min()
    }
}

/// Finds the crossings of both strokes within the range.
pub(crate) fn find(sweep: &mut Sweep<'_>, range: &Range, notices: &mut Vec<Notice>) -> Result<LimitTicks, BuildError> {
    let close = crossing(sweep, range, Stroke::Close, notices)?;
    let open = crossing(sweep, range, Stroke::Open, notices)?;
    let limits = LimitTicks { close, open };
    if limits.first().is_none() {
        let last = sweep.at(range.last);
        return Err(BuildError::LimitNotReached {
            fault: sweep.simulation.id(),
            largest: sweep.simulation.named(range.last),
            close_time_s: last.close_time_s.unwrap_or(f64::NAN),
            open_time_s: last.open_time_s.unwrap_or(f64::NAN),
        });
    }
    Ok(limits)
}

fn crossing(
    sweep: &mut Sweep<'_>,
    range: &Range,
    stroke: Stroke,
    notices: &mut Vec<Notice>,
) -> Result<Option<Ticks>, BuildError> {
    let limit_s = sweep.limit_s(stroke);
    let beyond = |sweep: &Sweep<'_>| {
        let mut samples = sweep.samples().range(..=range.last);
        samples.find(|(_, point)| point.time_s(stroke).is_some_and(|time_s| time_s > limit_s)).map(|(ticks, _)| *ticks)
    };
    if beyond(sweep).is_none() {
        // A stroke that ends up unfinished has crossed its limit, at the last severity with which it was finished.
        let stalls = range.stall.is_some_and(|stall| sweep.at(stall).time_s(stroke).is_none());
        let window_s = sweep.window_s(stroke);
        if stalls && limit_s >= window_s {
            notices.push(Notice::LimitBeyondCycle { fault: sweep.simulation.id(), stroke, limit_s, window_s });
        }
        return Ok(stalls.then_some(range.last));
    }
    while let Some(high) = beyond(sweep) {
        let low = sweep.samples().range(..high).next_back().map_or(0, |(ticks, _)| *ticks);
        let inside = ticks::between(low, high, INSIDE);
        if inside.is_empty() {
            // `low` is within the limit and `high` is not: neighbours to the last digit.
            return Ok(Some(high));
        }
        sweep.simulate(&inside, Stage::Limits, 0.2)?;
        let guess = interpolated(sweep, low, high, stroke, limit_s);
        sweep.simulate(&[guess], Stage::Limits, 0.2)?;
        if sweep.at(guess).time_s(stroke).is_some_and(|time_s| (time_s - limit_s).abs() < RESOLUTION_S) {
            return Ok(Some(guess));
        }
    }
    Ok(None)
}

/// Where the curve through the samples from `low` to `high` has the time; the middle if they are no curve.
fn interpolated(sweep: &Sweep<'_>, low: Ticks, high: Ticks, stroke: Stroke, time_s: f64) -> Ticks {
    let samples = sweep.samples().range(low..=high);
    let (x, y): (Vec<f64>, Vec<f64>) =
        samples.filter_map(|(_, p)| p.time_s(stroke).map(|time_s| (p.severity, time_s))).unzip();
    let ticks = MonotoneCubic::new(x, y).map(|curve| sweep.simulation.nearest(curve.inverse(time_s)));
    ticks.unwrap_or(low.midpoint(high)).clamp(low, high)
}
