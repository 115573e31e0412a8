//! Tables: built, read, written, shipped.

use std::collections::BTreeMap;
use std::fs;
use std::path::PathBuf;
use std::sync::Arc;

use answers::figures::life::History;
use leak_table::{MANIFEST_FILE, Stroke, TableBundle, TimeAt};
use lut_builder::Built;
use numpy::{PyArray1, PyArrayLike1};
use prognoser::{LogRow, Method, Prognoser};
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyTuple};
use report::figures::TableFigure;

use crate::answer::to_python;
use crate::error::refused;
use crate::figure::Figure;
use crate::frame::{self, Columns};

/// An array of NumPy.
type Numbers<'py> = Bound<'py, PyArray1<f64>>;

/// Tables from leaks and other wear to stroke times: all that a prognosis needs to know of a valve.
#[pyclass(frozen, module = "valve_prognosis")]
pub struct Tables {
    bundle: Arc<TableBundle>,
    simulated: Option<usize>,
    notices: Vec<String>,
}

impl Tables {
    /// As they were built.
    pub fn built(built: Built) -> Self {
        let notices = built.notices.iter().map(ToString::to_string).collect();
        Self { bundle: Arc::new(built.bundle), simulated: Some(built.simulated), notices }
    }

    /// What a prognoser shares.
    pub fn bundle(&self) -> Arc<TableBundle> {
        Arc::clone(&self.bundle)
    }
}

#[pymethods]
impl Tables {
    /// Read tables from a directory; with ``valve``, refuse those of another model.
    #[staticmethod]
    #[pyo3(signature = (path, *, valve = None))]
    fn read(path: PathBuf, valve: Option<&Bound<'_, crate::valve::ValveFile>>) -> PyResult<Self> {
        let bundle = match valve {
            Some(valve) => TableBundle::read_for_model(&path, &answers::tables::hash_of(&valve.get().0)),
            None => TableBundle::read(&path),
        };
        Ok(Self { bundle: Arc::new(bundle.map_err(refused)?), simulated: None, notices: Vec::new() })
    }

    /// Write the tables into a directory, the same files as ``valve build-tables`` writes.
    ///
    /// Tables that are there are replaced only with ``force``.
    #[pyo3(signature = (path, *, force = false))]
    fn write(&self, path: PathBuf, force: bool) -> PyResult<()> {
        if !force && path.join(MANIFEST_FILE).exists() {
            return Err(refused(format!(
                "{}: has tables already; write elsewhere, or with force=True",
                path.display()
            )));
        }
        fs::create_dir_all(&path)?;
        self.bundle.write(&path).map_err(refused)
    }

    /// The name of the valve.
    #[getter]
    fn valve_name(&self) -> &str {
        &self.bundle.manifest().valve
    }

    /// The hash of the model that they were built from.
    #[getter]
    fn model_hash(&self) -> &str {
        &self.bundle.manifest().model_hash
    }

    /// What was odd while they were built, a sentence each.
    #[getter]
    fn notices(&self) -> Vec<String> {
        self.notices.clone()
    }

    /// The kinds of wear that have a table.
    #[getter]
    fn faults(&self) -> Vec<String> {
        self.bundle.entries().map(|entry| entry.degradation.id.to_string()).collect()
    }

