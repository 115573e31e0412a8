//! Batches of lanes: the periodic cycle of a worn valve at many severities and conditions.

use std::sync::atomic::{AtomicU64, Ordering};

use leak_table::{Degradation, Limits, SeverityPoint, Stroke};
use rayon::prelude::*;
use valve_model::cycle::{CycleTimes, cycles};
use valve_model::simulate::ABREAST;
use valve_model::{Conditions, EffectKind, Fidelity, Outcome, Valve};

use crate::error::BuildError;
use crate::levelled::evened;
use crate::model::{Options, TableModel};
use crate::ticks::{self, Ticks};
use crate::wear::Wear;

/// Times that wander by no more than this from cycle to cycle are periodic for all purposes, s.
const WANDERING_S: f64 = 5e-3;

/// Friction that sticks and slips moves a time by up to this share of itself, both ways, from cycle to cycle and from one
/// severity to the next: two thousandths were seen of strokes of two seconds.
pub(crate) const UNEVEN: f64 = 0.005;

/// Times that wander for ever without going anywhere do so by up to this share of themselves, both ways: a piston that stops
/// on its way now at one place and now at another was seen to move a time of 1.5 s by 0.6 %.
const ASTRAY: f64 = 0.02;

/// Cycles over which times that wander are averaged.
const WANDERING_CYCLES: usize = 10;

/// A valve of which one thing wears.
pub(crate) struct Simulation<'a> {
    pub(crate) model: &'a TableModel<'a>,
    pub(crate) options: &'a Options,
    pub(crate) wear: &'a Wear,
    /// How closely it is simulated.
    pub(crate) fidelity: Fidelity,
    /// Bits of the widest wandering seen, s; positive numbers order as their bits do.
    wandering: AtomicU64,
}

impl<'a> Simulation<'a> {
    pub(crate) fn new(model: &'a TableModel<'a>, options: &'a Options, wear: &'a Wear, fidelity: Fidelity) -> Self {
        Self { model, options, wear, fidelity, wandering: AtomicU64::new(0) }
    }

    /// Times wander by this, s.
    pub(crate) fn wanders(&self, by_s: f64) {
        self.wandering.fetch_max(by_s.to_bits(), Ordering::Relaxed);
    }

    /// By how much the times of one severity wander from cycle to cycle, or turn from one severity to the next, at worst, s.
    /// No table can be more accurate than that.
    pub(crate) fn wandering_s(&self) -> f64 {
        f64::from_bits(self.wandering.load(Ordering::Relaxed))
    }

    /// Times of rising severities, evened out where they turn by no more than friction lets them, or than the given share of
    /// themselves; what turns by more stays.
    pub(crate) fn evened(&self, severities: &[f64], times_s: &[f64], most: Option<f64>) -> Vec<f64> {
        let (even, most_s) = evened(severities, times_s, most.unwrap_or_else(|| self.uneven()));
        if most_s > 0.0 {
            // A turn goes as far back as it comes on again.
            self.wanders(2.0 * most_s);
        }
        even
    }

    /// The share of itself by which a time may turn: a valve that is known to stick and slip may turn as far as it goes astray
    /// from cycle to cycle.
    fn uneven(&self) -> f64 {
        if self.sticks() { ASTRAY } else { UNEVEN }
    }

    /// Whether the valve is known to stick and slip.
    pub(crate) fn sticks(&self) -> bool {
        let sticks = [EffectKind::DRY_FRICTION, EffectKind::SEAL_FRICTION];
        self.model.valve.effects().iter().any(|effect| sticks.contains(&effect.kind()))
    }

    /// The id of what wears.
    pub(crate) fn id(&self) -> String {
        self.wear.degradation.id.to_string()
    }

    /// A severity in SI.
    pub(crate) fn si(&self, ticks: Ticks) -> f64 {
        ticks::si(&self.wear.degradation.severity, ticks)
    }

