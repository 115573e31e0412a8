//! A prognosis as it is kept between runs: the same numbers, written so that they can be read back.

use leak_table::DegradationId;
use serde::{Deserialize, Serialize};

use crate::bayes::FaultProbability;
use crate::fault_call::FaultCall;
use crate::record::{Prognosis, Status};

/// The last prognosis of a valve, without its notices, which are said once.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct KeptPrognosis {
    cycle: u64,
    time: Option<String>,
    fault: String,
    probability: Option<KeptProbability>,
    leak: [Option<f64>; 2],
    severity: Option<f64>,
    eol_cycle: Option<f64>,
    rul: [Option<f64>; 4],
    replace_by_cycle: Option<u64>,
    dates: [Option<String>; 2],
    fault_group: Vec<String>,
    caveat: Option<String>,
    status: Status,
    noise_s: Option<f64>,
}

/// The probabilities: of no wear, of both leaks, of other wear, and of each kind that there is a table for.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
struct KeptProbability([f64; 3], Vec<(String, f64)>);

impl KeptPrognosis {
    pub(crate) fn of(one: &Prognosis) -> Self {
        // All fields by name, so that a new one is not forgotten here.
        let Prognosis {
            valve: _,
            cycle,
            time,
            fault,
            fault_probability,
            leak_area_mm2,
            leak_rate_mm2_per_cycle,
            severity,
            eol_cycle,
            rul_cycles,
            rul_p05,
            rul_p50,
            rul_p95,
            replace_by_cycle,
            eol_time,
            replace_by,
            fault_group,
            caveat,
            status,
            noise_s,
            notices: _,
        } = one.clone();
        Self {
            cycle,
            time,
            fault: fault.name().to_owned(),
            probability: fault_probability.map(|all| {
                let wears = all.wears().iter().map(|(id, share)| (id.name().to_owned(), *share));
                KeptProbability([all.none, all.both_leaks, all.other], wears.collect())
            }),
            leak: [leak_area_mm2, leak_rate_mm2_per_cycle],
            severity,
            eol_cycle,
            rul: [rul_cycles, rul_p05, rul_p50, rul_p95],
            replace_by_cycle,
            dates: [eol_time, replace_by],
            fault_group: fault_group.iter().map(|fault| fault.name().to_owned()).collect(),
            caveat,
            status,
            noise_s,
        }
    }

    pub(crate) fn of_valve(self, valve: &str) -> Prognosis {
        let [leak_area_mm2, leak_rate_mm2_per_cycle] = self.leak;
        let [rul_cycles, rul_p05, rul_p50, rul_p95] = self.rul;
        let [eol_time, replace_by] = self.dates;
        Prognosis {
            valve: valve.to_owned(),
            cycle: self.cycle,
            time: self.time,
            fault: FaultCall::read(&self.fault),
            fault_probability: self.probability.map(|KeptProbability([none, both_leaks, other], wears)| {
                let wears: Vec<_> = wears.iter().map(|(id, share)| (DegradationId::read(id), *share)).collect();
                FaultProbability::of_shares(none, &wears, both_leaks, other)
            }),
            leak_area_mm2,
            leak_rate_mm2_per_cycle,
            severity: self.severity,
            eol_cycle: self.eol_cycle,
            rul_cycles,
            rul_p05,
            rul_p50,
            rul_p95,
            replace_by_cycle: self.replace_by_cycle,
            eol_time,
            replace_by,
            fault_group: self.fault_group.iter().map(|fault| FaultCall::read(fault)).collect(),
            caveat: self.caveat,
            status: self.status,
            noise_s: self.noise_s,
            notices: Vec::new(),
        }
    }
}
