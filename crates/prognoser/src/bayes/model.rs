//! The tables as the estimator sees them: leak as a fraction of the leak at
//! end of life.

use leak_table::{Fault, Stroke, TableBundle};

use super::sums::Linearised;

/// One fault's table with its leak counted in units of the limit.
#[derive(Clone, Copy)]
pub(crate) struct FaultModel<'t> {
    bundle: &'t TableBundle,
    fault: Fault,
    limit_m2: f64,
}

impl<'t> FaultModel<'t> {
    pub(crate) fn new(bundle: &'t TableBundle, fault: Fault) -> Self {
        Self { bundle, fault, limit_m2: bundle.limit_area_m2(fault) }
    }

    /// Leak area at end of life in m2.
    pub(crate) fn limit_m2(&self) -> f64 {
        self.limit_m2
    }

    /// Time in s and its derivative by the leak, at a leak given as a fraction
    /// of the limit.
    #[inline]
    pub(crate) fn time_and_slope(&self, stroke: Stroke, leak: f64) -> (f64, f64) {
        let curve = self.bundle.table(self.fault).curve(stroke);
        let (time, slope) = curve.extrapolated_time_and_slope(leak * self.limit_m2);
        (time, slope * self.limit_m2)
    }

    /// A timing linearised about a leak.
    pub(crate) fn linearise(&self, stroke: Stroke, leak: f64, time_s: f64) -> Linearised {
        let (time, slope) = self.time_and_slope(stroke, leak);
        Linearised { leak, residual: time_s - time, slope }
    }

    /// The leak, as a fraction of the limit, that gives this time.
    pub(crate) fn leak_at(&self, stroke: Stroke, time_s: f64) -> f64 {
        let curve = self.bundle.table(self.fault).curve(stroke);
        curve.extrapolated_severity(time_s) / self.limit_m2
    }

    /// The leak, as a fraction of the limit, from which on the stroke is not
    /// finished within the cycle.
    pub(crate) fn stall(&self, stroke: Stroke) -> Option<f64> {
        let info = self.bundle.manifest().fault(self.fault).stroke(stroke);
        info.stall_severity.map(|area| area / self.limit_m2)
    }

    /// The time within which a stroke counts as finished, in s.
    pub(crate) fn window_s(&self, stroke: Stroke) -> f64 {
        self.bundle.manifest().schedule.window_s(stroke)
    }
}
