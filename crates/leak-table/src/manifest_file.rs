//! The manifest as JSON. Areas are in mm2 there, rounded like the tables'.

use std::ffi::OsStr;
use std::path::Path;

use serde::{Deserialize, Serialize};

use crate::csv_file::round_area_mm2;
use crate::error::TableError;
use crate::fault::Fault;
use crate::manifest::{CycleSchedule, FaultInfo, FileInfo, InterpolationError, Limits, Manifest, StrokeInfo};
use crate::{m2_from_mm2, mm2_from_m2};

/// Version of the manifest and of the tables' CSV.
pub const FORMAT_VERSION: u32 = 1;
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
    atmosphere: RawFault,
    supply: RawFault,
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

/// The manifest as text; `ranges_m2` are first and last area of each table.
pub(crate) fn to_json(manifest: &Manifest, ranges_m2: [(f64, f64); 2]) -> String {
    let fault = |fault: Fault| {
        let info = manifest.fault(fault);
        let file = manifest.file(fault);
        let (first, last) = ranges_m2[fault as usize];
        RawFault {
            file: file.name.clone(),
            blake3: file.blake3.clone(),
            bytes: file.bytes,
            rows: file.rows,
            first_area_mm2: round_area_mm2(mm2_from_m2(first)),
            last_area_mm2: round_area_mm2(mm2_from_m2(last)),
            limit_area_mm2: info.limit_area_m2().map(rounded_mm2),
            close: raw_stroke(&info.close),
            open: raw_stroke(&info.open),
            interpolation_error: RawError {
                up_to_limit_s: round_time_error(info.interpolation_error.up_to_limit_s),
                beyond_limit_s: round_time_error(info.interpolation_error.beyond_limit_s),
            },
        }
    };
    let raw = RawManifest {
        format_version: FORMAT_VERSION,
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
        atmosphere: fault(Fault::Atmosphere),
        supply: fault(Fault::Supply),
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
    if version.and_then(serde_json::Value::as_u64) != Some(u64::from(FORMAT_VERSION)) {
        return Err(TableError::Version {
            path: path.to_path_buf(),
            found: version.map_or_else(|| "(none)".to_owned(), ToString::to_string),
            expected: FORMAT_VERSION,
        });
    }
    let raw: RawManifest = serde_json::from_str(text).map_err(|e| broken(&e))?;
    for name in [&raw.atmosphere.file, &raw.supply.file] {
        if Path::new(name).file_name() != Some(OsStr::new(name)) {
            return Err(TableError::Manifest {
                path: path.to_path_buf(),
                line: line_of(text, name),
                message: format!("\"{name}\" is not the name of a file beside the manifest"),
            });
        }
    }
    Ok(Manifest {
        faults: [fault_info(&raw.atmosphere), fault_info(&raw.supply)],
        files: [file_info(raw.atmosphere), file_info(raw.supply)],
        valve: raw.valve,
        model_hash: raw.model_hash,
        schedule: CycleSchedule {
            close_at_s: raw.schedule.close_at_s,
            open_at_s: raw.schedule.open_at_s,
            end_s: raw.schedule.end_s,
        },
        limits: Limits { close_within_s: raw.limits.close_within_s, open_within_s: raw.limits.open_within_s },
    })
}

/// Line, from 1, of the first mention of a file's name.
fn line_of(text: &str, name: &str) -> usize {
    let quoted = serde_json::Value::from(name).to_string();
    text.lines().position(|line| line.contains(&quoted)).map_or(1, |i| i + 1)
}

fn raw_stroke(info: &StrokeInfo) -> RawStroke {
    RawStroke {
        limit_area_mm2: info.limit_area_m2.map(rounded_mm2),
        not_finished_from_mm2: info.stall_area_m2.map(rounded_mm2),
    }
}

fn rounded_mm2(area_m2: f64) -> f64 {
    round_area_mm2(mm2_from_m2(area_m2))
}

/// A tenth of a microsecond is finer than any use of a measured error.
fn round_time_error(error_s: f64) -> f64 {
    (error_s * 1e7).round() / 1e7
}

fn fault_info(raw: &RawFault) -> FaultInfo {
    let stroke = |raw: &RawStroke| StrokeInfo {
        limit_area_m2: raw.limit_area_mm2.map(m2_from_mm2),
        stall_area_m2: raw.not_finished_from_mm2.map(m2_from_mm2),
    };
    FaultInfo {
        close: stroke(&raw.close),
        open: stroke(&raw.open),
        interpolation_error: InterpolationError {
            up_to_limit_s: raw.interpolation_error.up_to_limit_s,
            beyond_limit_s: raw.interpolation_error.beyond_limit_s,
        },
    }
}

fn file_info(raw: RawFault) -> FileInfo {
    FileInfo { name: raw.file, blake3: raw.blake3, bytes: raw.bytes, rows: raw.rows }
}
