//! Files that appear whole or not at all.

use std::fs::{self, File};
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};

use anyhow::Context;

/// A file being written under another name beside its final one. It is opened
/// before the work starts, so that a directory that cannot be written is known
/// then, and gets its name when all is in it.
#[derive(Debug)]
pub struct StagedFile {
    target: PathBuf,
    staged: PathBuf,
    writer: Option<BufWriter<File>>,
}

impl StagedFile {
    /// Opens a file for writing. What it may replace stays until [`commit`](Self::commit).
    pub fn create(target: &Path) -> anyhow::Result<Self> {
        let context = || format!("{}: cannot be written", target.display());
        if target.is_dir() {
            return Err(io::Error::from(io::ErrorKind::IsADirectory)).with_context(context);
        }
        let mut name = target
            .file_name()
            .ok_or(io::ErrorKind::InvalidInput)
            .map_err(io::Error::from)
            .with_context(context)?
            .to_owned();
        name.push(format!(".{}.partial", std::process::id()));
        let staged = target.with_file_name(name);
        let file = File::create(&staged).with_context(context)?;
        Ok(Self { target: target.to_owned(), staged, writer: Some(BufWriter::new(file)) })
    }

    /// Puts the file in its place.
    pub fn commit(mut self) -> anyhow::Result<()> {
        let context = || format!("{}: cannot be written", self.target.display());
        if let Some(writer) = self.writer.take() {
            let file = writer.into_inner().map_err(io::IntoInnerError::into_error).with_context(context)?;
            file.sync_all().with_context(context)?;
        }
        fs::rename(&self.staged, &self.target).with_context(context)
    }
}

impl Write for StagedFile {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.writer.as_mut().map_or(Ok(0), |writer| writer.write(bytes))
    }

    fn flush(&mut self) -> io::Result<()> {
        self.writer.as_mut().map_or(Ok(()), Write::flush)
    }
}

impl Drop for StagedFile {
    fn drop(&mut self) {
        // After a commit the staged name is gone and this does nothing.
        let _ = fs::remove_file(&self.staged);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nothing_appears_without_commit() {
        let dir = tempfile::tempdir().unwrap();
        let target = dir.path().join("out.csv");
        let mut file = StagedFile::create(&target).unwrap();
        file.write_all(b"half").unwrap();
        drop(file);
        assert_eq!(fs::read_dir(dir.path()).unwrap().count(), 0);
    }

    #[test]
    fn commit_replaces_the_old_file() {
        let dir = tempfile::tempdir().unwrap();
        let target = dir.path().join("out.csv");
        fs::write(&target, "old").unwrap();
        let mut file = StagedFile::create(&target).unwrap();
        file.write_all(b"new").unwrap();
        assert_eq!(fs::read_to_string(&target).unwrap(), "old");
        file.commit().unwrap();
        assert_eq!(fs::read_to_string(&target).unwrap(), "new");
        assert_eq!(fs::read_dir(dir.path()).unwrap().count(), 1);
    }
}
