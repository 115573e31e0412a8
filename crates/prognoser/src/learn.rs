//! What the logs of sister valves teach of the next one.
//!
//! Every valve is read by the default method. What it says in the end (how long
//! the life is from health to the limit, how the wear grows, by how much its
//! healthy times are off, how noisy its times are) is an observation with an
//! error of its own; the population is fitted to those, with the priors as
//! observations of a stated weight. An unfinished life is one whose length is
//! less well known, a healthy valve tells that nothing began in so many cycles.

use std::collections::BTreeMap;
use std::hash::{DefaultHasher, Hash, Hasher};
use std::sync::Arc;

use leak_table::TableBundle;
use serde::{Deserialize, Serialize};

use crate::bayes::{BayesConfig, BayesEstimate, BayesEstimator, GrowthPrior, Noise};
use crate::log::LogRow;
use crate::reading::Reading;

/// Version of [`Learned`].
pub const PRIOR_VERSION: u32 = 1;
/// Valves that the default priors are worth.
pub const PRIOR_VALVES: f64 = 4.0;
/// Healthy cycles that the prior of the onset is worth.
const PRIOR_CYCLES: f64 = 400.0;
/// Severity from which on the pace of wear is known well enough to learn from.
const WORN: f64 = 0.1;
/// Probability from which on a valve counts as wearing.
const WEARS_FROM: f64 = 0.99;
/// Readings from which on a valve's offset and noise are its own and not the prior's.
const ENOUGH_READINGS: u64 = 10;
/// Cycles after the first row from which on wear began under watch: earlier, it may have been there before.
const LATE_FROM: f64 = 3.0;
/// Probability of a curved growth from which on the wear is taken to have begun with the log.
const CURVED_FROM: f64 = 0.5;
/// Smallest growth a cycle that a beginning is told from: slower wear began with the log.
const SMALLEST_GROWTH: f64 = 1e-9;
/// Standard deviations from the 5 % to the 95 % quantile of a Gaussian.
const SIGMAS_OF_90: f64 = 3.29;
/// Smallest standard deviation of the logarithm of a life.
const LEAST_LN_SD: f64 = 1e-3;
/// Rounds in which the spread of the population and the errors of its members
/// are told apart.
const ROUNDS: usize = 50;

/// What was learnt, as plain numbers.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Learned {
    /// [`PRIOR_VERSION`] of the program that wrote it.
    pub version: u32,
    /// Hash of the model whose tables were used.
    pub model_hash: String,
    /// Valves read, and how many of them wear.
    pub valves: usize,
    /// See [`valves`](Self::valves).
    pub worn: usize,
    /// Cycles from health to the limit: median and standard deviation of the
    /// logarithm.
    pub life_median_cycles: f64,
    /// See [`life_median_cycles`](Self::life_median_cycles).
    pub life_ln_sd: f64,
    /// Relative standard deviation of the healthy times from valve to valve.
    pub unit_sd: f64,
    /// Standard deviation of a time, s.
    pub noise_sd_s: f64,
    /// Share of growth along curves and by varying increments.
    pub curved: f64,
    /// See [`curved`](Self::curved).
    pub rough: f64,
    /// Probability a cycle that wear begins.
    pub onset: f64,
}

/// Why what was learnt cannot be started from.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum PriorError {
    /// It is of another version.
    #[error("found version {found}, expected {PRIOR_VERSION}; learn it again with this program")]
    Version {
        /// Its version.
        found: u32,
    },
    /// A number is none that was ever learnt.
    #[error("{key}: found {found}, expected {expected}")]
    Value {
        /// Which.
        key: &'static str,
        /// What it is.
        found: f64,
        /// What it may be.
        expected: &'static str,
    },
}

/// Reads the logs of sister valves.
pub struct Learner {
    tables: Arc<TableBundle>,
    valves: BTreeMap<String, Seen>,
}

struct Seen {
    valve: String,
    log: usize,
    estimator: BayesEstimator,
    first: u64,
    last: u64,
    estimate: BayesEstimate,
    /// Of all readings so far, in order.
    digest: DefaultHasher,
}

/// The same readings, taken in twice.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Repeated {
    /// The valve, as each log calls it.
    pub valves: [String; 2],
    /// The two logs, in the order in which they were read.
    pub logs: [usize; 2],
}

impl Learner {
    /// A learner that has read nothing.
    pub fn new(tables: Arc<TableBundle>) -> Self {
        Self { tables, valves: BTreeMap::new() }
    }

    /// Takes in a row; cycles of a valve that do not rise are left out. Valves
    /// of different logs are told apart by `log`.
    pub fn push(&mut self, log: usize, row: &LogRow<'_>) {
        let reading = &row.reading;
        let key = format!("{log}/{}", row.valve);
        if let Some(seen) = self.valves.get_mut(&key) {
            if reading.cycle > seen.last {
                seen.last = reading.cycle;
                digest(reading, &mut seen.digest);
                seen.estimate = seen.estimator.update(&self.tables, reading);
            }
            return;
        }
        let mut estimator = BayesEstimator::new(&BayesConfig::default());
        let estimate = estimator.update(&self.tables, reading);
        let mut seen = Seen {
            valve: row.valve.to_owned(),
            log,
            estimator,
            first: reading.cycle,
            last: reading.cycle,
            estimate,
            digest: DefaultHasher::new(),
        };
        digest(reading, &mut seen.digest);
        self.valves.insert(key, seen);
    }

