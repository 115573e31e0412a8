//! `valve report`: one HTML page of what is known.

mod campaign;
mod log;
mod valve;

use std::io::Write;
use std::sync::Arc;

use anyhow::Context;
use report::html::Page;
use valve_file::ValveFile;

use super::tables;
use crate::cli::ReportArgs;
use crate::failure::Answer;
use crate::output::{self, StagedFile};

/// Builds the page, section by section.
pub fn run(args: &ReportArgs) -> anyhow::Result<Answer> {
    let file = ValveFile::read(&args.valve)?;
    let mut out = StagedFile::create(&args.out)?;
    let bundle = Arc::new(tables::build(&file).with_context(|| file.file_name().to_owned())?.bundle);
    let mut page = Page {
        title: file.name().to_owned(),
        subtitle: format!("from {}", file.file_name()),
        sections: Vec::new(),
        footer: format!("Made by valve {}. Times in s, pressures absolute.", env!("CARGO_PKG_VERSION")),
    };
    if let Some(path) = &args.log {
        page.sections.push(log::section(path, &bundle)?);
    }
    if let Some(path) = &args.campaign {
        page.sections.extend(campaign::sections(&args.valve, path)?);
    }
    page.sections.push(valve::strokes(&file));
    page.sections.push(valve::tables(&bundle));
    page.sections.push(valve::model(&file));
    out.write_all(page.to_html().as_bytes())?;
    out.commit()?;
    output::note(&format!("written: {}", args.out.display()));
    Ok(Answer::Fine)
}
