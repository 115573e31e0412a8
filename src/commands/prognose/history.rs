//! What is kept of the stream: the last state of every valve, and the path of the
//! one that is drawn.

use std::collections::HashMap;

use leak_table::{Fault, SeverityAt, Stroke, TableBundle, mm2_from_m2};
use prognoser::{FaultCall, Prognosis, Reading, Status};
use report::figures::{PrognosisFigure, PrognosisPoint};

use crate::commands::tables::fault_name;

/// How a valve stood after its last row.
#[derive(Debug, Clone)]
pub struct End {
    /// The valve.
    pub valve: String,
    /// Its last cycle.
    pub cycle: u64,
    /// The fault named.
    pub fault: FaultCall,
    /// Remaining cycles and their 5 and 95 % bounds.
    pub rul_cycles: Option<(f64, Option<[f64; 2]>)>,
    /// Leak area, mm2.
    pub leak_area_mm2: Option<f64>,
    /// How it stands.
    pub status: Status,
}

/// The last state of every valve, in the order in which they appeared.
#[derive(Debug, Default)]
pub struct Ends {
    places: HashMap<String, usize>,
    ends: Vec<End>,
}

impl Ends {
    /// Takes in the latest state of a valve.
    pub fn add(&mut self, prognosis: &Prognosis) {
        let place = if let Some(place) = self.places.get(&prognosis.valve) {
            *place
        } else {
            self.places.insert(prognosis.valve.clone(), self.ends.len());
            self.ends.push(End {
                valve: prognosis.valve.clone(),
                cycle: 0,
                fault: FaultCall::Undecided,
                rul_cycles: None,
                leak_area_mm2: None,
                status: Status::Healthy,
            });
            self.ends.len() - 1
        };
        let end = &mut self.ends[place];
        end.cycle = prognosis.cycle;
        end.fault = prognosis.fault;
        end.rul_cycles = prognosis.rul_cycles.map(|rul| (rul, bounds(prognosis)));
        end.leak_area_mm2 = prognosis.leak_area_mm2;
        end.status = prognosis.status;
    }

    /// All valves.
    pub fn iter(&self) -> impl Iterator<Item = &End> {
        self.ends.iter()
    }

    /// Number of valves.
    pub fn len(&self) -> usize {
        self.ends.len()
    }
}

impl End {
    /// The state in a sentence.
    pub fn sentence(&self) -> String {
        let name = &self.valve;
        let cycle = self.cycle;
        let Some(fault) = self.fault.fault() else {
            let known = if self.fault == FaultCall::None { "no growing leak" } else { "no fault can be named yet" };
            return format!("{name}, cycle {cycle}: {known}");
        };
        let leak = self.leak_area_mm2.map_or_else(String::new, |area| format!(" of {area:.4} mm²"));
        let kind = fault_name(fault);
        let life = match (self.status, self.rul_cycles) {
            (Status::EolReached, _) => "end of life is reached".to_owned(),
            (_, Some((rul, Some([low, high])))) => {
                format!("{rul:.1} cycles left (5 to 95 %: {low:.1} to {high:.1})")
            }
            (_, Some((rul, None))) => format!("{rul:.1} cycles left"),
            (_, None) => "too early to tell the remaining life".to_owned(),
        };
        format!("{name}, cycle {cycle}: {kind}{leak}; {life}")
    }
}

fn bounds(prognosis: &Prognosis) -> Option<[f64; 2]> {
    Some([prognosis.rul_p05?, prognosis.rul_p95?])
}

/// Points kept of a path; a longer one is thinned, so that memory stays bounded.
const MOST_POINTS: usize = 4000;

/// The path of one valve.
#[derive(Debug)]
pub struct History {
    valve: Option<String>,
    points: Vec<(Reading, PrognosisPoint)>,
    stride: usize,
    seen: usize,
    last: Option<Prognosis>,
}

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
            self.points.push((*reading, point(prognosis)));
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
        let last = self.last?;
        let fault = last.fault.fault();
        let read = |(reading, mut point): (Reading, PrognosisPoint)| {
            if let Some(fault) = fault {
                point.leak_readings_mm2 = Stroke::ALL.map(|stroke| leak_alone(tables, fault, stroke, &reading));
            }
            point
        };
        let title = match (fault, last.rul_cycles) {
            (Some(fault), Some(rul)) => {
                format!("{}: {}, {rul:.1} cycles left at cycle {}", last.valve, fault_name(fault), last.cycle)
            }
            (Some(fault), None) => format!("{}: {}", last.valve, fault_name(fault)),
            (None, _) => format!("{}: no fault named at cycle {}", last.valve, last.cycle),
        };
        let bounds = bounds(&last)
            .map_or_else(String::new, |[low, high]| format!("5 to 95 %: {low:.1} to {high:.1} cycles left; "));
        let noise = last.noise_s.map_or_else(String::new, |noise| format!(", timing noise {:.1} ms", 1e3 * noise));
        Some(PrognosisFigure {
            title,
            subtitle: format!("{bounds}method {method}{noise}; tables of {:?}", tables.manifest().valve),
            points: self.points.into_iter().map(read).collect(),
            area_at_limit_mm2: fault.map(|fault| mm2_from_m2(tables.limit_area_m2(fault))),
            true_eol_cycle,
            alpha: 0.1,
        })
    }
}

/// The leak that one time alone would give, mm2.
fn leak_alone(tables: &TableBundle, fault: Fault, stroke: Stroke, reading: &Reading) -> Option<f64> {
    match tables.table(fault).curve(stroke).severity_at(reading.time_s(stroke)?) {
        SeverityAt::Within(area_m2) => Some(mm2_from_m2(area_m2)),
        SeverityAt::BelowRange | SeverityAt::AboveRange | SeverityAt::Untold => None,
    }
}

fn point(prognosis: &Prognosis) -> PrognosisPoint {
    let named = prognosis.fault.fault().is_some();
    PrognosisPoint {
        cycle: prognosis.cycle as f64,
        leak_readings_mm2: [None; 2],
        leak_area_mm2: prognosis.leak_area_mm2,
        leak_bounds_mm2: None,
        // While no fault is named there is no life to tell.
        rul_cycles: prognosis.rul_cycles.filter(|_| named),
        rul_bounds_cycles: bounds(prognosis).filter(|_| named),
        fault_probability: prognosis.fault_probability.map(|all| [all.none, all.atmosphere, all.supply]),
    }
}

/// The probability of what is named, or of the likeliest while nothing is.
pub fn probability(one: &Prognosis) -> Option<f64> {
    let all = one.fault_probability?;
    Some(match one.fault {
        FaultCall::Atmosphere => all.atmosphere,
        FaultCall::Supply => all.supply,
        FaultCall::None => all.none,
        FaultCall::Undecided => all.none.max(all.atmosphere).max(all.supply),
    })
}
