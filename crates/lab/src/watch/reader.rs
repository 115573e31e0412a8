//! Logs that grow, each read by a thread of its own.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::thread;
use std::time::Duration;

use prognoser::{FollowOptions, Followed, FollowedLog, LogError};

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

/// Reads a log as it grows. Where that cannot be done it is begun again: rows that were read before are known by their
/// cycle and count once.
fn follow(path: &Path, fleet: &Fleet) {
    loop {
        if let Err(error) = read(path, fleet) {
            fleet.trouble(error.to_string());
        }
        thread::sleep(PAUSE);
    }
}

fn read(path: &Path, fleet: &Fleet) -> Result<(), LogError> {
    let stop = Arc::new(AtomicBool::new(false));
    let options = FollowOptions { forever: true, poll: POLL, stop, empty_is_stalled: false };
    let mut log = FollowedLog::open(path, None, options)?;
    loop {
        match log.next()? {
            Followed::Row(row) => fleet.push(&row),
            Followed::Skipped(error) => fleet.trouble(format!("{error}; the line is skipped")),
            Followed::Notice(notice) => fleet.trouble(format!("{}: {notice}", path.display())),
            Followed::Idle => {}
            Followed::End => return Ok(()),
        }
    }
}
