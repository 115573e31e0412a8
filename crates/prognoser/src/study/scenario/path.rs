//! How wear grows over the cycles, and when it ends a life.

use super::catalogue::Growth;
use crate::study::noise::NoiseSource;

/// Cycles of a life, drawn evenly.
const LIFE_CYCLES: [f64; 2] = [40.0, 60.0];
/// Cycles into the log at which a late leak begins.
const ONSET_CYCLE: f64 = 5.0;
/// Folds of exponential growth over a life.
const FOLDS: [f64; 2] = [3.0, 5.0];
/// The same where the log begins with a third to less than a hundredth of the wear at the limit.
const FOLDS_BEGUN: [f64; 2] = [1.2, 5.0];
/// Severity at which a log begins of a valve that was worn by then.
const BEGUN: [f64; 2] = [0.02, 0.3];
/// Size of a step, fraction of the limit.
const STEP: [f64; 2] = [0.10, 0.25];
/// Share of the growth before the step.
const STEP_AT: [f64; 2] = [0.15, 0.35];
/// Cycles without growth after it.
const REST_CYCLES: [f64; 2] = [8.0, 12.0];
/// Severity at which a valve is repaired, and what is left of it.
const REPAIR_AT: [f64; 2] = [0.5, 0.7];
const REPAIRED_TO: f64 = 0.4;

/// The severity over the cycles 0, 1, 2, ... as far as somebody looks, and the
/// real-valued cycle at which it is 1.
pub(crate) struct Path {
    pub severity: Vec<f64>,
    pub end_cycle: f64,
    /// Cycle at which growth begins (after a repair: goes on).
    pub begins: f64,
}

impl Path {
    pub(crate) fn draw(growth: Growth, noise: &mut NoiseSource, healthy_cycles: u64) -> Self {
        let mut between = |[low, high]: [f64; 2]| low + (high - low) * noise.uniform();
        let end = between(LIFE_CYCLES);
        match growth {
            Growth::None => {
                let count = usize::try_from(healthy_cycles).unwrap_or(usize::MAX);
                Self { severity: vec![0.0; count], end_cycle: healthy_cycles as f64, begins: 0.0 }
            }
            Growth::Linear => Self::of(end, 0.0, |k| k / end),
            Growth::Square => Self::of(end, 0.0, |k| (k / end).powi(2)),
            Growth::Exponential => {
                let folds = between(FOLDS);
                Self::of(end, 0.0, |k| (folds * k / end).exp_m1() / folds.exp_m1())
            }
            Growth::Compound => {
                let folds = between(FOLDS_BEGUN);
                Self::of(end, 0.0, |k| (folds * (k / end - 1.0)).exp())
            }
            Growth::Begun => {
                let begun = between(BEGUN);
                Self::of(end, 0.0, |k| begun + (1.0 - begun) * k / end)
            }
            Growth::Onset => Self::of(end, ONSET_CYCLE, |k| ((k - ONSET_CYCLE) / (end - ONSET_CYCLE)).max(0.0)),
            Growth::StepRest => {
                let (step, at, rest) = (between(STEP), between(STEP_AT), between(REST_CYCLES));
                let rate = (1.0 - step) / (end - rest);
                let when = at * (1.0 - step) / rate;
                Self::of(end, 0.0, |k| {
                    if k < when {
                        rate * k
                    } else if k < when + rest {
                        rate * when + step
                    } else {
                        step + rate * (k - rest)
                    }
                })
            }
            Growth::Repair => {
                let at = between(REPAIR_AT);
                let fall = (1.0 - REPAIRED_TO) * at;
                let rate = (1.0 + fall) / end;
                let when = at / rate;
                let severity = |k: f64| if k < when { rate * k } else { rate * k - fall };
                Self::of(end, when.ceil(), severity)
            }
            Growth::Gamma => Self::gamma(end, noise),
        }
    }

    /// The same steady growth from the first cycle to another end.
    pub(crate) fn ending_at(&self, severity: f64) -> Self {
        let life = self.end_cycle;
        Self::of(life * severity, self.begins, |k| k / life)
    }

    fn of(end_cycle: f64, begins: f64, severity: impl Fn(f64) -> f64) -> Self {
        let cycles = (0_u32..).map(f64::from).take_while(|k| *k < end_cycle);
        Self { severity: cycles.map(severity).collect(), end_cycle, begins }
    }

    /// Independent increments with an exponential distribution: a gamma process
    /// whose increments have a coefficient of variation of 1.
    fn gamma(mean_life: f64, noise: &mut NoiseSource) -> Self {
        let mut severity = vec![0.0];
        loop {
            let now = severity[severity.len() - 1];
            let increment = -(1.0 - noise.uniform()).ln() / mean_life;
            if now + increment >= 1.0 {
                let end_cycle = (severity.len() - 1) as f64 + (1.0 - now) / increment;
                return Self { severity, end_cycle, begins: 0.0 };
            }
            severity.push(now + increment);
        }
    }
}
