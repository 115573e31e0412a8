//! Many valves interleaved in one log: a state each, a line out for a line in.

use std::collections::HashMap;
use std::sync::Arc;

use leak_table::{Stroke, TableBundle};
use serde::{Deserialize, Serialize};

use crate::bayes::{
    BayesConfig, BayesEstimate, BayesEstimator, Change, Noise, PROPER_FROM, ValveRecord, Wanted, Workspace,
};
use crate::calendar::{Calendar, Dated};
use crate::fault_call::FaultCall;
use crate::intermittent::{Intermittent, Seen};
use crate::kept::KeptPrognosis;
use crate::log::LogRow;
use crate::mistakes::{self, Times};
use crate::notice::Notice;
use crate::ols::OlsEstimator;
use crate::output::{blank, findings, from_bayes, from_ols, is_far_off, is_off, limits, remark, way_to_limit};
use crate::reading::Reading;
use crate::record::{Prognosis, Status};
use crate::repeats::{Repeated, Repeats};
use crate::status::{ASKED, Ladder};

/// Rows in rising order below the latest cycle after which the cycle counter
/// counts as restarted.
const RESTART_AFTER: usize = 3;

/// A stroke that is so often in succession beyond its limit ends a valve's life, whatever the reason; a single time may be an
/// outlier.
const OVER_FROM: u32 = 2;

/// Weight of the newest residual in the running mean of their squares.
const NEWEST: f64 = 0.05;
/// Residuals before a stated noise is doubted.
const ENOUGH: f64 = 20.0;
/// Mean square over the stated variance from which on it is.
const TOO_LARGE: f64 = 2.0;

/// How the remaining life is estimated.
#[derive(Clone, Copy, Debug, PartialEq)]
#[expect(clippy::large_enum_variant, reason = "there is one of it, and it is copied as a whole")]
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
    /// Each in a place of its own: a map of large values has room for as many again.
    valves: HashMap<String, Box<Valve>>,
    workspace: Workspace,
}

enum Estimator {
    Bayes(Box<BayesEstimator>),
    Ols(OlsEstimator),
}

/// All that is kept of a valve from row to row by the default method: plain
/// numbers of a bounded size, which a store can write and go on from.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ValveState {
    /// What the estimate remembers.
    pub record: ValveRecord,
    rows: Rows,
    late: Vec<Reading>,
    last: Option<KeptPrognosis>,
}

/// What is kept of a valve's rows beside the estimate.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
struct Rows {
    latest: Option<u64>,
    /// Whether a cycle below the latest is already known: the last ones seen.
    seen: [Option<u64>; 8],
    /// Which strokes the rows of the latest cycle tell.
    told: [bool; 2],
    /// Cycles in succession whose stroke was beyond its limit, of those that tell it.
    over: [u32; 2],
    ladder: Ladder,
    calendar: Calendar,
    /// Kinds of findings that were said.
    said: Vec<String>,
    /// Number and mean square of the residuals, in stated variances.
    residuals: (f64, f64),
    /// By which exchanged times are told.
    times: Times,
    /// By which times are told that a recorder repeats.
    repeats: Repeats,
    /// By which a fault is told that comes and goes.
    intermittent: Intermittent,
}

/// What all valves are looked at with.
struct Means<'a> {
    tables: &'a TableBundle,
    method: &'a Method,
    workspace: &'a mut Workspace,
    wanted: Wanted,
}

struct Valve {
    estimator: Estimator,
    rows: Rows,
    late: Vec<Reading>,
    last: Option<Prognosis>,
}

impl ValveState {
    /// The last prognosis, for the valve of this name.
    pub fn last(self, valve: &str) -> Option<Prognosis> {
        self.last.map(|last| last.of_valve(valve))
    }
}

impl Prognoser {
    /// A prognoser that has seen no valve.
    pub fn new(tables: Arc<TableBundle>, method: Method) -> Self {
        Self { tables, method, valves: HashMap::new(), workspace: Workspace::default() }
    }

    /// Number of valves seen.
    pub fn valves(&self) -> usize {
        self.valves.len()
    }

    /// The last prognosis of every valve, in no order.
    pub fn lasts(&self) -> impl Iterator<Item = &Prognosis> {
        self.valves.values().filter_map(|valve| valve.last.as_ref())
    }

    /// The last prognosis of a valve; none if it was not seen.
    pub fn last(&self, valve: &str) -> Option<&Prognosis> {
        self.valves.get(valve)?.last.as_ref()
    }

    /// What is kept of a valve by the default method; none if it was not seen.
    pub fn state(&self, valve: &str) -> Option<ValveState> {
        let valve = self.valves.get(valve)?;
        match &valve.estimator {
            Estimator::Bayes(estimator) => Some(ValveState {
                record: estimator.record().clone(),
                rows: valve.rows.clone(),
                late: valve.late.clone(),
                last: valve.last.as_ref().map(KeptPrognosis::of),
            }),
            Estimator::Ols(_) => None,
        }
    }

