//! Lives boiled down to a row of the table.

use serde::Serialize;

use super::life::Life;
use super::world::Wear;
use crate::fault_call::FaultCall;
use crate::record::{Prognosis, Status};

/// Severity from which on it is wrong to call a valve healthy.
pub const SEVERE: f64 = 0.2;
/// Cycles of growth before predictions count.
const FIRST_CYCLES: f64 = 2.0;

/// How one life went.
#[expect(clippy::struct_excessive_bools, reason = "each is counted by itself")]
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct LifeScore {
    accuracy: f64,
    intervals: f64,
    held: f64,
    named_wrongly: bool,
    named_rightly: bool,
    called_other: bool,
    ended_early: bool,
    failed: bool,
    given_away: f64,
    rows: f64,
    seconds: f64,
}

/// A row of the table: one world at one noise.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ScenarioResult {
    /// The world's name.
    pub scenario: &'static str,
    /// One-sigma noise of a time, in s.
    pub noise_s: f64,
    /// Number of lives.
    pub lives: u64,
    /// Median relative accuracy; none for healthy valves.
    pub relative_accuracy: Option<f64>,
    /// Share of the 90 % intervals that hold the truth.
    pub coverage_90: Option<f64>,
    /// Share of the lives with a wrong name.
    pub named_wrongly: f64,
    /// Share of the lives with the right name at the end.
    pub named_rightly: f64,
    /// Share of the lives in which wear that has a table is called other.
    pub called_other: f64,
    /// Share of the lives whose end was told too early.
    pub ended_early: f64,
    /// Share of the lives that failed in service.
    pub failed_in_service: Option<f64>,
    /// Median share of the life left at replacement.
    pub life_given_away: Option<f64>,
    /// Time for a row, in s. It is the only number that differs from run to run.
    pub row_s: f64,
}

impl LifeScore {
    pub(crate) fn of(life: &Life, said: &[Prognosis], seconds: f64) -> Self {
        let healthy = life.wear.is_empty();
        let mut score = Self { rows: said.len() as f64, seconds, ..Self::default() };
        let (mut sum, mut count) = (0.0, 0.0);
        let mut replaced = None;
        let before: Vec<Wear> =
            life.wear.iter().copied().filter(|wear| life.later.is_none_or(|(later, _)| *wear != later)).collect();
        for (one, severity) in said.iter().zip(&life.severity) {
            let cycle = one.cycle as f64;
            let left = life.end_cycle - cycle;
            let wear = if life.later.is_some_and(|(_, begins)| cycle < begins) { &before } else { &life.wear };
            score.named_wrongly |= wrong(one, wear, *severity);
            score.called_other |= one.fault == FaultCall::Other && !grouped_with(one, wear);
            score.ended_early |= one.status == Status::EolReached && left > 1.0 && cycle < life.over_from;
            if replaced.is_none() && one.replace_by_cycle.is_some_and(|by| (by as f64) < cycle + 1.0) {
                replaced = Some(cycle);
            }
            if !healthy && cycle >= life.begins + FIRST_CYCLES {
                count += 1.0;
                sum += one.rul_cycles.map_or(0.0, |rul| (1.0 - (left - rul).abs() / left).max(0.0));
                if let (Some(low), Some(high)) = (one.rul_p05, one.rul_p95) {
                    score.intervals += 1.0;
                    score.held += f64::from(u8::from(low <= left && left <= high));
                }
            }
        }
        score.accuracy = if count > 0.0 { sum / count } else { 1.0 };
        score.failed = replaced.is_none();
        score.given_away = replaced.map_or(0.0, |cycle| (life.end_cycle - cycle) / life.end_cycle);
        score.named_rightly = said.last().is_some_and(|one| right(one, &life.wear));
        score
    }
}

/// Whether a row names what is not there.
fn wrong(one: &Prognosis, wear: &[Wear], severity: f64) -> bool {
    match one.fault {
        FaultCall::Undecided | FaultCall::Other => wear.is_empty() && one.fault == FaultCall::Other,
        FaultCall::None => severity > SEVERE,
        _ => !right(one, wear),
    }
}

/// Whether a row names what is there, alone or in a group.
fn right(one: &Prognosis, wear: &[Wear]) -> bool {
    match wear {
        [] => matches!(one.fault, FaultCall::None | FaultCall::Undecided),
        [only] => one.fault.name() == only.name() || grouped_with(one, wear),
        // Of several kinds at once, any of them is right to be named.
        _ => {
            let leak =
                |fault: FaultCall| fault == FaultCall::BothLeaks || wear.iter().any(|wear| fault.name() == wear.name());
            leak(one.fault) || one.fault_group.iter().any(|fault| leak(*fault))
        }
    }
}

fn grouped_with(one: &Prognosis, wear: &[Wear]) -> bool {
    one.fault_group.iter().any(|fault| wear.iter().any(|wear| fault.name() == wear.name()))
}

impl ScenarioResult {
    pub(crate) fn of(scenario: &'static str, noise_s: f64, healthy: bool, lives: &[LifeScore]) -> Self {
        let count = lives.len() as f64;
        let share = |pick: &dyn Fn(&LifeScore) -> bool| lives.iter().filter(|life| pick(life)).count() as f64 / count;
        let sum = |pick: &dyn Fn(&LifeScore) -> f64| lives.iter().map(pick).sum::<f64>();
        let degrading = |value: f64| (!healthy).then_some(value);
        let intervals = sum(&|life| life.intervals);
        Self {
            scenario,
            noise_s,
            lives: lives.len() as u64,
            relative_accuracy: degrading(median(lives.iter().map(|life| life.accuracy))),
            coverage_90: degrading(sum(&|life| life.held) / intervals).filter(|_| intervals > 0.0),
            named_wrongly: share(&|life| life.named_wrongly),
            named_rightly: share(&|life| life.named_rightly),
            called_other: share(&|life| life.called_other),
            ended_early: share(&|life| life.ended_early),
            failed_in_service: degrading(share(&|life| life.failed)),
            life_given_away: degrading(median(lives.iter().map(|life| life.given_away))),
            row_s: sum(&|life| life.seconds) / sum(&|life| life.rows),
        }
    }
}

fn median(values: impl Iterator<Item = f64>) -> f64 {
    let mut values: Vec<f64> = values.collect();
    values.sort_by(f64::total_cmp);
    let middle = values.len() / 2;
    if values.len() % 2 == 1 { values[middle] } else { f64::midpoint(values[middle - 1], values[middle]) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::output::blank;

    #[test]
    fn an_end_is_told_too_early_only_before_a_stroke_is_over_its_limit() {
        let life = |over_from| Life {
            readings: Vec::new(),
            severity: vec![0.5; 20],
            over_from,
            end_cycle: 20.0,
            begins: 0.0,
            wear: vec![Wear::Atmosphere],
            later: None,
        };
        let told = |cycle| Prognosis { status: Status::EolReached, ..blank("V", cycle) };
        let early = |over_from, cycle| LifeScore::of(&life(over_from), &[told(cycle)], 1.0).ended_early;
        assert!(early(f64::INFINITY, 12) && early(13.0, 12));
        assert!(!early(12.0, 12) && !early(10.0, 12), "it really did take too long");
        assert!(!early(f64::INFINITY, 19), "a cycle is near enough");
    }
}
