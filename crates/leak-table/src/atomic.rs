//! Files that appear whole or not at all.

use std::fs;
use std::io::{self, Write};
use std::path::Path;

use tempfile::NamedTempFile;

use crate::error::TableError;

/// Writes `files` (name and content) into `dir`, making it if need be.
///
/// Everything is first written under temporary names. Only when all of it is
/// on disk are the files renamed to their own names, in the order given: a
/// full disk or an interruption before that leaves `dir` as it was.
pub(crate) fn write_all(dir: &Path, files: &[(&str, &[u8])]) -> Result<(), TableError> {
    let at = |path: &Path| {
        let path = path.to_path_buf();
        move |source: io::Error| TableError::Io { path, source }
    };
    let made = !dir.exists();
    fs::create_dir_all(dir).map_err(at(dir))?;
    let result = stage(dir, files).map_err(at(dir)).and_then(|staged| {
        for (temporary, (name, _)) in staged.into_iter().zip(files) {
            let target = dir.join(name);
            temporary.persist(&target).map_err(|e| at(&target)(e.error))?;
        }
        Ok(())
    });
    if result.is_err() && made {
        // Removes the directory only if it is empty; a failure to tidy up must
        // not hide the failure itself.
        fs::remove_dir(dir).ok();
    }
    result
}

fn stage(dir: &Path, files: &[(&str, &[u8])]) -> io::Result<Vec<NamedTempFile>> {
    let mut builder = tempfile::Builder::new();
    builder.prefix(".writing-");
    // Temporary files are private by default; tables are ordinary files, and
    // the user's umask decides who may read them.
    #[cfg(unix)]
    builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o666));
    files
        .iter()
        .map(|(_, content)| {
            let mut file = builder.tempfile_in(dir)?;
            file.write_all(content)?;
            file.as_file().sync_all()?;
            Ok(file)
        })
        .collect()
}
