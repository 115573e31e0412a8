//! Many valves interleaved in one log: a state each, a line out for a line in.

use std::collections::HashMap;
use std::sync::Arc;

use leak_table::{Fault, Stroke, TableBundle, mm2_from_m2};

use crate::bayes::{BayesConfig, BayesEstimate, BayesEstimator, Change, Noise};
use crate::log::LogRow;
use crate::monitor::Monitor;
use crate::notice::Notice;
use crate::ols::{OlsEstimate, OlsEstimator};
use crate::reading::Reading;
use crate::record::{FaultCall, Prognosis, Status};

/// Rows in rising order below the latest cycle after which the cycle counter
/// counts as restarted.
const RESTART_AFTER: usize = 3;
/// Probability of being a proper reading below which a timing is called a
/// glitch.
const GLITCH_BELOW: f64 = 0.05;
/// Standard deviations by which a time may lie outside the tables as noise.
const OUTSIDE_FROM: f64 = 5.0;

/// How the remaining life is estimated.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Method {
    /// Recursive Bayesian estimate from both timings.
    Bayes(BayesConfig),
    /// One timing and a straight line by least squares, as in the paper.
    Ols,
}

impl Method {
    /// The name used in output and on the command line.
    pub const fn name(&self) -> &'static str {
        match self {
            Self::Bayes(_) => "bayes",
            Self::Ols => "ols",
        }
    }
}

impl Default for Method {
    fn default() -> Self {
        Self::Bayes(BayesConfig::default())
    }
}

/// Prognosis of all valves of a log. Its size grows with the number of valves
/// and not with the number of rows.
pub struct Prognoser {
    tables: Arc<TableBundle>,
    method: Method,
    valves: HashMap<String, Valve>,
}

enum Estimator {
    Bayes(Box<BayesEstimator>),
    Ols(OlsEstimator),
}

struct Valve {
    estimator: Estimator,
    monitor: Monitor,
    latest: Option<u64>,
    /// Whether a cycle below the latest is already known: the last ones seen.
    seen: [Option<u64>; 8],
    late: Vec<Reading>,
    last: Option<Prognosis>,
}

impl Prognoser {
    /// A prognoser that has seen no valve.
    pub fn new(tables: Arc<TableBundle>, method: Method) -> Self {
        Self {
            tables,
            method,
            valves: HashMap::new(),
        }
    }

    /// Number of valves seen.
    pub fn valves(&self) -> usize {
        self.valves.len()
    }

    /// Takes in one row and gives the prognosis after it. A row that cannot be
    /// used gives the last prognosis of its valve again, with a notice.
    pub fn push(&mut self, row: &LogRow<'_>) -> Prognosis {
        if !self.valves.contains_key(row.valve) {
            self.valves
                .insert(row.valve.to_owned(), Valve::new(&self.method));
        }
        let valve = self
            .valves
            .get_mut(row.valve)
            .expect("it was inserted if it was missing");
        let mut prognosis = valve.push(&self.tables, &self.method, row.valve, &row.reading);
        prognosis.time = row.time.map(str::to_owned);
        prognosis
    }
}

impl Valve {
    fn new(method: &Method) -> Self {
        let estimator = match method {
            Method::Bayes(config) => Estimator::Bayes(Box::new(BayesEstimator::new(config))),
            Method::Ols => Estimator::Ols(OlsEstimator::new()),
        };
        Self {
            estimator,
            monitor: Monitor::default(),
            latest: None,
            seen: [None; 8],
            late: Vec::new(),
            last: None,
        }
    }

