//! What every source of scatter changes in the records, to first order.

use rayon::prelude::*;
use valve_model::{CommandEdge, Valve};

use super::{SOURCES, Source};
use crate::data::Dataset;
use crate::forward::residuals;

/// Start and end of each unit in the residual vector: runs, then single rows of stroke times.
pub(super) fn layout(data: &Dataset) -> Vec<(usize, usize)> {
    let mut bounds = Vec::new();
    let mut start = 0;
    for run in &data.runs {
        bounds.push((start, start + run.block_count()));
        start += run.block_count();
    }
    for group in &data.timing_groups {
        for _ in &group.rows {
            bounds.push((start, start + 2));
            start += 2;
        }
    }
    bounds
}

/// Residual per unit of each source, over the whole residual vector; `base` are the residuals of the valve.
pub(super) fn directions(data: &Dataset, valve: &Valve, base: &[f64]) -> Vec<Vec<f64>> {
    SOURCES
        .par_iter()
        .map(|(source, size)| {
            let changed = match source {
                Source::CloseDelay | Source::OpenDelay => {
                    let close = *source == Source::CloseDelay;
                    let mut shifted = data.clone();
                    for run in &mut shifted.runs {
                        let edges: Vec<CommandEdge> =
                            run.run.commands.iter().map(|edge| later(edge, close, *size)).collect();
                        run.run.commands = edges;
                    }
                    let mut moved = residuals(&shifted, core::slice::from_ref(valve)).remove(0);
                    shift_timings(data, &mut moved, close, *size);
                    moved
                }
                Source::Parameter(id) => {
                    let mut parameters = valve.parameters().clone();
                    parameters.set(*id, parameters.get(*id) * (1.0 + size));
                    let changed =
                        Valve::new(parameters, valve.switches(), valve.effects().to_vec(), valve.custom().to_vec());
                    match changed {
                        Ok(changed) => residuals(data, &[changed]).remove(0),
                        Err(_) => base.to_vec(),
                    }
                }
                Source::Supply => {
                    let mut raised = data.clone();
                    for run in &mut raised.runs {
                        run.run.conditions.supply_pressure_pa *= 1.0 + size;
                    }
                    for group in &mut raised.timing_groups {
                        group.conditions.supply_pressure_pa *= 1.0 + size;
                    }
                    residuals(&raised, core::slice::from_ref(valve)).remove(0)
                }
            };
            changed.iter().zip(base).map(|(changed, base)| changed - base).collect()
        })
        .collect()
}

fn later(edge: &CommandEdge, close: bool, by_s: f64) -> CommandEdge {
    let time_s = if edge.close == close { edge.time_s + by_s } else { edge.time_s };
    CommandEdge { time_s, ..*edge }
}

/// A delay lengthens the stroke times of its direction by just that.
fn shift_timings(data: &Dataset, residual: &mut [f64], close: bool, by_s: f64) {
    let first = residual.len() - 2 * data.timing_rows.len();
    let offset = usize::from(!close);
    for pair in residual[first..].chunks_mut(2) {
        pair[offset] -= by_s / data.timing_noise_s;
    }
}
