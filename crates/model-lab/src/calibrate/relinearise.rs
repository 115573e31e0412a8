//! Scatter between strokes beyond first order.
//!
//! A stroke that comes a few milliseconds late meets its stop a few milliseconds late: the corner of
//! its trace moves, which a direction that is taken at the mean stroke does not show. So each stroke is
//! simulated once with its own most likely scatter; what it leaves there, and the direction from there
//! back to no scatter, take the place of its residual. The scatter is then linear again.

use valve_model::{Run, Valve};

use crate::data::Dataset;
use crate::forward::{residuals, residuals_of};
use crate::scatter::{SOURCES, Scatter, Source};

/// The dataset with the scatter of single strokes made linear about what it most likely is. `data` are
/// the data as recorded, `straight` those of the last time (or the same). Stroke times stay as they are.
pub fn relinearised(data: &Dataset, straight: &Dataset, scatter: &Scatter, valve: &Valve) -> Dataset {
    let own = core::slice::from_ref(valve);
    let now = residuals(straight, own).remove(0);
    let plain = residuals(data, own).remove(0);
    let clean = scatter.without_scatter(&now);
    let strokes = scatter.strokes(&now);
    let mut result = straight.clone();
    let mut start = 0;
    for (index, (run, scattered)) in data.runs.iter().zip(likeliest(data, valve, &strokes, scatter)).enumerate() {
        let end = start + run.block_count();
        let Some((share, left)) = scattered else {
            start = end;
            continue;
        };
        let blocks = result.runs[index].channels.iter_mut().flat_map(|channel| &mut channel.blocks);
        let recorded = run.channels.iter().flat_map(|channel| &channel.blocks);
        for (offset, (block, recorded)) in blocks.zip(recorded).enumerate() {
            let at = start + offset;
            let linear = left[offset] + share * (now[at] - clean[at]) - plain[at];
            block.mean = recorded.mean + linear / recorded.inverse_sigma;
        }
        start = end;
    }
    result
}

/// Shares of what a stroke's scatter is to first order that are tried: where the corners of a stroke move,
/// first order can go too far.
const SHARES: [f64; 3] = [1.0, 0.5, 0.0];

/// For every run the most likely of these shares, and what it leaves of the stroke; nothing where none is a
/// possible valve.
fn likeliest(
    data: &Dataset,
    valve: &Valve,
    strokes: &[[f64; SOURCES.len()]],
    scatter: &Scatter,
) -> Vec<Option<(f64, Vec<f64>)>> {
    let mut tried = Vec::new();
    let mut simulated = Vec::new();
    for (index, (recorded, off)) in data.runs.iter().zip(strokes).enumerate() {
        for share in SHARES {
            if let Some((run, valve)) = stroke(&recorded.run, valve, &off.map(|amount| share * amount)) {
                tried.push((index, share));
                simulated.push((recorded, run, valve));
            }
        }
    }
    let mut likeliest: Vec<Option<(f64, f64, Vec<f64>)>> = vec![None; data.runs.len()];
    for ((index, share), left) in tried.into_iter().zip(residuals_of(&simulated, data.fidelity)) {
        let off = strokes[index].iter().zip(&SOURCES).zip(&scatter.variances);
        let needed = off.filter(|(_, variance)| **variance > 0.0);
        let needed: f64 =
            needed.map(|((amount, (_, size)), variance)| (share * amount / size).powi(2) / variance).sum();
        let cost = left.iter().map(|value| value * value).sum::<f64>() + needed;
        if likeliest[index].as_ref().is_none_or(|(least, ..)| cost < *least) {
            likeliest[index] = Some((cost, share, left));
        }
    }
    likeliest.into_iter().map(|one| one.map(|(_, share, left)| (share, left))).collect()
}

/// A run with the scatter of its stroke in its commands and supply, and the valve with the rest.
fn stroke(recorded: &Run, valve: &Valve, off: &[f64; SOURCES.len()]) -> Option<(Run, Valve)> {
    let mut run = recorded.clone();
    let mut parameters = valve.parameters().clone();
    for ((source, _), amount) in SOURCES.iter().zip(off) {
        match source {
            Source::CloseDelay | Source::OpenDelay => {
                let close = *source == Source::CloseDelay;
                for edge in run.commands.iter_mut().filter(|edge| edge.close == close) {
                    edge.time_s += amount;
                }
            }
            Source::Parameter(id) => parameters.set(*id, parameters.get(*id) * (1.0 + amount)),
            Source::Supply => run.conditions.supply_pressure_pa *= 1.0 + amount,
        }
    }
    let valve = Valve::new(parameters, valve.switches(), valve.effects().to_vec(), valve.custom().to_vec()).ok()?;
    Some((run, valve))
}
