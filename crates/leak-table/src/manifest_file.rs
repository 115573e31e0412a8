//! The manifest as JSON. Severities are in the unit of their table there, rounded like the tables'.
//!
//! Version 1 has the two leaks and nothing else; it is still what bundles of leaks alone are written as. Version 2
//! adds `reference`, `conditions`, `wear` and the leaks' own `over_conditions`; version 3 `both_leaks`, and is
//! written where there is such a table.

use std::borrow::Cow;
use std::ffi::OsStr;
use std::path::Path;

use serde::{Deserialize, Serialize};

use crate::conditions::{ConditionRange, Conditions};
use crate::csv_file::rounded;
use crate::degradation::{Degradation, Moves, Severity};
use crate::error::TableError;
use crate::fault::Fault;
use crate::id::DegradationId;
use crate::manifest::{
    ConditionFile, ConditionInfo, CycleSchedule, FaultInfo, FileInfo, InterpolationError, Limits, Manifest,
    ManifestEntry, StrokeInfo,
};
use crate::stroke::Monotone;

/// The newest version of the manifest and of the tables' CSV.
pub const FORMAT_VERSION: u32 = 3;
/// The version without a table of both leaks at once.
const WITHOUT_BOTH: u32 = 2;
/// The version with the two leaks and nothing else.
const LEAKS_ONLY: u32 = 1;
/// Name of the manifest in a bundle's directory.
pub const MANIFEST_FILE: &str = "manifest.json";

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct RawManifest {
    format_version: u32,
    valve: String,
    model_hash: String,
    schedule: RawSchedule,
    limits: RawLimits,
    #[serde(skip_serializing_if = "Option::is_none")]
    reference: Option<RawReference>,
    #[serde(skip_serializing_if = "Option::is_none")]
    conditions: Option<RawConditions>,
    atmosphere: RawFault,
    supply: RawFault,
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    wear: Vec<RawWear>,
    #[serde(skip_serializing_if = "Option::is_none")]
    both_leaks: Option<RawOverConditions>,
}

/// The conditions of the tables over the severity alone.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct RawReference {
    supply_pressure_kpa: f64,
    temperature_k: f64,
}

