//! Files that appear whole or not at all, and take nothing away that is not theirs.

use std::fs::{self, File, Metadata};
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};

use anyhow::Context;
use tempfile::NamedTempFile;

use crate::failure::Hinted;

/// Ends the names of files that are being written.
const PARTIAL: &str = ".valve-partial";
/// Longest part of a file's name that its partial file has, in bytes.
const LONGEST_STEM: usize = 100;
/// Links from name to name that are followed before they count as a ring.
const MOST_LINKS: usize = 40;

/// The files that one call writes. They are held against each other, against what
/// the call reads and against what is there already before the work begins.
#[derive(Debug)]
pub struct Outputs {
    force: bool,
    inputs: Vec<PathBuf>,
    targets: Vec<PathBuf>,
}

impl Outputs {
    /// The outputs of a call; with `force` they may replace files.
    pub fn new(force: bool) -> Self {
        Self { force, inputs: Vec::new(), targets: Vec::new() }
    }

    /// Names what the call reads: none of it is ever replaced. What is in a
    /// directory counts as read.
    pub fn reads<P: AsRef<Path>>(mut self, paths: impl IntoIterator<Item = P>) -> Self {
        for path in paths {
            let path = path.as_ref();
            self.inputs.push(path.to_owned());
            if path.is_dir() {
                let inside = fs::read_dir(path).into_iter().flatten().flatten();
                self.inputs.extend(inside.map(|entry| entry.path()));
            }
        }
        self
    }

    /// Opens an output. What it may replace stays as it is until
    /// [`commit`](StagedFile::commit).
    ///
    /// # Errors
    /// If it is there already and may not be replaced, is an input or another
    /// output, or cannot be written.
    pub fn file(&mut self, target: &Path) -> anyhow::Result<StagedFile> {
        let real = self.claim(target)?;
        StagedFile::create(target, real, self.force)
    }

    /// Checks a name without opening it; the path that it stands for once links
    /// are followed.
    pub fn claim(&mut self, target: &Path) -> anyhow::Result<PathBuf> {
        let shown = target.display();
        let real = followed(target).with_context(|| format!("{shown}: cannot be written"))?;
        if let Some(input) = self.inputs.iter().find(|input| same(input, &real)) {
            return Err(Hinted::error(
                format!("{shown}: is read by this call ({}) and would be replaced", input.display()),
                "give the output another name",
            ));
        }
        if self.targets.iter().any(|other| same(other, &real)) {
            return Err(Hinted::error(
                format!("{shown}: two outputs of this call would have this name"),
                "give each output a name of its own",
            ));
        }
        if let Ok(there) = fs::metadata(&real).or_else(|_| fs::metadata(target)) {
            check_replaceable(target, &there, self.force)?;
        }
        self.targets.push(real.clone());
        Ok(real)
    }
}

/// Refuses to replace what is no ordinary file, and without `force` anything.
fn check_replaceable(target: &Path, there: &Metadata, force: bool) -> anyhow::Result<()> {
    let shown = target.display();
    if there.is_dir() {
        return Err(Hinted::error(format!("{shown}: is a directory"), "give the name of a file"));
    }
    if !there.is_file() {
        return Err(Hinted::error(
            format!("{shown}: is no regular file and is not replaced"),
            "give the name of a file; texts and JSON go to stdout by themselves",
        ));
    }
    if !force {
        return Err(Hinted::error(
            format!("{shown}: exists already"),
            "choose another name, or replace it with --force",
        ));
    }
    if there.permissions().readonly() {
        return Err(Hinted::error(
            format!("{shown}: is read-only and is not replaced"),
            "choose another name, or allow writing to it first",
        ));
    }
    Ok(())
}

/// Where a name leads once symbolic links are followed, also to something that is
/// not there yet.
fn followed(target: &Path) -> io::Result<PathBuf> {
    let mut path = target.to_owned();
    for _ in 0..MOST_LINKS {
        let name = path.file_name().ok_or(io::ErrorKind::InvalidInput)?.to_owned();
        let folder = match path.parent() {
            Some(folder) if !folder.as_os_str().is_empty() => folder.to_owned(),
            _ => PathBuf::from("."),
        };
        let real = fs::canonicalize(folder)?.join(name);
        match fs::read_link(&real) {
            Ok(next) => path = real.parent().unwrap_or(&real).join(next),
            Err(_) => return Ok(real),
        }
    }
    Err(io::Error::other("its symbolic links go round in a ring"))
}

/// Whether two paths are the same file, by whatever names.
fn same(a: &Path, b: &Path) -> bool {
    let real = |path: &Path| followed(path).unwrap_or_else(|_| path.to_owned());
    if real(a) == real(b) {
        return true;
    }
    matches!((fs::metadata(a), fs::metadata(b)), (Ok(a), Ok(b)) if same_inode(&a, &b))
}

