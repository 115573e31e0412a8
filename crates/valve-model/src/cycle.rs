//! Full cycles: close, open, and again, until the cycle repeats itself.

use crate::command::CommandEdge;
use crate::conditions::Conditions;
use crate::fidelity::Fidelity;
use crate::params::Schedule;
use crate::simulate::{Prepared, Run, simulate};
use crate::start::Start;
use crate::state::State;
use crate::stroke::strokes;
use crate::trajectory::Outcome;
use crate::valve::Valve;

/// The stroke times of one cycle; nothing where the valve did not get there.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct CycleTimes {
    /// Closing time, s.
    pub close_time_s: Option<f64>,
    /// Opening time, s.
    pub open_time_s: Option<f64>,
    /// How the cycle ended. One that stopped has no stroke times, which must not be taken for those of a valve that does not get
    /// there.
    pub outcome: Outcome,
}

/// A cycle counts as periodic when no state moves by more than this share from one to the next.
const PERIODIC: f64 = 1e-9;

/// The commands of one cycle.
pub fn cycle_commands(schedule: &Schedule) -> Vec<CommandEdge> {
    vec![CommandEdge::new(schedule.close_at_s, true), CommandEdge::new(schedule.open_at_s, false)]
}

/// How the first cycle ends, which begins at rest.
pub fn outcome(valve: &Valve, conditions: Conditions, schedule: &Schedule, fidelity: impl Into<Fidelity>) -> Outcome {
    let run = cycle_run(conditions, schedule);
    let mut outcome = Outcome::Refused;
    simulate(&[Prepared::new(valve, &run, fidelity)], false, |_, nodes, _| outcome = nodes.outcome);
    outcome
}

/// One cycle from rest.
fn cycle_run(conditions: Conditions, schedule: &Schedule) -> Run {
    Run { conditions, commands: cycle_commands(schedule), end_s: schedule.end_s, prescribed: None, start: Start::Rest }
}

/// Simulates cycles one after the other, each from the state in which the last one ended: for every
/// valve and its conditions the times of each cycle, at most `cycles` of them, fewer once they are periodic.
pub fn cycles(
    valves: &[(&Valve, Conditions)],
    schedule: &Schedule,
    cycles: usize,
    fidelity: impl Into<Fidelity>,
) -> Vec<Vec<CycleTimes>> {
    let fidelity = fidelity.into();
    let commands = cycle_commands(schedule);
    let mut runs: Vec<Prepared> = valves
        .iter()
        .map(|(valve, conditions)| Prepared::new(valve, &cycle_run(*conditions, schedule), fidelity))
        .collect();
    let mut times: Vec<Vec<CycleTimes>> = vec![Vec::new(); valves.len()];
    let mut active: Vec<usize> = (0..valves.len()).collect();
    for cycle in 1..=cycles {
        let mut ends: Vec<State<f64>> = active.iter().map(|index| *runs[*index].initial()).collect();
        let batch: Vec<Prepared> = active
            .iter()
            .map(|index| {
                let run = runs[*index].clone();
                // Nothing follows the last opening that anybody asks for.
                if cycle == cycles { run.until_open(valves[*index].0) } else { run }
            })
            .collect();
        simulate(&batch, false, |position, nodes, end| {
            let strokes = strokes(valves[active[position]].0, &commands, nodes);
            times[active[position]].push(CycleTimes {
                close_time_s: strokes[0].time_s,
                open_time_s: strokes[1].time_s,
                outcome: nodes.outcome,
            });
            ends[position] = *end;
        });
        let mut still = Vec::with_capacity(active.len());
        for (index, end) in active.iter().zip(ends) {
            if !end.is_within(runs[*index].initial(), PERIODIC) {
                still.push(*index);
            }
            runs[*index] = runs[*index].clone().starting_from(end);
        }
        active = still;
        if active.is_empty() {
            break;
        }
    }
    times
}
