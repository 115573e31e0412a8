//! Simulated cycles of one valve.

use answers::strokes::{Cycles, instants};
use answers::{figures, simulation};
use numpy::PyArray1;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use valve_model::Conditions;

use crate::answer::to_python;
use crate::error::refused;
use crate::figure::Figure;

/// Cycles in a trace at most: its rows would fill the memory.
const TRACE_CYCLES: u32 = 100;

/// Cycles of a valve under some conditions.
#[pyclass(frozen, module = "valve_prognosis")]
pub struct Simulation {
    file: valve_file::ValveFile,
    conditions: Conditions,
    cycles: u32,
    step_s: f64,
    times_s: Vec<[Option<f64>; 2]>,
}

impl Simulation {
    /// Simulates.
    pub fn new(
        py: Python<'_>,
        file: valve_file::ValveFile,
        conditions: Conditions,
        cycles: u32,
        step_s: f64,
    ) -> PyResult<Self> {
        if cycles == 0 || !(step_s > 0.0 && step_s.is_finite()) {
            return Err(refused(format!("found cycles = {cycles} and step_s = {step_s}, expected both above 0")));
        }
        let times_s = py.detach(|| simulation::times_s(&file, conditions, cycles as usize, step_s));
        Ok(Self { file, conditions, cycles, step_s, times_s })
    }

    fn path(&self, py: Python<'_>) -> PyResult<Cycles> {
        if self.cycles > TRACE_CYCLES {
            return Err(refused(format!(
                "a trace of {} cycles is too long, expected at most {TRACE_CYCLES}",
                self.cycles
            )));
        }
        let (valve, schedule) = (self.file.valve(), self.file.schedule());
        Ok(py.detach(|| Cycles::simulate(valve, self.conditions, &schedule, self.cycles, self.step_s)))
    }

    fn times<'py>(&self, py: Python<'py>, stroke: usize) -> Bound<'py, PyArray1<f64>> {
        PyArray1::from_iter(py, self.times_s.iter().map(|times| times[stroke].unwrap_or(f64::NAN)))
    }
}

#[pymethods]
impl Simulation {
    /// Closing time of each cycle, s, shape (cycles,); NaN where the valve did not get there.
    #[getter]
    fn close_time_s<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        self.times(py, 0)
    }

    /// Opening time of each cycle, s, shape (cycles,); NaN where the valve did not get there.
    #[getter]
    fn open_time_s<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        self.times(py, 1)
    }

    /// The same as the program prints it with ``--format json``.
    #[getter]
    fn document<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        to_python(py, &simulation::document(&self.file, &self.conditions, &self.times_s))
    }

    /// What the sensors of the valve record, sampled evenly.
    ///
    /// Parameters
    /// ----------
    /// spacing_s : float
    ///     Time between two samples, s.
    ///
    /// Returns
    /// -------
    /// dict of str to array of shape (samples,)
    ///     time_s, command (1: to close), position_m (0: closed), chamber_pressure_pa and pipe_pressure_pa (absolute).
    #[pyo3(signature = (spacing_s = 1e-3))]
    fn trace<'py>(&self, py: Python<'py>, spacing_s: f64) -> PyResult<Bound<'py, PyDict>> {
        if !(spacing_s > 0.0 && spacing_s.is_finite()) {
            return Err(refused(format!("spacing_s: found {spacing_s}, expected a time above 0 s")));
        }
        let path = self.path(py)?;
        let times = instants(path.nodes.time_s.last().copied().unwrap_or(0.0), spacing_s);
        let record = path.record(self.file.valve(), &times);
        let command: Vec<i64> = times.iter().map(|time| i64::from(path.is_closing_at(*time))).collect();
        let all = PyDict::new(py);
        all.set_item("time_s", PyArray1::from_vec(py, times))?;
        all.set_item("command", PyArray1::from_vec(py, command))?;
        all.set_item("position_m", PyArray1::from_vec(py, record.position_m))?;
        all.set_item("chamber_pressure_pa", PyArray1::from_vec(py, record.chamber_pressure_pa))?;
        all.set_item("pipe_pressure_pa", PyArray1::from_vec(py, record.pipe_pressure_pa))?;
        Ok(all)
    }

    /// Strokes, pressures and commands over time.
    fn figure(&self, py: Python<'_>) -> PyResult<Figure> {
        let path = self.path(py)?;
        Ok(Figure::of(figures::simulation::trace(&self.file, &self.conditions, &path).figure()))
    }

    fn _repr_svg_(&self, py: Python<'_>) -> PyResult<String> {
        Ok(self.figure(py)?.html())
    }

    fn __repr__(&self) -> String {
        format!("<Simulation of {:?}: {} cycles>", self.file.name(), self.cycles)
    }
}
