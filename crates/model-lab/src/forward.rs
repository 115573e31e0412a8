//! What the model predicts of a record, and of stroke times.

use rayon::prelude::*;
use valve_model::cycle::{CycleTimes, cycles};
use valve_model::simulate::ABREAST;
use valve_model::{Fidelity, Trajectory, Valve};

use crate::data::{Channel, Dataset};

/// What a recorder would have written down of a simulated run, at its sample times.
pub use valve_model::measurement::Record as Predicted;

/// A channel of a record.
pub fn channel_of(record: &Predicted, channel: Channel) -> &[f64] {
    match channel {
        Channel::Position => &record.position_m,
        Channel::ChamberPressure => &record.chamber_pressure_pa,
        Channel::PipePressure => &record.pipe_pressure_pa,
    }
}

/// The record of a simulated run as the sensors of the valve would give it.
pub fn record(valve: &Valve, nodes: &Trajectory, times_s: &[f64], into: &mut Predicted) {
    valve.measurement().record(nodes, times_s, into);
}

/// One channel of such a record alone, at sample times of its own.
pub fn record_channel(valve: &Valve, nodes: &Trajectory, channel: Channel, times_s: &[f64], into: &mut Vec<f64>) {
    match channel {
        Channel::Position => valve.measurement().positions(nodes, times_s, into),
        Channel::ChamberPressure => nodes.pressures_at(&nodes.chamber_pressure_pa, times_s, into),
        Channel::PipePressure => nodes.pressures_at(&nodes.pipe_pressure_pa, times_s, into),
    }
}

/// The stroke times of every group of stroke times.
pub fn timing_predictions(data: &Dataset, valve: &Valve) -> Vec<CycleTimes> {
    let mut times = vec![CycleTimes::default(); data.timing_groups.len()];
    let offset_s = valve.measurement().offset_s;
    for wanted in [1, 2] {
        let groups: Vec<usize> = (0..times.len()).filter(|group| data.timing_groups[*group].cycles == wanted).collect();
        let predicted: Vec<Vec<CycleTimes>> = groups
            .par_chunks(ABREAST)
            .flat_map(|chunk| {
                let batch: Vec<_> = chunk.iter().map(|group| (valve, data.timing_groups[*group].conditions)).collect();
                cycles(&batch, &data.schedule, wanted, Fidelity::FINE)
            })
            .collect();
        for (group, cycle) in groups.into_iter().zip(predicted) {
            if let Some(last) = cycle.last() {
                let shifted = |time: Option<f64>| time.map(|time| time + offset_s);
                times[group] = CycleTimes {
                    close_time_s: shifted(last.close_time_s),
                    open_time_s: shifted(last.open_time_s),
                    ..*last
                };
            }
        }
    }
    times
}
