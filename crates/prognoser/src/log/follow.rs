//! A file that is still being written, read as it grows.

use std::fs::{self, File};
use std::io::{self, Read};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;
use std::time::Duration;

use thiserror::Error;

/// Why a file can no longer be followed. It comes as the source of an
/// [`io::Error`].
#[derive(Debug, Error)]
pub enum FollowFailure {
    /// The file is gone.
    #[error("the log {} vanished while it was followed; start again once it is back", .0.display())]
    Vanished(PathBuf),
    /// The file became shorter.
    #[error("the log {} became shorter while it was followed; start again to read it from its beginning", .0.display())]
    Truncated(PathBuf),
    /// Another file took its name.
    #[error("the log {} was replaced by another file while it was followed; start again to read the new one", .0.display())]
    Replaced(PathBuf),
}

/// Reads a file and, at its end, waits for more. An end of file is given only
/// after [`stop_by`](Self::stop_by)'s flag is set.
pub struct FollowedFile {
    path: PathBuf,
    file: File,
    position: u64,
    poll: Duration,
    stop: Option<Arc<AtomicBool>>,
}

impl FollowedFile {
    /// Opens a file and looks for more of it every `poll`.
    pub fn open(path: &Path, poll: Duration) -> io::Result<Self> {
        let file = File::open(path)?;
        Ok(Self { path: path.to_path_buf(), file, position: 0, poll, stop: None })
    }

    /// Ends the file, as far as readers see, once the flag is set.
    #[must_use]
    pub fn stop_by(mut self, flag: Arc<AtomicBool>) -> Self {
        self.stop = Some(flag);
        self
    }

    fn check(&self) -> io::Result<()> {
        let failure = |make: fn(PathBuf) -> FollowFailure| io::Error::other(make(self.path.clone()));
        let at_path = match fs::metadata(&self.path) {
            Ok(metadata) => metadata,
            Err(error) if error.kind() == io::ErrorKind::NotFound => {
                return Err(failure(FollowFailure::Vanished));
            }
            Err(error) => return Err(error),
        };
        if !same_file(&at_path, &self.file.metadata()?) {
            return Err(failure(FollowFailure::Replaced));
        }
        if at_path.len() < self.position {
            return Err(failure(FollowFailure::Truncated));
        }
        Ok(())
    }
}

#[cfg(unix)]
fn same_file(a: &fs::Metadata, b: &fs::Metadata) -> bool {
    use std::os::unix::fs::MetadataExt;
    (a.dev(), a.ino()) == (b.dev(), b.ino())
}

#[cfg(not(unix))]
fn same_file(a: &fs::Metadata, b: &fs::Metadata) -> bool {
    a.created().ok() == b.created().ok()
}

impl Read for FollowedFile {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        loop {
            let count = self.file.read(buffer)?;
            if count > 0 || buffer.is_empty() {
                self.position += count as u64;
                return Ok(count);
            }
            if self.stop.as_ref().is_some_and(|flag| flag.load(Ordering::Relaxed)) {
                return Ok(0);
            }
            self.check()?;
            thread::sleep(self.poll);
        }
    }
}
