//! The path of the valve that is drawn.

use leak_table::{BundleEntry, Degradation, Fault, SeverityAt, Stroke, TableBundle};
use prognoser::bayes::{FaultProbability, LONGEST};
use prognoser::{FaultCall, Prognosis, Reading};
use report::figures::{PrognosisFigure, PrognosisPoint};

use crate::tables::quantity;

/// A fault in words.
pub fn fault_words(fault: FaultCall) -> &'static str {
    match fault {
        FaultCall::Wears(id) => Degradation::from_id(&id).map_or(id.name(), |known| &known.short),
        FaultCall::BothLeaks => "leaks of both kinds",
        FaultCall::Other => "wear that no table has",
        FaultCall::None => "nothing",
        FaultCall::Undecided => "undecided",
    }
}

/// The remaining cycles from 5 to 95 %.
pub fn bounds(prognosis: &Prognosis) -> Option<[f64; 2]> {
    Some([prognosis.rul_p05?, prognosis.rul_p95?])
}

/// Bounds in words: beyond what is looked for there is none.
pub fn bounds_words([low, high]: [f64; 2]) -> String {
    if high < LONGEST { format!("{low:.1} to {high:.1}") } else { format!("{low:.1} or more") }
}

/// Points kept of a path; a longer one is thinned, so that memory stays bounded.
const MOST_POINTS: usize = 4000;

/// The path of one valve.
#[derive(Debug)]
pub struct History {
    valve: Option<String>,
    points: Vec<Said>,
    stride: usize,
    seen: usize,
    last: Option<Prognosis>,
}

/// What is kept of a cycle.
#[derive(Debug, Clone, Copy)]
struct Said {
    reading: Reading,
    fault: FaultCall,
    leak_area_mm2: Option<f64>,
    severity: Option<f64>,
    rul_cycles: Option<f64>,
    rul_bounds_cycles: Option<[f64; 2]>,
    probability: Option<FaultProbability>,
}

impl Said {
    fn of(reading: &Reading, prognosis: &Prognosis) -> Self {
        // While no fault is named there is no life to tell.
        let named = prognosis.fault.wears();
        Self {
            reading: *reading,
            fault: prognosis.fault,
            leak_area_mm2: prognosis.leak_area_mm2,
            severity: prognosis.severity,
            rul_cycles: prognosis.rul_cycles.filter(|_| named),
            rul_bounds_cycles: bounds(prognosis).filter(|_| named),
            probability: prognosis.fault_probability,
        }
    }

    fn point(&self, table: Option<&BundleEntry<'_>>, faults: &[FaultCall]) -> PrognosisPoint {
        let alone = |stroke| table.and_then(|entry| severity_alone(entry, stroke, &self.reading));
        let of_table = |entry: &BundleEntry<'_>| {
            let named = self.fault == FaultCall::Wears(entry.degradation.id);
            let limit = entry.degradation.severity.file_from_si(entry.limit_severity);
            self.severity.filter(|_| named).map(|severity| severity * limit)
        };
        PrognosisPoint {
            cycle: self.reading.cycle as f64,
            readings: Stroke::ALL.map(alone),
            severity: match table {
                Some(entry) if !is_leak(entry) => of_table(entry),
                _ => self.leak_area_mm2,
            },
            severity_bounds: None,
            rul_cycles: self.rul_cycles,
            rul_bounds_cycles: self.rul_bounds_cycles,
            fault_probability: self
                .probability
                .map_or_else(Vec::new, |all| faults.iter().map(|fault| all.of(*fault)).collect()),
        }
    }
}

/// Hypotheses beside none and the leaks are drawn where they were ever as likely as this.
const NOTABLE: f64 = 0.5;

impl History {
    /// The path of the valve of this name, or of the first one.
    pub fn of(valve: Option<String>) -> Self {
        Self { valve, points: Vec::new(), stride: 1, seen: 0, last: None }
    }

    /// Takes in a state, if it is of the valve that is drawn.
    pub fn add(&mut self, reading: &Reading, prognosis: &Prognosis) {
        let valve = self.valve.get_or_insert_with(|| prognosis.valve.clone());
        if *valve != prognosis.valve {
            return;
        }
        self.last = Some(prognosis.clone());
        if self.seen.is_multiple_of(self.stride) {
            self.points.push(Said::of(reading, prognosis));
        }
        self.seen += 1;
        if self.points.len() > MOST_POINTS {
            let mut keep = false;
            self.points.retain(|_| {
                keep = !keep;
                keep
            });
            self.stride *= 2;
        }
    }

