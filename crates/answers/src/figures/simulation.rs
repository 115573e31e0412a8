//! The picture of simulated cycles.

use report::figures::TraceFigure;
use valve_file::ValveFile;
use valve_model::Conditions;

use crate::strokes::Cycles;

/// Strokes, pressures and commands of a path.
pub fn trace(file: &ValveFile, conditions: &Conditions, path: &Cycles) -> TraceFigure {
    let nodes = &path.nodes;
    let mut events = Vec::new();
    let mut said = Vec::new();
    for (pair, edges) in path.times_s.iter().zip(path.commands.chunks(2)) {
        for (time, edge, done, verb) in [(pair[0], edges[0], "closed", "closes"), (pair[1], edges[1], "open", "opens")]
        {
            if let Some(time) = time {
                events.push((edge.time_s + time, format!("{done} after {time:.3} s")));
                said.push(format!("{verb} in {time:.4} s"));
            } else {
                said.push(format!("not {done} in time"));
            }
        }
    }
    said.truncate(2);
    if path.times_s.len() > 2 {
        // Texts of many cycles would lie over each other.
        events.clear();
    }
    let scaled = |values: &[f64], factor: f64| values.iter().map(|value| value * factor).collect();
    TraceFigure {
        title: format!(
            "{}: {} kPa supply, {:.0} K",
            file.name(),
            (conditions.supply_pressure_pa / 1e3).round(),
            conditions.temperature_k
        ),
        subtitle: said.join(", "),
        command_close: nodes.time_s.iter().map(|time| path.is_closing_at(*time)).collect(),
        position_mm: scaled(&nodes.position_m, 1e3),
        chamber_pressure_kpa: scaled(&nodes.chamber_pressure_pa, 1e-3),
        pipe_pressure_kpa: scaled(&nodes.pipe_pressure_pa, 1e-3),
        supply_pressure_kpa: Some(conditions.supply_pressure_pa / 1e3),
        stroke_mm: file.valve().parameters().stroke_m * 1e3,
        events,
        time_s: nodes.time_s.clone(),
    }
}
