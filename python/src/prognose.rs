//! The prognoser with its state.

use std::hash::{BuildHasher, BuildHasherDefault, DefaultHasher};
use std::path::PathBuf;
use std::sync::Arc;

use answers::prognosis;
use arrow_array::RecordBatch;
use leak_table::TableBundle;
use prognoser::{LogRow, Method, ValveState};
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict};
use rayon::prelude::*;

use crate::answer::to_python;
use crate::error::refused;
use crate::frame::{self, Columns, Output, Rows, Told};
use crate::method::Settings;
use crate::row;
use crate::state::{Kept, Terms};
use crate::tables::Tables;

/// Rows that are worked on before they go out, as in the program.
const CHUNK: usize = 1 << 14;

/// Fault, leak and remaining life of the valves of a timing log, row by row.
///
/// Every row that goes in gives a row that comes out, the same as from ``valve prognose``. What is kept of a valve has
/// a bounded size and can be written as bytes at any time.
///
/// Parameters
/// ----------
/// tables : Tables
///     The tables of the kind of valve that the log is of.
/// method : {"bayes", "ols"}
///     How the life is estimated; "ols" is the paper's straight line.
/// noise_s : float, optional
///     Standard deviation of a measured time, s; estimated unless given.
/// start : {"healthy", "unknown"}
///     What is known of each valve before its first row.
/// growth : {"linear", "exponential", "auto"}, optional
///     The law of growth.
/// life_cycles : float, optional
///     Cycles that a valve usually lives.
/// risk : float
///     Accepted probability that a valve fails before ``replace_by_cycle``.
/// prior : path, optional
///     What ``valve learn`` wrote of sister valves.
/// empty_is_stalled : bool
///     A time that is missing is a stroke that did not arrive.
/// threads : int, optional
///     Threads that work on frames; all cores unless given.
#[pyclass(module = "valve_prognosis")]
pub struct Prognoser {
    tables: Arc<TableBundle>,
    method: Method,
    empty_is_stalled: bool,
    /// The valves, shared out by name.
    shards: Vec<prognoser::Prognoser>,
}

impl Prognoser {
    fn shard_of(&self, valve: &str) -> usize {
        let hasher = BuildHasherDefault::<DefaultHasher>::default();
        #[expect(clippy::cast_possible_truncation, reason = "a remainder by a small number")]
        let shard = (hasher.hash_one(valve) % self.shards.len() as u64) as usize;
        shard
    }

    fn terms(&self) -> Terms {
        Terms::new(&self.tables, &self.method)
    }

    fn work(&mut self, batches: &[RecordBatch], keep: bool) -> PyResult<Vec<RecordBatch>> {
        let columns: Vec<Columns<'_>> =
            batches.iter().map(|batch| Columns::of(batch, self.empty_is_stalled)).collect::<PyResult<_>>()?;
        if !keep {
            // All rows or none: what is refused leaves the state as it was.
            let mut before = 0;
            for columns in &columns {
                if let Some((row, error)) =
                    (0..columns.rows).find_map(|row| columns.reading(row).err().map(|e| (row, e)))
                {
                    return Err(refused(format!("row {}: {error}", before + row)));
                }
                before += columns.rows;
            }
        }
        let mut out = Vec::new();
        for columns in &columns {
            for start in (0..columns.rows).step_by(CHUNK) {
                out.push(self.chunk(columns, start..(start + CHUNK).min(columns.rows))?);
            }
        }
        Ok(out)
    }

    fn chunk(&mut self, columns: &Columns<'_>, rows: std::ops::Range<usize>) -> PyResult<RecordBatch> {
        let shard_of: Vec<usize> = rows.clone().map(|row| self.shard_of(columns.valve(row))).collect();
        let told: Vec<Vec<Told>> = self
            .shards
            .par_iter_mut()
            .enumerate()
            .map(|(shard, prognoser)| {
                let own = rows.clone().filter(|row| shard_of[row - rows.start] == shard);
                own.map(|row| push(prognoser, columns, row)).collect()
            })
            .collect();
        let mut output = Output::new();
        let mut next = vec![0; told.len()];
        for (row, shard) in rows.zip(shard_of) {
            output.push(columns.valve(row), &told[shard][next[shard]])?;
            next[shard] += 1;
        }
        output.batch()
    }
}

