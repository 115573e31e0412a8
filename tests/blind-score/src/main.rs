//! Draws campaigns with hidden effects, has each explained, and prints how often the answer is right.

use std::fs;
use std::path::PathBuf;

use anyhow::{Context, Result, ensure};
use blind_benchmark::draw::{DrawSpec, draw};
use blind_score::{Scored, Summary, score};
use clap::Parser;
use serde_json::json;

/// Score the search for missing effects on campaigns drawn by an emulator that shares no code with it.
#[derive(Debug, Parser)]
#[command(name = "blind-score", version)]
struct Arguments {
    /// How many campaigns.
    #[arg(long, default_value_t = 60)]
    cases: usize,
    /// Seed of all random numbers.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Index of the first campaign.
    #[arg(long, default_value_t = 0)]
    first: usize,
    /// Weights of: nothing hidden, one effect, two effects, one outside the catalogue.
    #[arg(long, value_delimiter = ',', value_name = "N,N,N,N", default_values_t = DrawSpec::default().weights)]
    mix: Vec<f64>,
    /// Record pressures too; by default in half of the campaigns.
    #[arg(long)]
    pressures: Option<bool>,
    /// Repeat conditions with scatter from stroke to stroke; by default in half of the campaigns.
    #[arg(long)]
    repeats: Option<bool>,
    /// Let strokes scatter even where none is repeated.
    #[arg(long)]
    scatter: bool,
    /// Take stroke times only.
    #[arg(long)]
    timings: bool,
    /// Append one line of JSON a campaign to this file.
    #[arg(long, value_name = "FILE")]
    log: Option<PathBuf>,
}

fn main() -> Result<()> {
    let arguments = Arguments::parse();
    let weights = <[f64; 4]>::try_from(arguments.mix.as_slice());
    let weights = weights.ok().with_context(|| format!("--mix needs four weights; got {}", arguments.mix.len()))?;
    ensure!(
        weights.iter().all(|w| *w >= 0.0) && weights.iter().sum::<f64>() > 0.0,
        "--mix needs four weights, none below zero and one above; got {weights:?}"
    );
    let spec = DrawSpec {
        weights,
        pressures: arguments.pressures,
        repeats: arguments.repeats,
        always_scatters: arguments.scatter,
        timings_only: arguments.timings,
        ..DrawSpec::default()
    };
    let mut all = Vec::new();
    for index in arguments.first..arguments.first + arguments.cases {
        let drawn = draw(arguments.seed, index, &spec);
        let folder = tempfile::tempdir()?;
        let scored = score(&drawn, folder.path())?;
        println!("{}", line(&scored));
        if let Some(path) = &arguments.log {
            let mut text = fs::read_to_string(path).unwrap_or_default();
            text.push_str(&json(&scored).to_string());
            text.push('\n');
            fs::write(path, text).with_context(|| path.display().to_string())?;
        }
        all.push(scored);
    }
    println!("\n{}", Summary { all: &all });
    Ok(())
}

fn line(scored: &Scored) -> String {
    let truth = &scored.truth;
    format!(
        "{} {:44} {:8} {:.2} mm {:17} {:24} lack {:5.1} left out {:.3} {:5.1} s  {}",
        if scored.is_right() { "ok " } else { "BAD" },
        scored.name,
        match (truth.repeats, truth.scatter) {
            (true, _) => "repeats",
            (false, Some(_)) => "scatter",
            (false, None) => "",
        },
        truth.position_noise_m * 1e3,
        scored.verdict.id(),
        scored.groups.iter().map(|group| group.join("|")).collect::<Vec<_>>().join(" + "),
        scored.lack,
        scored.held_out.unwrap_or(f64::NAN),
        scored.seconds,
        scored.parameters,
    )
}

fn json(scored: &Scored) -> serde_json::Value {
    json!({
        "name": scored.name,
        "seed": scored.truth.seed,
        "index": scored.truth.index,
        "category": scored.truth.category.word(),
        "right": scored.is_right(),
        "verdict": scored.verdict.id(),
        "groups": scored.groups,
        "size_errors": scored.size_errors,
        "held_out_normalised_rms": scored.held_out,
        "lack": scored.lack,
        "seconds": scored.seconds,
    })
}
