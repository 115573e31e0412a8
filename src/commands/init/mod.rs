//! `valve init`: a first valve file or campaign file.

mod campaign;
mod collector;
mod conditions;
mod dialogue;
mod facts;
mod orifice;
mod sheet;
mod typical;
mod valve;

use crate::cli::{InitArgs, InitWhat};
use crate::failure::Answer;

/// Writes what is asked for.
pub fn run(args: &InitArgs) -> anyhow::Result<Answer> {
    match &args.what {
        Some(InitWhat::Campaign(args)) => campaign::run(args),
        None => valve::run(&args.valve),
    }
}
