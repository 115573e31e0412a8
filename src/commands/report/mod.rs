//! `valve report`: one HTML page of what is known.

mod campaign;
mod log;
mod valve;

use std::sync::Arc;

use answers::CampaignInput;
use anyhow::Context;
use report::html::Page;
use serde::Serialize;
use valve_file::ValveFile;

use super::{campaign_input, tables};
use crate::cli::{Format, ReportArgs};
use crate::failure::Answer;
use crate::output::{self, Outputs};

/// What was written, for programs.
#[derive(Serialize)]
struct ReportDocument<'a> {
    sections: Vec<&'a str>,
    out: String,
}

/// Builds the page, section by section.
pub fn run(args: &ReportArgs) -> anyhow::Result<Answer> {
    let file = ValveFile::read(&args.valve)?;
    let campaign = args.campaign.as_deref().map(|path| campaign_input::read(&args.valve, path)).transpose()?;
    let read = campaign.as_ref().map(CampaignInput::files).unwrap_or_default();
    let mut outputs = Outputs::new(args.force).reads(read).reads([&args.valve]).reads(&args.log);
    let out = outputs.file(&args.out)?;
    let bundle = Arc::new(tables::build(&file).with_context(|| file.file_name().to_owned())?.bundle);
    let mut page = Page {
        title: file.name().to_owned(),
        subtitle: format!("from {}", output::short_name(file.file_name())),
        sections: Vec::new(),
        footer: format!("Made by valve {}. Times in s, pressures absolute.", env!("CARGO_PKG_VERSION")),
    };
    if let Some(path) = &args.log {
        page.sections.push(log::section(path, &args.columns, &bundle)?);
    }
    if let Some(input) = &campaign {
        page.sections.extend(campaign::sections(input)?);
    }
    page.sections.push(valve::strokes(&file));
    page.sections.push(valve::tables(&bundle));
    page.sections.push(valve::model(&file));
    out.write_whole(page.to_html().as_bytes())?;
    let out = args.out.display().to_string();
    match args.format {
        Format::Text => output::note(&format!("written: {out}")),
        Format::Json => {
            let sections = page.sections.iter().map(|section| section.title.as_str()).collect();
            output::print_document(&ReportDocument { sections, out })?;
        }
    }
    Ok(Answer::Fine)
}
