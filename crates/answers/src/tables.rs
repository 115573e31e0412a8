//! From valve files to tables, and what is told of them: for programs, and in pictures.

use leak_table::{BundleEntry, Degradation, Fault, Severity, Stroke, TableBundle, TimeAt, mm2_from_m2};
use lut_builder::{BuildError, Built, Options, Progress, Request, TableModel, Wear, build_request};
use report::figures::{Quantity, TableFigure, TablePoint};
use serde::Serialize;
use valve_file::ValveFile;

use crate::SCHEMA;

/// Points of a drawn curve.
const LINE_POINTS: u32 = 400;

/// The hash that tables of this valve file carry.
pub fn hash_of(file: &ValveFile) -> String {
    lut_builder::model_hash(&file.canonical_model(), &file.limits())
}

/// A name that is no kind of wear.
#[derive(Debug, thiserror::Error)]
#[error("found {found:?}, expected all, leaks or some of {}", known.join(", "))]
pub struct UnknownWear {
    found: String,
    known: Vec<String>,
}

/// The kinds of wear of these names, the two leaks first and always among them. "all" names the whole catalogue, "leaks"
/// nothing more.
///
/// # Errors
/// If a name is none of these and of no kind of wear.
pub fn wears<S: AsRef<str>>(names: &[S]) -> Result<Vec<Wear>, UnknownWear> {
    let all = Wear::catalogue();
    for name in names.iter().map(AsRef::as_ref) {
        if !["all", "leaks"].contains(&name) && Degradation::from_id(name).is_none() {
            let known = all.iter().map(|wear| wear.degradation.id.to_string()).collect();
            return Err(UnknownWear { found: name.to_owned(), known });
        }
    }
    let is_leak = |wear: &Wear| Fault::ALL.into_iter().any(|fault| wear.degradation.id == fault.name());
    let is_named =
        |wear: &Wear| names.iter().map(AsRef::as_ref).any(|name| name == "all" || wear.degradation.id == *name);
    Ok(all.into_iter().filter(|wear| is_leak(wear) || is_named(wear)).collect())
}

/// Builds what is asked for; `progress` is told how far each kind of wear is.
pub fn build(file: &ValveFile, request: &Request, progress: &(dyn Fn(Progress) + Sync)) -> Result<Built, BuildError> {
    let text = file.canonical_model();
    let model = TableModel {
        name: file.name(),
        canonical_text: &text,
        valve: file.valve(),
        schedule: file.schedule(),
        limits: file.limits(),
    };
    build_request(&model, request, &Options::default(), progress)
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

/// What is told to programs of tables.
#[derive(Serialize)]
pub struct Document<'a> {
    schema: u32,
    valve: &'a str,
    model_hash: &'a str,
    #[serde(skip_serializing_if = "Option::is_none")]
    simulated_areas: Option<usize>,
    #[serde(skip_serializing_if = "Option::is_none")]
    conditions: Option<ConditionsOut>,
    faults: Vec<FaultOut>,
    #[serde(skip_serializing_if = "Option::is_none")]
    both_leaks: Option<BothLeaksOut>,
}

#[derive(Serialize)]
struct BothLeaksOut {
    leaks_to_atmosphere: usize,
    leaks_from_supply: usize,
    error_up_to_limit_s: f64,
    error_beyond_limit_s: f64,
    measured_at: usize,
}

#[derive(Serialize)]
struct ConditionsOut {
    supply_pressure_pa: (f64, f64),
    temperature_k: (f64, f64),
}

#[derive(Serialize)]
struct FaultOut {
    fault: String,
    points: usize,
    #[serde(flatten)]
    severities: SeveritiesOut,
    failing_stroke: Option<String>,
    interpolation_error_up_to_limit_s: f64,
    interpolation_error_beyond_limit_s: f64,
    #[serde(skip_serializing_if = "Option::is_none")]
    over_conditions: Option<OverConditionsOut>,
}

/// Leaks have names and units of their own; any other severity tells its unit.
#[derive(Serialize)]
#[serde(untagged)]
enum SeveritiesOut {
    Leak { largest_leak_area_mm2: f64, leak_area_at_limit_mm2: f64 },
    Other { severity: String, unit: String, largest_severity: f64, severity_at_limit: f64 },
}

#[derive(Serialize)]
struct OverConditionsOut {
    pressures: usize,
    temperatures: usize,
    severities: usize,
    error_up_to_limit_s: f64,
    error_beyond_limit_s: f64,
    measured_at: usize,
}

/// Tables for programs; `simulated_areas` is what building them took, none where they were read.
pub fn document(bundle: &TableBundle, simulated_areas: Option<usize>) -> Document<'_> {
    let manifest = bundle.manifest();
    Document {
        schema: SCHEMA,
        valve: &manifest.valve,
        model_hash: &manifest.model_hash,
        simulated_areas,
        conditions: bundle.condition_range().map(|range| ConditionsOut {
            supply_pressure_pa: range.supply_pressure_pa,
            temperature_k: range.temperature_k,
        }),
        faults: bundle.entries().enumerate().map(|(place, entry)| fault_out(place, &entry)).collect(),
        both_leaks: bundle.both_leaks().map(|both| BothLeaksOut {
            leaks_to_atmosphere: both.areas_m2(Fault::Atmosphere).len(),
            leaks_from_supply: both.areas_m2(Fault::Supply).len(),
            error_up_to_limit_s: both.info().interpolation_error.up_to_limit_s,
            error_beyond_limit_s: both.info().interpolation_error.beyond_limit_s,
            measured_at: both.info().checked,
        }),
    }
}

fn fault_out(place: usize, entry: &BundleEntry<'_>) -> FaultOut {
    let error = entry.info.interpolation_error;
    let severity = &entry.degradation.severity;
    let (largest, limit) = (entry.table.range().1, entry.limit_severity);
    let severities = if place < Fault::ALL.len() {
        SeveritiesOut::Leak { largest_leak_area_mm2: mm2_from_m2(largest), leak_area_at_limit_mm2: mm2_from_m2(limit) }
    } else {
        SeveritiesOut::Other {
            severity: severity.quantity.to_string(),
            unit: severity.unit.to_string(),
            largest_severity: severity.file_from_si(largest),
            severity_at_limit: severity.file_from_si(limit),
        }
    };
    FaultOut {
        fault: entry.degradation.id.to_string(),
        points: entry.table.points().len(),
        severities,
        failing_stroke: failing_stroke(entry).map(|stroke| stroke.to_string()),
        interpolation_error_up_to_limit_s: error.up_to_limit_s,
        interpolation_error_beyond_limit_s: error.beyond_limit_s,
        over_conditions: entry.over_conditions.map(|over| OverConditionsOut {
            pressures: over.pressures_pa().len(),
            temperatures: over.temperatures_k().len(),
            severities: over.shares().len(),
            error_up_to_limit_s: over.info().interpolation_error.up_to_limit_s,
            error_beyond_limit_s: over.info().interpolation_error.beyond_limit_s,
            measured_at: over.info().checked,
        }),
    }
}
