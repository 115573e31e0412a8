//! Simulated leak areas of one fault, each simulated once, in parallel batches of lanes.

use std::collections::BTreeMap;

use leak_table::{Fault, LeakPoint, Stroke};
use std::sync::atomic::{AtomicU64, Ordering};

use rayon::prelude::*;
use valve_model::Conditions;
use valve_model::cycle::{CycleTimes, cycles};
use valve_model::dispatch::LANES;

use crate::area::{self, Area};
use crate::error::BuildError;
use crate::model::{Options, TableModel};
use crate::progress::{Progress, Stage};

/// Times that wander by no more than this from cycle to cycle are periodic for all purposes, s.
const WANDERING_S: f64 = 5e-3;

/// Cycles over which times that wander are averaged.
const WANDERING_CYCLES: usize = 10;

/// The stroke times simulated so far, by leak area.
pub(crate) struct Sweep<'a> {
    pub(crate) model: &'a TableModel<'a>,
    pub(crate) options: &'a Options,
    pub(crate) fault: Fault,
    samples: BTreeMap<Area, LeakPoint>,
    simulated_areas: usize,
    share: f64,
    progress: &'a (dyn Fn(Progress) + Sync),
    /// Bits of the widest wandering seen, s; positive numbers order as their bits do.
    wandering: AtomicU64,
}

impl<'a> Sweep<'a> {
    pub(crate) fn new(
        model: &'a TableModel<'a>,
        options: &'a Options,
        fault: Fault,
        progress: &'a (dyn Fn(Progress) + Sync),
    ) -> Self {
        Self {
            model,
            options,
            fault,
            samples: BTreeMap::new(),
            simulated_areas: 0,
            share: 0.0,
            progress,
            wandering: AtomicU64::new(0),
        }
    }

    /// The samples, by area.
    pub(crate) fn samples(&self) -> &BTreeMap<Area, LeakPoint> {
        &self.samples
    }

    /// The sample at an area that was simulated.
    pub(crate) fn at(&self, area: Area) -> &LeakPoint {
        &self.samples[&area]
    }

    /// By how much the times of one area wander from cycle to cycle, at worst, s. No table can be more
    /// accurate than that.
    pub(crate) fn wandering_s(&self) -> f64 {
        f64::from_bits(self.wandering.load(Ordering::Relaxed))
    }

    /// How many areas were simulated.
    pub(crate) fn simulated_areas(&self) -> usize {
        self.simulated_areas
    }

    /// Simulates the areas that have not been simulated yet.
    pub(crate) fn simulate(&mut self, areas: &[Area], stage: Stage, share: f64) -> Result<(), BuildError> {
        let mut missing: Vec<Area> = areas.iter().copied().filter(|area| !self.samples.contains_key(area)).collect();
        missing.sort_unstable();
        missing.dedup();
        let batches: Vec<Vec<LeakPoint>> =
            missing.par_chunks(LANES).map(|batch| self.batch(batch)).collect::<Result<_, _>>()?;
        self.simulated_areas += missing.len();
        self.samples.extend(missing.into_iter().zip(batches.into_iter().flatten()));
        self.share = self.share.max(share);
        let (fault, simulated_areas, share) = (self.fault, self.simulated_areas, self.share);
        (self.progress)(Progress { fault, stage, simulated_areas, share });
        Ok(())
    }

    /// Forgets the samples beyond an area.
    pub(crate) fn forget_beyond(&mut self, area: Area) {
        self.samples.retain(|sampled, _| *sampled <= area);
    }

    fn batch(&self, areas: &[Area]) -> Result<Vec<LeakPoint>, BuildError> {
        let valve = self.model.valve;
        let runs: Vec<_> = areas.iter().map(|area| (valve, self.conditions(*area))).collect();
        let simulated = cycles(&runs, &self.model.schedule, self.options.most_cycles, self.options.step_s);
        areas.iter().zip(simulated).map(|(area, times)| self.periodic(*area, &times)).collect()
    }

    fn conditions(&self, area: Area) -> Conditions {
        let mut conditions = Conditions::nominal(self.model.valve.parameters());
        match self.fault {
            Fault::Atmosphere => conditions.leak_to_atmosphere_m2 = area::m2(area),
            Fault::Supply => conditions.leak_from_supply_m2 = area::m2(area),
        }
        conditions
    }

    /// The last of the cycles, which must be like those before it. Sticking and slipping at the stops
    /// can keep the times of a valve with dry friction wandering by a millisecond or so for
    /// ever; their mean over the last cycles is then taken.
    fn periodic(&self, area: Area, times: &[CycleTimes]) -> Result<LeakPoint, BuildError> {
        let leak_area_m2 = area::m2(area);
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
                return Err(BuildError::NotPeriodic { fault: self.fault, area_m2: leak_area_m2, cycles });
            }
            last = CycleTimes { close_time_s, open_time_s };
        }
        let point = LeakPoint {
            leak_area_m2,
            close_time_s: last.close_time_s.map(stored),
            open_time_s: last.open_time_s.map(stored),
        };
        for stroke in Stroke::ALL {
            if let Some(found_s) = point.time_s(stroke)
                && !(found_s.is_finite() && found_s >= 0.0)
            {
                return Err(BuildError::NotFinite { fault: self.fault, stroke, area_m2: leak_area_m2, found_s });
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

/// A time as a table's file holds it: whole nanoseconds.
fn stored(time_s: f64) -> f64 {
    (time_s * 1e9).round() / 1e9
}
