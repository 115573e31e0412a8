//! The leak from one closing time: read off the table, or found by simulating until the time is met.

use std::cell::Cell;
use std::hint::black_box;

use argmin::core::{CostFunction, Error, Executor, State};
use argmin::solver::brent::BrentRoot;
use argmin::solver::neldermead::NelderMead;
use leak_table::{Fault, Stroke, TableBundle};
use valve_model::cycle::cycles;
use valve_model::simulate::DEFAULT_STEP_S;
use valve_model::stroke::strokes;
use valve_model::{CommandEdge, Prepared, Run, Start, Valve, simulate};

use crate::markdown::{Table, figures, miss, time};
use crate::pace::{Call, by_turns};
use crate::reference_valve::{CYCLE, leaking, spread, tables, valve};

/// Leaks that have to be found.
const LEAKS: usize = 16;
/// Times and leaks that are looked up to see how long the table takes.
const LOOKUPS: usize = 4096;
/// Part of the table's range that they are drawn from: not healthy, and not at its last row.
const SHARES: (f64, f64) = (0.02, 0.95);
/// No search that works takes more simulations.
const MOST_SIMULATIONS: usize = 200;
/// Where a search without a bracket begins, as shares of the range.
const STARTS: [f64; 2] = [0.0, 0.1];

/// A closing time whose leak is asked for.
#[derive(Clone, Copy, Debug)]
pub struct Question {
    /// The leak, m2.
    pub leak_m2: f64,
    /// Its closing time, s.
    pub close_time_s: f64,
}

/// The valve as a search sees it.
pub struct Search<'a> {
    valve: &'a Valve,
    /// Largest leak of the table, m2: a root lies below it.
    largest_m2: f64,
    simulations: Cell<usize>,
}

/// How leaks are found by simulating.
#[derive(Clone, Copy, Debug)]
pub enum Method {
    /// By the secant through the last two.
    Secant,
    /// By Brent's method, between no leak and the largest of the table.
    Brent,
    /// By the simplex of Nelder and Mead, which minimises the squared miss.
    NelderMead,
}

impl Method {
    const ALL: [Self; 3] = [Self::Secant, Self::Brent, Self::NelderMead];

    const fn name(self) -> &'static str {
        match self {
            Self::Secant => "secant, on the simulation",
            Self::Brent => "Brent (argmin), on the simulation",
            Self::NelderMead => "Nelder-Mead (argmin), on the simulation",
        }
    }
}

impl<'a> Search<'a> {
    /// A search below a largest leak, m2.
    pub fn new(valve: &'a Valve, largest_m2: f64) -> Self {
        Self { valve, largest_m2, simulations: Cell::new(0) }
    }

    /// How much faster than asked for the valve closes with a leak, 1/s: nearly a line over the leak, and finite where the
    /// valve does not close. One closing from rest is simulated, no longer than a cycle gives it.
    fn too_fast(&self, leak_m2: f64, question: Question) -> f64 {
        self.simulations.set(self.simulations.get() + 1);
        let commands = vec![CommandEdge::new(0.0, true)];
        let run = Run {
            conditions: leaking(self.valve, leak_m2),
            commands: commands.clone(),
            end_s: CYCLE.open_at_s - CYCLE.close_at_s,
            prescribed: None,
            start: Start::Rest,
        };
        let mut close_time_s = None;
        simulate(&[Prepared::new(self.valve, &run, DEFAULT_STEP_S)], false, |_, nodes, _| {
            close_time_s = strokes(self.valve, &commands, nodes)[0].time_s;
        });
        close_time_s.map_or(0.0, |time| 1.0 / time) - 1.0 / question.close_time_s
    }

    /// The leak, m2, with which the valve is no more than `tolerance`, 1/s, too fast or too slow.
    pub fn leak(&self, method: Method, question: Question, tolerance: f64) -> f64 {
        let share = match method {
            Method::Secant => self.secant(question, tolerance),
            Method::Brent => self.brent(question, tolerance),
            Method::NelderMead => self.nelder_mead(question, tolerance),
        };
        share * self.largest_m2
    }

