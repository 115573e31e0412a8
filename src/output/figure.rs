//! Pictures to files; the ending of the name decides the kind.

use std::ffi::OsStr;
use std::io::Write;
use std::path::Path;

use report::Figure;

use super::{Outputs, StagedFile, note};
use crate::failure::Hinted;

/// Image points per pixel of a PNG: sharp on today's screens and in print.
const PNG_SCALE: f64 = 2.0;

#[derive(Debug, Clone, Copy)]
enum Kind {
    Svg,
    Png,
}

/// An open file for a picture.
#[derive(Debug)]
pub struct PlotFile {
    kind: Kind,
    file: StagedFile,
    shown: String,
}

impl PlotFile {
    /// Opens the file that an option names, if it names one. Done before the work,
    /// so that a wrong name does not cost a long run.
    pub fn create(outputs: &mut Outputs, path: Option<&Path>) -> anyhow::Result<Option<Self>> {
        let Some(path) = path else { return Ok(None) };
        let extension = path.extension().and_then(OsStr::to_str).map(str::to_ascii_lowercase);
        let kind = match extension.as_deref() {
            Some("svg") => Kind::Svg,
            Some("png") => Kind::Png,
            _ => {
                return Err(Hinted::error(
                    format!("{}: pictures are written as .svg or .png", path.display()),
                    "end the name of the plot in .svg or .png",
                ));
            }
        };
        Ok(Some(Self { kind, file: outputs.file(path)?, shown: path.display().to_string() }))
    }

    /// Draws the picture, puts the file in its place and says so.
    pub fn write(mut self, figure: &Figure) -> anyhow::Result<()> {
        match self.kind {
            Kind::Svg => self.file.write_all(figure.to_svg().as_bytes())?,
            Kind::Png => self.file.write_all(&figure.to_png(PNG_SCALE)?)?,
        }
        self.file.commit()?;
        note(&format!("drawn: {}", self.shown));
        Ok(())
    }
}