/// The conditions that the tables over conditions cover, from and to.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct RawConditions {
    supply_pressure_kpa: [f64; 2],
    temperature_k: [f64; 2],
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
#[expect(clippy::struct_field_names, reason = "the unit is part of every key in the file")]
struct RawSchedule {
    close_at_s: f64,
    open_at_s: f64,
    end_s: f64,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct RawLimits {
    close_within_s: f64,
    open_within_s: f64,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct RawFault {
    file: String,
    blake3: String,
    bytes: u64,
    rows: usize,
    first_area_mm2: f64,
    last_area_mm2: f64,
    /// End of life: the smaller of the two limit areas.
    limit_area_mm2: Option<f64>,
    close: RawStroke,
    open: RawStroke,
    interpolation_error: RawError,
    #[serde(skip_serializing_if = "Option::is_none")]
    over_conditions: Option<RawOverConditions>,
}

/// A degradation that is no leak, described in full.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct RawWear {
    id: String,
    name: String,
    severity: RawSeverity,
    prior: f64,
    file: String,
    blake3: String,
    bytes: u64,
    rows: usize,
    first: f64,
    last: f64,
    limit: Option<f64>,
    close: RawWearStroke,
    open: RawWearStroke,
    interpolation_error: RawError,
    #[serde(skip_serializing_if = "Option::is_none")]
    over_conditions: Option<RawOverConditions>,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct RawSeverity {
    quantity: String,
    unit: String,
    column: String,
    per_si: f64,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct RawWearStroke {
    moves: Option<Monotone>,
    limit: Option<f64>,
    not_finished_from: Option<f64>,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct RawOverConditions {
    file: String,
    blake3: String,
    bytes: u64,
    rows: usize,
    interpolation_error: RawError,
    checked: usize,
    stall_share: Option<f64>,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct RawStroke {
    limit_area_mm2: Option<f64>,
    not_finished_from_mm2: Option<f64>,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct RawError {
    up_to_limit_s: f64,
    beyond_limit_s: f64,
}

/// One kPa in Pa.
const PA_PER_KPA: f64 = 1e3;

/// The manifest as text; `ranges` are first and last severity of each table.
pub(crate) fn to_json(manifest: &Manifest, ranges: &[(f64, f64)]) -> String {
    let mut entries = manifest.entries.iter().zip(ranges);
    let mut leak = || entries.next().map(|(entry, range)| raw_fault(entry, *range)).expect("a bundle has both leaks");
    let (atmosphere, supply) = (leak(), leak());
    let wear: Vec<RawWear> = entries.map(|(entry, range)| raw_wear(entry, *range)).collect();
    let conditions = manifest.conditions.map(|range| {
        let (low, high) = range.supply_pressure_pa;
        let (cold, warm) = range.temperature_k;
        RawConditions { supply_pressure_kpa: [low, high].map(kpa), temperature_k: [cold, warm] }
    });
    let leaks_only = wear.is_empty() && conditions.is_none() && manifest.both_leaks.is_none();
    let without_both = if leaks_only { LEAKS_ONLY } else { WITHOUT_BOTH };
    let reference = manifest
        .reference
        .filter(|_| !leaks_only)
        .map(|at| RawReference { supply_pressure_kpa: kpa(at.supply_pressure_pa), temperature_k: at.temperature_k });
    let raw = RawManifest {
        format_version: if manifest.both_leaks.is_some() { FORMAT_VERSION } else { without_both },
        valve: manifest.valve.clone(),
        model_hash: manifest.model_hash.clone(),
        schedule: RawSchedule {
            close_at_s: manifest.schedule.close_at_s,
            open_at_s: manifest.schedule.open_at_s,
            end_s: manifest.schedule.end_s,
        },
        limits: RawLimits {
            close_within_s: manifest.limits.close_within_s,
            open_within_s: manifest.limits.open_within_s,
        },
        reference,
        conditions,
        atmosphere,
        supply,
        wear,
        both_leaks: manifest.both_leaks.as_ref().map(raw_over_conditions),
    };
    let mut text =
        serde_json::to_string_pretty(&raw).expect("a manifest has string keys only, which is all that JSON asks for");
    text.push('\n');
    text
}

/// The manifest in a text read from `path`.
pub(crate) fn from_json(text: &str, path: &Path) -> Result<Manifest, TableError> {
    let broken = |error: &serde_json::Error| TableError::Manifest {
        path: path.to_path_buf(),
        line: error.line().max(1),
        message: error.to_string(),
    };
    // The version comes first: another version may have other keys.
    let value: serde_json::Value = serde_json::from_str(text).map_err(|e| broken(&e))?;
    let version = value.get("format_version");
    let known = u64::from(LEAKS_ONLY)..=u64::from(FORMAT_VERSION);
    if !version.and_then(serde_json::Value::as_u64).is_some_and(|version| known.contains(&version)) {
        return Err(TableError::Version {
            path: path.to_path_buf(),
            found: version.map_or_else(|| "(none)".to_owned(), ToString::to_string),
            expected: FORMAT_VERSION,
        });
    }
    let raw: RawManifest = serde_json::from_str(text).map_err(|e| broken(&e))?;
    let manifest = Manifest {
        valve: raw.valve,
        model_hash: raw.model_hash,
        schedule: CycleSchedule {
            close_at_s: raw.schedule.close_at_s,
            open_at_s: raw.schedule.open_at_s,
            end_s: raw.schedule.end_s,
        },
        limits: Limits { close_within_s: raw.limits.close_within_s, open_within_s: raw.limits.open_within_s },
        reference: raw.reference.map(|at| Conditions {
            supply_pressure_pa: at.supply_pressure_kpa * PA_PER_KPA,
            temperature_k: at.temperature_k,
        }),
        conditions: raw.conditions.map(|range| {
            let ([low, high], [cold, warm]) = (range.supply_pressure_kpa, range.temperature_k);
            ConditionRange { supply_pressure_pa: (low * PA_PER_KPA, high * PA_PER_KPA), temperature_k: (cold, warm) }
        }),
        entries: [(raw.atmosphere, Fault::Atmosphere), (raw.supply, Fault::Supply)]
            .into_iter()
            .map(|(raw, fault)| leak_entry(raw, fault.degradation()))
            .chain(raw.wear.into_iter().map(wear_entry))
            .collect(),
        both_leaks: raw.both_leaks.map(condition_file),
    };
    for file in files(&manifest) {
        if Path::new(&file.name).file_name() != Some(OsStr::new(&file.name)) {
            return Err(TableError::Manifest {
                path: path.to_path_buf(),
                line: line_of(text, &file.name),
                message: format!("\"{}\" is not the name of a file beside the manifest", file.name),
            });
        }
    }
    Ok(manifest)
}

/// Every file that a manifest tells of.
pub(crate) fn files(manifest: &Manifest) -> impl Iterator<Item = &FileInfo> {
    let over_conditions = manifest.entries.iter().filter_map(|entry| entry.over_conditions.as_ref());
    let further = over_conditions.chain(&manifest.both_leaks).map(|info| &info.file);
    manifest.entries.iter().map(|entry| &entry.file).chain(further)
}

/// Line, from 1, of the first mention of a file's name.
fn line_of(text: &str, name: &str) -> usize {
    let quoted = serde_json::Value::from(name).to_string();
    text.lines().position(|line| line.contains(&quoted)).map_or(1, |i| i + 1)
}

/// A pressure in kPa, rounded as the tables' are.
fn kpa(pressure_pa: f64) -> f64 {
    rounded(pressure_pa / PA_PER_KPA)
}

/// A measured error as the manifest has it: a tenth of a microsecond is finer than any use of it.
fn rounded_error(error: InterpolationError) -> InterpolationError {
    let round = |error_s: f64| (error_s * 1e7).round() / 1e7;
    InterpolationError { up_to_limit_s: round(error.up_to_limit_s), beyond_limit_s: round(error.beyond_limit_s) }
}

/// What is known about a table over conditions as the manifest has it.
pub(crate) fn rounded_info(info: &ConditionInfo) -> ConditionInfo {
    ConditionInfo {
        interpolation_error: rounded_error(info.interpolation_error),
        stall_share: info.stall_share.map(rounded),
        ..*info
    }
}

fn raw_error(error: InterpolationError) -> RawError {
    let InterpolationError { up_to_limit_s, beyond_limit_s } = rounded_error(error);
    RawError { up_to_limit_s, beyond_limit_s }
}

fn error_info(raw: &RawError) -> InterpolationError {
    InterpolationError { up_to_limit_s: raw.up_to_limit_s, beyond_limit_s: raw.beyond_limit_s }
}

/// A severity as the manifest has it.
fn in_file(entry: &ManifestEntry, severity: f64) -> f64 {
    rounded(entry.degradation.severity.file_from_si(severity))
}

fn raw_fault(entry: &ManifestEntry, (first, last): (f64, f64)) -> RawFault {
    let in_file = |severity: f64| in_file(entry, severity);
    let stroke = |info: &StrokeInfo| RawStroke {
        limit_area_mm2: info.limit_severity.map(in_file),
        not_finished_from_mm2: info.stall_severity.map(in_file),
    };
    RawFault {
        file: entry.file.name.clone(),
        blake3: entry.file.blake3.clone(),
        bytes: entry.file.bytes,
        rows: entry.file.rows,
        first_area_mm2: in_file(first),
        last_area_mm2: in_file(last),
        limit_area_mm2: entry.info.limit_severity().map(in_file),
        close: stroke(&entry.info.close),
        open: stroke(&entry.info.open),
        interpolation_error: raw_error(entry.info.interpolation_error),
        over_conditions: entry.over_conditions.as_ref().map(raw_over_conditions),
    }
}

fn raw_wear(entry: &ManifestEntry, (first, last): (f64, f64)) -> RawWear {
    let in_file = |severity: f64| in_file(entry, severity);
    let degradation = &entry.degradation;
    let stroke = |info: &StrokeInfo, moves: Option<Monotone>| RawWearStroke {
        moves,
        limit: info.limit_severity.map(in_file),
        not_finished_from: info.stall_severity.map(in_file),
    };
    RawWear {
        id: degradation.id.to_string(),
        name: degradation.name.to_string(),
        severity: RawSeverity {
            quantity: degradation.severity.quantity.to_string(),
            unit: degradation.severity.unit.to_string(),
            column: degradation.severity.column.to_string(),
            per_si: degradation.severity.per_si,
        },
        prior: degradation.prior,
        file: entry.file.name.clone(),
        blake3: entry.file.blake3.clone(),
        bytes: entry.file.bytes,
        rows: entry.file.rows,
        first: in_file(first),
        last: in_file(last),
        limit: entry.info.limit_severity().map(in_file),
        close: stroke(&entry.info.close, degradation.moves.close),
        open: stroke(&entry.info.open, degradation.moves.open),
        interpolation_error: raw_error(entry.info.interpolation_error),
        over_conditions: entry.over_conditions.as_ref().map(raw_over_conditions),
    }
}

fn raw_over_conditions(over: &ConditionFile) -> RawOverConditions {
    let ConditionFile { file, info } = over;
    RawOverConditions {
        file: file.name.clone(),
        blake3: file.blake3.clone(),
        bytes: file.bytes,
        rows: file.rows,
        interpolation_error: raw_error(info.interpolation_error),
        checked: info.checked,
        stall_share: info.stall_share.map(rounded),
    }
}

fn leak_entry(raw: RawFault, degradation: &Degradation) -> ManifestEntry {
    let si = |in_file: f64| degradation.severity.si_from_file(in_file);
    let stroke = |raw: &RawStroke| StrokeInfo {
        limit_severity: raw.limit_area_mm2.map(si),
        stall_severity: raw.not_finished_from_mm2.map(si),
    };
    ManifestEntry {
        info: FaultInfo {
            close: stroke(&raw.close),
            open: stroke(&raw.open),
            interpolation_error: error_info(&raw.interpolation_error),
        },
        degradation: degradation.clone(),
        file: FileInfo { name: raw.file, blake3: raw.blake3, bytes: raw.bytes, rows: raw.rows },
        over_conditions: raw.over_conditions.map(condition_file),
    }
}

fn wear_entry(raw: RawWear) -> ManifestEntry {
    let per_si = raw.severity.per_si;
    let stroke = |raw: &RawWearStroke| StrokeInfo {
        limit_severity: raw.limit.map(|in_file| in_file / per_si),
        stall_severity: raw.not_finished_from.map(|in_file| in_file / per_si),
    };
    ManifestEntry {
        info: FaultInfo {
            close: stroke(&raw.close),
            open: stroke(&raw.open),
            interpolation_error: error_info(&raw.interpolation_error),
        },
        degradation: Degradation {
            id: DegradationId::read(&raw.id),
            short: Degradation::from_id(&raw.id)
                .map_or_else(|| Cow::Owned(raw.name.clone()), |known| known.short.clone()),
            name: Cow::Owned(raw.name),
            severity: Severity {
                quantity: Cow::Owned(raw.severity.quantity),
                unit: Cow::Owned(raw.severity.unit),
                column: Cow::Owned(raw.severity.column),
                per_si,
            },
            moves: Moves { close: raw.close.moves, open: raw.open.moves },
            prior: raw.prior,
        },
        file: FileInfo { name: raw.file, blake3: raw.blake3, bytes: raw.bytes, rows: raw.rows },
        over_conditions: raw.over_conditions.map(condition_file),
    }
}

fn condition_file(raw: RawOverConditions) -> ConditionFile {
    ConditionFile {
        info: ConditionInfo {
            interpolation_error: error_info(&raw.interpolation_error),
            checked: raw.checked,
            stall_share: raw.stall_share,
        },
        file: FileInfo { name: raw.file, blake3: raw.blake3, bytes: raw.bytes, rows: raw.rows },
    }
}
