//! Pictures of a comparison.

use std::ffi::OsStr;
use std::fmt::Write;
use std::path::Path;

use model_lab::compare::{Comparison, Direction, RunComparison};
use model_lab::data::{Channel, RunData};
use model_lab::residual_force::{Axis, Bin, ResidualForce, Signature};
use report::figures::{
    MissingFigure, MissingPoint, OverlayFigure, OverlayRun, SignatureFigure, StripRow, StripsFigure,
};
use valve_file::ValveFile;
use valve_model::Conditions;

use crate::CampaignInput;
use crate::comparison::Compared;

/// Points of a trace that a picture shows at most.
const POINTS: usize = 1500;

fn run_name(run: &RunComparison) -> String {
    format!("{}: {}", run.file, conditions_words(&run.conditions))
}

/// Conditions as a short label.
pub fn conditions_words(conditions: &Conditions) -> String {
    let mut words = format!("{:.0} kPa, {:.0} K", conditions.supply_pressure_pa / 1e3, conditions.temperature_k);
    for (area, name) in
        [(conditions.leak_to_atmosphere_m2, "leak to atmosphere"), (conditions.leak_from_supply_m2, "leak from supply")]
    {
        if area > 0.0 {
            // Writing to a string cannot fail.
            let _ = write!(words, ", {name} {:.3} mm²", area * 1e6);
        }
    }
    words
}

fn position(run: &RunData) -> &[f64] {
    let channel = run.channels.iter().find(|channel| channel.channel == Channel::Position);
    channel.map_or(&[], |channel| &channel.samples)
}

/// Measured and simulated strokes with their difference; `error` is how large it is, in words.
pub fn overlay(input: &CampaignInput, comparison: &Comparison, error: &str) -> OverlayFigure {
    let runs = input
        .data
        .runs
        .iter()
        .zip(&comparison.runs)
        .map(|(data, run)| {
            let step = data.times_s.len().div_ceil(POINTS).max(1);
            let thin = |values: &[f64], factor: f64| -> Vec<f64> {
                values.iter().step_by(step).map(|value| value * factor).collect()
            };
            OverlayRun {
                name: run_name(run),
                time_s: thin(&data.times_s, 1.0),
                measured_mm: thin(position(data), 1e3),
                simulated_mm: thin(&run.predicted.position_m, 1e3),
            }
        })
        .collect();
    OverlayFigure {
        title: format!("{} beside {}", input.file.name(), input.campaign.name),
        subtitle: format!("error: {error}"),
        runs,
        noise_mm: comparison.noise_m.map(|noise| noise * 1e3),
    }
}

/// The difference of all strokes, and that of another model below it.
pub fn strips(
    input: &CampaignInput,
    comparison: &Comparison,
    against: Option<&(&ValveFile, Compared)>,
) -> StripsFigure {
    let first = short_name(input.file.file_name());
    let mut stages = vec![(first.to_owned(), rows(input, comparison))];
    if let Some((file, other)) = against {
        let name = short_name(file.file_name());
        let name = if name == first { format!("the other {name}") } else { name.to_owned() };
        stages.push((name, rows(input, &other.comparison)));
    }
    StripsFigure {
        title: format!("what {} leaves of {}", input.file.name(), input.campaign.name),
        subtitle: "stripes that repeat from stroke to stroke are the model's".to_owned(),
        stages,
    }
}

fn rows(input: &CampaignInput, comparison: &Comparison) -> Vec<StripRow> {
    let mut rows: Vec<(Direction, f64, StripRow)> = Vec::new();
    for (data, run) in input.data.runs.iter().zip(&comparison.runs) {
        let samples = position(data);
        for stroke in &run.strokes {
            let window = stroke.window;
            let inside = (0..data.times_s.len())
                .filter(|index| data.times_s[*index] >= window.command_s && data.times_s[*index] < window.until_s);
            let (time_s, residual_mm) = inside
                .map(|index| {
                    let residual = (samples[index] - run.predicted.position_m[index]) * 1e3;
                    (data.times_s[index] - window.command_s, residual)
                })
                .unzip();
            let name = format!("{} {}", window.direction.name(), conditions_words(&run.conditions));
            rows.push((window.direction, run.conditions.supply_pressure_pa, StripRow { name, time_s, residual_mm }));
        }
    }
    rows.sort_by(|a, b| (a.0 as u8).cmp(&(b.0 as u8)).then(a.1.total_cmp(&b.1)));
    rows.into_iter().map(|(_, _, row)| row).collect()
}

/// The force that the model lacks against position, velocity, pressure and time.
pub fn missing_force(force: &ResidualForce) -> MissingFigure {
    let axes = [
        (Axis::Position, "position (mm)", 1e3),
        (Axis::Velocity, "velocity (mm/s)", 1e3),
        (Axis::ChamberPressure, "chamber pressure (kPa)", 1e-3),
        (Axis::SinceCommand, "time since the command (s)", 1.0),
    ];
    MissingFigure {
        title: "the force that the model lacks".to_owned(),
        subtitle: format!(
            "+ opens; pressure {}",
            if force.pressure_is_measured { "measured" } else { "simulated along the measured motion" }
        ),
        quantity: "missing force (N)".to_owned(),
        axes: axes
            .into_iter()
            .map(|(axis, label, factor)| {
                let points = |direction| force.profile(axis, direction).iter().map(|bin| point(bin, factor)).collect();
                (label.to_owned(), points(Direction::Closing), points(Direction::Opening))
            })
            .collect(),
    }
}

fn point(bin: &Bin, factor: f64) -> MissingPoint {
    MissingPoint { at: bin.at * factor, value: bin.force_n, standard_error: bin.standard_error_n }
}

/// Pressure against travel; `words` say what is read from it.
pub fn signature(name: &str, signature: &Signature, words: String) -> SignatureFigure {
    let scaled = |points: &[[f64; 2]]| points.iter().map(|[travel, gauge]| [travel * 1e3, gauge / 1e3]).collect();
    SignatureFigure {
        title: format!(
            "{name}: valve signature, pressure {}",
            if signature.is_measured { "measured" } else { "simulated along the measured motion" }
        ),
        subtitle: words,
        closing: scaled(&signature.closing),
        opening: scaled(&signature.opening),
        spring: scaled(&signature.spring),
    }
}

/// What a file is called where it stands, without the way to it.
fn short_name(path: &str) -> &str {
    Path::new(path).file_name().and_then(OsStr::to_str).unwrap_or(path)
}