    fn push(
        &mut self,
        tables: &TableBundle,
        method: &Method,
        name: &str,
        reading: &Reading,
    ) -> Prognosis {
        let mut notices = Vec::new();
        if let Some(latest) = self.latest {
            if reading.cycle <= latest {
                if self.seen.contains(&Some(reading.cycle)) && self.late.is_empty() {
                    return self.unused(name, reading, Notice::RepeatedCycle);
                }
                if self
                    .late
                    .last()
                    .is_some_and(|before| before.cycle >= reading.cycle)
                {
                    self.late.clear();
                }
                self.late.push(*reading);
                if self.late.len() < RESTART_AFTER {
                    return self.unused(name, reading, Notice::OutOfOrder { latest });
                }
                let late = std::mem::take(&mut self.late);
                *self = Self::new(method);
                for earlier in &late[..late.len() - 1] {
                    self.take(tables, method, name, earlier, Vec::new());
                }
                notices.push(Notice::CounterRestarted);
            } else {
                self.late.clear();
                let missing = reading.cycle - latest - 1;
                if missing > 0 {
                    notices.push(Notice::MissedCycles { count: missing });
                }
            }
        }
        self.take(tables, method, name, reading, notices)
    }

    /// The last prognosis again, for a row that is not used.
    fn unused(&self, name: &str, reading: &Reading, notice: Notice) -> Prognosis {
        let mut prognosis = self
            .last
            .clone()
            .unwrap_or_else(|| blank(name, reading.cycle));
        prognosis.cycle = reading.cycle;
        prognosis.notices = vec![notice];
        prognosis
    }

    fn take(
        &mut self,
        tables: &TableBundle,
        method: &Method,
        name: &str,
        reading: &Reading,
        mut notices: Vec<Notice>,
    ) -> Prognosis {
        self.latest = Some(reading.cycle);
        self.seen.rotate_right(1);
        self.seen[0] = Some(reading.cycle);
        let over_limit = limits(tables, reading, &mut notices);
        let mut prognosis = match (&mut self.estimator, method) {
            (Estimator::Bayes(estimator), Method::Bayes(config)) => {
                let estimate = estimator.update(tables, reading);
                if matches!(estimate.change, Some(Change::Repaired | Change::Broken)) {
                    self.monitor = Monitor::default();
                }
                remark(tables, reading, &estimate, &mut notices);
                let sound = |i: usize| {
                    estimate.residual_s[i].filter(|_| estimate.inlier[i] >= GLITCH_BELOW)
                };
                let stated = match config.noise {
                    Noise::Known { sd_s } => Some(sd_s),
                    Noise::Estimated { .. } => None,
                };
                let residuals = [sound(0), sound(1)];
                let healthy = Stroke::ALL.map(|stroke| {
                    tables
                        .table(Fault::Atmosphere)
                        .curve(stroke)
                        .end_times_s()
                        .0
                });
                self.monitor
                    .look(residuals, healthy, stated, estimate.leading, &mut notices);
                from_bayes(name, reading, &estimate, config.name_from, over_limit)
            }
            (Estimator::Ols(estimator), _) => from_ols(
                name,
                reading,
                &estimator.update(tables, reading),
                over_limit,
            ),
            (Estimator::Bayes(_), Method::Ols) => {
                unreachable!("the estimator is made by the method, which never changes")
            }
        };
        prognosis.notices = notices;
        self.last = Some(Prognosis {
            notices: Vec::new(),
            ..prognosis.clone()
        });
        prognosis
    }
}

/// Notes strokes that did not finish or took too long; whether one of them
/// would mean end of life if it is no glitch.
fn limits(tables: &TableBundle, reading: &Reading, notices: &mut Vec<Notice>) -> [bool; 2] {
    Stroke::ALL.map(|stroke| {
        let limit_s = tables.manifest().limits.within_s(stroke);
        match reading.time_s(stroke) {
            None => {
                notices.push(Notice::NotFinished { stroke });
                true
            }
            Some(time) if time > limit_s => {
                notices.push(Notice::AboveLimit { stroke, limit_s });
                true
            }
            Some(_) => false,
        }
    })
}

