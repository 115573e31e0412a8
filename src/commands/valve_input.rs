//! A valve file, read with a word about what looks wrong in it.

use std::path::Path;

use valve_file::{ValveFile, ValveFileError};

use crate::output;

/// Reads a valve file; what looks wrong is told on stderr.
pub fn read(path: &Path) -> Result<ValveFile, ValveFileError> {
    let file = ValveFile::read(path)?;
    for doubt in file.doubts() {
        output::note(&format!("warning: {doubt}"));
    }
    Ok(file)
}
