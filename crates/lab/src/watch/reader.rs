//! Logs that grow, each read by a thread of its own.

use std::collections::BTreeSet;
use std::io::BufReader;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::thread;
use std::time::Duration;

use prognoser::{FollowedFile, LogError, LogErrorKind, TimingLog};

use super::fleet::Fleet;

/// How often a log and a folder are looked at.
const POLL: Duration = Duration::from_millis(200);

/// How long to wait before a log is opened again that cannot be read.
const PAUSE: Duration = Duration::from_secs(1);

/// Follows files, and the CSV files of folders, those that come later included.
pub fn follow_all(paths: Vec<PathBuf>, fleet: Arc<Fleet>) {
    thread::spawn(move || {
        let mut known: BTreeSet<PathBuf> = BTreeSet::new();
        loop {
            for path in paths.iter().flat_map(|path| files(path)) {
                if known.insert(path.clone()) {
                    let fleet = Arc::clone(&fleet);
                    thread::spawn(move || follow(&path, &fleet));
                }
            }
            thread::sleep(PAUSE);
        }
    });
}

/// A file itself, or the CSV files of a folder.
fn files(path: &Path) -> Vec<PathBuf> {
    if !path.is_dir() {
        return vec![path.to_path_buf()];
    }
    let entries = std::fs::read_dir(path).into_iter().flatten().flatten().map(|entry| entry.path());
    let mut files: Vec<PathBuf> =
        entries.filter(|path| path.extension().is_some_and(|extension| extension == "csv") && path.is_file()).collect();
    files.sort();
    files
}

/// Reads a log as it grows; one that vanishes or is replaced is read from its beginning once it is there. Rows that were
/// read before are known by their cycle and count once.
fn follow(path: &Path, fleet: &Fleet) {
    loop {
        if let Err(error) = read(path, fleet) {
            fleet.trouble(error.to_string());
        }
        thread::sleep(PAUSE);
    }
}

fn read(path: &Path, fleet: &Fleet) -> Result<(), LogError> {
    let name = path.display().to_string();
    let unreadable = |error| LogError { log: name.clone(), line: 1, kind: LogErrorKind::Io(error) };
    let file = FollowedFile::open(path, POLL).map_err(unreadable)?;
    let mut log = TimingLog::new(name.clone(), BufReader::new(file))?;
    loop {
        match log.next_row() {
            Ok(Some(row)) => fleet.push(&row),
            Ok(None) => return Ok(()),
            // The line is behind; the next one may be better.
            Err(error)
                if matches!(
                    error.kind,
                    LogErrorKind::FieldCount { .. } | LogErrorKind::Field { .. } | LogErrorKind::NotText
                ) =>
            {
                fleet.trouble(format!("{error}; the row is left out"));
            }
            Err(error) => return Err(error),
        }
    }
}
