//! Simulated stroke times, and how they are told to programs.

use leak_table::mm2_from_m2;
use serde::Serialize;
use valve_file::ValveFile;
use valve_model::cycle::cycles;
use valve_model::{Conditions, Fidelity, Prepared, Run, Schedule, Start, Valve, simulate};

use crate::SCHEMA;

/// Closing and opening time of every cycle, s. Once cycles repeat, the later ones
/// are the same and are not simulated again.
pub fn times_s(file: &ValveFile, conditions: Conditions, wanted: usize, step_s: f64) -> Vec<[Option<f64>; 2]> {
    let simulated = cycles(&[(file.valve(), conditions)], &file.schedule(), wanted, step_s);
    let mut times: Vec<[Option<f64>; 2]> =
        simulated.into_iter().flatten().map(|cycle| [cycle.close_time_s, cycle.open_time_s]).collect();
    if let Some(last) = times.last().copied() {
        times.resize(wanted, last);
    }
    times
}

/// Where the piston of a sound valve rests at its closed and at its open stop under its own conditions, m from the closed one: stops
/// give way. Nothing where it cannot be simulated.
pub fn rests_m(valve: &Valve) -> Option<[f64; 2]> {
    let runs = [Start::ClosedRest, Start::Rest].map(|start| Run {
        conditions: Conditions::nominal(valve.parameters()),
        commands: Vec::new(),
        end_s: Fidelity::FINE.step_s,
        prescribed: None,
        start,
    });
    let prepared = runs.each_ref().map(|run| Prepared::new(valve, run, Fidelity::FINE));
    let mut rests_m = [None; 2];
    for (prepared, rest_m) in prepared.iter().zip(&mut rests_m) {
        simulate(&[prepared], false, |_, nodes, _| *rest_m = nodes.position_m.first().copied());
    }
    let [closed_m, open_m] = rests_m;
    Some([closed_m?, open_m?])
}

/// Stroke times for programs.
#[derive(Serialize)]
pub struct Document<'a> {
    schema: u32,
    valve: &'a str,
    conditions: ConditionsOut,
    schedule: ScheduleOut,
    cycles: Vec<CycleOut>,
}

#[derive(Serialize)]
struct ConditionsOut {
    supply_pressure_pa: f64,
    temperature_k: f64,
    leak_to_atmosphere_mm2: f64,
    leak_from_supply_mm2: f64,
}

#[derive(Serialize)]
#[expect(clippy::struct_field_names, reason = "a raw number carries its unit in its name")]
struct ScheduleOut {
    close_at_s: f64,
    open_at_s: f64,
    end_s: f64,
}

#[derive(Serialize)]
struct CycleOut {
    cycle: usize,
    close_time_s: Option<f64>,
    open_time_s: Option<f64>,
}

/// Stroke times of cycles under some conditions, for programs.
pub fn document<'a>(file: &'a ValveFile, conditions: &Conditions, times: &[[Option<f64>; 2]]) -> Document<'a> {
    let Schedule { close_at_s, open_at_s, end_s } = file.schedule();
    let cycle = |(cycle, [close_time_s, open_time_s]): (usize, &[Option<f64>; 2])| CycleOut {
        cycle,
        close_time_s: *close_time_s,
        open_time_s: *open_time_s,
    };
    Document {
        schema: SCHEMA,
        valve: file.name(),
        conditions: ConditionsOut {
            supply_pressure_pa: conditions.supply_pressure_pa,
            temperature_k: conditions.temperature_k,
            leak_to_atmosphere_mm2: mm2_from_m2(conditions.leak_to_atmosphere_m2),
            leak_from_supply_mm2: mm2_from_m2(conditions.leak_from_supply_m2),
        },
        schedule: ScheduleOut { close_at_s, open_at_s, end_s },
        cycles: times.iter().enumerate().map(cycle).collect(),
    }
}
