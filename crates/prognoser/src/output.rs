//! From estimates to what goes out.

use leak_table::{Fault, Stroke, TableBundle, mm2_from_m2};

use crate::bayes::{BayesEstimate, Change};
use crate::notice::Notice;
use crate::ols::OlsEstimate;
use crate::reading::Reading;
use crate::record::{FaultCall, Prognosis, Status};

/// Probability of being a proper reading below which a timing is called a
/// glitch.
pub(crate) const GLITCH_BELOW: f64 = 0.05;
/// Standard deviations by which a time may lie outside the tables as noise.
const OUTSIDE_FROM: f64 = 5.0;

/// Notes strokes that did not finish or took too long; whether one of them
/// would mean end of life if it is no glitch.
pub(crate) fn limits(tables: &TableBundle, reading: &Reading, notices: &mut Vec<Notice>) -> [bool; 2] {
    Stroke::ALL.map(|stroke| {
        let limit_s = tables.manifest().limits.within_s(stroke);
        match reading.time_s(stroke) {
            None => {
                notices.push(Notice::NotFinished { stroke });
                true
            }
            Some(time) if time > limit_s => {
                notices.push(Notice::AboveLimit { stroke, limit_s });
                true
            }
            Some(_) => false,
        }
    })
}

/// Notes what the estimator found odd.
pub(crate) fn remark(tables: &TableBundle, reading: &Reading, estimate: &BayesEstimate, notices: &mut Vec<Notice>) {
    for (i, stroke) in Stroke::ALL.into_iter().enumerate() {
        let Some(time) = reading.time_s(stroke) else {
            continue;
        };
        let (mut shortest_s, mut longest_s) = (f64::INFINITY, f64::NEG_INFINITY);
        for fault in Fault::ALL {
            let (a, b) = tables.table(fault).curve(stroke).end_times_s();
            shortest_s = shortest_s.min(a).min(b);
            longest_s = longest_s.max(a).max(b);
        }
        let margin = OUTSIDE_FROM * estimate.noise_sd_s;
        if time < shortest_s - margin || time > longest_s + margin {
            notices.push(Notice::OutsideTables { stroke, found_s: time, shortest_s, longest_s });
        }
        if estimate.inlier[i] < GLITCH_BELOW
            && let Some(residual_s) = estimate.residual_s[i]
        {
            notices.push(Notice::Glitch { stroke, residual_s });
        }
    }
    notices.extend(estimate.change.map(|change| match change {
        Change::Repaired => Notice::Repaired,
        Change::Broken => Notice::GrowthChanged,
        Change::Exponential => Notice::GrowthExponential,
        Change::Reread => Notice::Reread,
    }));
}

pub(crate) fn blank(name: &str, cycle: u64) -> Prognosis {
    Prognosis {
        valve: name.to_owned(),
        cycle,
        time: None,
        fault: FaultCall::Undecided,
        fault_probability: None,
        leak_area_mm2: None,
        leak_rate_mm2_per_cycle: None,
        eol_cycle: None,
        rul_cycles: None,
        rul_p05: None,
        rul_p50: None,
        rul_p95: None,
        status: Status::Healthy,
        noise_s: None,
        notices: Vec::new(),
    }
}

pub(crate) fn from_bayes(
    name: &str,
    reading: &Reading,
    estimate: &BayesEstimate,
    name_from: f64,
    over_limit: [bool; 2],
) -> Prognosis {
    let probability = estimate.probability;
    let fault = if probability.none >= name_from {
        FaultCall::None
    } else if probability.of(estimate.leading) >= name_from {
        estimate.leading.into()
    } else {
        FaultCall::Undecided
    };
    let mut prognosis = blank(name, reading.cycle);
    prognosis.fault = fault;
    prognosis.fault_probability = Some(probability);
    prognosis.noise_s = Some(estimate.noise_sd_s);
    if fault == FaultCall::None {
        return prognosis;
    }
    let remaining = |eol: f64| (eol - reading.cycle as f64).max(0.0);
    prognosis.leak_area_mm2 = Some(mm2_from_m2(estimate.leak_area_m2));
    prognosis.leak_rate_mm2_per_cycle = Some(mm2_from_m2(estimate.leak_rate_m2));
    prognosis.eol_cycle = Some(estimate.eol_cycle);
    prognosis.rul_cycles = Some(remaining(estimate.eol_cycle));
    prognosis.rul_p05 = Some(remaining(estimate.eol.p05));
    prognosis.rul_p50 = Some(remaining(estimate.eol.p50));
    prognosis.rul_p95 = Some(remaining(estimate.eol.p95));
    let over = (0..2).any(|i| over_limit[i] && estimate.inlier[i] > 0.5);
    prognosis.status = match fault {
        FaultCall::Undecided | FaultCall::None => Status::Healthy,
        _ if over || estimate.eol.p50 <= reading.cycle as f64 => Status::EolReached,
        _ => Status::Degrading,
    };
    prognosis
}

pub(crate) fn from_ols(name: &str, reading: &Reading, estimate: &OlsEstimate, over_limit: [bool; 2]) -> Prognosis {
    let mut prognosis = blank(name, reading.cycle);
    let Some(fault) = estimate.fault else {
        return prognosis;
    };
    prognosis.fault = fault.into();
    prognosis.leak_area_mm2 = estimate.leak_area_m2.map(mm2_from_m2);
    prognosis.leak_rate_mm2_per_cycle = estimate.leak_rate_m2.map(mm2_from_m2);
    prognosis.eol_cycle = estimate.eol_cycle;
    prognosis.rul_cycles = estimate.rul_cycles;
    let reached = estimate.eol_cycle.is_some_and(|eol| eol <= reading.cycle as f64);
    prognosis.status = if reached || over_limit.contains(&true) { Status::EolReached } else { Status::Degrading };
    prognosis
}