    /// Goes on from what was kept of a valve, whose rows then need not be read
    /// again. Says whether it could: the version must be this program's, the
    /// method the default one.
    pub fn resume(&mut self, valve: &str, state: ValveState) -> bool {
        let Method::Bayes(config) = &self.method else { return false };
        if state.record.version != crate::bayes::STATE_VERSION {
            return false;
        }
        let estimator = Estimator::Bayes(Box::new(BayesEstimator::resume(config, state.record)));
        let last = state.last.map(|last| last.of_valve(valve));
        let resumed = Valve { estimator, rows: state.rows, late: state.late, last };
        self.valves.insert(valve.to_owned(), Box::new(resumed));
        true
    }

    /// Lets go of a valve; what is to be known of it later must have been kept.
    pub fn forget(&mut self, valve: &str) {
        self.valves.remove(valve);
    }

    /// Whether a valve is at hand.
    pub fn knows(&self, valve: &str) -> bool {
        self.valves.contains_key(valve)
    }

    /// Names of the valves at hand, in no order.
    pub fn names(&self) -> impl Iterator<Item = &str> {
        self.valves.keys().map(String::as_str)
    }

    /// Takes in one row and gives the prognosis after it. A row that cannot be
    /// used gives the last prognosis of its valve again, with a notice.
    pub fn push(&mut self, row: &LogRow<'_>) -> Prognosis {
        self.push_wanted(row, Wanted::Numbers)
    }

    /// Takes in a row of which nobody looks at more than how the valve stands: status and notices are those of
    /// [`push`](Self::push), the end of life is only told as closely as they ask, in less time. The next row must be one of
    /// this valve with a higher cycle, and [`last`](Self::last) be looked at only then.
    pub fn pass(&mut self, row: &LogRow<'_>) -> Prognosis {
        self.push_wanted(row, Wanted::Standing(ASKED))
    }

    fn push_wanted(&mut self, row: &LogRow<'_>, wanted: Wanted) -> Prognosis {
        let means = &mut Means { tables: &self.tables, method: &self.method, workspace: &mut self.workspace, wanted };
        let mut prognosis = match self.valves.get_mut(row.valve) {
            Some(valve) => valve.push(means, row),
            None => self
                .valves
                .entry(row.valve.to_owned())
                .or_insert_with(|| Box::new(Valve::new(means.method)))
                .push(means, row),
        };
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
        Self { estimator, rows: Rows::default(), late: Vec::new(), last: None }
    }