fn push(prognoser: &mut prognoser::Prognoser, columns: &Columns<'_>, row: usize) -> Told {
    match columns.reading(row) {
        Ok(reading) => {
            let row = LogRow { valve: columns.valve(row), reading, time: columns.time(row), line: row as u64 };
            Told::Prognosis(Box::new(prognoser.push(&row)))
        }
        Err(error) => Told::Refused(error.to_string()),
    }
}

#[pymethods]
impl Prognoser {
    #[new]
    #[pyo3(signature = (tables, *, method = "bayes".to_owned(), noise_s = None, start = "healthy".to_owned(),
                        growth = None, life_cycles = None, risk = 0.05, prior = None, empty_is_stalled = false,
                        threads = None))]
    fn new(
        tables: &Bound<'_, Tables>,
        method: String,
        noise_s: Option<f64>,
        start: String,
        growth: Option<String>,
        life_cycles: Option<f64>,
        risk: f64,
        prior: Option<PathBuf>,
        empty_is_stalled: bool,
        threads: Option<usize>,
    ) -> PyResult<Self> {
        let tables = tables.get().bundle();
        let method = Settings { method, noise_s, start, growth, life_cycles, risk, prior }.method()?;
        let count = threads.unwrap_or_else(rayon::current_num_threads).max(1);
        let shards = (0..count).map(|_| prognoser::Prognoser::new(Arc::clone(&tables), method)).collect();
        Ok(Self { tables, method, empty_is_stalled, shards })
    }

    /// Take in one row and give the prognosis after it.
    ///
    /// Parameters
    /// ----------
    /// row : dict, optional
    ///     Values by the names of a log's columns: valve, cycle, close_time_s and open_time_s (s; None or NaN if it was
    ///     not measured, infinity or "stalled" if the valve did not get there), optionally time,
    ///     supply_pressure_UNIT and temperature_UNIT.
    /// **values
    ///     The same as keywords.
    ///
    /// Returns
    /// -------
    /// dict
    ///     The line of ``valve prognose --format jsonl``.
    #[pyo3(signature = (row = None, **values))]
    fn push<'py>(
        &mut self,
        py: Python<'py>,
        row: Option<Bound<'py, PyDict>>,
        values: Option<Bound<'py, PyDict>>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let all = PyDict::new(py);
        for part in [row, values].into_iter().flatten() {
            all.update(part.as_mapping())?;
        }
        let row = row::read(&all, self.empty_is_stalled)?;
        let shard = self.shard_of(&row.valve);
        let row = LogRow { valve: &row.valve, reading: row.reading, time: row.time.as_deref(), line: 0 };
        to_python(py, &prognosis::document(&self.shards[shard].push(&row)))
    }

    /// Take in the rows of a data frame, on all cores and without Python's lock.
    ///
    /// Parameters
    /// ----------
    /// frame : pandas, Polars or pyarrow data frame, or anything with ``__arrow_c_stream__``
    ///     Columns as in a log, see `push`; columns of other names are not used. Nothing of it is copied.
    /// on_error : {"raise", "keep"}
    ///     What to do with what is no row: refuse the whole frame, which leaves the state as it was, or give a row out
    ///     with nothing but the reason in its column ``error``.
    ///
    /// Returns
    /// -------
    /// Rows
    ///     As many rows as went in, in the same order.
    #[pyo3(signature = (frame, *, on_error = "raise"))]
    fn push_frame(&mut self, py: Python<'_>, frame: Bound<'_, PyAny>, on_error: &str) -> PyResult<Rows> {
        let keep = match on_error {
            "raise" => false,
            "keep" => true,
            other => return Err(refused(format!("on_error: found {other:?}, expected \"raise\" or \"keep\""))),
        };
        let batches = frame::read(&frame)?;
        py.detach(|| self.work(&batches, keep)).map(Rows::of)
    }

    /// The names of the valves at hand, sorted.
    #[getter]
    fn valves(&self) -> Vec<String> {
        let mut names: Vec<String> =
            self.shards.iter().flat_map(prognoser::Prognoser::names).map(str::to_owned).collect();
        names.sort_unstable();
        names
    }

    fn __len__(&self) -> usize {
        self.shards.iter().map(prognoser::Prognoser::valves).sum()
    }

    fn __contains__(&self, valve: &str) -> bool {
        self.shards[self.shard_of(valve)].knows(valve)
    }

    /// The last prognosis of a valve; None if it was not seen.
    fn last<'py>(&self, py: Python<'py>, valve: &str) -> PyResult<Option<Bound<'py, PyAny>>> {
        self.shards[self.shard_of(valve)].last(valve).map(|last| to_python(py, &prognosis::document(last))).transpose()
    }

    /// The last prognosis of every valve, by name.
    fn lasts(&self) -> PyResult<Rows> {
        let mut lasts: Vec<_> = self.shards.iter().flat_map(prognoser::Prognoser::lasts).collect();
        lasts.sort_unstable_by(|a, b| a.valve.cmp(&b.valve));
        let mut output = Output::new();
        for one in lasts {
            output.push(&one.valve, &Told::Prognosis(Box::new(one.clone())))?;
        }
        Ok(Rows::of(vec![output.batch()?]))
    }

    /// What is kept of a valve, as bytes; None if it was not seen.
    ///
    /// Only with the method "bayes". The bytes fit this prognoser's tables, settings and version; `resume` refuses
    /// others.
    fn state<'py>(&self, py: Python<'py>, valve: &str) -> PyResult<Option<Bound<'py, PyBytes>>> {
        self.has_state()?;
        let state = self.shards[self.shard_of(valve)].state(valve);
        state.map(|state| Ok(PyBytes::new(py, &self.terms().keep(&state)?))).transpose()
    }

    /// Go on with a valve from what was kept of it.
    fn resume(&mut self, valve: &str, state: &[u8]) -> PyResult<()> {
        self.has_state()?;
        let state: ValveState = self.terms().take_up(state)?;
        let shard = self.shard_of(valve);
        self.resumed(shard, valve, state)
    }

    /// Let go of a valve; what is to be known of it later must have been kept.
    fn forget(&mut self, valve: &str) {
        let shard = self.shard_of(valve);
        self.shards[shard].forget(valve);
    }

    /// What is kept of all valves, as bytes.
    fn to_bytes<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyBytes>> {
        self.has_state()?;
        let state = |name: String| {
            let state = self.shards[self.shard_of(&name)].state(&name);
            state.map(|state| (name, state))
        };
        let kept: Kept = self.valves().into_iter().filter_map(state).collect();
        Ok(PyBytes::new(py, &self.terms().keep(&kept)?))
    }

    /// Go on with all valves from what `to_bytes` gave; valves that are at hand and not among them stay.
    fn load_bytes(&mut self, state: &[u8]) -> PyResult<()> {
        self.has_state()?;
        let kept: Kept = self.terms().take_up(state)?;
        for (valve, state) in kept {
            let shard = self.shard_of(&valve);
            self.resumed(shard, &valve, state)?;
        }
        Ok(())
    }

    fn __repr__(&self) -> String {
        format!("<Prognoser of {} valves, method {}>", self.__len__(), self.method.name())
    }
}

impl Prognoser {
    fn has_state(&self) -> PyResult<()> {
        match self.method {
            Method::Bayes(_) => Ok(()),
            Method::Ols => Err(refused("method \"ols\" keeps no state; use \"bayes\"")),
        }
    }

    fn resumed(&mut self, shard: usize, valve: &str, state: ValveState) -> PyResult<()> {
        if self.shards[shard].resume(valve, state) {
            return Ok(());
        }
        Err(refused("the state was kept by another version; begin anew from the log"))
    }
}
