//! What a prognosis remembers between runs.
//!
//! Each valve's state, how far the log was read and how long the output then was change in one transaction: whenever the
//! program or the machine stops, they are those of one instant. Who goes on cuts the output back to that length and reads
//! on from that place, so that nothing is lost and nothing is told twice.

mod error;
mod taken;

use std::fs;
use std::path::{Path, PathBuf};

use prognoser::{LogPosition, ValveState};
use redb::{Builder, Database, ReadTransaction, ReadableDatabase, ReadableTable, Table, TableDefinition, TableError};
use serde::{Deserialize, Serialize};

pub use error::StoreError;
pub use taken::{Fingerprint, Taken};

/// The one file of a directory of states.
const FILE: &str = "state.redb";
/// What a state depends on, by name.
const TERMS: TableDefinition<&str, &str> = TableDefinition::new("terms");
/// The progress, under a single key.
const PROGRESS: TableDefinition<(), &[u8]> = TableDefinition::new("progress");
/// The state of each valve.
const VALVES: TableDefinition<&str, &[u8]> = TableDefinition::new("valves");
/// Fingerprints of the last messages that are in the states, in the order in which they came.
const TAKEN: TableDefinition<u64, &Fingerprint> = TableDefinition::new("taken");
/// What was made up once and stays, by name.
const NAMES: TableDefinition<&str, &str> = TableDefinition::new("names");
/// Memory for pages of the file, bytes: with four times as much a fleet takes no less time, and 25 MB more.
const CACHE: usize = 4 << 20;

/// Something that a state depends on: a state that was kept under others is of no use.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Term {
    /// What it is called in a refusal, such as "tables".
    pub name: &'static str,
    /// What it is.
    pub value: String,
}

/// How far a run has got.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Progress {
    /// The place in the log, once a row was read.
    pub position: Option<LogPosition>,
    /// Length of the output, in bytes.
    pub output_bytes: u64,
    /// Rows in the output.
    pub output_rows: u64,
}

/// States in a directory. One process at a time has them open.
#[derive(Debug)]
pub struct Store {
    file: PathBuf,
    database: Database,
}

impl Store {
    /// Opens what is kept in a directory, or begins it.
    ///
    /// # Errors
    /// If it was kept under other terms, another process has it open, or it cannot be read or written.
    pub fn open(folder: &Path, terms: &[Term]) -> Result<Self, StoreError> {
        let file = folder.join(FILE);
        fs::create_dir_all(folder).map_err(|error| StoreError::folder(folder, error))?;
        let database =
            Builder::new().set_cache_size(CACHE).create(&file).map_err(|error| StoreError::open(&file, error))?;
        let store = Self { file, database };
        store.check(terms)?;
        Ok(store)
    }

    fn check(&self, terms: &[Term]) -> Result<(), StoreError> {
        let kept = self.terms()?;
        if kept.is_empty() {
            return self.write(|transaction| {
                let mut table = transaction.open_table(TERMS)?;
                for term in terms {
                    table.insert(term.name, term.value.as_str())?;
                }
                Ok(())
            });
        }
        for term in terms {
            let found = kept.iter().find(|(name, _)| name == term.name).map(|(_, value)| value.as_str());
            if found != Some(&term.value) {
                return Err(StoreError::OtherTerm {
                    file: self.file.clone(),
                    name: term.name,
                    found: found.unwrap_or("nothing").to_owned(),
                    expected: term.value.clone(),
                });
            }
        }
        Ok(())
    }

    fn terms(&self) -> Result<Vec<(String, String)>, StoreError> {
        self.read(|transaction| {
            let table = match transaction.open_table(TERMS) {
                Err(TableError::TableDoesNotExist(_)) => return Ok(Vec::new()),
                table => table?,
            };
            let mut all = Vec::new();
            for entry in table.iter()? {
                let (name, value) = entry?;
                all.push((name.value().to_owned(), value.value().to_owned()));
            }
            Ok(all)
        })
    }

    /// How far the last run got; none before the first [`commit`](Self::commit).
    pub fn progress(&self) -> Result<Option<Progress>, StoreError> {
        let bytes = self.read(|transaction| match transaction.open_table(PROGRESS) {
            Err(TableError::TableDoesNotExist(_)) => Ok(None),
            table => Ok(table?.get(())?.map(|bytes| bytes.value().to_vec())),
        })?;
        bytes.map(|bytes| self.decoded("progress", &bytes)).transpose()
    }

    /// A text that is kept under a name, made where there is none yet.
    pub fn name(&self, what: &str, make: impl FnOnce() -> String) -> Result<String, StoreError> {
        let kept = self.read(|transaction| match transaction.open_table(NAMES) {
            Err(TableError::TableDoesNotExist(_)) => Ok(None),
            table => Ok(table?.get(what)?.map(|text| text.value().to_owned())),
        })?;
        if let Some(kept) = kept {
            return Ok(kept);
        }
        let made = make();
        self.write(|transaction| {
            transaction.open_table(NAMES)?.insert(what, made.as_str())?;
            Ok(())
        })?;
        Ok(made)
    }

