//! Sets of files that are replaced as one.
//!
//! Every file is first written under a name of its own that carries its hash. The moment at which the manifest gets
//! its name is the moment at which the set is the new one: from then on a file is looked for under its own name and,
//! if something else is there, under the name with its hash ([`read_file`]). Then the files get their own names. An
//! interruption at any instant leaves the older set or the new one, whole; the next write tidies up.

use std::fs::{self, File};
use std::io::{self, Write};
use std::path::Path;

use tempfile::NamedTempFile;

use crate::error::TableError;
use crate::manifest::{FileInfo, Manifest};
use crate::manifest_file::{self, MANIFEST_FILE};

/// Begins the names of files that are being written.
const WRITING: &str = ".writing-";
/// Begins the names of files that belong to a manifest and have not got their own names yet.
const NEXT: &str = ".next-";
/// Digits of its hash in such a name.
const DIGITS: usize = 16;
/// How often a file is looked for under both names while somebody else gives it its own.
const LOOKS: usize = 3;

/// The name of a file before it gets its own.
fn next_name(file: &FileInfo) -> String {
    let digits = file.blake3.get(..DIGITS).unwrap_or(&file.blake3);
    format!("{NEXT}{digits}-{}", file.name)
}

/// Writes `tables` (in the order of the files that the manifest tells of) and the manifest's `text` into `dir`, making
/// it if need be.
pub(crate) fn write_set(dir: &Path, manifest: &Manifest, tables: &[String], text: &str) -> Result<(), TableError> {
    let at = |path: &Path| {
        let path = path.to_path_buf();
        move |source: io::Error| TableError::Io { path, source }
    };
    let made = !dir.exists();
    fs::create_dir_all(dir).map_err(at(dir))?;
    let files: Vec<&FileInfo> = manifest_file::files(manifest).collect();
    let written = write_locked(dir, &files, tables, text).map_err(at(dir));
    if written.is_err() && made {
        // Removes the directory only if it is empty; a failure to tidy up must
        // not hide the failure itself.
        fs::remove_dir(dir).ok();
    }
    written
}

fn write_locked(dir: &Path, files: &[&FileInfo], tables: &[String], text: &str) -> io::Result<()> {
    let _lock = lock(dir)?;
    let older = finish_older(dir)?;
    let staged = stage(dir, files, tables, text);
    let manifest = staged.inspect_err(|_| remove_leftovers(dir))?;
    sync(dir)?;
    manifest.persist(dir.join(MANIFEST_FILE)).map_err(|error| error.error)?;
    sync(dir)?;
    for file in files {
        fs::rename(dir.join(next_name(file)), dir.join(&file.name))?;
    }
    // Tables of the older set that the new one has not.
    for file in older {
        let replaced = files.iter().any(|other| other.name == file.name);
        if !replaced && holds(&dir.join(&file.name), &file).is_ok() {
            fs::remove_file(dir.join(&file.name))?;
        }
    }
    sync(dir)
}

/// Whoever else writes into the directory waits. Where a directory cannot be locked, nobody does.
fn lock(dir: &Path) -> io::Result<Option<File>> {
    let Ok(handle) = File::open(dir) else { return Ok(None) };
    match handle.lock() {
        Ok(()) => Ok(Some(handle)),
        Err(error) if error.kind() == io::ErrorKind::Unsupported => Ok(None),
        Err(error) => Err(error),
    }
}

/// Gives the files of an interrupted write their own names and removes what belongs to nothing; the files of the set
/// that is there.
fn finish_older(dir: &Path) -> io::Result<Vec<FileInfo>> {
    let path = dir.join(MANIFEST_FILE);
    let older = fs::read_to_string(&path).ok().and_then(|text| manifest_file::from_json(&text, &path).ok());
    let files: Vec<FileInfo> = older.iter().flat_map(manifest_file::files).cloned().collect();
    for file in &files {
        let next = dir.join(next_name(file));
        if holds(&dir.join(&file.name), file).is_err() && holds(&next, file).is_ok() {
            fs::rename(next, dir.join(&file.name))?;
        }
    }
    remove_leftovers(dir);
    Ok(files)
}

/// Removes files that an interrupted write has left.
fn remove_leftovers(dir: &Path) {
    for entry in fs::read_dir(dir).into_iter().flatten().flatten() {
        let name = entry.file_name();
        let ours = name.to_str().is_some_and(|name| name.starts_with(WRITING) || name.starts_with(NEXT));
        if ours {
            // What cannot be removed does no harm.
            fs::remove_file(entry.path()).ok();
        }
    }
}

/// Puts everything on disk under other names; the manifest, which has none yet.
fn stage(dir: &Path, files: &[&FileInfo], tables: &[String], text: &str) -> io::Result<NamedTempFile> {
    for (file, table) in files.iter().zip(tables) {
        let staged = written(dir, &file.name, table)?;
        staged.persist(dir.join(next_name(file))).map_err(|error| error.error)?;
    }
    written(dir, MANIFEST_FILE, text)
}

/// A file that is to get a name, with the mode of the one that it replaces.
fn written(dir: &Path, name: &str, text: &str) -> io::Result<NamedTempFile> {
    let mut builder = tempfile::Builder::new();
    builder.prefix(WRITING);
    // Temporary files are private by default; tables are ordinary files, and
    // the user's umask decides who may read them.
    #[cfg(unix)]
    builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o666));
    let mut file = builder.tempfile_in(dir)?;
    if let Ok(older) = fs::metadata(dir.join(name)) {
        file.as_file().set_permissions(older.permissions())?;
        #[cfg(unix)]
        keep_owner(file.as_file(), &older)?;
    }
    file.write_all(text.as_bytes())?;
    file.as_file().sync_all()?;
    Ok(file)
}

#[cfg(unix)]
fn keep_owner(file: &File, older: &fs::Metadata) -> io::Result<()> {
    use std::os::unix::fs::{MetadataExt, fchown};
    let own = file.metadata()?;
    if (own.uid(), own.gid()) == (older.uid(), older.gid()) {
        return Ok(());
    }
    fchown(file, Some(older.uid()), Some(older.gid()))
}

/// Makes the names in a directory last, where a system can.
fn sync(dir: &Path) -> io::Result<()> {
    if cfg!(unix) { File::open(dir)?.sync_all() } else { Ok(()) }
}

/// The bytes of a file of a set.
pub(crate) fn read_file(dir: &Path, file: &FileInfo) -> Result<Vec<u8>, TableError> {
    let own = dir.join(&file.name);
    let mut found = holds(&own, file);
    for _ in 0..LOOKS {
        if found.is_ok() {
            break;
        }
        if let Ok(bytes) = holds(&dir.join(next_name(file)), file) {
            return Ok(bytes);
        }
        // It may have got its own name in between.
        found = holds(&own, file);
    }
    found
}

/// The bytes at a path if they are those that the manifest tells of.
fn holds(path: &Path, file: &FileInfo) -> Result<Vec<u8>, TableError> {
    let path = path.to_path_buf();
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
    Ok(bytes)
}
