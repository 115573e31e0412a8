//! What is kept of the stream: the last state of every valve, and the path of the
//! one that is drawn.

use leak_table::{Fault, SeverityAt, Stroke, TableBundle, mm2_from_m2};
use prognoser::{FaultCall, Prognosis, Reading, Status};
use report::figures::{PrognosisFigure, PrognosisPoint};

use crate::output::{Align, TextTable};

/// How a valve stood after its last row.
#[derive(Debug, Clone)]
pub struct End(Prognosis);

/// The last state of every valve, the worst first.
#[derive(Debug, Default)]
pub struct Ends(Vec<End>);

impl Ends {
    /// From the last prognosis of every valve.
    pub fn of(lasts: impl Iterator<Item = Prognosis>) -> Self {
        let mut ends: Vec<End> = lasts.map(End).collect();
        let left = |end: &End| end.0.rul_p05.unwrap_or(f64::INFINITY);
        ends.sort_by(|a, b| {
            let worse = b.0.status.cmp(&a.0.status).then(left(a).total_cmp(&left(b)));
            worse.then_with(|| a.0.valve.cmp(&b.0.valve))
        });
        Self(ends)
    }

    /// All valves.
    pub fn iter(&self) -> impl Iterator<Item = &End> {
        self.0.iter()
    }

    /// Number of valves.
    pub fn len(&self) -> usize {
        self.0.len()
    }

    /// How many valves stand where, the worst first: "2 act-now, 5 healthy".
    pub fn counts(&self) -> String {
        let count = |status: Status| self.0.iter().filter(|end| end.0.status == status).count();
        let words = Status::ALL.into_iter().rev().map(|status| (count(status), status.name()));
        words
            .filter(|(count, _)| *count > 0)
            .map(|(count, name)| format!("{count} {name}"))
            .collect::<Vec<_>>()
            .join(", ")
    }

    /// All valves in a table.
    pub fn table(&self) -> TextTable {
        let mut table = TextTable::new(&[
            ("valve", Align::Left),
            ("cycle", Align::Right),
            ("status", Align::Left),
            ("fault", Align::Left),
            ("severity", Align::Right),
            ("cycles left", Align::Right),
            ("5 to 95 %", Align::Right),
            ("replace by", Align::Right),
            ("caveat", Align::Left),
        ]);
        for End(one) in &self.0 {
            let number = |value: Option<f64>, digits: usize| {
                value.map_or_else(|| "-".to_owned(), |value| format!("{value:.digits$}"))
            };
            let named = one.fault.wears();
            table.row(vec![
                one.valve.clone(),
                one.cycle.to_string(),
                one.status.name().to_owned(),
                one.fault.name().to_owned(),
                number(one.severity.filter(|_| named), 2),
                number(one.rul_cycles.filter(|_| named), 1),
                bounds(one)
                    .filter(|_| named)
                    .map_or_else(|| "-".to_owned(), |[low, high]| format!("{low:.1} to {high:.1}")),
                one.replace_by
                    .clone()
                    .or(one.replace_by_cycle.map(|by| by.to_string()))
                    .unwrap_or_else(|| "-".to_owned()),
                one.caveat.clone().unwrap_or_default(),
            ]);
        }
        table
    }
}

impl End {
    /// The last row.
    pub fn row(&self) -> &Prognosis {
        &self.0
    }

    /// The state in a sentence.
    pub fn sentence(&self) -> String {
        let one = &self.0;
        let (name, cycle) = (&one.valve, one.cycle);
        let mut sentence = if one.fault.wears() {
            let kind = fault_words(one.fault);
            let leak = one.leak_area_mm2.map_or_else(String::new, |area| format!(" of {area:.4} mm²"));
            let life = match (one.status, one.rul_cycles, bounds(one)) {
                (Status::EolReached, ..) => "end of life is reached".to_owned(),
                (_, Some(rul), Some([low, high])) => format!("{rul:.1} cycles left (5 to 95 %: {low:.1} to {high:.1})"),
                (_, Some(rul), None) => format!("{rul:.1} cycles left"),
                (_, None, _) => "too early to tell the remaining life".to_owned(),
            };
            format!("{name}, cycle {cycle}: {kind}{leak}; {life}")
        } else {
            let known = match (one.status, one.fault) {
                (Status::EolReached, _) => "end of life is reached: strokes take too long",
                (_, FaultCall::None) => "nothing wears",
                _ => "no fault can be named yet",
            };
            format!("{name}, cycle {cycle}: {known}")
        };
        if let Some(caveat) = &one.caveat {
            sentence.push_str(" (");
            sentence.push_str(caveat);
            sentence.push(')');
        }
        sentence
    }
}

/// A fault in words.
pub fn fault_words(fault: FaultCall) -> &'static str {
    match fault {
        FaultCall::Atmosphere => "leak to atmosphere",
        FaultCall::Supply => "leak from the supply",
        FaultCall::Friction => "friction",
        FaultCall::Spring => "weak spring",
        FaultCall::Exhaust => "clogged exhaust",
        FaultCall::SupplyLine => "clogged supply line",
        FaultCall::BothLeaks => "leaks of both kinds",
        FaultCall::Other => "wear that no table has",
        FaultCall::None => "nothing",
        FaultCall::Undecided => "undecided",
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
        let title = match (last.fault.wears(), last.rul_cycles) {
            (true, Some(rul)) => {
                format!("{}: {}, {rul:.1} cycles left at cycle {}", last.valve, fault_words(last.fault), last.cycle)
            }
            (true, None) => format!("{}: {}", last.valve, fault_words(last.fault)),
            (false, _) => format!("{}: no fault named at cycle {}", last.valve, last.cycle),
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
    let named = prognosis.fault.wears();
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
        FaultCall::Undecided => {
            FaultCall::FAULTS.into_iter().chain([FaultCall::None]).map(|fault| all.of(fault)).fold(0.0, f64::max)
        }
        named => all.of(named),
    })
}
