//! What can be wrong with kept states.

use std::io;
use std::path::{Path, PathBuf};

use thiserror::Error;

/// Why states cannot be kept or gone on from.
#[derive(Debug, Error)]
pub enum StoreError {
    /// The directory cannot be made.
    #[error("{}: found {error}, expected a directory that can be written", folder.display())]
    Folder {
        /// The directory.
        folder: PathBuf,
        /// What the system says.
        error: io::Error,
    },
    /// Another process has it open.
    #[error("{}: found it in use by another process, expected to be the only one; end that one, or give this one a directory of its own", file.display())]
    InUse {
        /// The file.
        file: PathBuf,
    },
    /// It was kept by something else.
    #[error("{}: found a state kept with {name} {found}, expected {expected}; call with what it was kept with, or begin anew with another directory", file.display())]
    OtherTerm {
        /// The file.
        file: PathBuf,
        /// What differs.
        name: &'static str,
        /// As it was when the state was kept.
        found: String,
        /// As it is now.
        expected: String,
    },
    /// What is kept is not what this program writes.
    #[error("{}: found a {what} that this program does not understand ({error}), expected one that it wrote; begin anew with another directory", file.display())]
    NotUnderstood {
        /// The file.
        file: PathBuf,
        /// Which entry.
        what: String,
        /// What is wrong with it.
        error: postcard::Error,
    },
    /// The file cannot be read or written.
    #[error("{}: found {error}, expected states that can be read and written", file.display())]
    Database {
        /// The file.
        file: PathBuf,
        /// What the database says.
        error: Box<redb::Error>,
    },
}

impl StoreError {
    pub(crate) fn folder(folder: &Path, error: io::Error) -> Self {
        Self::Folder { folder: folder.to_path_buf(), error }
    }

    pub(crate) fn open(file: &Path, error: redb::DatabaseError) -> Self {
        let file = file.to_path_buf();
        match error {
            redb::DatabaseError::DatabaseAlreadyOpen => Self::InUse { file },
            error => Self::Database { file, error: Box::new(error.into()) },
        }
    }
}
