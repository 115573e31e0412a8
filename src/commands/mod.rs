//! One file a verb: read, call the crates, print.

mod effects;
mod manual;
mod revert;
mod simulate;
mod strokes;

use crate::cli::Verb;
use crate::failure::Answer;

/// Does what the command line asks.
pub fn run(verb: &Verb) -> anyhow::Result<Answer> {
    match verb {
        Verb::Simulate(args) => simulate::run(args),
        Verb::Effects(args) => effects::run(args),
        Verb::Revert(args) => revert::run(args),
        Verb::Completions { shell } => manual::completions(*shell),
        Verb::Man { dir } => manual::pages(dir.as_deref()),
    }
}
