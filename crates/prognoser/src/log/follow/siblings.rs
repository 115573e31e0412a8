//! The files beside a log: what a rotation has made of it.
//!
//! A log that is rotated is renamed (`log.csv` to `log.csv.1`) and begun anew, or copied and cut back to nothing. A file
//! is known by device, inode and first bytes, since names change and inodes are used again.

use std::ffi::OsStr;
use std::fs::{self, File, Metadata};
use std::io;
use std::path::{Path, PathBuf};
use std::time::SystemTime;

use serde::{Deserialize, Serialize};

use super::window::read_at;

/// First bytes of a file by which it is known.
pub(super) const HEAD: usize = 4096;
/// Bytes in which a first row is looked for.
const FIRST_LINES: u64 = 1 << 17;
/// Bytes that are compared at once.
const PIECE: u64 = 1 << 16;

/// Device and inode of a file; elsewhere than on Unix, when it was made.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub(super) struct FileId(u64, u64);

impl FileId {
    #[cfg(unix)]
    pub(super) fn of(metadata: &Metadata) -> Self {
        use std::os::unix::fs::MetadataExt;
        Self(metadata.dev(), metadata.ino())
    }

    #[cfg(not(unix))]
    pub(super) fn of(metadata: &Metadata) -> Self {
        let made = metadata.created().ok().and_then(|made| made.duration_since(SystemTime::UNIX_EPOCH).ok());
        Self(0, made.map_or(0, |made| made.as_nanos() as u64))
    }
}

/// A file that is older than the one that is read.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub(super) struct Known {
    id: FileId,
    head: u64,
}

impl Known {
    pub(super) fn of(id: FileId, head: &[u8]) -> Self {
        Self { id, head: hash(head) }
    }
}

/// A file that a rotation has made of the log.
#[derive(Debug)]
pub(super) struct Sibling {
    pub(super) path: PathBuf,
    pub(super) file: File,
    pub(super) id: FileId,
    pub(super) head: Vec<u8>,
    pub(super) length: u64,
    pub(super) written: SystemTime,
}

impl Sibling {
    pub(super) fn open(path: PathBuf) -> io::Result<Self> {
        let file = File::open(&path)?;
        Self::of(path, file)
    }

    pub(super) fn of(path: PathBuf, file: File) -> io::Result<Self> {
        let metadata = file.metadata()?;
        let written = metadata.modified().unwrap_or(SystemTime::UNIX_EPOCH);
        let head = head(&file)?;
        Ok(Self { path, id: FileId::of(&metadata), head, length: metadata.len(), written, file })
    }

    pub(super) fn known(&self) -> Known {
        Known::of(self.id, &self.head)
    }

    /// Whether the file begins as another one does, as far as the shorter of the two goes.
    pub(super) fn begins_as(&self, head: &[u8]) -> bool {
        let common = self.head.len().min(head.len());
        common > 0 && self.head[..common] == head[..common]
    }

    /// Whether one of two files is a copy of the other, made when that was shorter or as long.
    pub(super) fn is_copy_of(&self, other: &File) -> io::Result<bool> {
        let common = self.length.min(other.metadata()?.len());
        let mut place = 0;
        while place < common {
            let most = PIECE.min(common - place);
            let (mut here, mut there) = (Vec::new(), Vec::new());
            read_at(&self.file, place, most, &mut here)?;
            read_at(other, place, most, &mut there)?;
            if here != there || here.is_empty() {
                return Ok(false);
            }
            place += here.len() as u64;
        }
        Ok(common > 0)
    }

    /// The whole lines that the file begins with.
    pub(super) fn first_lines(&self) -> io::Result<Vec<u8>> {
        let mut bytes = Vec::new();
        read_at(&self.file, 0, FIRST_LINES, &mut bytes)?;
        let end = bytes.iter().rposition(|byte| *byte == b'\n').map_or(0, |end| end + 1);
        bytes.truncate(end);
        Ok(bytes)
    }
}

/// The first bytes of a file.
pub(super) fn head(file: &File) -> io::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    read_at(file, 0, HEAD as u64, &mut bytes)?;
    Ok(bytes)
}

/// The files that rotations have made of a log, the one last written to last.
pub(super) fn siblings(log: &Path) -> io::Result<Vec<Sibling>> {
    let mut all = Vec::new();
    for path in files(log)? {
        // A file that goes or may not be read is none.
        if is_rotated(log, &path)
            && let Ok(sibling) = Sibling::open(path)
        {
            all.push(sibling);
        }
    }
    all.sort_by(|a, b| a.written.cmp(&b.written).then_with(|| a.path.cmp(&b.path)));
    Ok(all)
}

/// The file of this identity in the folder of a log, whatever its name.
pub(super) fn with_id(log: &Path, id: FileId) -> io::Result<Option<Sibling>> {
    let same = |path: &PathBuf| fs::metadata(path).is_ok_and(|metadata| FileId::of(&metadata) == id);
    Ok(files(log)?.into_iter().find(same).and_then(|path| Sibling::open(path).ok()))
}

/// All regular files in the folder of a log but the log itself.
fn files(log: &Path) -> io::Result<Vec<PathBuf>> {
    // A file that is renamed while a folder is listed may be missing in the list.
    let mut files = listed(log)?;
    loop {
        let again = listed(log)?;
        if again == files {
            return Ok(files);
        }
        files = again;
    }
}

fn listed(log: &Path) -> io::Result<Vec<PathBuf>> {
    let folder = match log.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder,
        _ => Path::new("."),
    };
    let mut files = Vec::new();
    for entry in fs::read_dir(folder)? {
        let entry = entry?;
        if Some(entry.file_name().as_os_str()) != log.file_name() && entry.file_type().is_ok_and(|kind| kind.is_file())
        {
            files.push(entry.path());
        }
    }
    files.sort();
    Ok(files)
}

/// Whether a name is one that rotation gives a log: of `log.csv`, `log.csv.1` and all that begins so, `log.1.csv` and
/// `log-20260131.csv`.
fn is_rotated(log: &Path, path: &Path) -> bool {
    let text = |part: Option<&OsStr>| part.unwrap_or_default().to_string_lossy().into_owned();
    let (name, stem) = (text(log.file_name()), text(log.file_stem()));
    let found = text(path.file_name());
    if found.starts_with(&name) {
        return true;
    }
    let Some(rest) = found.strip_prefix(&stem) else { return false };
    let Some(middle) = rest.strip_suffix(&name[stem.len()..]) else { return false };
    let digits = middle.bytes().filter(u8::is_ascii_digit).count();
    let plain = middle.bytes().all(|byte| byte.is_ascii_digit() || b".-_TZ".contains(&byte));
    plain && ((middle.starts_with('.') && digits > 0) || digits >= 6)
}

/// 64 bits of bytes (Fowler, Noll, Vo: FNV-1a), the same in every version of the program.
fn hash(bytes: &[u8]) -> u64 {
    bytes.iter().fold(0xcbf2_9ce4_8422_2325, |hash, byte| (hash ^ u64::from(*byte)).wrapping_mul(0x0100_0000_01b3))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_that_rotation_gives_are_told_from_other_logs() {
        let rotated = |path: &str| is_rotated(Path::new("log.csv"), Path::new(path));
        for name in
            ["log.csv.1", "log.csv-20260131", "log.csv.2.gz", "log.1.csv", "log-20260131.csv", "log.2026-01-31.csv"]
        {
            assert!(rotated(name), "{name}");
        }
        for name in ["log2.csv", "log-2.csv", "login.csv", "other.csv", "log.txt", "log-2026013a.csv"] {
            assert!(!rotated(name), "{name}");
        }
    }
}
