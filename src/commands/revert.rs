//! `valve revert`: the valve file before its last step.

use serde_json::json;
use valve_file::ValveFile;

use crate::cli::{Format, RevertArgs};
use crate::failure::Answer;
use crate::output;

/// Writes the earlier valve file.
pub fn run(args: &RevertArgs) -> anyhow::Result<Answer> {
    let file = ValveFile::read(&args.valve)?;
    let undone = file.history().last().map(|entry| entry.action.clone());
    let earlier = file.reverted()?;
    earlier.write(&args.out, args.force)?;
    let (undone, out) = (undone.unwrap_or_default(), args.out.display().to_string());
    match args.format {
        Format::Text => output::print_text(&format!("undone: {undone}\nwritten: {out}\n"))?,
        Format::Json => output::print_json(&json!({ "undone": undone, "out": out }))?,
    }
    Ok(Answer::Fine)
}