/// Notes what the estimator found odd.
fn remark(
    tables: &TableBundle,
    reading: &Reading,
    estimate: &BayesEstimate,
    notices: &mut Vec<Notice>,
) {
    for (i, stroke) in Stroke::ALL.into_iter().enumerate() {
        let Some(time) = reading.time_s(stroke) else {
            continue;
        };
        let (mut shortest_s, mut longest_s) = (f64::INFINITY, f64::NEG_INFINITY);
        for fault in Fault::ALL {
            let (a, b) = tables.table(fault).curve(stroke).end_times_s();
            shortest_s = shortest_s.min(a).min(b);
            longest_s = longest_s.max(a).max(b);
        }
        let margin = OUTSIDE_FROM * estimate.noise_sd_s;
        if time < shortest_s - margin || time > longest_s + margin {
            notices.push(Notice::OutsideTables {
                stroke,
                found_s: time,
                shortest_s,
                longest_s,
            });
        }
        if estimate.inlier[i] < GLITCH_BELOW
            && let Some(residual_s) = estimate.residual_s[i]
        {
            notices.push(Notice::Glitch { stroke, residual_s });
        }
    }
    notices.extend(estimate.change.map(|change| match change {
        Change::Repaired => Notice::Repaired,
        Change::Broken => Notice::GrowthChanged,
        Change::Exponential => Notice::GrowthExponential,
        Change::Reread => Notice::Reread,
    }));
}

fn blank(name: &str, cycle: u64) -> Prognosis {
    Prognosis {
        valve: name.to_owned(),
        cycle,
        time: None,
        fault: FaultCall::Undecided,
        fault_probability: None,
        leak_area_mm2: None,
        leak_rate_mm2_per_cycle: None,
        eol_cycle: None,
        rul_cycles: None,
        rul_p05: None,
        rul_p50: None,
        rul_p95: None,
        status: Status::Healthy,
        noise_s: None,
        notices: Vec::new(),
    }
}

fn from_bayes(
    name: &str,
    reading: &Reading,
    estimate: &BayesEstimate,
    name_from: f64,
    over_limit: [bool; 2],
) -> Prognosis {
    let probability = estimate.probability;
    let fault = if probability.none >= name_from {
        FaultCall::None
    } else if probability.of(estimate.leading) >= name_from {
        estimate.leading.into()
    } else {
        FaultCall::Undecided
    };
    let mut prognosis = blank(name, reading.cycle);
    prognosis.fault = fault;
    prognosis.fault_probability = Some(probability);
    prognosis.noise_s = Some(estimate.noise_sd_s);
    if fault == FaultCall::None {
        return prognosis;
    }
    let remaining = |eol: f64| (eol - reading.cycle as f64).max(0.0);
    prognosis.leak_area_mm2 = Some(mm2_from_m2(estimate.leak_area_m2));
    prognosis.leak_rate_mm2_per_cycle = Some(mm2_from_m2(estimate.leak_rate_m2));
    prognosis.eol_cycle = Some(estimate.eol_cycle);
    prognosis.rul_cycles = Some(remaining(estimate.eol_cycle));
    prognosis.rul_p05 = Some(remaining(estimate.eol.p05));
    prognosis.rul_p50 = Some(remaining(estimate.eol.p50));
    prognosis.rul_p95 = Some(remaining(estimate.eol.p95));
    let over = (0..2).any(|i| over_limit[i] && estimate.inlier[i] > 0.5);
    prognosis.status = match fault {
        FaultCall::Undecided | FaultCall::None => Status::Healthy,
        _ if over || estimate.eol.p50 <= reading.cycle as f64 => Status::EolReached,
        _ => Status::Degrading,
    };
    prognosis
}

fn from_ols(
    name: &str,
    reading: &Reading,
    estimate: &OlsEstimate,
    over_limit: [bool; 2],
) -> Prognosis {
    let mut prognosis = blank(name, reading.cycle);
    let Some(fault) = estimate.fault else {
        return prognosis;
    };
    prognosis.fault = fault.into();
    prognosis.leak_area_mm2 = estimate.leak_area_m2.map(mm2_from_m2);
    prognosis.leak_rate_mm2_per_cycle = estimate.leak_rate_m2.map(mm2_from_m2);
    prognosis.eol_cycle = estimate.eol_cycle;
    prognosis.rul_cycles = estimate.rul_cycles;
    let reached = estimate
        .eol_cycle
        .is_some_and(|eol| eol <= reading.cycle as f64);
    prognosis.status = if reached || over_limit.contains(&true) {
        Status::EolReached
    } else {
        Status::Degrading
    };
    prognosis
}
