//! From valve files to tables and to the pictures of them.

use std::sync::Mutex;

use leak_table::{BundleEntry, Degradation, Fault, Severity, Stroke, TableBundle, TimeAt};
use lut_builder::{BuildError, Built, Options, Progress, Request, TableModel, build_request};
use report::figures::{Quantity, TableFigure, TablePoint};
use valve_file::ValveFile;

use crate::output::ProgressLine;

/// Points of a drawn curve.
const LINE_POINTS: u32 = 400;

/// The hash that tables of this valve file carry.
pub fn hash_of(file: &ValveFile) -> String {
    lut_builder::model_hash(&file.canonical_model(), &file.limits())
}

/// Builds the tables of both kinds of leak.
pub fn build(file: &ValveFile) -> Result<Built, BuildError> {
    build_what(file, &Request::default())
}

/// Builds what is asked for.
pub fn build_what(file: &ValveFile, request: &Request) -> Result<Built, BuildError> {
    let text = file.canonical_model();
    let model = TableModel {
        name: file.name(),
        canonical_text: &text,
        valve: file.valve(),
        schedule: file.schedule(),
        limits: file.limits(),
    };
    let line = ProgressLine::new("building tables");
    let shares = Mutex::new(vec![0.0; request.wears.len()]);
    build_request(&model, request, &Options::default(), &|progress: Progress| {
        let Ok(mut shares) = shares.lock() else { return };
        shares[progress.place] = progress.share;
        line.show(shares.iter().sum::<f64>() / shares.len() as f64, progress.stage.name());
    })
}

/// The kind of leak in words.
pub fn fault_name(fault: Fault) -> &'static str {
    &fault.degradation().name
}

/// Which stroke ends the life first.
pub fn failing_stroke(entry: &BundleEntry<'_>) -> Option<Stroke> {
    let limit = Some(entry.limit_severity);
    Stroke::ALL.into_iter().find(|stroke| entry.info.stroke(*stroke).limit_severity == limit)
}

/// What the severity of a degradation is counted in.
pub fn quantity(degradation: &Degradation) -> Quantity {
    let Severity { quantity, unit, .. } = &degradation.severity;
    Quantity::new(quantity.clone(), unit.replace("mm2", "mm²"))
}

/// What all pictures of a bundle's tables stand over.
pub fn title(bundle: &TableBundle) -> &'static str {
    let only_leaks = bundle.entries().all(|entry| entry.degradation.severity == Fault::Supply.degradation().severity);
    if only_leaks { "Stroke times over the leak area" } else { "Stroke times over what wears" }
}

/// The pictures of all tables.
pub fn figures(bundle: &TableBundle) -> Vec<TableFigure> {
    bundle.entries().map(|entry| figure(bundle, &entry)).collect()
}

/// The picture of a table.
fn figure(bundle: &TableBundle, entry: &BundleEntry<'_>) -> TableFigure {
    let (limits, table, severity) = (bundle.manifest().limits, entry.table, &entry.degradation.severity);
    let limit = |stroke: Stroke| entry.info.stroke(stroke).limit_severity.map(|_| limits.within_s(stroke));
    let points = table.points().iter().map(|point| TablePoint {
        severity: severity.file_from_si(point.severity),
        close_time_s: point.close_time_s,
        open_time_s: point.open_time_s,
    });
    let (first, last) = table.range();
    let time = |stroke: Stroke, at: f64| match table.curve(stroke).time_at(at) {
        TimeAt::Within(time_s) => Some(time_s),
        _ => None,
    };
    let interpolated = (0..=LINE_POINTS).map(|index| {
        let at = first + (last - first) * f64::from(index) / f64::from(LINE_POINTS);
        TablePoint {
            severity: severity.file_from_si(at),
            close_time_s: time(Stroke::Close, at),
            open_time_s: time(Stroke::Open, at),
        }
    });
    TableFigure {
        interpolated: interpolated.collect(),
        fault: entry.degradation.name.to_string(),
        quantity: quantity(entry.degradation),
        points: points.collect(),
        close_limit_s: limit(Stroke::Close),
        open_limit_s: limit(Stroke::Open),
        severity_at_limit: entry.info.limit_severity().map(|limit| severity.file_from_si(limit)),
    }
}
