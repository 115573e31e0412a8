//! Figures that show in a notebook.

use std::ffi::OsStr;
use std::path::PathBuf;

use pyo3::prelude::*;

use crate::error::refused;

/// A figure. A notebook shows it by itself.
#[pyclass(frozen, module = "valve_prognosis")]
pub struct Figure(report::Figure);

impl Figure {
    /// From what the crates draw.
    pub fn of(figure: report::Figure) -> Self {
        Self(figure)
    }

    /// To be put into a page.
    pub fn html(&self) -> String {
        self.0.to_svg()
    }
}

#[pymethods]
impl Figure {
    /// The figure as SVG, the same text as the program writes.
    #[getter]
    fn svg(&self) -> String {
        self.0.to_svg()
    }

    /// The figure as PNG.
    ///
    /// Parameters
    /// ----------
    /// scale : float
    ///     Image points per pixel; 2 is what the program writes.
    #[pyo3(signature = (scale = 2.0))]
    fn png(&self, scale: f64) -> PyResult<Vec<u8>> {
        self.0.to_png(scale).map_err(refused)
    }

    /// Write the figure to a file whose name ends in .svg or .png.
    fn save(&self, path: PathBuf) -> PyResult<()> {
        let extension = path.extension().and_then(OsStr::to_str).map(str::to_ascii_lowercase);
        let bytes = match extension.as_deref() {
            Some("svg") => self.0.to_svg().into_bytes(),
            Some("png") => self.png(2.0)?,
            _ => {
                let shown = path.display();
                return Err(refused(format!(
                    "{shown}: pictures are written as .svg or .png; end the name in one of them"
                )));
            }
        };
        Ok(std::fs::write(path, bytes)?)
    }

    fn _repr_svg_(&self) -> String {
        self.svg()
    }
}
