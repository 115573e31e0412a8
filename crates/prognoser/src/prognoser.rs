//! Many valves interleaved in one log: a state each, a line out for a line in.

use std::collections::HashMap;
use std::sync::Arc;

use leak_table::{Fault, Stroke, TableBundle};

use crate::bayes::{BayesConfig, BayesEstimator, Change, Noise};
use crate::log::LogRow;
use crate::monitor::Monitor;
use crate::notice::Notice;
use crate::ols::OlsEstimator;
use crate::output::{GLITCH_BELOW, blank, from_bayes, from_ols, limits, remark};
use crate::reading::Reading;
use crate::record::{Prognosis, Status};

/// Rows in rising order below the latest cycle after which the cycle counter
/// counts as restarted.
const RESTART_AFTER: usize = 3;

/// Cycles in a row with a stroke beyond its limit that end a valve's life,
/// whatever the reason; a single one may be a glitch.
const OVER_FROM: u32 = 2;

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
    /// Cycles in a row with a stroke beyond its limit.
    over: u32,
    last: Option<Prognosis>,
}

impl Prognoser {
    /// A prognoser that has seen no valve.
    pub fn new(tables: Arc<TableBundle>, method: Method) -> Self {
        Self { tables, method, valves: HashMap::new() }
    }

    /// Number of valves seen.
    pub fn valves(&self) -> usize {
        self.valves.len()
    }

    /// Takes in one row and gives the prognosis after it. A row that cannot be
    /// used gives the last prognosis of its valve again, with a notice.
    pub fn push(&mut self, row: &LogRow<'_>) -> Prognosis {
        if !self.valves.contains_key(row.valve) {
            self.valves.insert(row.valve.to_owned(), Valve::new(&self.method));
        }
        let valve = self.valves.get_mut(row.valve).expect("it was inserted if it was missing");
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
            over: 0,
            last: None,
        }
    }

    fn push(&mut self, tables: &TableBundle, method: &Method, name: &str, reading: &Reading) -> Prognosis {
        let mut notices = Vec::new();
        if let Some(latest) = self.latest {
            if reading.cycle <= latest {
                if self.seen.contains(&Some(reading.cycle)) && self.late.is_empty() {
                    return self.unused(name, reading, Notice::RepeatedCycle);
                }
                if self.late.last().is_some_and(|before| before.cycle >= reading.cycle) {
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
        let mut prognosis = self.last.clone().unwrap_or_else(|| blank(name, reading.cycle));
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
        self.over = if over_limit.contains(&true) { self.over + 1 } else { 0 };
        let mut prognosis = match (&mut self.estimator, method) {
            (Estimator::Bayes(estimator), Method::Bayes(config)) => {
                let estimate = estimator.update(tables, reading);
                if matches!(estimate.change, Some(Change::Repaired | Change::Broken)) {
                    self.monitor = Monitor::default();
                }
                remark(tables, reading, &estimate, &mut notices);
                let sound = |i: usize| estimate.residual_s[i].filter(|_| estimate.inlier[i] >= GLITCH_BELOW);
                let stated = match config.noise {
                    Noise::Known { sd_s } => Some(sd_s),
                    Noise::Estimated { .. } => None,
                };
                let residuals = [sound(0), sound(1)];
                let healthy = Stroke::ALL.map(|stroke| tables.table(Fault::Atmosphere).curve(stroke).end_times_s().0);
                self.monitor.look(residuals, healthy, stated, estimate.leading, &mut notices);
                from_bayes(name, reading, &estimate, config.name_from, over_limit)
            }
            (Estimator::Ols(estimator), _) => from_ols(name, reading, &estimator.update(tables, reading), over_limit),
            (Estimator::Bayes(_), Method::Ols) => {
                unreachable!("the estimator is made by the method, which never changes")
            }
        };
        if self.over >= OVER_FROM {
            prognosis.status = Status::EolReached;
        }
        prognosis.notices = notices;
        self.last = Some(Prognosis { notices: Vec::new(), ..prognosis.clone() });
        prognosis
    }
}
