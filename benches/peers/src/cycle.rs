//! One valve alone: its stroke times by our integrator, by a plain program and by a general solver of stiff equations.

use std::hint::black_box;

use valve_model::real::LANES;
use valve_model::simulate::{DEFAULT_STEP_S, simulate_scalar};
use valve_model::stroke::strokes;
use valve_model::{Conditions, Prepared, Schedule, Trajectory, Valve, simulate};

use crate::bdf::{self, Closeness};
use crate::markdown::{Table, figures, miss, time};
use crate::pace::{Call, by_turns};
use crate::plain::{Plain, TIGHT_BLEND};
use crate::reference_valve::{CYCLE, leaking, valve, whole_cycle};

/// What the stroke times of a peer may miss the accurate ones by, s.
const ALLOWED_S: f64 = 1e-4;
/// Step of the solution that all are held against, s; once more with twice the step and the blend to see what it is worth.
const FINE_STEP_S: f64 = 1e-5;
/// Blend of the plain program at the step of a millisecond, where a narrower one is not stable.
const PLAIN_BLEND: f64 = 1e-3;
/// A method of the order 4 by Runge and Kutta asks so often a step.
const STAGES: usize = 4;
/// Leak of the case with one, m2.
const LEAK_M2: f64 = 0.3e-6;

/// Stroke times, and how often the equations were asked for.
#[derive(Clone, Copy, Debug)]
pub struct Answer {
    /// Closing and opening, s.
    pub times_s: [Option<f64>; 2],
    /// Evaluations of the right-hand side.
    pub evaluations: usize,
}

impl Answer {
    /// The larger of the misses of both stroke times, s.
    pub fn miss_s(&self, accurate_s: [f64; 2]) -> f64 {
        let miss =
            |(found, accurate): (Option<f64>, f64)| found.map_or(f64::INFINITY, |found| (found - accurate).abs());
        self.times_s.into_iter().zip(accurate_s).map(miss).fold(0.0, f64::max)
    }
}

/// A valve and its cycle.
pub struct Case {
    name: &'static str,
    valve: Valve,
    conditions: Conditions,
    schedule: Schedule,
}

impl Case {
    /// A cycle of the reference valve with a leak to atmosphere, m2.
    pub fn new(name: &'static str, leak_m2: f64, schedule: Schedule) -> Self {
        let valve = valve();
        let conditions = leaking(&valve, leak_m2);
        Self { name, valve, conditions, schedule }
    }

    fn prepared(&self) -> Prepared {
        Prepared::new(&self.valve, &whole_cycle(self.conditions, &self.schedule), DEFAULT_STEP_S)
    }

    fn answer(&self, nodes: &Trajectory) -> Answer {
        let commands = whole_cycle(self.conditions, &self.schedule).commands;
        let found = strokes(&self.valve, &commands, nodes);
        Answer { times_s: [found[0].time_s, found[1].time_s], evaluations: STAGES * (nodes.time_s.len() - 1) }
    }

    /// By our scalar path, which is what the lanes must meet.
    pub fn scalar(&self) -> Answer {
        let mut answer = None;
        simulate_scalar(&[self.prepared()], false, |_, nodes, _| answer = Some(self.answer(nodes)));
        answer.expect("a run was given")
    }

    /// By the lanes, so many of the same valve in them.
    fn lanes(&self, count: usize) -> Answer {
        let runs: Vec<Prepared> = (0..count).map(|_| self.prepared()).collect();
        let mut answer = None;
        simulate(&runs, false, |_, nodes, _| answer = Some(self.answer(nodes)));
        answer.expect("runs were given")
    }

    /// By the plain program with `powf`.
    fn plain(&self, blend: f64, step_s: f64) -> Answer {
        let times_s = Plain::new(self.valve.parameters(), &self.conditions, blend).cycle(&self.schedule, step_s);
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a positive count of steps")]
        let steps = (self.schedule.end_s / step_s).round() as usize;
        Answer { times_s, evaluations: STAGES * steps }
    }

    /// By the general solver; nothing if it gives up.
    fn bdf(&self, closeness: Closeness) -> Option<Answer> {
        bdf::cycle(&self.valve, &self.conditions, &self.schedule, closeness).ok()
    }

    /// The stroke times that all are held against, and what a coarser solution of the kind differs by, s.
    pub fn accurate(&self) -> ([f64; 2], f64) {
        let finished = |answer: Answer| answer.times_s.map(|time| time.expect("the cycle is long enough"));
        let accurate = finished(self.plain(TIGHT_BLEND, FINE_STEP_S));
        (accurate, self.plain(2.0 * TIGHT_BLEND, 2.0 * FINE_STEP_S).miss_s(accurate))
    }

    /// The general solver as coarse as is accurate to `allowed_s`: the one that asks least.
    fn coarsest_bdf(&self, accurate_s: [f64; 2], allowed_s: f64) -> Option<(Closeness, Answer)> {
        let tolerances = (0..13).map(|k| 1e-2 * 10.0_f64.powf(-0.5 * f64::from(k)));
        let all = tolerances.flat_map(|tolerance| [1e-2, 1e-3, 1e-4].map(|laminar| Closeness { tolerance, laminar }));
        all.filter_map(|closeness| Some((closeness, self.bdf(closeness)?)))
            .filter(|(_, answer)| answer.miss_s(accurate_s) <= allowed_s)
            .min_by_key(|(_, answer)| answer.evaluations)
    }