    /// The nearest ticks to a severity in SI.
    pub(crate) fn nearest(&self, severity: f64) -> Ticks {
        ticks::nearest(&self.wear.degradation.severity, severity)
    }

    /// A severity in words: "a leak area of 0.1 mm2".
    pub(crate) fn named(&self, ticks: Ticks) -> String {
        named(&self.wear.degradation, self.si(ticks))
    }

    /// The valve's own conditions but for pressure and temperature.
    pub(crate) fn under(&self, conditions: &leak_table::Conditions) -> Conditions {
        Conditions {
            supply_pressure_pa: conditions.supply_pressure_pa,
            temperature_k: conditions.temperature_k,
            ..Conditions::nominal(self.model.valve.parameters())
        }
    }

    /// The limits as tables have them.
    pub(crate) fn limits(&self) -> Limits {
        let limits = &self.model.limits;
        Limits { close_within_s: limits.close_within_s, open_within_s: limits.open_within_s }
    }

    /// The stroke times at each severity under its conditions, in parallel.
    pub(crate) fn points(&self, wanted: &[(Conditions, Ticks)]) -> Result<Vec<SeverityPoint>, BuildError> {
        let batches: Vec<Vec<SeverityPoint>> =
            wanted.par_chunks(ABREAST).map(|batch| self.batch(batch)).collect::<Result<_, _>>()?;
        Ok(batches.into_iter().flatten().collect())
    }

    fn batch(&self, wanted: &[(Conditions, Ticks)]) -> Result<Vec<SeverityPoint>, BuildError> {
        let worn = |(conditions, ticks): &(Conditions, Ticks)| {
            self.wear.worn(self.model.valve, *conditions, self.si(*ticks)).map_err(|source| BuildError::Worn {
                fault: self.id(),
                at: self.named(*ticks),
                source: Box::new(source),
            })
        };
        let worn: Vec<(Valve, Conditions)> = wanted.iter().map(worn).collect::<Result<_, _>>()?;
        let runs: Vec<_> = worn.iter().map(|(valve, conditions)| (valve, *conditions)).collect();
        let simulated = cycles(&runs, &self.model.schedule, self.options.most_cycles, self.fidelity);
        // A formula of the user's may be no number where the valve is worn; a stroke that is not known is none that stalls.
        for (((_, ticks), (valve, _)), times) in wanted.iter().zip(&runs).zip(&simulated) {
            let stopped_s = |cycle: &CycleTimes| match cycle.outcome {
                Outcome::Diverged { time_s, .. } => Some(time_s),
                _ => None,
            };
            if let (false, Some(time_s)) = (valve.custom().is_empty(), times.iter().find_map(stopped_s)) {
                return Err(BuildError::NoNumber { fault: self.id(), at: self.named(*ticks), time_s });
            }
        }
        wanted.iter().zip(simulated).map(|((_, ticks), times)| self.periodic(*ticks, &times)).collect()
    }

    /// The last of the cycles, which must be like those before it. Sticking and slipping can keep the times of a valve with
    /// dry friction wandering for ever; their mean over the last cycles is then taken, over twice as many where they wander
    /// far. A stroke that is not finished in every one of them is none that can be relied on: it counts as not finished.
    fn periodic(&self, ticks: Ticks, times: &[CycleTimes]) -> Result<SeverityPoint, BuildError> {
        let mut last = times[times.len() - 1];
        if times.len() == self.options.most_cycles {
            let settled =
                |of: fn(&CycleTimes) -> Option<f64>| self.settled(ticks, &times.iter().map(of).collect::<Vec<_>>());
            last = CycleTimes {
                close_time_s: settled(|cycle| cycle.close_time_s)?,
                open_time_s: settled(|cycle| cycle.open_time_s)?,
                ..last
            };
        }
        let point = SeverityPoint {
            severity: self.si(ticks),
            close_time_s: last.close_time_s.map(stored),
            open_time_s: last.open_time_s.map(stored),
        };
        for stroke in Stroke::ALL {
            if let Some(found_s) = point.time_s(stroke)
                && !(found_s.is_finite() && found_s >= 0.0)
            {
                return Err(BuildError::NotFinite { fault: self.id(), stroke, at: self.named(ticks), found_s });
            }
        }
        Ok(point)
    }