    /// The first life whose readings are those of another one, cycle for cycle and time for time: one life that is given twice,
    /// which would count as two. Few readings may be alike by chance, where times are rounded.
    pub fn repeated(&self) -> Option<Repeated> {
        let mut lives: Vec<&Seen> =
            self.valves.values().filter(|seen| seen.estimate.readings >= ENOUGH_READINGS).collect();
        lives.sort_by_key(|seen| seen.log);
        let mut known: BTreeMap<u64, &Seen> = BTreeMap::new();
        lives.into_iter().find_map(|seen| {
            let before = known.insert(seen.digest.finish(), seen)?;
            let valves = [before.valve.clone(), seen.valve.clone()];
            Some(Repeated { valves, logs: [before.log, seen.log] })
        })
    }

    /// What the valves teach.
    pub fn finish(&self) -> Learned {
        let config = BayesConfig::default();
        let prior = &config.growth_prior;
        let worn: Vec<&Seen> = self.valves.values().filter(|seen| seen.wears()).collect();
        let lives: Vec<(f64, f64)> = worn.iter().filter_map(|seen| seen.ln_life()).collect();
        let (ln_median, life_ln_sd) = population(&lives, (config.life_median_cycles.ln(), config.life_ln_sd));
        let told = || self.valves.values().filter(|seen| seen.estimate.readings >= ENOUGH_READINGS);
        let offsets: Vec<(f64, f64)> = told().flat_map(|seen| seen.estimate.unit).collect();
        let squares: f64 = offsets.iter().map(|(off, sd)| (off * off - sd * sd).max(0.0)).sum();
        let (offset_count, prior_count) = (offsets.len() as f64, 2.0 * PRIOR_VALVES);
        let unit_sd = ((squares + prior_count * config.unit_sd.powi(2)) / (offset_count + prior_count)).sqrt();
        let Noise::Estimated { prior_sd_s, .. } = config.noise else { unreachable!("the default estimates the noise") };
        let noises: f64 = told().map(|seen| seen.estimate.noise_sd_s.powi(2)).sum();
        let noise_sd_s = ((noises + PRIOR_VALVES * prior_sd_s.powi(2)) / (told().count() as f64 + PRIOR_VALVES)).sqrt();
        let share = |pick: &dyn Fn(&BayesEstimate) -> f64, before: f64| {
            let sum: f64 = worn.iter().map(|seen| pick(&seen.estimate)).sum();
            (sum + PRIOR_VALVES * before) / (worn.len() as f64 + PRIOR_VALVES)
        };
        let healthy: f64 =
            self.valves.values().filter(|seen| !seen.wears()).map(|seen| (seen.last - seen.first) as f64).sum();
        let late = worn.iter().filter(|seen| seen.began() > seen.first as f64 + LATE_FROM).count() as f64;
        let before: f64 = worn.iter().map(|seen| (seen.began() - seen.first as f64).max(0.0)).sum();
        Learned {
            version: PRIOR_VERSION,
            model_hash: self.tables.manifest().model_hash.clone(),
            valves: self.valves.len(),
            worn: worn.len(),
            life_median_cycles: ln_median.exp(),
            life_ln_sd,
            unit_sd,
            noise_sd_s,
            curved: share(&|estimate| estimate.curved, prior.curved()),
            rough: share(&|estimate| estimate.rough, prior.rough),
            onset: (late + PRIOR_CYCLES * prior.onset) / (healthy + before + PRIOR_CYCLES),
        }
    }
}

fn digest(reading: &Reading, into: &mut DefaultHasher) {
    let times = [reading.close_time_s, reading.open_time_s].map(|time| time.map(f64::to_bits));
    (reading.cycle, times, reading.stalled).hash(into);
}

impl Seen {
    fn wears(&self) -> bool {
        self.estimate.probability.none < 1.0 - WEARS_FROM && self.estimate.severity > WORN
    }

    /// The cycle at which the wear began, at its present pace.
    fn began(&self) -> f64 {
        let since = self.estimate.severity / self.estimate.growth.max(SMALLEST_GROWTH);
        if self.estimate.curved > CURVED_FROM {
            self.first as f64
        } else {
            (self.last as f64 - since).max(self.first as f64)
        }
    }

    /// Logarithm of the life from health to the limit, with its error.
    fn ln_life(&self) -> Option<(f64, f64)> {
        let end = self.estimate.end?;
        let life = |cycle: f64| (cycle - self.began()).max(1.0).ln();
        Some((life(end.cycle), ((life(end.quantiles.p95) - life(end.quantiles.p05)) / SIGMAS_OF_90).max(LEAST_LN_SD)))
    }
}

