//! Answers: the program's document with its pictures.

use pyo3::prelude::*;
use pyo3::types::PyDict;
use serde::Serialize;

use crate::error::refused;
use crate::figure::Figure;
use crate::valve::ValveFile;

/// A JSON document as Python's dictionaries and lists.
pub fn to_python<'py>(py: Python<'py>, document: &impl Serialize) -> PyResult<Bound<'py, PyAny>> {
    let text = serde_json::to_string(document).map_err(refused)?;
    py.import("json")?.call_method1("loads", (text,))
}

/// What a question about a valve is answered with.
#[pyclass(frozen, module = "valve_prognosis")]
pub struct Answer {
    headline: String,
    document: serde_json::Value,
    figures: Vec<(&'static str, Py<Figure>)>,
    valve: Option<ValveFile>,
}

impl Answer {
    /// From the parts.
    pub fn new(
        py: Python<'_>,
        headline: String,
        document: serde_json::Value,
        figures: Vec<(&'static str, report::Figure)>,
        valve: Option<ValveFile>,
    ) -> PyResult<Self> {
        let figures = figures.into_iter().map(|(name, figure)| Ok((name, Py::new(py, Figure::of(figure))?)));
        Ok(Self { headline, document, figures: figures.collect::<PyResult<_>>()?, valve })
    }
}

#[pymethods]
impl Answer {
    /// The answer in a sentence.
    #[getter]
    fn headline(&self) -> &str {
        &self.headline
    }

    /// The answer as the program prints it with ``--format json``: SI units, with the unit in the name of each key.
    #[getter]
    fn document<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        to_python(py, &self.document)
    }

    /// The figures by name.
    #[getter]
    fn figures<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let all = PyDict::new(py);
        for (name, figure) in &self.figures {
            all.set_item(name, figure.clone_ref(py))?;
        }
        Ok(all)
    }

    /// The valve file that came out, where the question makes one; else None.
    #[getter]
    fn valve(&self) -> Option<ValveFile> {
        self.valve.clone()
    }

    fn __getitem__<'py>(&self, py: Python<'py>, key: &str) -> PyResult<Bound<'py, PyAny>> {
        self.document(py)?.get_item(key)
    }

    fn __repr__(&self) -> String {
        self.headline.clone()
    }

    fn _repr_html_(&self, py: Python<'_>) -> String {
        let escaped = self.headline.replace('&', "&amp;").replace('<', "&lt;");
        let first = self.figures.first().map(|(_, figure)| figure.bind(py).get().html());
        format!("<p>{escaped}</p>{}", first.unwrap_or_default())
    }
}