    fn compare(&self) {
        let (accurate_s, doubt_s) = self.accurate();
        let mut names = vec!["plain scalar program with `powf`, 1 ms".to_owned()];
        let mut answers = vec![self.plain(PLAIN_BLEND, DEFAULT_STEP_S)];
        let mut calls: Vec<Call<'_>> = vec![Box::new(|| {
            black_box(self.plain(PLAIN_BLEND, DEFAULT_STEP_S));
        })];
        let ours_s = self.scalar().miss_s(accurate_s);
        for (aim, allowed_s) in
            [(format!("to {}", miss(ALLOWED_S)), ALLOWED_S), ("as accurate as ours".to_owned(), ours_s)]
        {
            let Some((closeness, answer)) = self.coarsest_bdf(accurate_s, allowed_s) else { continue };
            let Closeness { tolerance, laminar } = closeness;
            names.push(format!("BDF of diffsol, {aim} (tolerance {tolerance:.0e}, laminar below {laminar:.0e})"));
            answers.push(answer);
            calls.push(Box::new(move || {
                black_box(self.bdf(closeness));
            }));
        }
        names.push("ours, scalar path".to_owned());
        answers.push(self.scalar());
        calls.push(Box::new(|| {
            black_box(self.scalar());
        }));
        for count in [1, LANES] {
            names.push(format!("ours, {count} of {LANES} lanes in use, a valve"));
            answers.push(self.lanes(count));
            calls.push(Box::new(move || {
                black_box(self.lanes(count));
            }));
        }
        let mut shares = vec![1; calls.len()];
        *shares.last_mut().expect("just filled") = LANES;
        let paces = by_turns(&mut calls);
        let rows =
            names.into_iter().zip(&answers).zip(paces.iter().zip(shares)).map(|((name, answer), (pace, share))| {
                let share = share as f64;
                vec![
                    name,
                    time(pace.call_s / share),
                    format!("{} times", figures(share / pace.to_first)),
                    figures(answer.evaluations as f64),
                    miss(answer.miss_s(accurate_s)),
                ]
            });
        Table {
            title: format!("One valve alone: {}", self.name),
            about: format!(
                "Closing {:.4} s, opening {:.4} s; told to open at {:.2} s, over at {:.2} s. Held against the plain program with \
                 steps of {:.0} us; one twice as coarse differs by {}.",
                accurate_s[0],
                accurate_s[1],
                self.schedule.open_at_s,
                self.schedule.end_s,
                1e6 * FINE_STEP_S,
                miss(doubt_s)
            ),
            head: vec!["by", "time", "faster than the plain program", "evaluations", "largest miss of a stroke time"],
            rows: rows.collect(),
        }
        .print();
    }
}

/// The shortest cycle in which the piston comes to rest on both of its stops: each command comes when it rests.
fn short_cycle() -> Schedule {
    let long = Case::new("", 0.0, CYCLE);
    let open_at_s = rests_from(&long, 0.0, CYCLE.open_at_s);
    let schedule = Schedule { close_at_s: 0.0, open_at_s, end_s: open_at_s + CYCLE.end_s - CYCLE.open_at_s };
    let case = Case { schedule, ..long };
    Schedule { end_s: rests_from(&case, open_at_s, schedule.end_s), ..schedule }
}

/// When the piston has bounced for the last time between two instants, to the next hundredth of a second.
fn rests_from(case: &Case, from_s: f64, until_s: f64) -> f64 {
    let stroke = case.valve.parameters().stroke_m;
    let mut last = from_s;
    simulate_scalar(&[case.prepared()], false, |_, nodes, _| {
        let inside = nodes.time_s.iter().zip(&nodes.position_m).filter(|(_, x)| (0.0..=stroke).contains(*x));
        last = inside.map(|(time, _)| *time).filter(|time| (from_s..until_s).contains(time)).fold(from_s, f64::max);
    });
    (100.0 * last).ceil() / 100.0
}

/// All cases.
pub fn compare() {
    Case::new("healthy, the cycle of the tables", 0.0, CYCLE).compare();
    Case::new("healthy, a cycle that is over when the piston rests", 0.0, short_cycle()).compare();
    Case::new("a leak of 0.3 mm2, the cycle of the tables", LEAK_M2, CYCLE).compare();
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn three_ways_agree_in_stroke_times() {
        for leak_m2 in [0.0, LEAK_M2] {
            let case = Case::new("", leak_m2, CYCLE);
            let accurate_s = case.plain(TIGHT_BLEND, 2.0 * FINE_STEP_S).times_s.map(|time| time.expect("finishes"));
            assert!(case.scalar().miss_s(accurate_s) < ALLOWED_S, "{:?} {accurate_s:?}", case.scalar());
            let (_, bdf) = case.coarsest_bdf(accurate_s, ALLOWED_S).expect("accurate enough");
            assert!(bdf.evaluations < case.scalar().evaluations, "{bdf:?}");
        }
    }
}
