//! `valve build-tables`: the valve file's tables into a directory.

use std::fs;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use anyhow::Context;
use leak_table::{Condition, ConditionRange, Fault, LeakPairTable, MANIFEST_FILE, Severity, TableBundle};
use lut_builder::Request;
use prognoser::FaultCall;
use quantity::Dimension;
use report::figures::TableFigure;
use valve_file::ValveFile;

use super::{tables, valve_input};
use crate::cli::{BuildTablesArgs, Format, QuantityRange};
use crate::failure::{Answer, Hinted};
use crate::output::{self, Align, Outputs, PlotFile, TextTable, next_step, told_in};

/// Builds, writes, says what was built.
pub fn run(args: &BuildTablesArgs) -> anyhow::Result<Answer> {
    let file = valve_input::read(&args.valve)?;
    let request = Request {
        wears: answers::tables::wears(&args.wear).context("--wear")?,
        conditions: conditions(args, &file)?,
        both_leaks: true,
    };
    let mut outputs = Outputs::new(args.force).reads([&args.valve]);
    let wears = request.wears.iter().map(|wear| &*wear.degradation.id);
    let ids: Vec<&str> = wears.chain([FaultCall::BothLeaks.name()]).collect();
    let dir = TableDir::prepare(&mut outputs, &args.out, args.force, &ids)?;
    let plot = PlotFile::create(&mut outputs, args.plot.as_deref())?;
    let start = Instant::now();
    let built = tables::build_and_tell(&file, &request).with_context(|| file.file_name().to_owned())?;
    let took = start.elapsed();
    dir.write(&built.bundle)?;
    match args.format {
        Format::Text => {
            let mut text = summary(&built.bundle).render();
            if let Some(range) = built.bundle.condition_range() {
                text = format!("{text}\n{}\n{}", over(&range), summary_over_conditions(&built.bundle));
            }
            if let Some(both) = built.bundle.both_leaks() {
                text = format!("{text}\n{}", over_both_leaks(both));
            }
            let severities = built.simulated;
            let log = timing_log(&args.valve);
            let next = next_step(
                &format!(
                    "read a timing log with them{}",
                    if log.exists() { "" } else { ", with its name for log.csv" }
                ),
                &["prognose", &log.display().to_string(), "--tables", &args.out.display().to_string()],
            );
            output::print_text(&format!("{text}\n{severities} severities simulated in {}\n{next}", seconds(took)))?;
        }
        Format::Json => output::print_json(&answers::tables::document(&built.bundle, Some(built.simulated)))?,
    }
    if let Some(plot) = plot {
        let figures = answers::tables::figures(&built.bundle);
        let title = format!("{}: {}", file.name(), answers::tables::title(&built.bundle).replacen('S', "s", 1));
        let is_area = figures.iter().all(|figure| figure.quantity == figures[0].quantity);
        let what = if is_area { "area" } else { "severity" };
        plot.write(&TableFigure::side_by_side(
            title,
            format!("dashed: limits, and the {what} at which life ends"),
            &figures,
        ))?;
    }
    Ok(Answer::Fine)
}

/// A timing log where one would lie: here, or beside the valve file.
fn timing_log(valve: &Path) -> PathBuf {
    let here = PathBuf::from("log.csv");
    let beside = valve.with_file_name("log.csv");
    if !here.exists() && beside.exists() { beside } else { here }
}

/// The conditions to build over; one that is not given stays as the valve file has it.
fn conditions(args: &BuildTablesArgs, file: &ValveFile) -> anyhow::Result<Option<ConditionRange>> {
    if args.supply_range.is_none() && args.temperature_range.is_none() {
        return Ok(None);
    }
    let parameters = file.valve().parameters();
    let absolute = |range: &QuantityRange| -> anyhow::Result<(f64, f64)> {
        let pa = |end: &quantity::Quantity| end.absolute_pa(parameters.ambient_pressure_pa).context("--supply-range");
        Ok((pa(&range.from)?, pa(&range.to)?))
    };
    let own_pa = parameters.supply_pressure_pa;
    let own_k = parameters.temperature_k;
    let range = ConditionRange {
        supply_pressure_pa: args.supply_range.as_ref().map_or(Ok((own_pa, own_pa)), absolute)?,
        temperature_k: args.temperature_range.as_ref().map_or((own_k, own_k), |range| (range.from.si(), range.to.si())),
    };
    range.check_ends()?;
    Ok(Some(range))
}

fn seconds(took: Duration) -> String {
    format!("{:.2} s", took.as_secs_f64())
}

/// The directory of the tables; one that was made for them goes again if they
/// cannot be built.
pub struct TableDir {
    path: PathBuf,
    made: bool,
}

impl TableDir {
    /// Makes the directory if need be and sees that the tables of these
    /// degradations may be written there.
    pub fn prepare(outputs: &mut Outputs, path: &Path, force: bool, ids: &[&str]) -> anyhow::Result<Self> {
        let names = || ids.iter().map(|id| format!("{id}.csv")).chain([MANIFEST_FILE.to_owned()]);
        let is_there = |name: &String| fs::symlink_metadata(path.join(name)).is_ok();
        if let Some(name) = names().find(is_there).filter(|_| !force) {
            return Err(Hinted::error(
                format!("{}: {name} exists already", path.display()),
                "choose another directory, or replace its tables with --force",
            ));
        }
        let made = !path.exists();
        fs::create_dir_all(path).with_context(|| format!("{}: cannot be made", path.display()))?;
        let dir = Self { path: path.to_owned(), made };
        for name in names() {
            let file = path.join(name);
            if file.is_symlink() {
                return Err(Hinted::error(
                    format!("{}: is a symbolic link; tables are replaced as a set of files", file.display()),
                    "choose another directory, or link the directory instead of its files",
                ));
            }
            outputs.claim(&file)?;
        }
        tempfile::tempfile_in(path).with_context(|| format!("{}: cannot be written", path.display()))?;
        Ok(dir)
    }

