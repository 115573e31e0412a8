//! `valve report`: one HTML page of what is known.

mod campaign;
mod log;
mod valve;

use std::sync::Arc;

use answers::{CampaignInput, SCHEMA};
use anyhow::Context;
use lut_builder::Request;
use report::html::{Page, Point, Section};
use serde::Serialize;
use valve_file::ValveFile;

use super::{campaign_input, tables};
use crate::cli::{Format, ReportArgs};
use crate::failure::Answer;
use crate::output::{self, Outputs};

/// What was written, for programs.
#[derive(Serialize)]
struct ReportDocument<'a> {
    schema: u32,
    sections: Vec<&'a str>,
    out: String,
}

/// What a page gains from one of the things that it is about.
#[derive(Default)]
struct Part {
    /// For its top.
    short: Vec<Point>,
    sections: Vec<Section>,
    /// What its views show.
    data: Vec<(&'static str, String)>,
}

/// Builds the page, section by section.
pub fn run(args: &ReportArgs) -> anyhow::Result<Answer> {
    let file = ValveFile::read(&args.valve)?;
    let campaign = args.campaign.as_deref().map(|path| campaign_input::read(&args.valve, path)).transpose()?;
    let read = campaign.as_ref().map(CampaignInput::files).unwrap_or_default();
    let mut outputs = Outputs::new(args.force).reads(read).reads([&args.valve]).reads(&args.log);
    let out = outputs.file(&args.out)?;
    let request = match &args.log {
        // As `valve prognose` would need them for that log.
        Some(log) => tables::for_log(&file, log, &args.columns)?,
        None => Request::default(),
    };
    let built = tables::build_and_tell(&file, &request).map(|built| Arc::new(built.bundle));
    let mut parts = Vec::new();
    // Only a log cannot be read without tables.
    let leaks = match (built, &args.log) {
        (Ok(bundle), log) => {
            if let Some(path) = log {
                parts.push(log::part(path, &args.columns, &bundle)?);
            }
            valve::tables(&bundle)
        }
        (Err(reason), None) => valve::no_tables(&reason),
        (Err(reason), Some(_)) => return Err(reason).with_context(|| file.file_name().to_owned()),
    };
    if let Some(input) = &campaign {
        parts.push(campaign::part(input, args)?);
    }
    let about = vec![valve::strokes(&file), leaks, valve::model(&file)];
    parts.push(Part { sections: about, ..Part::default() });
    let mut page = Page {
        title: file.name().to_owned(),
        subtitle: format!("from {}", output::short_name(file.file_name())),
        footer: format!("Made by valve {}. Times in s, pressures absolute.", env!("CARGO_PKG_VERSION")),
        style: lab::frozen::style(),
        script: lab::frozen::script(),
        ..Page::default()
    };
    for part in parts {
        page.short.extend(part.short);
        page.sections.extend(part.sections);
        page.data.extend(part.data);
    }
    out.write_whole(page.to_html().as_bytes())?;
    let out = args.out.display().to_string();
    match args.format {
        Format::Text => output::note(&format!("written: {out}")),
        Format::Json => {
            let sections = page.sections.iter().map(|section| section.title.as_str()).collect();
            output::print_document(&ReportDocument { schema: SCHEMA, sections, out })?;
        }
    }
    Ok(Answer::Fine)
}