    fn secant(&self, question: Question, tolerance: f64) -> f64 {
        let at = |share: f64| self.too_fast(share * self.largest_m2, question);
        let [mut before, mut here] = STARTS;
        let (mut miss_before, mut miss) = (at(before), at(here));
        for _ in 0..MOST_SIMULATIONS {
            if miss.abs() <= tolerance || here == before {
                break;
            }
            let next = here + miss * (here - before) / (miss_before - miss);
            (before, miss_before) = (here, miss);
            here = next.clamp(0.0, 1.0);
            miss = at(here);
        }
        here
    }

    fn brent(&self, question: Question, tolerance: f64) -> f64 {
        let result = Executor::new(TooFast { search: self, question }, BrentRoot::new(0.0, 1.0, 0.0))
            .configure(|state| state.max_iters(MOST_SIMULATIONS as u64).target_cost(tolerance))
            .run()
            .expect("the largest leak closes later than asked for");
        *result.state().get_best_param().expect("it has begun")
    }

    fn nelder_mead(&self, question: Question, tolerance: f64) -> f64 {
        let start = STARTS.map(|share| vec![share]).to_vec();
        // Its own way to stop takes two points that miss by as much on either side for the end.
        let solver = NelderMead::new(start).with_sd_tolerance(f64::MIN_POSITIVE).expect("a tolerance above 0");
        let result = Executor::new(Square(TooFast { search: self, question }), solver)
            .configure(|state| state.max_iters(MOST_SIMULATIONS as u64).target_cost(tolerance * tolerance))
            .run()
            .expect("finite costs");
        result.state().get_best_param().expect("it has begun")[0].abs()
    }
}

/// One question as argmin takes it.
struct TooFast<'a> {
    search: &'a Search<'a>,
    question: Question,
}

/// For a root.
impl CostFunction for TooFast<'_> {
    type Param = f64;
    type Output = f64;

    fn cost(&self, share: &f64) -> Result<f64, Error> {
        Ok(self.search.too_fast(share * self.search.largest_m2, self.question))
    }
}

/// For a least square. A simplex may go below no leak, where it must not find a plain: what it finds there is mirrored.
struct Square<'a>(TooFast<'a>);

impl CostFunction for Square<'_> {
    type Param = Vec<f64>;
    type Output = f64;

    fn cost(&self, share: &Vec<f64>) -> Result<f64, Error> {
        self.0.cost(&share[0].abs()).map(|miss| miss * miss)
    }
}

/// Closing times of leaks over the range of a table, as the periodic cycle of the simulation has them.
pub fn questions(valve: &Valve, largest_m2: f64) -> Vec<Question> {
    let leaks: Vec<f64> = spread(LEAKS, 0.3).map(|u| (SHARES.0 + u * (SHARES.1 - SHARES.0)) * largest_m2).collect();
    let valves: Vec<_> = leaks.iter().map(|leak| (valve, leaking(valve, *leak))).collect();
    let times = cycles(&valves, &CYCLE, 40, DEFAULT_STEP_S);
    let last = |times: &Vec<valve_model::cycle::CycleTimes>| times.last().and_then(|times| times.close_time_s);
    let asked = leaks.iter().zip(&times).map(|(leak_m2, times)| Question {
        leak_m2: *leak_m2,
        close_time_s: last(times).expect("the table says that it closes"),
    });
    asked.collect()
}

/// The largest miss of leaks, m2.
fn worst(questions: &[Question], leak_m2: impl Fn(Question) -> f64) -> f64 {
    questions.iter().map(|question| (leak_m2(*question) - question.leak_m2).abs()).fold(0.0, f64::max)
}