    /// The last messages that are in the states.
    pub fn taken(&self) -> Result<Taken, StoreError> {
        self.read(|transaction| {
            let mut taken = Taken::default();
            let table = match transaction.open_table(TAKEN) {
                Err(TableError::TableDoesNotExist(_)) => return Ok(taken),
                table => table?,
            };
            for entry in table.iter()? {
                taken.add(*entry?.1.value());
            }
            Ok(taken)
        })
    }

    /// The states as they were committed last, to look valves up in.
    pub fn reader(&self) -> Result<Reader<'_>, StoreError> {
        let transaction = self.database.begin_read().map_err(|error| self.failed(error))?;
        Ok(Reader { store: self, transaction })
    }

    /// Keeps states, progress and the messages that they now hold, all or none of them. When it returns they are on the
    /// disk.
    pub fn commit<'a>(
        &self,
        progress: &Progress,
        taken: &[Fingerprint],
        states: impl Iterator<Item = (&'a str, ValveState)>,
    ) -> Result<(), StoreError> {
        let mut bytes = Vec::new();
        self.write(|transaction| {
            let mut valves = transaction.open_table(VALVES)?;
            for (name, state) in states {
                bytes = postcard::to_extend(&state, std::mem::take(&mut bytes)).map_err(redb_error)?;
                valves.insert(name, &bytes[..])?;
                bytes.clear();
            }
            bytes = postcard::to_extend(progress, std::mem::take(&mut bytes)).map_err(redb_error)?;
            transaction.open_table(PROGRESS)?.insert((), &bytes[..])?;
            if !taken.is_empty() {
                add(&mut transaction.open_table(TAKEN)?, taken)?;
            }
            Ok(())
        })
    }

    fn read<T>(&self, look: impl FnOnce(&ReadTransaction) -> Result<T, redb::Error>) -> Result<T, StoreError> {
        let transaction = self.database.begin_read().map_err(|error| self.failed(error))?;
        look(&transaction).map_err(|error| self.failed(error))
    }

    fn write(&self, change: impl FnOnce(&redb::WriteTransaction) -> Result<(), redb::Error>) -> Result<(), StoreError> {
        let transaction = self.database.begin_write().map_err(|error| self.failed(error))?;
        change(&transaction).map_err(|error| self.failed(error))?;
        transaction.commit().map_err(|error| self.failed(error))
    }

    fn decoded<T: for<'a> Deserialize<'a>>(&self, what: &str, bytes: &[u8]) -> Result<T, StoreError> {
        postcard::from_bytes(bytes).map_err(|error| StoreError::NotUnderstood {
            file: self.file.clone(),
            what: what.to_owned(),
            error,
        })
    }

    fn failed(&self, error: impl Into<redb::Error>) -> StoreError {
        StoreError::Database { file: self.file.clone(), error: Box::new(error.into()) }
    }
}

/// Adds fingerprints behind those that are there, and lets go of the oldest.
fn add(table: &mut Table<'_, u64, &Fingerprint>, taken: &[Fingerprint]) -> Result<(), redb::Error> {
    let mut next = table.last()?.map_or(0, |(place, _)| place.value() + 1);
    for fingerprint in taken {
        table.insert(next, fingerprint)?;
        next += 1;
    }
    table.retain_in(..next.saturating_sub(taken::MOST as u64), |_, _| false)?;
    Ok(())
}

fn redb_error(error: postcard::Error) -> redb::Error {
    redb::Error::Io(std::io::Error::other(error))
}

/// States as they were at one instant.
pub struct Reader<'a> {
    store: &'a Store,
    transaction: ReadTransaction,
}

impl Reader<'_> {
    /// What is kept of a valve; none if it was not seen.
    pub fn valve(&self, name: &str) -> Result<Option<ValveState>, StoreError> {
        let bytes = match self.transaction.open_table(VALVES) {
            Err(TableError::TableDoesNotExist(_)) => None,
            Err(error) => return Err(self.store.failed(error)),
            Ok(table) => table
                .get(name)
                .map_err(|error| self.store.failed(error))?
                .map(|bytes| self.store.decoded(name, bytes.value()))
                .transpose()?,
        };
        Ok(bytes)
    }

    /// Calls with each valve, by name.
    pub fn each(&self, mut call: impl FnMut(&str, ValveState)) -> Result<(), StoreError> {
        let table = match self.transaction.open_table(VALVES) {
            Err(TableError::TableDoesNotExist(_)) => return Ok(()),
            table => table.map_err(|error| self.store.failed(error))?,
        };
        for entry in table.iter().map_err(|error| self.store.failed(error))? {
            let (name, bytes) = entry.map_err(|error| self.store.failed(error))?;
            call(name.value(), self.store.decoded(name.value(), bytes.value())?);
        }
        Ok(())
    }
}