    /// What ``valve build-tables --format json`` prints.
    #[getter]
    fn document<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        to_python(py, &answers::tables::document(&self.bundle, self.simulated))
    }

    /// Stroke times over the severity of a fault.
    ///
    /// Parameters
    /// ----------
    /// fault : str
    ///     One of `faults`.
    /// severity : array of shape (n,)
    ///     SI: m2 for a leak.
    ///
    /// Returns
    /// -------
    /// (array of shape (n,), array of shape (n,))
    ///     Closing and opening times, s; NaN where the valve does not get there or the table does not reach.
    fn stroke_times<'py>(
        &self,
        py: Python<'py>,
        fault: &str,
        severity: PyArrayLike1<'py, f64, numpy::AllowTypeChange>,
    ) -> PyResult<(Numbers<'py>, Numbers<'py>)> {
        let entry = self.bundle.get(fault).ok_or_else(|| {
            refused(format!("there is no table of {fault:?}, expected one of {}", self.faults().join(", ")))
        })?;
        let severity = severity.as_array().to_vec();
        let times = |stroke: Stroke| {
            let curve = entry.table.curve(stroke);
            let time = |severity: &f64| match curve.time_at(*severity) {
                TimeAt::Within(time_s) => time_s,
                TimeAt::NotReached | TimeAt::BelowRange | TimeAt::AboveRange => f64::NAN,
            };
            PyArray1::from_iter(py, severity.iter().map(time))
        };
        Ok((times(Stroke::Close), times(Stroke::Open)))
    }

    /// Stroke times over what wears.
    fn figure(&self) -> Figure {
        let figures = answers::tables::figures(&self.bundle);
        let title = answers::tables::title(&self.bundle);
        Figure::of(TableFigure::side_by_side(title, "periodic cycles, as simulated", &figures))
    }

    /// The path of one valve of a log: readings, severity, remaining life, which fault.
    ///
    /// Parameters
    /// ----------
    /// frame : data frame
    ///     Rows as `Prognoser.push_frame` takes them; read from the beginning by the default method.
    /// valve : str, optional
    ///     The first one unless given.
    /// true_eol_cycle : float, optional
    ///     Where the life ended, if that is known.
    #[pyo3(signature = (frame, *, valve = None, true_eol_cycle = None))]
    fn life_figure(
        &self,
        py: Python<'_>,
        frame: Bound<'_, PyAny>,
        valve: Option<String>,
        true_eol_cycle: Option<f64>,
    ) -> PyResult<Figure> {
        let batches = frame::read(&frame)?;
        py.detach(|| {
            let method = Method::default();
            let mut prognoser = Prognoser::new(self.bundle(), method);
            let mut history: Option<(String, History)> = None;
            for batch in &batches {
                let columns = Columns::of(batch, false)?;
                for row in 0..columns.rows {
                    let name = columns.valve(row);
                    let wanted = valve.as_deref().or(history.as_ref().map(|(first, _)| first.as_str()));
                    if wanted.is_some_and(|wanted| wanted != name) {
                        continue;
                    }
                    let reading = columns.reading(row).map_err(|error| refused(format!("row {row}: {error}")))?;
                    let row = LogRow { valve: name, reading, time: columns.time(row), line: row as u64 };
                    let prognosis = prognoser.push(&row);
                    let history = history.get_or_insert_with(|| (name.to_owned(), History::of(None)));
                    history.1.add(&reading, &prognosis);
                }
            }
            let figure = history.and_then(|(_, history)| history.figure(&self.bundle, method.name(), true_eol_cycle));
            let missing = || refused(format!("the frame has no row of {}", valve.as_deref().unwrap_or("any valve")));
            Ok(Figure::of(figure.ok_or_else(missing)?.figure()))
        })
    }

    /// All files as bytes, to ship them to other machines; also what pickling uses.
    fn to_bytes<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyBytes>> {
        let dir = tempfile::tempdir()?;
        self.bundle.write(dir.path()).map_err(refused)?;
        let mut files = BTreeMap::new();
        for entry in fs::read_dir(dir.path())? {
            let entry = entry?;
            files.insert(entry.file_name().to_string_lossy().into_owned(), fs::read(entry.path())?);
        }
        Ok(PyBytes::new(py, &postcard::to_stdvec(&files).map_err(refused)?))
    }

    /// Tables from what `to_bytes` gave.
    #[staticmethod]
    fn from_bytes(bytes: &[u8]) -> PyResult<Self> {
        let not_ours = || refused("these bytes are no tables as Tables.to_bytes gives them");
        let files: BTreeMap<String, Vec<u8>> = postcard::from_bytes(bytes).map_err(|_| not_ours())?;
        let dir = tempfile::tempdir()?;
        for (name, content) in files {
            // A name alone: nothing is written elsewhere.
            if name.is_empty() || name.contains(['/', '\\', ':']) || name.starts_with('.') {
                return Err(not_ours());
            }
            fs::write(dir.path().join(name), content)?;
        }
        Self::read(dir.path().to_owned(), None)
    }

    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> PyResult<(Bound<'py, PyAny>, Bound<'py, PyTuple>)> {
        let from_bytes = slf.get_type().getattr("from_bytes")?;
        Ok((from_bytes, PyTuple::new(slf.py(), [slf.get().to_bytes(slf.py())?])?))
    }

    fn _repr_svg_(&self) -> String {
        self.figure().html()
    }

    fn __repr__(&self) -> String {
        format!("<Tables of {:?}: {}>", self.valve_name(), self.faults().join(", "))
    }
}