/// The table and each search, stopped as soon as it is as accurate as the table.
pub fn compare() {
    let (valve, tables) = (valve(), tables());
    let from_table = |question: Question| curve(&tables).extrapolated_severity(question.close_time_s);
    let largest_m2 = curve(&tables).range().1;
    let questions = questions(&valve, largest_m2);
    let table_worst = worst(&questions, from_table);
    let search = Search::new(&valve, largest_m2);
    let ladder = (2..40).map(|k| 10.0_f64.powf(-0.25 * f64::from(k)));
    let chosen: Vec<(Method, f64)> = Method::ALL
        .into_iter()
        .map(|method| {
            let enough = |tolerance: &f64| {
                worst(&questions, |question| search.leak(method, question, *tolerance)) <= table_worst
            };
            (method, ladder.clone().find(enough).expect("a search that goes on gets there"))
        })
        .collect();

    let mut calls: Vec<Call<'_>> = vec![Box::new(|| {
        for question in &questions {
            black_box(from_table(black_box(*question)));
        }
    })];
    let mut rows = vec![("the table".to_owned(), 0.0, table_worst)];
    for &(method, tolerance) in &chosen {
        search.simulations.set(0);
        let worst_m2 = worst(&questions, |question| search.leak(method, question, tolerance));
        rows.push((method.name().to_owned(), search.simulations.get() as f64 / LEAKS as f64, worst_m2));
        let (questions, search) = (&questions, &search);
        calls.push(Box::new(move || {
            for question in questions {
                black_box(search.leak(method, *question, tolerance));
            }
        }));
    }
    let paces = by_turns(&mut calls);
    let rows = rows.into_iter().zip(paces).map(|((name, simulations, worst_m2), pace)| {
        vec![
            name,
            time(pace.call_s / LEAKS as f64),
            format!("{} times", figures(pace.to_first)),
            figures(simulations),
            format!("{:.1e} mm2", 1e6 * worst_m2),
        ]
    });
    Table {
        title: "The leak from one closing time".to_owned(),
        about: format!(
            "{LEAKS} leaks to atmosphere up to {:.3} mm2, their times simulated; each search has the loosest tolerance at \
             which it is as accurate as the table on all of them.",
            1e6 * SHARES.1 * largest_m2
        ),
        head: vec!["by", "time a leak", "as long as the table", "simulations a leak", "largest miss"],
        rows: rows.collect(),
    }
    .print();
}

/// The table read both ways: a leak to its time, and a time to its leak.
pub fn compare_table() {
    let tables = tables();
    let curve = curve(&tables);
    let (first_s, last_s) = curve.end_times_s();
    let times: Vec<f64> = spread(LOOKUPS, 0.3).map(|u| first_s + u * (last_s - first_s)).collect();
    let leaks: Vec<f64> = times.iter().map(|time_s| curve.extrapolated_severity(*time_s)).collect();
    let paces = by_turns(&mut [
        Box::new(|| {
            black_box(leaks.iter().map(|leak| curve.extrapolated_time_and_slope(black_box(*leak)).0).sum::<f64>());
        }),
        Box::new(|| {
            black_box(times.iter().map(|time_s| curve.extrapolated_severity(black_box(*time_s))).sum::<f64>());
        }),
    ]);
    let miss_s = |(time_s, leak): (&f64, &f64)| (curve.extrapolated_time_and_slope(*leak).0 - time_s).abs();
    let misses = [None, Some(times.iter().zip(&leaks).map(miss_s).fold(0.0, f64::max))];
    let rows = ["a leak to its time and slope", "a time to its leak"].into_iter().zip(paces).zip(misses);
    let rows = rows.map(|((name, pace), miss_s)| {
        vec![
            name.to_owned(),
            time(pace.call_s / LOOKUPS as f64),
            format!("{} times", figures(pace.to_first)),
            miss_s.map_or_else(|| "-".to_owned(), miss),
        ]
    });
    Table {
        title: "The table, both ways".to_owned(),
        about: format!("{LOOKUPS} closing times anywhere in it, in no order, and their leaks."),
        head: vec!["what", "time", "as long as the first", "there and back differs by"],
        rows: rows.collect(),
    }
    .print();
}

fn curve(tables: &TableBundle) -> &leak_table::TimingCurve {
    tables.table(Fault::Atmosphere).curve(Stroke::Close)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_search_finds_what_the_table_says() {
        let (valve, tables) = (valve(), tables());
        let largest_m2 = curve(&tables).range().1;
        let search = Search::new(&valve, largest_m2);
        let question = questions(&valve, largest_m2)[0];
        let table_m2 = curve(&tables).extrapolated_severity(question.close_time_s);
        for method in Method::ALL {
            let found_m2 = search.leak(method, question, 1e-6);
            assert!((found_m2 - table_m2).abs() < 1e-4 * largest_m2, "{method:?}: {found_m2}, {table_m2}");
        }
    }
}