#[cfg(unix)]
fn same_inode(a: &Metadata, b: &Metadata) -> bool {
    use std::os::unix::fs::MetadataExt;
    a.is_file() && (a.dev(), a.ino()) == (b.dev(), b.ino())
}

#[cfg(not(unix))]
fn same_inode(_: &Metadata, _: &Metadata) -> bool {
    false
}

/// A file being written under another name beside its final one, which it gets
/// when all is in it. What is left of a process that was killed goes when the same
/// file is written again.
#[derive(Debug)]
pub struct StagedFile {
    shown: PathBuf,
    target: PathBuf,
    force: bool,
    writer: BufWriter<NamedTempFile>,
}

impl StagedFile {
    fn create(shown: &Path, target: PathBuf, force: bool) -> anyhow::Result<Self> {
        let context = || format!("{}: cannot be written", shown.display());
        remove_stale(&target);
        let partial = partial_beside(&target).with_context(context)?;
        if let Ok(there) = fs::metadata(&target) {
            keep_attributes(partial.as_file(), &there).with_context(context)?;
        }
        Ok(Self { shown: shown.to_owned(), target, force, writer: BufWriter::new(partial) })
    }

    /// Puts the file in its place.
    pub fn commit(self) -> anyhow::Result<()> {
        let context = || format!("{}: cannot be written", self.shown.display());
        let partial = self.writer.into_inner().map_err(io::IntoInnerError::into_error).with_context(context)?;
        partial.as_file().sync_all().with_context(context)?;
        // Who made such a file meanwhile does not lose it.
        let placed = if self.force { partial.persist(&self.target) } else { partial.persist_noclobber(&self.target) };
        match placed {
            Ok(_) => sync_folder(&self.target).with_context(context),
            Err(failed) if failed.error.kind() == io::ErrorKind::AlreadyExists => Err(Hinted::error(
                format!("{}: appeared while the call was running and was not replaced", self.shown.display()),
                "choose another name, or replace it with --force",
            )),
            Err(failed) => Err(failed.error).with_context(context),
        }
    }

    /// Writes all of it and puts it in its place.
    pub fn write_whole(mut self, bytes: &[u8]) -> anyhow::Result<()> {
        self.write_all(bytes).with_context(|| format!("{}: cannot be written", self.shown.display()))?;
        self.commit()
    }
}

impl Write for StagedFile {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.writer.write(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.writer.flush()
    }
}

/// Begins the name of a partial file: that of its target, shortened.
fn stem(target: &Path) -> String {
    let name = target.file_name().unwrap_or_default().to_string_lossy();
    let end = (0..=name.len().min(LONGEST_STEM)).rev().find(|end| name.is_char_boundary(*end)).unwrap_or(0);
    format!(".{}.", &name[..end])
}

fn partial_beside(target: &Path) -> io::Result<NamedTempFile> {
    let folder = target.parent().unwrap_or(Path::new("."));
    let stem = stem(target);
    let mut builder = tempfile::Builder::new();
    builder.prefix(&stem).suffix(PARTIAL);
    // The user's umask decides who may read it, as for any file.
    #[cfg(unix)]
    builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o666));
    loop {
        let partial = builder.tempfile_in(folder)?;
        // The lock says that somebody still writes. Between the file's making and
        // its locking somebody else may have taken it for stale and removed it.
        let _ = partial.as_file().try_lock();
        if partial.path().exists() {
            return Ok(partial);
        }
    }
}

/// Removes partial files of this target that nobody writes any more.
fn remove_stale(target: &Path) {
    let (Some(folder), stem) = (target.parent(), stem(target)) else { return };
    for entry in fs::read_dir(folder).into_iter().flatten().flatten() {
        let name = entry.file_name();
        let ours = name.to_str().is_some_and(|name| name.starts_with(&stem) && name.ends_with(PARTIAL));
        let is_file = || entry.file_type().is_ok_and(|kind| kind.is_file());
        if ours && is_file() && File::open(entry.path()).is_ok_and(|file| file.try_lock().is_ok()) {
            // What cannot be removed does no harm.
            let _ = fs::remove_file(entry.path());
        }
    }
}

/// Gives a file the mode and the owner of the one that it is to replace.
#[cfg(unix)]
fn keep_attributes(partial: &File, there: &Metadata) -> io::Result<()> {
    use std::os::unix::fs::{MetadataExt, fchown};
    let own = partial.metadata()?;
    if (own.uid(), own.gid()) != (there.uid(), there.gid()) {
        fchown(partial, Some(there.uid()), Some(there.gid())).map_err(|error| {
            let owner = format!("user {} and group {}", there.uid(), there.gid());
            io::Error::new(error.kind(), format!("it belongs to {owner} and would not any more: {error}"))
        })?;
    }
    partial.set_permissions(there.permissions())
}

