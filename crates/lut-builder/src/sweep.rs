//! Simulated severities of one degradation at the valve's own conditions, each simulated once.

use std::collections::BTreeMap;

use leak_table::{SeverityPoint, Stroke};
use valve_model::Conditions;

use crate::error::BuildError;
use crate::progress::{Progress, Stage};
use crate::simulation::Simulation;
use crate::ticks::Ticks;

/// The stroke times simulated so far, by severity.
pub(crate) struct Sweep<'a> {
    pub(crate) simulation: Simulation<'a>,
    /// Its place among those that are built.
    place: usize,
    samples: BTreeMap<Ticks, SeverityPoint>,
    simulated: usize,
    share: f64,
    progress: &'a (dyn Fn(Progress) + Sync),
}

impl<'a> Sweep<'a> {
    pub(crate) fn new(simulation: Simulation<'a>, place: usize, progress: &'a (dyn Fn(Progress) + Sync)) -> Self {
        Self { simulation, place, samples: BTreeMap::new(), simulated: 0, share: 0.0, progress }
    }

    /// The samples, by severity.
    pub(crate) fn samples(&self) -> &BTreeMap<Ticks, SeverityPoint> {
        &self.samples
    }

    /// The sample at a severity that was simulated.
    pub(crate) fn at(&self, ticks: Ticks) -> &SeverityPoint {
        &self.samples[&ticks]
    }

    /// How many severities were simulated.
    pub(crate) fn simulated(&self) -> usize {
        self.simulated
    }

    /// Simulates the severities that have not been simulated yet.
    pub(crate) fn simulate(&mut self, severities: &[Ticks], stage: Stage, share: f64) -> Result<(), BuildError> {
        let mut missing: Vec<Ticks> =
            severities.iter().copied().filter(|ticks| !self.samples.contains_key(ticks)).collect();
        missing.sort_unstable();
        missing.dedup();
        let conditions = Conditions::nominal(self.simulation.model.valve.parameters());
        let wanted: Vec<(Conditions, Ticks)> = missing.iter().map(|ticks| (conditions, *ticks)).collect();
        let points = self.simulation.points(&wanted)?;
        self.simulated += missing.len();
        self.samples.extend(missing.into_iter().zip(points));
        self.share = self.share.max(share);
        let (place, simulated, share) = (self.place, self.simulated, self.share);
        (self.progress)(Progress { place, stage, simulated, share });
        Ok(())
    }

    /// Forgets the samples beyond a severity.
    pub(crate) fn forget_beyond(&mut self, ticks: Ticks) {
        self.samples.retain(|sampled, _| *sampled <= ticks);
    }

    /// The limit of a stroke, s.
    pub(crate) fn limit_s(&self, stroke: Stroke) -> f64 {
        match stroke {
            Stroke::Close => self.simulation.model.limits.close_within_s,
            Stroke::Open => self.simulation.model.limits.open_within_s,
        }
    }

    /// The time that the cycle gives a stroke, s.
    pub(crate) fn window_s(&self, stroke: Stroke) -> f64 {
        let schedule = &self.simulation.model.schedule;
        match stroke {
            Stroke::Close => schedule.open_at_s - schedule.close_at_s,
            Stroke::Open => schedule.end_s - schedule.open_at_s,
        }
    }
}
