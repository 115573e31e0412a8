//! The tables of all degradations with their manifest, in memory and on disk.

use std::fs;
use std::io;
use std::path::Path;

use crate::atomic;
use crate::condition_table::ConditionTable;
use crate::conditions::{Condition, ConditionRange, Conditions};
use crate::csv_file;
use crate::degradation::Degradation;
use crate::error::TableError;
use crate::fault::Fault;
use crate::leak_pair::LeakPairTable;
use crate::manifest::{ConditionFile, CycleSchedule, FaultInfo, FileInfo, Limits, Manifest, ManifestEntry};
use crate::manifest_file::{self, MANIFEST_FILE};
use crate::stroke::Stroke;
use crate::table::SeverityTable;

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
    /// The conditions of the tables over the severity alone; not kept by a bundle of leaks alone.
    pub reference: Option<Conditions>,
}

/// What a builder made for one degradation.
#[derive(Clone, Debug, PartialEq)]
pub struct BundlePart {
    /// The stroke times over the severity.
    pub table: SeverityTable,
    /// What is known about them.
    pub info: FaultInfo,
    /// The same over the conditions of a cycle; all parts of a bundle have one over the same range, or none has.
    pub over_conditions: Option<ConditionTable>,
}

/// The tables of one valve, with their manifest: those of the two leaks first, then of whatever else wears.
#[derive(Clone, Debug, PartialEq)]
pub struct TableBundle {
    manifest: Manifest,
    tables: Vec<SeverityTable>,
    over_conditions: Vec<Option<ConditionTable>>,
    both_leaks: Option<LeakPairTable>,
}

/// All that a bundle has of one degradation.
#[derive(Clone, Copy, Debug)]
pub struct BundleEntry<'a> {
    /// What wears.
    pub degradation: &'a Degradation,
    /// The stroke times over the severity.
    pub table: &'a SeverityTable,
    /// What is known about them.
    pub info: &'a FaultInfo,
    /// The severity at which the valve's life ends: the smallest at which either stroke crosses its limit.
    pub limit_severity: f64,
    /// The stroke times over severity and conditions, if they were built.
    pub over_conditions: Option<&'a ConditionTable>,
}

impl TableBundle {
    /// Puts tables and what is known about them together, the leaks to atmosphere and from the supply first.
    ///
    /// Severities and times are rounded to nine decimals of their file's unit, so that a
    /// bundle is the same before writing and after reading.
    ///
    /// # Errors
    /// If a leak has no table or anything has two, or a degradation has no severity
    /// inside its table at which a limit is crossed.
    pub fn new(info: BundleInfo, parts: &[BundlePart]) -> Result<Self, TableError> {
        let mut entries = Vec::new();
        let mut tables = Vec::new();
        let mut over_conditions = Vec::new();
        for part in parts {
            let degradation = part.table.degradation().clone();
            let (table, file) = stored(&part.table)?;
            let conditions = part.over_conditions.as_ref().map(stored_over_conditions).transpose()?;
            let (conditions, file_over_conditions) = conditions.unzip();
            entries.push(ManifestEntry { degradation, info: part.info, file, over_conditions: file_over_conditions });
            tables.push(table);
            over_conditions.push(conditions);
        }
        let conditions = over_conditions.iter().flatten().next().map(ConditionTable::range);
        let manifest = Manifest {
            valve: info.valve,
            model_hash: info.model_hash,
            schedule: info.schedule,
            limits: info.limits,
            reference: info.reference,
            conditions,
            entries,
            both_leaks: None,
        };
        check_entries(&manifest)?;
        // The manifest rounds its severities as well.
        let text = manifest_file::to_json(&manifest, &ranges(&tables));
        let manifest = manifest_file::from_json(&text, Path::new(MANIFEST_FILE))?;
        Self { manifest, tables, over_conditions, both_leaks: None }.checked()
    }

    /// The same with a table of both leaks at once, rounded alike.
    ///
    /// # Errors
    /// If what is left of it after rounding is no grid.
    pub fn with_both_leaks(mut self, table: &LeakPairTable) -> Result<Self, TableError> {
        let name = "both-leaks.csv";
        let info = manifest_file::rounded_info(table.info());
        let text = csv_file::pair_to_csv(table);
        let table = csv_file::pair_from_csv(text.as_bytes(), name.as_ref(), self.leak_tables(), info)?;
        let file = file_info(name.to_owned(), &text, table.times_s().len());
        self.manifest.both_leaks = Some(ConditionFile { file, info });
        self.both_leaks = Some(table);
        Ok(self)
    }

    /// The table of both leaks at once, if there is one.
    pub fn both_leaks(&self) -> Option<&LeakPairTable> {
        self.both_leaks.as_ref()
    }

    /// The tables of the leaks to atmosphere and from the supply.
    #[inline]
    pub fn leak_tables(&self) -> [&SeverityTable; 2] {
        [&self.tables[0], &self.tables[1]]
    }

    /// The manifest.
    pub fn manifest(&self) -> &Manifest {
        &self.manifest
    }

