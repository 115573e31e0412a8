//! From a sound valve to the severity at which it no longer gets there.

use leak_table::{SeverityPoint, Stroke};

use crate::error::BuildError;
use crate::progress::Stage;
use crate::sweep::Sweep;
use crate::ticks::{self, Ticks};

/// Parts into which a range is cut.
const PARTS: u64 = 16;
/// The stall is located to this share of its severity.
pub(crate) const STALL_RESOLUTION: f64 = 5e-6;

/// The range of a table.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Range {
    /// The largest severity found with which both strokes are finished.
    pub last: Ticks,
    /// The smallest found with which one is not; none if there is none within reach.
    pub stall: Option<Ticks>,
}

/// Finds the range.
pub(crate) fn find(sweep: &mut Sweep<'_>) -> Result<Range, BuildError> {
    for reach in (sweep.simulation.wear.reach)(sweep.simulation.model.valve) {
        let largest = sweep.simulation.nearest(reach).max(PARTS);
        let mut severities = ticks::between(0, largest, PARTS - 1);
        severities.extend([0, largest]);
        sweep.simulate(&severities, Stage::Range, 0.05)?;
        healthy(sweep)?;
        if let Some(range) = bracket(sweep) {
            return narrowed(sweep, range);
        }
    }
    let last = *sweep.samples().keys().next_back().expect("the healthy valve was simulated");
    Ok(Range { last, stall: None })
}

/// The valve must stroke within its limits while it is sound.
fn healthy(sweep: &Sweep<'_>) -> Result<(), BuildError> {
    for stroke in Stroke::ALL {
        let limit_s = sweep.limit_s(stroke);
        match sweep.at(0).time_s(stroke) {
            None => return Err(BuildError::HealthyNotFinished { stroke, window_s: sweep.window_s(stroke) }),
            Some(found_s) if found_s > limit_s => {
                return Err(BuildError::HealthyBeyondLimit { stroke, found_s, limit_s });
            }
            Some(_) => {}
        }
    }
    Ok(())
}

/// The neighbouring samples between which the valve stalls first.
fn bracket(sweep: &Sweep<'_>) -> Option<Range> {
    let finished = |point: &SeverityPoint| point.close_time_s.is_some() && point.open_time_s.is_some();
    let stall = *sweep.samples().iter().find(|(_, point)| !finished(point))?.0;
    let last = *sweep.samples().range(..stall).next_back()?.0;
    Some(Range { last, stall: Some(stall) })
}

/// Cuts the bracket of the stall until it is narrow.
fn narrowed(sweep: &mut Sweep<'_>, mut range: Range) -> Result<Range, BuildError> {
    while let Some(stall) = range.stall {
        let severities = ticks::between(range.last, stall, PARTS - 1);
        if severities.is_empty() || ((stall - range.last) as f64) < STALL_RESOLUTION * stall as f64 {
            break;
        }
        sweep.simulate(&severities, Stage::Range, 0.15)?;
        range = bracket(sweep).unwrap_or(range);
    }
    Ok(range)
}
