//! The method of the paper: invert one timing to a leak, fit a straight line
//! by least squares, see where it reaches the limit.
//!
//! Kulkarni, Daigle, Gorospe, Goebel, "Application of Model-Based Prognostics
//! to a Pneumatic Valves Testbed", IEEE Aerospace Conference 2014, section 4.
//! The leak to atmosphere is read from the closing time, the leak from the
//! supply from the opening time: the stroke that its leak slows down. The
//! wrong hypothesis shows itself by estimates that make no sense: a leak that
//! is negative or shrinks.

use leak_table::{Fault, Stroke, TableBundle};

use crate::reading::Reading;

/// Running sums of a straight line, about its first cycle.
#[derive(Clone, Copy, Debug, Default)]
struct Line {
    n: f64,
    mean_x: f64,
    mean_y: f64,
    sxx: f64,
    sxy: f64,
    syy: f64,
}

impl Line {
    /// Welford's update: no difference of large sums is ever taken.
    fn add(&mut self, x: f64, y: f64) {
        self.n += 1.0;
        let dx = x - self.mean_x;
        let dy = y - self.mean_y;
        self.mean_x += dx / self.n;
        self.mean_y += dy / self.n;
        self.sxx += dx * (x - self.mean_x);
        self.sxy += dx * (y - self.mean_y);
        self.syy += dy * (y - self.mean_y);
    }

    fn slope(&self) -> Option<f64> {
        (self.n >= 2.0 && self.sxx > 0.0).then(|| self.sxy / self.sxx)
    }

    fn value(&self, slope: f64, x: f64) -> f64 {
        self.mean_y + slope * (x - self.mean_x)
    }

    /// Correlation of the points: how much of a line they are.
    fn correlation(&self) -> f64 {
        self.sxy / (self.sxx * self.syy).sqrt().max(f64::MIN_POSITIVE)
    }
}

/// The estimate after a cycle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OlsEstimate {
    /// The fault, or none if no hypothesis makes sense.
    pub fault: Option<Fault>,
    /// Leak area on the line now, in m2; of the fault, if there is one.
    pub leak_area_m2: Option<f64>,
    /// Slope of the line in m2 per cycle.
    pub leak_rate_m2: Option<f64>,
    /// Cycle at which the line reaches the limit, not rounded.
    pub eol_cycle: Option<f64>,
    /// Remaining cycles, rounded to a whole cycle as in the paper, not below
    /// zero.
    pub rul_cycles: Option<f64>,
}

/// The recursive estimate of one valve.
#[derive(Clone, Debug, Default)]
pub struct OlsEstimator {
    lines: [Line; 2],
    origin: Option<u64>,
}

/// The timing from which a fault's leak is read.
pub fn stroke_of(fault: Fault) -> Stroke {
    match fault {
        Fault::Atmosphere => Stroke::Close,
        Fault::Supply => Stroke::Open,
    }
}

impl OlsEstimator {
    /// An estimator that has seen nothing.
    pub fn new() -> Self {
        Self::default()
    }

    /// Takes in one cycle and gives the estimate after it. A stroke that did
    /// not finish has no leak and is left out.
    pub fn update(&mut self, tables: &TableBundle, reading: &Reading) -> OlsEstimate {
        let origin = *self.origin.get_or_insert(reading.cycle);
        let x = reading.cycle as f64 - origin as f64;
        for fault in Fault::ALL {
            let stroke = stroke_of(fault);
            if let Some(time) = reading.time_s(stroke) {
                let leak = tables.table(fault).curve(stroke).extrapolated_severity(time);
                self.lines[fault as usize].add(x, leak);
            }
        }
        let sensible = |fault: &Fault| {
            let line = &self.lines[*fault as usize];
            line.slope().is_some_and(|slope| slope > 0.0 && line.value(slope, x) > 0.0)
        };
        let fault = Fault::ALL.into_iter().filter(sensible).max_by(|a, b| {
            let correlation = |fault: &Fault| self.lines[*fault as usize].correlation();
            correlation(a).total_cmp(&correlation(b))
        });
        let Some(fault) = fault else {
            return OlsEstimate {
                fault: None,
                leak_area_m2: None,
                leak_rate_m2: None,
                eol_cycle: None,
                rul_cycles: None,
            };
        };
        let line = &self.lines[fault as usize];
        // A sensible line has a slope.
        let slope = line.slope().unwrap_or_default();
        let leak = line.value(slope, x);
        let remaining = (tables.limit_area_m2(fault) - leak) / slope;
        OlsEstimate {
            fault: Some(fault),
            leak_area_m2: Some(leak),
            leak_rate_m2: Some(slope),
            eol_cycle: Some(reading.cycle as f64 + remaining),
            rul_cycles: Some(remaining.round().max(0.0)),
        }
    }
}
