//! `valve build-tables`: the valve file's tables into a directory.

use std::fs;
use std::path::Path;
use std::time::{Duration, Instant};

use anyhow::Context;
use leak_table::{Fault, TableBundle, mm2_from_m2};
use report::figures::TableFigure;
use serde::Serialize;
use valve_file::ValveFile;

use super::tables;
use crate::cli::{BuildTablesArgs, Format};
use crate::failure::Answer;
use crate::output::{self, Align, PlotFile, TextTable};

/// Builds, writes, says what was built.
pub fn run(args: &BuildTablesArgs) -> anyhow::Result<Answer> {
    let file = ValveFile::read(&args.valve)?;
    let plot = PlotFile::create(args.plot.as_deref())?;
    let dir = TableDir::prepare(&args.out)?;
    let start = Instant::now();
    let built = tables::build(&file).with_context(|| file.file_name().to_owned())?;
    let took = start.elapsed();
    for notice in &built.notices {
        output::note(&format!("note: {notice}"));
    }
    dir.write(&built.bundle)?;
    match args.format {
        Format::Text => {
            let text = summary(&built.bundle);
            let areas = built.simulated;
            output::print_text(&format!("{text}\n{areas} leak areas simulated in {}\n", seconds(took)))?;
        }
        Format::Json => output::print_json(&document(&built.bundle, built.simulated))?,
    }
    if let Some(plot) = plot {
        let figures = Fault::ALL.map(|fault| tables::figure(&built.bundle, fault));
        let title = format!("{}: stroke times over the leak area", file.name());
        plot.write(&TableFigure::side_by_side(title, "dashed: limits, and the area at which life ends", &figures))?;
    }
    Ok(Answer::Fine)
}

fn seconds(took: Duration) -> String {
    format!("{:.2} s", took.as_secs_f64())
}

/// The directory of the tables; one that was made for them goes again if they
/// cannot be built.
struct TableDir<'a> {
    path: &'a Path,
    made: bool,
}

impl<'a> TableDir<'a> {
    fn prepare(path: &'a Path) -> anyhow::Result<Self> {
        let made = !path.exists();
        fs::create_dir_all(path).with_context(|| format!("{}: cannot be made", path.display()))?;
        Ok(Self { path, made })
    }

    fn write(mut self, bundle: &TableBundle) -> anyhow::Result<()> {
        bundle.write(self.path)?;
        self.made = false;
        Ok(())
    }
}

impl Drop for TableDir<'_> {
    fn drop(&mut self) {
        if self.made {
            // Only an empty directory is removed: nothing of others can be lost.
            let _ = fs::remove_dir(self.path);
        }
    }
}

/// What was built, in a table.
pub fn summary(bundle: &TableBundle) -> String {
    let left = [Align::Left, Align::Right, Align::Right, Align::Right, Align::Left, Align::Right, Align::Right];
    let columns: Vec<(&str, Align)> = SUMMARY_COLUMNS.into_iter().zip(left).collect();
    let mut table = TextTable::new(&columns);
    for row in summary_rows(bundle) {
        table.row(row);
    }
    table.render()
}

/// Heads of the columns of [`summary_rows`].
pub const SUMMARY_COLUMNS: [&str; 7] = [
    "fault",
    "points",
    "largest leak (mm²)",
    "life ends at (mm²)",
    "by the stroke",
    "error to there (ms)",
    "beyond (ms)",
];

/// A row for each fault.
pub fn summary_rows(bundle: &TableBundle) -> Vec<Vec<String>> {
    let row = |fault| {
        let info = bundle.manifest().fault(fault);
        vec![
            tables::fault_name(fault).to_owned(),
            bundle.table(fault).points().len().to_string(),
            format!("{:.4}", mm2_from_m2(bundle.table(fault).range().1)),
            format!("{:.6}", mm2_from_m2(bundle.limit_area_m2(fault))),
            tables::failing_stroke(bundle, fault).map_or_else(String::new, |stroke| stroke.to_string()),
            format!("{:.3}", 1e3 * info.interpolation_error.up_to_limit_s),
            format!("{:.3}", 1e3 * info.interpolation_error.beyond_limit_s),
        ]
    };
    Fault::ALL.map(row).into()
}

#[derive(Serialize)]
struct Document<'a> {
    valve: &'a str,
    model_hash: &'a str,
    simulated_areas: usize,
    faults: Vec<FaultOut>,
}

#[derive(Serialize)]
struct FaultOut {
    fault: &'static str,
    points: usize,
    largest_leak_area_mm2: f64,
    leak_area_at_limit_mm2: f64,
    failing_stroke: Option<String>,
    interpolation_error_up_to_limit_s: f64,
    interpolation_error_beyond_limit_s: f64,
}

fn document(bundle: &TableBundle, simulated_areas: usize) -> Document<'_> {
    let fault = |fault: Fault| {
        let error = bundle.manifest().fault(fault).interpolation_error;
        FaultOut {
            fault: match fault {
                Fault::Atmosphere => "atmosphere",
                Fault::Supply => "supply",
            },
            points: bundle.table(fault).points().len(),
            largest_leak_area_mm2: mm2_from_m2(bundle.table(fault).range().1),
            leak_area_at_limit_mm2: mm2_from_m2(bundle.limit_area_m2(fault)),
            failing_stroke: tables::failing_stroke(bundle, fault).map(|stroke| stroke.to_string()),
            interpolation_error_up_to_limit_s: error.up_to_limit_s,
            interpolation_error_beyond_limit_s: error.beyond_limit_s,
        }
    };
    let manifest = bundle.manifest();
    Document {
        valve: &manifest.valve,
        model_hash: &manifest.model_hash,
        simulated_areas,
        faults: Fault::ALL.map(fault).into(),
    }
}
