//! All lives of all worlds, in parallel; only the times differ from run to run.

use std::sync::Arc;
use std::time::Instant;

use leak_table::TableBundle;
use rayon::prelude::*;

use super::catalogue::Scenario;
use super::life::Life;
use super::score::{LifeScore, ScenarioResult};
use super::world::World;
use crate::log::LogRow;
use crate::prognoser::{Method, Prognoser};

/// Which lives to run.
#[derive(Clone, Debug)]
pub struct ScenarioConfig {
    /// The worlds.
    pub scenarios: Vec<Scenario>,
    /// One-sigma noise of the times, in s.
    pub noises_s: Vec<f64>,
    /// Lives of each world and noise.
    pub lives: u64,
    /// The first seed.
    pub first_seed: u64,
    /// The method.
    pub method: Method,
}

/// Runs them. Results come by noise, then world.
pub fn run_scenarios(world: &dyn World, tables: &Arc<TableBundle>, config: &ScenarioConfig) -> Vec<ScenarioResult> {
    let mut results = Vec::new();
    for &noise_s in &config.noises_s {
        for scenario in &config.scenarios {
            let lives: Vec<LifeScore> = (0..config.lives)
                .into_par_iter()
                .map(|index| {
                    let life = Life::draw(world, scenario, noise_s, config.first_seed + index);
                    let mut prognoser = Prognoser::new(Arc::clone(tables), config.method);
                    let started = Instant::now();
                    let said: Vec<_> = (life.readings.iter().zip(2..))
                        .map(|(reading, line)| {
                            prognoser.push(&LogRow { valve: "V", reading: *reading, time: None, line })
                        })
                        .collect();
                    LifeScore::of(&life, &said, started.elapsed().as_secs_f64())
                })
                .collect();
            results.push(ScenarioResult::of(scenario.name, noise_s, scenario.healthy_cycles > 0, &lives));
        }
    }
    results
}