    fn push(&mut self, means: &mut Means<'_>, row: &LogRow<'_>) -> Prognosis {
        let (name, reading) = (row.valve, &row.reading);
        let mut notices = Vec::new();
        if let Some(latest) = self.rows.latest {
            if reading.cycle == latest && self.rows.lacks(reading) {
                self.late.clear();
            } else if reading.cycle <= latest {
                if self.rows.seen.contains(&Some(reading.cycle)) && self.late.is_empty() {
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
                *self = Self::new(means.method);
                for earlier in &late[..late.len() - 1] {
                    self.take(means, name, earlier, None, Vec::new());
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
        self.take(means, name, reading, row.time, notices)
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
        Means { tables, method, workspace, wanted }: &mut Means<'_>,
        name: &str,
        reading: &Reading,
        time: Option<&str>,
        mut notices: Vec<Notice>,
    ) -> Prognosis {
        let written = tells(reading);
        let (reading, dead) = without_zeros(reading, &mut notices);
        let rows = &mut self.rows;
        let (reading, mistaken) = mistakes::left_out(tables, &reading, &mut rows.times, &mut notices);
        let (reading, stuck) = &rows.without_repeats(reading, &mut notices);
        if rows.latest != Some(reading.cycle) {
            rows.latest = Some(reading.cycle);
            rows.seen.rotate_right(1);
            rows.seen[0] = Some(reading.cycle);
            rows.told = [false; 2];
        }
        let over_limit = limits(tables, reading, &mut notices);
        for (stroke, is_over) in over_limit.into_iter().enumerate() {
            rows.told[stroke] |= written[stroke];
            if is_over {
                rows.over[stroke] += 1;
            } else if tells(reading)[stroke] {
                rows.over[stroke] = 0;
            }
        }
        let (mut repaired, mut is_odd, mut comes_and_goes) = (false, false, None);
        let mut prognosis = match (&mut self.estimator, method) {
            (Estimator::Bayes(estimator), Method::Bayes(config)) => {
                let estimate = estimator.update_in(workspace, tables, reading, *wanted);
                remark(tables, reading, &estimate, &mut notices);
                repaired = estimate.change == Some(Change::Repaired);
                let prognosis = from_bayes(name, tables, reading, &estimate, config);
                let seen = Seen {
                    is_off: is_off(reading, &estimate),
                    change: estimate.change,
                    is_healthy: prognosis.fault == FaultCall::None,
                    way: way_to_limit(tables, reading),
                };
                comes_and_goes = rows.intermittent.take(reading.cycle, &seen);
                is_odd |= is_far_off(&estimate, config);
                let mut found = findings(tables, reading, &estimate, &prognosis, config);
                found.extend(rows.noise_larger(config, &estimate));
                rows.once(found, &mut notices);
                prognosis
            }
            (Estimator::Ols(estimator), _) => from_ols(name, reading, &estimator.update(tables, reading)),
            (Estimator::Bayes(_), Method::Ols) => {
                unreachable!("the estimator is made by the method, which never changes")
            }
        };
        if let Some(time) = time.filter(|time| !time.is_empty()) {
            let dated = rows.calendar.add(reading.cycle, time);
            match dated {
                Dated::Well => {}
                Dated::Oddly => notices.push(Notice::StrangeDate),
                Dated::Not => rows.once(vec![Notice::NoDate], &mut notices),
            }
            if dated != Dated::Not {
                prognosis.eol_time =
                    prognosis.eol_cycle.filter(|_| prognosis.fault.wears()).and_then(|cycle| rows.calendar.date(cycle));
                prognosis.replace_by =
                    prognosis.replace_by_cycle.and_then(|cycle| rows.calendar.date_at_the_earliest(cycle as f64));
            }
        }
        let (status, is_held) = rows.ladder.step(&prognosis, rows.over.iter().any(|rows| *rows >= OVER_FROM), repaired);
        prognosis.status = status;
        if is_held && status > Status::Watch {
            let words = "status of an earlier row, until three calmer ones";
            prognosis.caveat = Some(prognosis.caveat.map_or(words.to_owned(), |other| format!("{words}; {other}")));
        }
        if comes_and_goes.is_some() && prognosis.status <= Status::Unknown {
            prognosis.status = Status::Watch;
        }
        for words in [rows.times.doubt(), comes_and_goes, stuck.clone()].into_iter().flatten() {
            prognosis.caveat = Some(match prognosis.caveat {
                Some(other) => format!("{words}; {other}"),
                None => words,
            });
        }
        if dead || mistaken || stuck.is_some() || is_odd {
            prognosis.status = rows.ladder.untold();
        }
        prognosis.notices = notices;
        self.last = Some(Prognosis { notices: Vec::new(), ..prognosis.clone() });
        prognosis
    }
}

/// Which strokes a reading tells.
fn tells(reading: &Reading) -> [bool; 2] {
    Stroke::ALL.map(|stroke| reading.time_s(stroke).is_some() || reading.stalled[stroke as usize])
}

/// A reading without times of zero, which no stroke takes; whether both were.
fn without_zeros(reading: &Reading, notices: &mut Vec<Notice>) -> (Reading, bool) {
    let zero = Stroke::ALL.map(|stroke| reading.time_s(stroke) == Some(0.0));
    let dead = zero == [true, true];
    if dead {
        notices.push(Notice::DeadSwitch);
    } else {
        notices.extend(
            Stroke::ALL.into_iter().filter(|stroke| zero[*stroke as usize]).map(|stroke| Notice::NoStroke { stroke }),
        );
    }
    let told = Reading {
        close_time_s: reading.close_time_s.filter(|_| !zero[Stroke::Close as usize]),
        open_time_s: reading.open_time_s.filter(|_| !zero[Stroke::Open as usize]),
        ..*reading
    };
    (told, dead)
}

impl Rows {
    /// Whether a reading of the latest cycle tells just what the rows of that cycle did not, as in logs with a row for each stroke.
    fn lacks(&self, reading: &Reading) -> bool {
        let tells = tells(reading);
        tells != [false; 2] && tells.iter().zip(self.told).all(|(tells, told)| !(*tells && told))
    }

    /// Adds those notices whose kind was not said before.
    fn once(&mut self, found: Vec<Notice>, notices: &mut Vec<Notice>) {
        for notice in found {
            if !self.said.iter().any(|kind| kind == notice.kind()) {
                self.said.push(notice.kind().to_owned());
                notices.push(notice);
            }
        }
    }

    /// The reading without times that a recorder repeats, and what is to be said of these.
    fn without_repeats(&mut self, reading: Reading, notices: &mut Vec<Notice>) -> (Reading, Option<String>) {
        let Some(repeated) = self.repeats.take(&reading) else { return (reading, None) };
        let left = Reading { close_time_s: None, open_time_s: None, ..reading };
        if !repeated.is_doubted {
            return (left, None);
        }
        let Repeated { rows, since, .. } = repeated;
        notices.push(Notice::RepeatedTimes { rows, since });
        (left, Some(format!("times repeat exactly since cycle {since}: {rows} rows not used")))
    }

    /// Whether the noise is larger than was stated.
    fn noise_larger(&mut self, config: &BayesConfig, estimate: &BayesEstimate) -> Option<Notice> {
        let Noise::Known { sd_s } = config.noise else { return None };
        for (residual, inlier) in estimate.residual_s.iter().zip(estimate.inlier) {
            if let Some(residual) = residual.filter(|_| inlier > PROPER_FROM) {
                let (count, square) = &mut self.residuals;
                *count += 1.0;
                *square += NEWEST.max(1.0 / *count) * ((residual / sd_s).powi(2) - *square);
            }
        }
        let (count, square) = self.residuals;
        (count > ENOUGH && square > TOO_LARGE)
            .then(|| Notice::NoiseLarger { stated_s: sd_s, found_s: sd_s * square.sqrt() })
    }
}
