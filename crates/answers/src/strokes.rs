//! Cycles simulated as one run, with what happened on the way.

use model_lab::forward::Predicted;
use valve_model::stroke::strokes;
use valve_model::{CommandEdge, Conditions, Schedule, Start, Valve};
use valve_model::{Prepared, Run, Trajectory, simulate};

/// Cycles one after the other and their path.
#[derive(Debug)]
pub struct Cycles {
    /// All commands, two a cycle.
    pub commands: Vec<CommandEdge>,
    /// Closing and opening time of each cycle, s.
    pub times_s: Vec<[Option<f64>; 2]>,
    /// State after every step.
    pub nodes: Trajectory,
}

impl Cycles {
    /// Simulates cycles from rest, each from where the one before ended.
    pub fn simulate(valve: &Valve, conditions: Conditions, schedule: &Schedule, cycles: u32, step_s: f64) -> Self {
        let commands: Vec<CommandEdge> = (0..cycles)
            .flat_map(|cycle| {
                let start_s = f64::from(cycle) * schedule.end_s;
                [
                    CommandEdge::new(start_s + schedule.close_at_s, true),
                    CommandEdge::new(start_s + schedule.open_at_s, false),
                ]
            })
            .collect();
        let end_s = f64::from(cycles) * schedule.end_s;
        let run = Run { conditions, commands: commands.clone(), end_s, prescribed: None, start: Start::Rest };
        let mut path = Trajectory::default();
        simulate(&[Prepared::new(valve, &run, step_s)], true, |_, nodes, _| path = nodes.clone());
        // An opening counts until its cycle ends, a closing until the command to open.
        let times_s = strokes(valve, &commands, &path)
            .chunks(2)
            .enumerate()
            .map(|(cycle, pair)| {
                let end_s = (cycle as f64 + 1.0) * schedule.end_s;
                let within = |time: &f64| pair[1].command.time_s + time < end_s;
                [pair[0].time_s, pair[1].time_s.filter(within)]
            })
            .collect();
        Self { commands, times_s, nodes: path }
    }

    /// What the sensors of the valve would record at some instants, s: its measurement
    /// effects, such as a slow sensor, are in it.
    pub fn record(&self, valve: &Valve, times_s: &[f64]) -> Predicted {
        let mut record = Predicted::default();
        model_lab::forward::record(valve, &self.nodes, times_s, &mut record);
        record
    }

    /// Whether the last command before an instant was to close.
    pub fn is_closing_at(&self, time_s: f64) -> bool {
        let given = self.commands.partition_point(|edge| edge.time_s <= time_s);
        given > 0 && self.commands[given - 1].closes()
    }
}

/// Instants at equal distances from 0 to `end_s`, s.
pub fn instants(end_s: f64, spacing_s: f64) -> Vec<f64> {
    // The number of samples of a record; far below what a usize holds.
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a count of samples")]
    let last = (end_s / spacing_s + 1e-6).floor() as usize;
    (0..=last).map(|index| index as f64 * spacing_s).collect()
}
