//! `valve revert`: the valve file before its last step.

use valve_file::ValveFile;

use crate::cli::RevertArgs;
use crate::failure::Answer;
use crate::output;

/// Writes the earlier valve file.
pub fn run(args: &RevertArgs) -> anyhow::Result<Answer> {
    let file = ValveFile::read(&args.valve)?;
    let undone = file.history().last().map(|entry| entry.action.clone());
    let earlier = file.reverted()?;
    earlier.write(&args.out, args.force)?;
    let undone = undone.unwrap_or_default();
    output::print_text(&format!("undone: {undone}\nwritten: {}\n", args.out.display()))?;
    Ok(Answer::Fine)
}