    /// How many degradations have tables: at least the two leaks.
    #[expect(clippy::len_without_is_empty, reason = "a bundle is never empty")]
    pub fn len(&self) -> usize {
        self.tables.len()
    }

    /// All of one degradation, by its place from 0 to [`len`](Self::len). The leaks are at 0 and 1.
    pub fn entry(&self, index: usize) -> BundleEntry<'_> {
        let ManifestEntry { degradation, info, .. } = &self.manifest.entries[index];
        BundleEntry {
            degradation,
            table: &self.tables[index],
            info,
            limit_severity: info.limit_severity().expect("a bundle without a limit is refused when it is made"),
            over_conditions: self.over_conditions[index].as_ref(),
        }
    }

    /// All degradations in turn.
    pub fn entries(&self) -> impl ExactSizeIterator<Item = BundleEntry<'_>> {
        (0..self.len()).map(|index| self.entry(index))
    }

    /// The degradation with this id.
    pub fn get(&self, id: &str) -> Option<BundleEntry<'_>> {
        self.entries().find(|entry| entry.degradation.id == id)
    }

    /// The conditions that the tables cover beyond the reference; none if they were built for that alone.
    pub fn condition_range(&self) -> Option<ConditionRange> {
        self.manifest.conditions
    }

    /// The table of one leak.
    #[inline]
    pub fn table(&self, fault: Fault) -> &SeverityTable {
        &self.tables[fault as usize]
    }

    /// The leak area at which the valve's life ends, in m2: the smallest at
    /// which either stroke crosses its limit.
    pub fn limit_area_m2(&self, fault: Fault) -> f64 {
        self.entry(fault as usize).limit_severity
    }

    /// Writes the bundle into a directory, replacing an older one in it as one: whoever reads it finds the
    /// older tables or these, whatever interrupts the writing.
    pub fn write(&self, dir: &Path) -> Result<(), TableError> {
        let own = self.manifest.entries.iter().zip(&self.tables);
        let over_conditions = self.over_conditions.iter().flatten().map(csv_file::conditions_to_csv);
        let tables: Vec<String> = own
            .map(|(entry, table)| csv_file::to_csv(&entry.degradation, table.points()))
            .chain(over_conditions)
            .chain(self.both_leaks.as_ref().map(csv_file::pair_to_csv))
            .collect();
        let text = manifest_file::to_json(&self.manifest, &ranges(&self.tables));
        atomic::write_set(dir, &self.manifest, &tables, &text)
    }

    /// Reads a bundle from a directory and checks it against its manifest.
    ///
    /// While somebody replaces the bundle, it is the older one or the new one.
    pub fn read(dir: &Path) -> Result<Self, TableError> {
        let mut text = manifest_text(dir)?;
        loop {
            let read = Self::read_tables(dir, &text);
            let now = manifest_text(dir)?;
            if read.is_ok() || now == text {
                return read;
            }
            text = now;
        }
    }

    fn read_tables(dir: &Path, text: &str) -> Result<Self, TableError> {
        let manifest = manifest_file::from_json(text, &dir.join(MANIFEST_FILE))?;
        check_entries(&manifest)?;
        let mut tables = Vec::new();
        let mut over_conditions = Vec::new();
        for entry in &manifest.entries {
            tables.push(read_table(dir, entry)?);
            let conditions = entry.over_conditions.as_ref();
            over_conditions.push(conditions.map(|info| read_over_conditions(dir, entry, info)).transpose()?);
        }
        let both_leaks = match &manifest.both_leaks {
            Some(info) => {
                let bytes = atomic::read_file(dir, &info.file)?;
                let path = dir.join(&info.file.name);
                let table = csv_file::pair_from_csv(&bytes, &path, [&tables[0], &tables[1]], info.info)?;
                check_rows(dir, &info.file, table.times_s().len())?;
                Some(table)
            }
            None => None,
        };
        Self { manifest, tables, over_conditions, both_leaks }.checked()
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

    /// Limits inside the tables, and all tables that are over conditions over the same ones, the leaks' among them.
    fn checked(mut self) -> Result<Self, TableError> {
        let range = self.over_conditions.iter().flatten().next().map(ConditionTable::range);
        let stated = range.is_none_or(|range| self.manifest.conditions.is_some_and(|stated| same(&stated, &range)));
        for ((entry, table), conditions) in self.manifest.entries.iter().zip(&self.tables).zip(&self.over_conditions) {
            check_limits(entry, table)?;
            let own = conditions.as_ref().map(ConditionTable::range);
            let is_leak = Fault::ALL.iter().any(|fault| fault.degradation().id == entry.degradation.id);
            if !stated || (own != range && (is_leak || own.is_some())) {
                return Err(TableError::Degradation {
                    id: entry.degradation.id.to_string(),
                    found: "a table over other conditions than those of the manifest or of other tables".to_owned(),
                    expected: "tables of all degradations over the conditions that the manifest states",
                });
            }
        }
        self.manifest.conditions = range;
        Ok(self)
    }
}