    /// Writes the tables, all as one.
    pub fn write(mut self, bundle: &TableBundle) -> anyhow::Result<()> {
        bundle.write(&self.path)?;
        self.made = false;
        Ok(())
    }
}

impl Drop for TableDir {
    fn drop(&mut self) {
        if self.made {
            // Only an empty directory is removed: nothing of others can be lost.
            let _ = fs::remove_dir(&self.path);
        }
    }
}

/// What was built: a row for each degradation.
pub fn summary(bundle: &TableBundle) -> TextTable {
    let leaks_only = leaks_only(bundle);
    let area = told_in(Dimension::Area);
    let (wear, largest, limit) = if leaks_only {
        ("fault", format!("largest leak ({})", area.name()), format!("life ends at ({})", area.name()))
    } else {
        ("wear", "largest".to_owned(), "life ends at".to_owned())
    };
    let mut table = TextTable::new(&[
        (wear, Align::Left),
        ("points", Align::Right),
        (&largest, Align::Right),
        (&limit, Align::Right),
        ("by the stroke", Align::Left),
        ("error to there (ms)", Align::Right),
        ("beyond (ms)", Align::Right),
    ]);
    for entry in bundle.entries() {
        let info = entry.info;
        let severity = &entry.degradation.severity;
        let number = |si: f64, decimals: usize| {
            if leaks_only {
                return area.number(si, decimals);
            }
            let number = format!("{:.decimals$}", severity.file_from_si(si));
            match shown_unit(severity).as_str() {
                "mm²" => format!("{} {}", area.number(si, decimals), area.name()),
                unit => format!("{number} {unit}").trim_end().to_owned(),
            }
        };
        table.row(vec![
            entry.degradation.name.to_string(),
            entry.table.points().len().to_string(),
            number(entry.table.range().1, 4),
            number(entry.limit_severity, 6),
            answers::tables::failing_stroke(&entry).map_or_else(String::new, |stroke| stroke.to_string()),
            milliseconds(info.interpolation_error.up_to_limit_s),
            milliseconds(info.interpolation_error.beyond_limit_s),
        ]);
    }
    table
}

/// How accurate the tables over conditions are.
fn summary_over_conditions(bundle: &TableBundle) -> String {
    let columns = [
        ("wear", Align::Left),
        ("pressures", Align::Right),
        ("temperatures", Align::Right),
        ("severities", Align::Right),
        ("error to the limit (ms)", Align::Right),
        ("beyond (ms)", Align::Right),
        ("measured at", Align::Right),
    ];
    let mut table = TextTable::new(&columns);
    for entry in bundle.entries() {
        let Some(over) = entry.over_conditions else { continue };
        let info = over.info();
        table.row(vec![
            entry.degradation.name.to_string(),
            over.pressures_pa().len().to_string(),
            over.temperatures_k().len().to_string(),
            over.shares().len().to_string(),
            milliseconds(info.interpolation_error.up_to_limit_s),
            milliseconds(info.interpolation_error.beyond_limit_s),
            format!("{} places", info.checked),
        ]);
    }
    table.render()
}

/// The conditions that tables cover, in words.
fn over(range: &ConditionRange) -> String {
    let (low, high) = range.supply_pressure_pa;
    let (cold, warm) = range.temperature_k;
    let (pa, kelvin) = (told_in(Dimension::Pressure), told_in(Dimension::Temperature));
    let absolute = if pa.name() == "kPa" { " absolute" } else { "" };
    let pressure = format!("supply pressure {} to {} {}{absolute}", pa.number(low, 1), pa.number(high, 1), pa.name());
    let temperature = format!("temperature {} to {} {}", kelvin.number(cold, 2), kelvin.number(warm, 2), kelvin.name());
    match (range.varies(Condition::SupplyPressure), range.varies(Condition::Temperature)) {
        (true, false) => format!("over {pressure}:"),
        (false, true) => format!("over {temperature}:"),
        _ => format!("over {pressure} and {temperature}:"),
    }
}

/// How accurate the table of both leaks at once is.
fn over_both_leaks(table: &LeakPairTable) -> String {
    let [atmosphere, supply] = Fault::ALL.map(|fault| table.areas_m2(fault).len());
    let info = table.info();
    format!(
        "leaks of both kinds at once: {atmosphere} by {supply} areas, error to the limits {} ms at worst, measured at {} places\n",
        milliseconds(info.interpolation_error.up_to_limit_s),
        info.checked
    )
}

fn leaks_only(bundle: &TableBundle) -> bool {
    bundle.len() == Fault::ALL.len()
}

fn shown_unit(severity: &Severity) -> String {
    severity.unit.replace("mm2", "mm²")
}

fn milliseconds(time_s: f64) -> String {
    format!("{:.3}", 1e3 * time_s)
}