    /// The picture, if the valve was there.
    pub fn figure(self, tables: &TableBundle, method: &str, true_eol_cycle: Option<f64>) -> Option<PrognosisFigure> {
        let last = self.last.as_ref()?;
        let table = match last.fault {
            FaultCall::Wears(id) => tables.get(&id),
            _ => None,
        };
        let faults = self.faults();
        let title = match (last.fault.wears(), last.rul_cycles) {
            (true, Some(rul)) => {
                format!("{}: {}, {rul:.1} cycles left at cycle {}", last.valve, fault_words(last.fault), last.cycle)
            }
            (true, None) => format!("{}: {}", last.valve, fault_words(last.fault)),
            (false, _) => format!("{}: no fault named at cycle {}", last.valve, last.cycle),
        };
        let bounds = bounds(last)
            .map_or_else(String::new, |[low, high]| format!("5 to 95 %: {low:.1} to {high:.1} cycles left; "));
        let noise = last.noise_s.map_or_else(String::new, |noise| format!(", timing noise {:.1} ms", 1e3 * noise));
        let shown = table.map_or_else(|| Fault::Atmosphere.degradation(), |entry| entry.degradation);
        let is_area = shown.severity == Fault::Atmosphere.degradation().severity;
        Some(PrognosisFigure {
            title,
            subtitle: format!("{bounds}method {method}{noise}; tables of {:?}", tables.manifest().valve),
            points: self.points.iter().map(|said| said.point(table.as_ref(), &faults)).collect(),
            quantity: quantity(shown),
            estimated: if is_area { "estimated leak" } else { "estimated" }.to_owned(),
            severity_at_limit: table.map(|entry| entry.degradation.severity.file_from_si(entry.limit_severity)),
            faults: faults.iter().map(|fault| hypothesis(*fault).to_owned()).collect(),
            true_eol_cycle,
            alpha: 0.1,
        })
    }

    /// The hypotheses to draw: none, the leaks, and what was ever notable.
    fn faults(&self) -> Vec<FaultCall> {
        let wears = self.points.iter().find_map(|said| said.probability.as_ref()).map(|all| all.wears().to_vec());
        let wears = wears.unwrap_or_default().into_iter().map(|(id, _)| FaultCall::Wears(id));
        let beside = [FaultCall::BothLeaks, FaultCall::Other];
        let most = |fault: FaultCall| {
            self.points.iter().filter_map(|said| said.probability).map(|all| all.of(fault)).fold(0.0, f64::max)
        };
        let shown = wears.chain(beside).filter(|fault| fault.fault().is_some() || most(*fault) >= NOTABLE);
        std::iter::once(FaultCall::None).chain(shown).collect()
    }
}

fn hypothesis(fault: FaultCall) -> &'static str {
    if fault == FaultCall::None { "none" } else { fault_words(fault) }
}

fn is_leak(entry: &BundleEntry<'_>) -> bool {
    FaultCall::Wears(entry.degradation.id).fault().is_some()
}

/// The severity that one time alone would give, in the unit of its file.
fn severity_alone(entry: &BundleEntry<'_>, stroke: Stroke, reading: &Reading) -> Option<f64> {
    entry.degradation.moves.stroke(stroke)?;
    match entry.table.curve(stroke).severity_at(reading.time_s(stroke)?) {
        SeverityAt::Within(severity) => Some(entry.degradation.severity.file_from_si(severity)),
        SeverityAt::BelowRange | SeverityAt::AboveRange | SeverityAt::Untold => None,
    }
}

/// The probability of what is named, or of the likeliest while nothing is.
pub fn probability(one: &Prognosis) -> Option<f64> {
    let all = one.fault_probability?;
    Some(match one.fault {
        FaultCall::Undecided => {
            let wears = all.wears().iter().map(|(_, share)| *share);
            wears.chain([all.none, all.both_leaks, all.other]).fold(0.0, f64::max)
        }
        named => all.of(named),
    })
}
