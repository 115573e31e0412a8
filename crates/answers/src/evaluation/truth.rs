//! True stroke times of a leaking valve, from the simulation itself.

use std::collections::HashMap;
use std::sync::{Mutex, PoisonError};

use leak_table::Fault;
use valve_file::ValveFile;
use valve_model::Conditions;
use valve_model::cycle::cycles;
use valve_model::simulate::DEFAULT_STEP_S;

/// Cycles after which a valve repeats itself at the latest.
const MOST_CYCLES: usize = 40;

/// Closing and opening time, s.
type Times = [Option<f64>; 2];

/// The valve, and what was simulated already: many lives pass the same leaks.
pub struct Truth<'a> {
    file: &'a ValveFile,
    known: Mutex<HashMap<(Fault, u64), Times>>,
}

impl<'a> Truth<'a> {
    /// Nothing simulated yet.
    pub fn new(file: &'a ValveFile) -> Self {
        Self { file, known: Mutex::new(HashMap::new()) }
    }

    /// Closing and opening time in a cycle that repeats itself, s.
    pub fn times_s(&self, fault: Fault, area_m2: f64) -> Times {
        let key = (fault, area_m2.to_bits());
        // The map is whole after every step, also where a thread stopped.
        let known = || self.known.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(times) = known().get(&key) {
            return *times;
        }
        let mut conditions = Conditions::nominal(self.file.valve().parameters());
        match fault {
            Fault::Atmosphere => conditions.leak_to_atmosphere_m2 = area_m2,
            Fault::Supply => conditions.leak_from_supply_m2 = area_m2,
        }
        let simulated = cycles(&[(self.file.valve(), conditions)], &self.file.schedule(), MOST_CYCLES, DEFAULT_STEP_S);
        let last = simulated[0].last().map_or([None; 2], |cycle| [cycle.close_time_s, cycle.open_time_s]);
        known().insert(key, last);
        last
    }
}