/// Whether two ranges are one but for rounding in files.
fn same(a: &ConditionRange, b: &ConditionRange) -> bool {
    let near = |condition| {
        let ((a0, a1), (b0, b1)) = (a.get(condition), b.get(condition));
        (a0 - b0).abs() <= 1e-9 * b0 && (a1 - b1).abs() <= 1e-9 * b1
    };
    Condition::ALL.into_iter().all(near)
}

fn ranges(tables: &[SeverityTable]) -> Vec<(f64, f64)> {
    tables.iter().map(SeverityTable::range).collect()
}

fn file_info(name: String, text: &str, rows: usize) -> FileInfo {
    FileInfo { name, blake3: blake3::hash(text.as_bytes()).to_hex().to_string(), bytes: text.len() as u64, rows }
}

/// The table as a file holds it, and what the manifest says about that file.
fn stored(table: &SeverityTable) -> Result<(SeverityTable, FileInfo), TableError> {
    let degradation = table.degradation();
    let name = format!("{}.csv", degradation.id);
    let text = csv_file::to_csv(degradation, table.points());
    let table = csv_file::from_csv(text.as_bytes(), name.as_ref(), degradation)?;
    let file = file_info(name, &text, table.points().len());
    Ok((table, file))
}

/// The same of a table over conditions.
fn stored_over_conditions(table: &ConditionTable) -> Result<(ConditionTable, ConditionFile), TableError> {
    let degradation = table.degradation();
    let name = format!("{}-conditions.csv", degradation.id);
    let info = manifest_file::rounded_info(table.info());
    let reread = |text: &str| csv_file::conditions_from_csv(text.as_bytes(), name.as_ref(), degradation, info);
    // The first writing rounds the shares, which are those of the first node; the severities of the other nodes
    // follow from them.
    let text = csv_file::conditions_to_csv(&reread(&csv_file::conditions_to_csv(table))?);
    let table = reread(&text)?;
    let file = file_info(name, &text, table.node_count() * table.shares().len());
    Ok((table, ConditionFile { file, info }))
}

fn manifest_text(dir: &Path) -> Result<String, TableError> {
    let path = dir.join(MANIFEST_FILE);
    fs::read_to_string(&path).map_err(|source| {
        if source.kind() == io::ErrorKind::NotFound {
            TableError::ManifestMissing { dir: dir.to_path_buf() }
        } else {
            TableError::Io { path, source }
        }
    })
}

fn check_rows(dir: &Path, file: &FileInfo, found: usize) -> Result<(), TableError> {
    if found == file.rows {
        return Ok(());
    }
    Err(TableError::RowCount { path: dir.join(&file.name), found, expected: file.rows })
}

fn read_table(dir: &Path, entry: &ManifestEntry) -> Result<SeverityTable, TableError> {
    let bytes = atomic::read_file(dir, &entry.file)?;
    let table = csv_file::from_csv(&bytes, &dir.join(&entry.file.name), &entry.degradation)?;
    check_rows(dir, &entry.file, table.points().len())?;
    Ok(table)
}

fn read_over_conditions(dir: &Path, entry: &ManifestEntry, info: &ConditionFile) -> Result<ConditionTable, TableError> {
    let bytes = atomic::read_file(dir, &info.file)?;
    let path = dir.join(&info.file.name);
    let table = csv_file::conditions_from_csv(&bytes, &path, &entry.degradation, info.info)?;
    check_rows(dir, &info.file, table.node_count() * table.shares().len())?;
    Ok(table)
}

/// Both leaks first, everything once, descriptions that can be used.
fn check_entries(manifest: &Manifest) -> Result<(), TableError> {
    for fault in Fault::ALL {
        let found = manifest.entries.get(fault as usize);
        if found.is_none_or(|entry| entry.degradation != *fault.degradation()) {
            return Err(TableError::LeakMissing { id: fault.name().to_owned() });
        }
    }
    for (index, ManifestEntry { degradation, .. }) in manifest.entries.iter().enumerate() {
        if manifest.entries[..index].iter().any(|other| other.degradation.id == degradation.id) {
            return Err(TableError::Twice { id: degradation.id.to_string() });
        }
        degradation.check()?;
    }
    Ok(())
}

fn check_limits(entry: &ManifestEntry, table: &SeverityTable) -> Result<(), TableError> {
    let degradation = &entry.degradation;
    let (_, last) = table.range();
    for stroke in Stroke::ALL {
        if let Some(found) = entry.info.stroke(stroke).limit_severity
            && !(found > 0.0 && found <= last)
        {
            return Err(TableError::Limit {
                id: degradation.id.to_string(),
                stroke,
                found: degradation.severity.text(found),
                last: degradation.severity.text(last),
            });
        }
    }
    if entry.info.limit_severity().is_none() {
        let (id, quantity) = (degradation.id.to_string(), degradation.severity.quantity.to_string());
        return Err(TableError::LimitOutside { id, quantity });
    }
    Ok(())
}