#[cfg(not(unix))]
fn keep_attributes(_: &File, _: &Metadata) -> io::Result<()> {
    Ok(())
}

/// Makes the new name last, where a system can.
fn sync_folder(target: &Path) -> io::Result<()> {
    match target.parent() {
        Some(folder) if cfg!(unix) => File::open(folder)?.sync_all(),
        _ => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names(dir: &Path) -> Vec<String> {
        let mut names: Vec<String> =
            fs::read_dir(dir).unwrap().map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect();
        names.sort();
        names
    }

    #[test]
    fn nothing_appears_without_commit() {
        let dir = tempfile::tempdir().unwrap();
        let mut file = Outputs::new(false).file(&dir.path().join("out.csv")).unwrap();
        file.write_all(b"half").unwrap();
        drop(file);
        assert_eq!(names(dir.path()), [""; 0]);
    }

    #[test]
    fn force_replaces_the_old_file_at_commit() {
        let dir = tempfile::tempdir().unwrap();
        let target = dir.path().join("out.csv");
        fs::write(&target, "old").unwrap();
        let refused = Outputs::new(false).file(&target).unwrap_err().to_string();
        assert!(refused.ends_with("out.csv: exists already"), "{refused}");
        let mut file = Outputs::new(true).file(&target).unwrap();
        file.write_all(b"new").unwrap();
        assert_eq!(fs::read_to_string(&target).unwrap(), "old");
        file.commit().unwrap();
        assert_eq!(fs::read_to_string(&target).unwrap(), "new");
        assert_eq!(names(dir.path()), ["out.csv"]);
    }

    #[test]
    fn a_file_that_appears_meanwhile_is_not_lost() {
        let dir = tempfile::tempdir().unwrap();
        let target = dir.path().join("out.csv");
        let file = Outputs::new(false).file(&target).unwrap();
        fs::write(&target, "theirs").unwrap();
        let refused = file.commit().unwrap_err().to_string();
        assert!(refused.contains("appeared while the call was running"), "{refused}");
        assert_eq!(fs::read_to_string(&target).unwrap(), "theirs");
        assert_eq!(names(dir.path()), ["out.csv"]);
    }

    #[test]
    fn what_a_killed_process_left_is_tidied_up_and_what_another_writes_is_not() {
        let dir = tempfile::tempdir().unwrap();
        let target = dir.path().join("out.csv");
        let stale = dir.path().join(format!(".out.csv.aB3xYz{PARTIAL}"));
        fs::write(&stale, "half").unwrap();
        fs::write(dir.path().join(".other.csv.aB3xYz.valve-partial"), "half").unwrap();
        let first = Outputs::new(false).file(&target).unwrap();
        assert!(!stale.exists());
        let second = Outputs::new(false).file(&target).unwrap();
        assert_eq!(names(dir.path()).len(), 3, "both are being written");
        first.write_whole(b"first").unwrap();
        assert!(second.write_whole(b"second").is_err());
        assert_eq!(fs::read_to_string(&target).unwrap(), "first");
        assert_eq!(names(dir.path()), [".other.csv.aB3xYz.valve-partial", "out.csv"]);
    }

    #[cfg(unix)]
    #[test]
    fn mode_and_links_are_kept() {
        use std::os::unix::fs::{PermissionsExt, symlink};
        let dir = tempfile::tempdir().unwrap();
        let (real, link) = (dir.path().join("real.csv"), dir.path().join("link.csv"));
        fs::write(&real, "old").unwrap();
        fs::set_permissions(&real, fs::Permissions::from_mode(0o640)).unwrap();
        symlink("real.csv", &link).unwrap();
        Outputs::new(true).file(&link).unwrap().write_whole(b"new").unwrap();
        assert_eq!(fs::read_to_string(&real).unwrap(), "new");
        assert_eq!(fs::metadata(&real).unwrap().permissions().mode() & 0o777, 0o640);
        assert!(fs::symlink_metadata(&link).unwrap().is_symlink());
        let ahead = dir.path().join("ahead.csv");
        symlink("later.csv", &ahead).unwrap();
        Outputs::new(false).file(&ahead).unwrap().write_whole(b"new").unwrap();
        assert_eq!(names(dir.path()), ["ahead.csv", "later.csv", "link.csv", "real.csv"]);
    }

    #[test]
    fn names_that_are_long_or_strange_are_shortened() {
        let dir = tempfile::tempdir().unwrap();
        let target = dir.path().join(format!("{}.svg", "ä".repeat(120)));
        Outputs::new(false).file(&target).unwrap().write_whole(b"new").unwrap();
        assert_eq!(names(dir.path()).len(), 1);
    }
}
