//! From valve files to tables and to the pictures of them.

use std::sync::Mutex;

use leak_table::{BundleEntry, Fault, Stroke, TableBundle, TimeAt, mm2_from_m2};
use lut_builder::{BuildError, Built, Options, Progress, Request, TableModel, build_request};
use report::figures::{TableFigure, TablePoint};
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
    let line = ProgressLine::new();
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

/// The picture of a table.
pub fn figure(bundle: &TableBundle, fault: Fault) -> TableFigure {
    let limits = bundle.manifest().limits;
    let info = bundle.manifest().fault(fault);
    let limit = |stroke: Stroke| info.stroke(stroke).limit_severity.map(|_| limits.within_s(stroke));
    let points = bundle.table(fault).points().iter().map(|point| TablePoint {
        leak_area_mm2: mm2_from_m2(point.severity),
        close_time_s: point.close_time_s,
        open_time_s: point.open_time_s,
    });
    let (first_m2, last_m2) = bundle.table(fault).range();
    let time = |stroke: Stroke, area_m2: f64| match bundle.table(fault).curve(stroke).time_at(area_m2) {
        TimeAt::Within(time_s) => Some(time_s),
        _ => None,
    };
    let interpolated = (0..=LINE_POINTS).map(|index| {
        let area_m2 = first_m2 + (last_m2 - first_m2) * f64::from(index) / f64::from(LINE_POINTS);
        TablePoint {
            leak_area_mm2: mm2_from_m2(area_m2),
            close_time_s: time(Stroke::Close, area_m2),
            open_time_s: time(Stroke::Open, area_m2),
        }
    });
    TableFigure {
        interpolated: interpolated.collect(),
        fault: fault_name(fault).to_owned(),
        points: points.collect(),
        close_limit_s: limit(Stroke::Close),
        open_limit_s: limit(Stroke::Open),
        area_at_limit_mm2: info.limit_severity().map(mm2_from_m2),
    }
}
