//! The tables of both faults with their manifest, in memory and on disk.

use std::fs;
use std::io;
use std::path::Path;

use crate::atomic;
use crate::csv_file;
use crate::error::TableError;
use crate::fault::{Fault, Stroke};
use crate::manifest::{CycleSchedule, FaultInfo, FileInfo, Limits, Manifest};
use crate::manifest_file::{self, MANIFEST_FILE};
use crate::table::LeakTable;

/// What a builder knows about its tables besides their rows.
#[derive(Clone, Debug, PartialEq)]
pub struct BundleInfo {
    /// The valve's name.
    pub valve: String,
    /// Hash of the model and of everything else that the rows depend on.
    pub model_hash: String,
    /// The cycle.
    pub schedule: CycleSchedule,
    /// The limits.
    pub limits: Limits,
    /// About the table of the leak to atmosphere.
    pub atmosphere: FaultInfo,
    /// About the table of the leak from the supply.
    pub supply: FaultInfo,
}

/// The tables of both faults of one valve, with their manifest.
#[derive(Clone, Debug, PartialEq)]
pub struct TableBundle {
    manifest: Manifest,
    tables: [LeakTable; 2],
}

impl TableBundle {
    /// Puts two tables and what is known about them together.
    ///
    /// Areas and times are rounded to nine decimals (of mm2 and s), so that a
    /// bundle is the same before writing and after reading.
    ///
    /// # Errors
    /// If a table is given for the wrong fault, or a fault has no leak area
    /// inside its table at which a limit is crossed.
    pub fn new(info: BundleInfo, atmosphere: &LeakTable, supply: &LeakTable) -> Result<Self, TableError> {
        let (atmosphere, atmosphere_file) = stored(Fault::Atmosphere, atmosphere)?;
        let (supply, supply_file) = stored(Fault::Supply, supply)?;
        let manifest = Manifest {
            valve: info.valve,
            model_hash: info.model_hash,
            schedule: info.schedule,
            limits: info.limits,
            faults: [info.atmosphere, info.supply],
            files: [atmosphere_file, supply_file],
        };
        // The manifest rounds its areas as well.
        let tables = [atmosphere, supply];
        let text = manifest_file::to_json(&manifest, ranges(&tables));
        let manifest = manifest_file::from_json(&text, Path::new(MANIFEST_FILE))?;
        check_limits(&manifest, &tables)?;
        Ok(Self { manifest, tables })
    }

    /// The manifest.
    pub fn manifest(&self) -> &Manifest {
        &self.manifest
    }

    /// The table of one fault.
    #[inline]
    pub fn table(&self, fault: Fault) -> &LeakTable {
        &self.tables[fault as usize]
    }

    /// The leak area at which the valve's life ends, in m2: the smallest at
    /// which either stroke crosses its limit.
    pub fn limit_area_m2(&self, fault: Fault) -> f64 {
        self.manifest.fault(fault).limit_area_m2().expect("a bundle without a limit area is refused when it is made")
    }

    /// Writes the bundle into a directory, replacing an older one in it. The
    /// manifest is put in place last, and nothing before all files are on
    /// disk under temporary names.
    pub fn write(&self, dir: &Path) -> Result<(), TableError> {
        let csv = |fault: Fault| csv_file::to_csv(self.table(fault).points());
        let (atmosphere, supply) = (csv(Fault::Atmosphere), csv(Fault::Supply));
        let manifest = manifest_file::to_json(&self.manifest, ranges(&self.tables));
        let name = |fault: Fault| self.manifest.file(fault).name.as_str();
        atomic::write_all(
            dir,
            &[
                (name(Fault::Atmosphere), atmosphere.as_bytes()),
                (name(Fault::Supply), supply.as_bytes()),
                (MANIFEST_FILE, manifest.as_bytes()),
            ],
        )
    }

    /// Reads a bundle from a directory and checks it against its manifest.
    pub fn read(dir: &Path) -> Result<Self, TableError> {
        let path = dir.join(MANIFEST_FILE);
        let text = fs::read_to_string(&path).map_err(|source| {
            if source.kind() == io::ErrorKind::NotFound {
                TableError::ManifestMissing { dir: dir.to_path_buf() }
            } else {
                TableError::Io { path: path.clone(), source }
            }
        })?;
        let manifest = manifest_file::from_json(&text, &path)?;
        let table = |fault| read_table(dir, manifest.file(fault), fault);
        let tables = [table(Fault::Atmosphere)?, table(Fault::Supply)?];
        check_limits(&manifest, &tables)?;
        Ok(Self { manifest, tables })
    }

    /// As [`read`](Self::read), and refuses tables that were built from a
    /// model with another hash.
    pub fn read_for_model(dir: &Path, model_hash: &str) -> Result<Self, TableError> {
        let bundle = Self::read(dir)?;
        if bundle.manifest.model_hash == model_hash {
            return Ok(bundle);
        }
        Err(TableError::Model {
            dir: dir.to_path_buf(),
            valve: bundle.manifest.valve,
            found: bundle.manifest.model_hash,
            expected: model_hash.to_owned(),
        })
    }
}

fn ranges(tables: &[LeakTable; 2]) -> [(f64, f64); 2] {
    [tables[0].range_m2(), tables[1].range_m2()]
}

/// The table as a file holds it, and what the manifest says about that file.
fn stored(expected: Fault, table: &LeakTable) -> Result<(LeakTable, FileInfo), TableError> {
    if table.fault() != expected {
        return Err(TableError::WrongFault { found: table.fault(), expected });
    }
    let name = format!("{expected}.csv");
    let rounded = csv_file::rounded(table.points());
    let text = csv_file::to_csv(&rounded);
    let table = LeakTable::new(expected, rounded).map_err(|source| TableError::Rows {
        path: name.clone().into(),
        line: source.row().map_or(1, |row| row + 2),
        source,
    })?;
    let file = FileInfo {
        name,
        blake3: blake3::hash(text.as_bytes()).to_hex().to_string(),
        bytes: text.len() as u64,
        rows: table.points().len(),
    };
    Ok((table, file))
}

fn read_table(dir: &Path, file: &FileInfo, fault: Fault) -> Result<LeakTable, TableError> {
    let path = dir.join(&file.name);
    let bytes = fs::read(&path).map_err(|source| TableError::Io { path: path.clone(), source })?;
    let length = bytes.len() as u64;
    if length < file.bytes {
        return Err(TableError::Truncated { path, found: length, expected: file.bytes });
    }
    let found = blake3::hash(&bytes).to_hex();
    if found.as_str() != file.blake3 {
        let (found, expected) = (found.to_string(), file.blake3.clone());
        return Err(TableError::Hash { path, found, expected });
    }
    let table = csv_file::from_csv(&bytes, &path, fault)?;
    let rows = table.points().len();
    if rows != file.rows {
        return Err(TableError::RowCount { path, found: rows, expected: file.rows });
    }
    Ok(table)
}

fn check_limits(manifest: &Manifest, tables: &[LeakTable; 2]) -> Result<(), TableError> {
    for fault in Fault::ALL {
        let info = manifest.fault(fault);
        let (_, last_m2) = tables[fault as usize].range_m2();
        for stroke in Stroke::ALL {
            if let Some(found_m2) = info.stroke(stroke).limit_area_m2
                && !(found_m2 > 0.0 && found_m2 <= last_m2)
            {
                return Err(TableError::LimitArea { fault, stroke, found_m2, last_m2 });
            }
        }
        if info.limit_area_m2().is_none() {
            return Err(TableError::LimitOutside { fault });
        }
    }
    Ok(())
}
