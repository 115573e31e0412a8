//! From no leak to the leak at which the valve no longer gets there.

use leak_table::{LeakPoint, Stroke};

use crate::area::{self, Area};
use crate::error::BuildError;
use crate::progress::Stage;
use crate::sweep::Sweep;

/// Largest leaks tried, in areas of the solenoid's orifice, one after the other.
const REACH: [f64; 4] = [2.0, 8.0, 32.0, 128.0];
/// Parts into which a range is cut.
const PARTS: u64 = 16;
/// The stall is located to this share of its area.
const STALL_RESOLUTION: f64 = 5e-6;

/// The range of a table.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Range {
    /// The largest leak found with which both strokes are finished.
    pub last: Area,
    /// The smallest found with which one is not; none if there is none within reach.
    pub stall: Option<Area>,
}

/// Finds the range.
pub(crate) fn find(sweep: &mut Sweep<'_>) -> Result<Range, BuildError> {
    let solenoid = sweep.model.valve.parameters().solenoid_orifice_area_m2;
    for reach in REACH {
        let largest = area::nearest(reach * solenoid).max(PARTS);
        let mut areas = area::between(0, largest, PARTS - 1);
        areas.extend([0, largest]);
        sweep.simulate(&areas, Stage::Range, 0.05)?;
        healthy(sweep)?;
        if let Some(range) = bracket(sweep) {
            return narrowed(sweep, range);
        }
    }
    let last = *sweep.samples().keys().next_back().expect("the healthy valve was simulated");
    Ok(Range { last, stall: None })
}

/// The valve must stroke within its limits while it does not leak.
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
    let finished = |point: &LeakPoint| point.close_time_s.is_some() && point.open_time_s.is_some();
    let stall = *sweep.samples().iter().find(|(_, point)| !finished(point))?.0;
    let last = *sweep.samples().range(..stall).next_back()?.0;
    Some(Range { last, stall: Some(stall) })
}

/// Cuts the bracket of the stall until it is narrow.
fn narrowed(sweep: &mut Sweep<'_>, mut range: Range) -> Result<Range, BuildError> {
    while let Some(stall) = range.stall {
        let areas = area::between(range.last, stall, PARTS - 1);
        if areas.is_empty() || ((stall - range.last) as f64) < STALL_RESOLUTION * stall as f64 {
            break;
        }
        sweep.simulate(&areas, Stage::Range, 0.15)?;
        range = bracket(sweep).unwrap_or(range);
    }
    Ok(range)
}
