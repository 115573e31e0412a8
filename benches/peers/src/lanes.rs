//! Lanes full of equal runs, which never wait for each other, beside runs that differ in leak and commands.

use std::hint::black_box;

use valve_model::command::CommandEdge;
use valve_model::simulate::{DEFAULT_STEP_S, simulate_scalar};
use valve_model::stroke::strokes;
use valve_model::{Prepared, Run, Start, Valve, simulate};

use crate::markdown::{Table, figures, miss, time};
use crate::pace::{Call, by_turns};
use crate::reference_valve::{leaking, spread, valve};

/// Runs: many fillings of the lanes.
const RUNS: usize = 96;
/// Leaks go up to this, m2: with the larger ones the valve takes twice as long to close.
const LARGEST_M2: f64 = 0.5e-6;
/// Shortest and longest time before the valve is told to open, s.
const OPENS: (f64, f64) = (2.5, 6.0);
/// How long a run goes on after that, s.
const AFTER_S: f64 = 4.0;

/// A full cycle from rest.
fn run(valve: &Valve, leak_m2: f64, open_at_s: f64) -> Run {
    Run {
        conditions: leaking(valve, leak_m2),
        commands: vec![CommandEdge::new(0.0, true), CommandEdge::new(open_at_s, false)],
        end_s: open_at_s + AFTER_S,
        prescribed: None,
        start: Start::Rest,
    }
}

/// The stroke times of runs and the steps of all of them.
struct Answer {
    times_s: Vec<[Option<f64>; 2]>,
    steps: usize,
}

fn answer(valve: &Valve, runs: &[Run], prepared: &[Prepared], scalar: bool) -> Answer {
    let mut answer = Answer { times_s: vec![[None; 2]; runs.len()], steps: 0 };
    let take = |index: usize, nodes: &valve_model::Trajectory, _: &_| {
        let found = strokes(valve, &runs[index].commands, nodes);
        answer.times_s[index] = [found[0].time_s, found[1].time_s];
        answer.steps += nodes.time_s.len() - 1;
    };
    if scalar {
        simulate_scalar(prepared, false, take);
    } else {
        simulate(prepared, false, take);
    }
    answer
}

/// The largest difference of a stroke time; infinite if one has a time that the other has not.
fn difference_s(one: &Answer, other: &Answer) -> f64 {
    let differences = one.times_s.as_flattened().iter().zip(other.times_s.as_flattened()).map(|pair| match pair {
        (Some(one), Some(other)) => (one - other).abs(),
        (None, None) => 0.0,
        _ => f64::INFINITY,
    });
    differences.fold(0.0, f64::max)
}

/// Equal and different runs, each by the scalar path and in lanes.
pub fn compare() {
    let valve = valve();
    let equal: Vec<Run> = (0..RUNS).map(|_| run(&valve, 0.5 * LARGEST_M2, 0.5 * (OPENS.0 + OPENS.1))).collect();
    let leaks = spread(RUNS, 0.2).map(|u| u * LARGEST_M2);
    let opens = spread(RUNS, 0.7).map(|u| (u * 7.0).fract()).map(|u| OPENS.0 + u * (OPENS.1 - OPENS.0));
    let different: Vec<Run> = leaks.zip(opens).map(|(leak, open_at_s)| run(&valve, leak, open_at_s)).collect();
    let prepare =
        |runs: &[Run]| -> Vec<Prepared> { runs.iter().map(|run| Prepared::new(&valve, run, DEFAULT_STEP_S)).collect() };
    let sets = [("equal runs", &equal, prepare(&equal)), ("different runs", &different, prepare(&different))];
    let (mut names, mut answers, mut calls) = (Vec::new(), Vec::new(), Vec::<Call<'_>>::new());
    for scalar in [true, false] {
        for (name, runs, prepared) in &sets {
            names.push(format!("{name}, {}", if scalar { "scalar path" } else { "lanes" }));
            answers.push(answer(&valve, runs, prepared, scalar));
            let valve = &valve;
            calls.push(Box::new(move || {
                black_box(answer(valve, runs, prepared, scalar));
            }));
        }
    }
    let paces = by_turns(&mut calls);
    let step_s = |index: usize| paces[index].call_s / answers[index].steps as f64;
    let rows = names.iter().enumerate().map(|(index, name)| {
        let beside = index % sets.len();
        vec![
            name.clone(),
            time(paces[index].call_s / RUNS as f64),
            figures(answers[index].steps as f64 / RUNS as f64),
            time(step_s(index)),
            format!("{} times", figures(step_s(beside) / step_s(index))),
            miss(difference_s(&answers[index], &answers[beside])),
        ]
    });
    Table {
        title: "Lanes with different runs".to_owned(),
        about: format!(
            "{RUNS} cycles of the reference valve; the different ones leak up to {:.1} mm2 and open after {} to {} s.",
            1e6 * LARGEST_M2,
            OPENS.0,
            OPENS.1
        ),
        head: vec!["runs", "time a run", "steps a run", "time a step", "faster than scalar", "differ from scalar by"],
        rows: rows.collect(),
    }
    .print();
}
