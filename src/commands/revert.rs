//! `valve revert`: the valve file before its last step.

use answers::SCHEMA;
use serde::Serialize;
use valve_file::ValveFile;

use crate::cli::{Format, RevertArgs};
use crate::failure::Answer;
use crate::output::{self, Outputs, free_name_beside, next_step};

/// What was done, for programs.
#[derive(Serialize)]
struct RevertDocument {
    schema: u32,
    undone: String,
    out: String,
}

/// Writes the earlier valve file.
pub fn run(args: &RevertArgs) -> anyhow::Result<Answer> {
    let file = ValveFile::read(&args.valve)?;
    let out = Outputs::new(args.force).reads([&args.valve]).file(&args.out)?;
    let undone = file.history().last().map(|entry| entry.action.clone());
    let earlier = file.reverted()?;
    out.write_whole(earlier.text().as_bytes())?;
    let (undone, out) = (undone.unwrap_or_default(), args.out.display().to_string());
    match args.format {
        Format::Text => {
            let tables = free_name_beside(&args.out, "tables");
            let next = next_step("build its tables", &["build-tables", &out, "--out", &tables]);
            output::print_text(&format!("undone: {undone}\nwritten: {out}\n{next}"))?;
        }
        Format::Json => output::print_document(&RevertDocument { schema: SCHEMA, undone, out })?,
    }
    Ok(Answer::Fine)
}