impl Learned {
    /// Holds the version and every number against what they may be, as a file may have been written by anybody.
    pub fn checked(self) -> Result<Self, PriorError> {
        if self.version != PRIOR_VERSION {
            return Err(PriorError::Version { found: self.version });
        }
        let numbers = [
            ("life_median_cycles", self.life_median_cycles, 1e-3, 1e12, "a number of cycles from 0.001 to 1e12"),
            ("life_ln_sd", self.life_ln_sd, 1e-3, 10.0, "a number from 0.001 to 10"),
            ("unit_sd", self.unit_sd, 1e-9, 1.0, "a share from 1e-9 to 1"),
            ("noise_sd_s", self.noise_sd_s, 1e-9, 1e4, "a time in s from 1e-9 to 1e4"),
            ("curved", self.curved, 0.0, 1.0, "a share from 0 to 1"),
            ("rough", self.rough, 0.0, 1.0, "a share from 0 to 1"),
            ("curved and rough together", self.curved + self.rough, 0.0, 1.0, "a share from 0 to 1"),
            ("onset", self.onset, 0.0, 1.0, "a probability from 0 to 1"),
        ];
        match numbers.into_iter().find(|(_, found, from, to, _)| !(from..=to).contains(&found)) {
            None => Ok(self),
            Some((key, found, _, _, expected)) => Err(PriorError::Value { key, found, expected }),
        }
    }

    /// The settings that start from what was learnt.
    pub fn config(&self) -> BayesConfig {
        let config = BayesConfig::default();
        BayesConfig {
            life_median_cycles: self.life_median_cycles,
            life_is_stated: true,
            life_ln_sd: self.life_ln_sd,
            unit_sd: self.unit_sd,
            noise: Noise::Estimated { prior_readings: 2.0, prior_sd_s: self.noise_sd_s },
            growth_prior: GrowthPrior { onset: self.onset, ..config.growth_prior.with_shares(self.curved, self.rough) },
            ..config
        }
    }
}

/// Mean and standard deviation of a population whose members are known with
/// errors, by expectation and maximisation; the prior counts as
/// [`PRIOR_VALVES`] members.
fn population(members: &[(f64, f64)], (prior_mean, prior_sd): (f64, f64)) -> (f64, f64) {
    let (mut mean, mut variance) = (prior_mean, prior_sd * prior_sd);
    for _ in 0..ROUNDS {
        let own = |(value, error): &(f64, f64)| {
            let trust = variance / (variance + error * error);
            (mean + trust * (value - mean), trust * error * error)
        };
        let total = members.len() as f64 + PRIOR_VALVES;
        let next = (members.iter().map(|member| own(member).0).sum::<f64>() + PRIOR_VALVES * prior_mean) / total;
        let spread = members.iter().map(own).map(|(value, left)| (value - next).powi(2) + left).sum::<f64>();
        variance = (spread + PRIOR_VALVES * prior_sd * prior_sd) / total;
        mean = next;
    }
    (mean, variance.sqrt())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_that_nobody_learnt_are_refused() {
        let learned = |change: &dyn Fn(&mut Learned)| {
            let mut learned = Learned {
                version: PRIOR_VERSION,
                model_hash: String::new(),
                valves: 3,
                worn: 2,
                life_median_cycles: 300.0,
                life_ln_sd: 0.8,
                unit_sd: 0.01,
                noise_sd_s: 0.01,
                curved: 0.2,
                rough: 0.1,
                onset: 0.002,
            };
            change(&mut learned);
            learned.checked().map_err(|error| error.to_string())
        };
        assert!(learned(&|_| {}).is_ok());
        for (change, expected) in [
            (&(|one: &mut Learned| one.version = 0) as &dyn Fn(&mut Learned), "found version 0, expected 1"),
            (&|one| one.life_median_cycles = -5.0, "life_median_cycles: found -5, expected a number of cycles"),
            (&|one| one.noise_sd_s = f64::NAN, "noise_sd_s: found NaN, expected a time in s"),
            (&|one| one.unit_sd = 0.0, "unit_sd: found 0, expected a share from 1e-9"),
            (&|one| one.rough = 0.9, "curved and rough together: found 1.1"),
            (&|one| one.onset = f64::INFINITY, "onset: found inf"),
        ] {
            let error = learned(change).expect_err(expected);
            assert!(error.starts_with(expected), "{error}");
        }
    }

    #[test]
    fn a_population_is_found_among_errors() {
        let members: Vec<(f64, f64)> = (0..200).map(|i| (4.0 + 0.3 * f64::from(i % 21 - 10) / 6.0, 0.05)).collect();
        let (mean, sd) = population(&members, (3.0, 1.0));
        assert!((mean - 4.0).abs() < 0.05 && (sd - 0.3).abs() < 0.1, "{mean} {sd}");
        assert_eq!(population(&[], (3.0, 1.0)).0, 3.0);
    }
}
