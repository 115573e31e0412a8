//! Simulated severities of one degradation, each simulated once, in parallel batches of lanes.

use std::collections::BTreeMap;

use leak_table::{Degradation, SeverityPoint, Stroke};
use std::sync::atomic::{AtomicU64, Ordering};

use rayon::prelude::*;
use valve_model::cycle::{CycleTimes, cycles};
use valve_model::dispatch::LANES;
use valve_model::{Conditions, Valve};

use crate::error::BuildError;
use crate::model::{Options, TableModel};
use crate::progress::{Progress, Stage};
use crate::ticks::{self, Ticks};
use crate::wear::Wear;

/// Times that wander by no more than this from cycle to cycle are periodic for all purposes, s.
const WANDERING_S: f64 = 5e-3;

/// Cycles over which times that wander are averaged.
const WANDERING_CYCLES: usize = 10;

/// The stroke times simulated so far, by severity.
pub(crate) struct Sweep<'a> {
    pub(crate) model: &'a TableModel<'a>,
    pub(crate) options: &'a Options,
    pub(crate) wear: &'a Wear,
    /// Its place among those that are built.
    place: usize,
    samples: BTreeMap<Ticks, SeverityPoint>,
    simulated: usize,
    share: f64,
    progress: &'a (dyn Fn(Progress) + Sync),
    /// Bits of the widest wandering seen, s; positive numbers order as their bits do.
    wandering: AtomicU64,
}

impl<'a> Sweep<'a> {
    pub(crate) fn new(
        model: &'a TableModel<'a>,
        options: &'a Options,
        (place, wear): (usize, &'a Wear),
        progress: &'a (dyn Fn(Progress) + Sync),
    ) -> Self {
        Self {
            model,
            options,
            wear,
            place,
            samples: BTreeMap::new(),
            simulated: 0,
            share: 0.0,
            progress,
            wandering: AtomicU64::new(0),
        }
    }

    /// The samples, by severity.
    pub(crate) fn samples(&self) -> &BTreeMap<Ticks, SeverityPoint> {
        &self.samples
    }

    /// The sample at a severity that was simulated.
    pub(crate) fn at(&self, ticks: Ticks) -> &SeverityPoint {
        &self.samples[&ticks]
    }

    /// By how much the times of one severity wander from cycle to cycle, at worst, s. No table can be more
    /// accurate than that.
    pub(crate) fn wandering_s(&self) -> f64 {
        f64::from_bits(self.wandering.load(Ordering::Relaxed))
    }

    /// How many severities were simulated.
    pub(crate) fn simulated(&self) -> usize {
        self.simulated
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

    /// A severity in words: "a leak ticks of 0.1 mm2".
    pub(crate) fn named(&self, ticks: Ticks) -> String {
        named(&self.wear.degradation, self.si(ticks))
    }

    /// Simulates the severities that have not been simulated yet.
    pub(crate) fn simulate(&mut self, severities: &[Ticks], stage: Stage, share: f64) -> Result<(), BuildError> {
        let mut missing: Vec<Ticks> =
            severities.iter().copied().filter(|ticks| !self.samples.contains_key(ticks)).collect();
        missing.sort_unstable();
        missing.dedup();
        let batches: Vec<Vec<SeverityPoint>> =
            missing.par_chunks(LANES).map(|batch| self.batch(batch)).collect::<Result<_, _>>()?;
        self.simulated += missing.len();
        self.samples.extend(missing.into_iter().zip(batches.into_iter().flatten()));
        self.share = self.share.max(share);
        let (place, simulated, share) = (self.place, self.simulated, self.share);
        (self.progress)(Progress { place, stage, simulated, share });
        Ok(())
    }

    /// Forgets the samples beyond a severity.
    pub(crate) fn forget_beyond(&mut self, ticks: Ticks) {
        self.samples.retain(|sampled, _| *sampled <= ticks);
    }

    fn batch(&self, severities: &[Ticks]) -> Result<Vec<SeverityPoint>, BuildError> {
        let valve = self.model.valve;
        let conditions = Conditions::nominal(valve.parameters());
        let worn = |ticks: &Ticks| {
            let severity = self.si(*ticks);
            self.wear.worn(valve, conditions, severity).map_err(|source| BuildError::Worn {
                fault: self.id(),
                at: self.named(*ticks),
                source: Box::new(source),
            })
        };
        let worn: Vec<(Valve, Conditions)> = severities.iter().map(worn).collect::<Result<_, _>>()?;
        let runs: Vec<_> = worn.iter().map(|(valve, conditions)| (valve, *conditions)).collect();
        let simulated = cycles(&runs, &self.model.schedule, self.options.most_cycles, self.options.step_s);
        severities.iter().zip(simulated).map(|(ticks, times)| self.periodic(*ticks, &times)).collect()
    }

    /// The last of the cycles, which must be like those before it. Sticking and slipping at the stops
    /// can keep the times of a valve with dry friction wandering by a millisecond or so for
    /// ever; their mean over the last cycles is then taken.
    fn periodic(&self, ticks: Ticks, times: &[CycleTimes]) -> Result<SeverityPoint, BuildError> {
        let mut last = times[times.len() - 1];
        if times.len() == self.options.most_cycles {
            let tail = &times[times.len().saturating_sub(WANDERING_CYCLES)..];
            let settle = |of: fn(&CycleTimes) -> Option<f64>| {
                let reached: Vec<f64> = tail.iter().filter_map(of).collect();
                let lowest = reached.iter().copied().fold(f64::INFINITY, f64::min);
                let highest = reached.iter().copied().fold(f64::NEG_INFINITY, f64::max);
                let mean = reached.iter().sum::<f64>() / reached.len().max(1) as f64;
                if highest > lowest {
                    self.wandering.fetch_max((highest - lowest).to_bits(), Ordering::Relaxed);
                }
                let settled = reached.is_empty() || (reached.len() == tail.len() && highest - lowest <= WANDERING_S);
                (settled, (!reached.is_empty()).then_some(mean))
            };
            let (close_settled, close_time_s) = settle(|cycle| cycle.close_time_s);
            let (open_settled, open_time_s) = settle(|cycle| cycle.open_time_s);
            if !(close_settled && open_settled) {
                let cycles = times.len();
                return Err(BuildError::NotPeriodic { fault: self.id(), at: self.named(ticks), cycles });
            }
            last = CycleTimes { close_time_s, open_time_s };
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

    /// The limit of a stroke, s.
    pub(crate) fn limit_s(&self, stroke: Stroke) -> f64 {
        match stroke {
            Stroke::Close => self.model.limits.close_within_s,
            Stroke::Open => self.model.limits.open_within_s,
        }
    }

    /// The time that the cycle gives a stroke, s.
    pub(crate) fn window_s(&self, stroke: Stroke) -> f64 {
        let schedule = &self.model.schedule;
        match stroke {
            Stroke::Close => schedule.open_at_s - schedule.close_at_s,
            Stroke::Open => schedule.end_s - schedule.open_at_s,
        }
    }
}

/// A severity (SI) in words.
pub(crate) fn named(degradation: &Degradation, severity: f64) -> String {
    let what = &degradation.severity;
    format!("a {} of {}", what.quantity, what.text(severity))
}

/// A time as a table's file holds it: whole nanoseconds.
pub(crate) fn stored(time_s: f64) -> f64 {
    (time_s * 1e9).round() / 1e9
}