    /// What the times of a stroke, one for each cycle, have come to; an error where they still go somewhere.
    fn settled(&self, ticks: Ticks, times_s: &[Option<f64>]) -> Result<Option<f64>, BuildError> {
        let last = |many: usize| -> Option<Vec<f64>> {
            times_s[times_s.len().saturating_sub(many)..].iter().copied().collect()
        };
        let Some(tail) = last(WANDERING_CYCLES) else { return Ok(None) };
        if let Some(settled_s) = approached(&tail) {
            return Ok(Some(settled_s));
        }
        let (mut settled_s, range_s) = (mean(&tail), range(&tail));
        if range_s > WANDERING_S.max(2.0 * UNEVEN * settled_s) {
            let both = last(2 * WANDERING_CYCLES).unwrap_or_default();
            let before_s = mean(&both[..both.len().saturating_sub(tail.len())]);
            settled_s = mean(&both);
            let stays = (before_s - mean(&tail)).abs() <= UNEVEN * settled_s;
            if both.is_empty() || !stays {
                let cycles = times_s.len();
                return Err(BuildError::NotPeriodic { fault: self.id(), at: self.named(ticks), cycles });
            }
        }
        // Farther apart they are of two kinds, a rebound more in one cycle than in the next: the severity lies where the
        // time jumps, and others are no less sure for it.
        if range_s > 0.0 && range_s <= 2.0 * ASTRAY * settled_s {
            self.wanders(range_s);
        }
        Ok(Some(settled_s))
    }
}

/// What times approach by steps that get smaller by about the same factor from cycle to cycle, as those of a valve that is only
/// nearly vented when it closes again (Aitken's extrapolation); nothing where they do not, or are not near yet.
fn approached(times_s: &[f64]) -> Option<f64> {
    let steps: Vec<f64> = times_s.windows(2).map(|pair| pair[1] - pair[0]).collect();
    let shrinks = steps.windows(2).all(|pair| (0.0..1.0).contains(&(pair[1] / pair[0])));
    let ([.., before, step], [.., last_s]) = (steps.as_slice(), times_s) else { return None };
    let left_s = step * step / (before - step);
    (shrinks && left_s.abs() <= UNEVEN * last_s).then_some(last_s + left_s)
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len().max(1) as f64
}

/// From the least to the largest.
fn range(values: &[f64]) -> f64 {
    let ends = |(low, high): (f64, f64), value: &f64| (low.min(*value), high.max(*value));
    let (low, high) = values.iter().fold((f64::INFINITY, f64::NEG_INFINITY), ends);
    high - low
}

/// A severity (SI) in words.
pub(crate) fn named(degradation: &Degradation, severity: f64) -> String {
    let what = &degradation.severity;
    let article = if what.quantity.starts_with(['a', 'e', 'i', 'o', 'u']) { "an" } else { "a" };
    format!("{article} {} of {}", what.quantity, what.text(severity))
}

/// A time as a table's file holds it: whole nanoseconds.
pub(crate) fn stored(time_s: f64) -> f64 {
    (time_s * 1e9).round() / 1e9
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_that_still_approach_something_are_taken_there() {
        let approach = |factor: f64| -> Vec<f64> { (0..10).map(|k| 2.0 + 1e-3 * factor.powi(k)).collect() };
        assert!((approached(&approach(0.9)).expect("approaches") - 2.0).abs() < 1e-12);
        // To and fro, all alike, and apart from each other.
        assert_eq!(approached(&approach(-0.9)), None);
        assert_eq!(approached(&[2.0; 10]), None);
        assert_eq!(approached(&approach(1.1)), None);
    }
}
