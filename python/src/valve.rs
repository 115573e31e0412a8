//! Valve files.

use std::path::PathBuf;

use lut_builder::Request;
use numpy::PyArrayLike1;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use quantity::suggest::did_you_mean;
use valve_model::simulate::DEFAULT_STEP_S;
use valve_model::{Conditions, Effect, EffectKind, ParameterId};

use crate::batch::{Spread, Strokes, simulate};
use crate::error::refused;
use crate::simulation::Simulation;
use crate::tables::Tables;

/// A valve file that passed every check: what the valve is made of, the commands of its cycle, its limits.
///
/// It cannot be changed; methods give new ones. ``str(file)`` is its text.
#[pyclass(frozen, from_py_object, module = "valve_prognosis")]
#[derive(Clone)]
pub struct ValveFile(pub valve_file::ValveFile);

/// The parameter of a dotted key.
pub fn parameter(key: &str) -> PyResult<ParameterId> {
    let all = ParameterId::ALL.iter();
    all.clone()
        .find(|id| id.key() == key)
        .copied()
        .ok_or_else(|| refused(format!("there is no parameter {key:?}{}", did_you_mean(key, all.map(|id| id.key())))))
}

/// Conditions: those of the valve file, or others.
pub fn conditions(
    file: &valve_file::ValveFile,
    supply_pressure_pa: Option<f64>,
    temperature_k: Option<f64>,
    leak_to_atmosphere_m2: f64,
    leak_from_supply_m2: f64,
) -> PyResult<Conditions> {
    let nominal = Conditions::nominal(file.valve().parameters());
    let conditions = Conditions {
        supply_pressure_pa: supply_pressure_pa.unwrap_or(nominal.supply_pressure_pa),
        temperature_k: temperature_k.unwrap_or(nominal.temperature_k),
        leak_to_atmosphere_m2,
        leak_from_supply_m2,
    };
    conditions.check().map_err(refused)?;
    Ok(conditions)
}

/// The timing log that comes along, as CSV text: 25 cycles of a leaking valve, one missing, one time mistyped.
#[pyfunction]
pub fn leaking_log() -> &'static str {
    answers::samples::LEAKING_LOG
}

#[pymethods]
impl ValveFile {
    /// Read and check a valve file.
    #[staticmethod]
    fn read(path: PathBuf) -> PyResult<Self> {
        valve_file::ValveFile::read(&path).map(Self).map_err(refused)
    }

    /// Check the text of a valve file; ``name`` is what messages call it.
    #[staticmethod]
    #[pyo3(signature = (text, name = "valve.toml"))]
    fn parse(text: &str, name: &str) -> PyResult<Self> {
        valve_file::ValveFile::parse(text, name).map(Self).map_err(refused)
    }

    /// The valve of the paper that the method comes from.
    #[staticmethod]
    fn reference() -> Self {
        Self(answers::samples::reference_valve())
    }

    /// The valve's name.
    #[getter]
    fn name(&self) -> &str {
        self.0.name()
    }

    /// What messages call the file.
    #[getter]
    fn file_name(&self) -> &str {
        self.0.file_name()
    }

    /// The whole text.
    #[getter]
    fn text(&self) -> &str {
        self.0.text()
    }

    /// The hash that tables of this valve carry.
    #[getter]
    fn model_hash(&self) -> String {
        answers::tables::hash_of(&self.0)
    }

    /// What looks wrong and can be used all the same, a sentence each.
    #[getter]
    fn doubts(&self) -> Vec<String> {
        self.0.doubts().iter().map(ToString::to_string).collect()
    }

    /// The parameters by their dotted keys, SI units, pressures absolute; `parameter_units` has the units.
    #[getter]
    fn parameters<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let all = PyDict::new(py);
        for id in ParameterId::ALL {
            all.set_item(id.key(), self.0.valve().parameters().get(*id))?;
        }
        Ok(all)
    }

    /// The SI unit of each parameter.
    #[staticmethod]
    fn parameter_units(py: Python<'_>) -> PyResult<Bound<'_, PyDict>> {
        let all = PyDict::new(py);
        for id in ParameterId::ALL {
            all.set_item(id.key(), id.si_unit())?;
        }
        Ok(all)
    }

    /// When a cycle gives its commands and ends, s: close_at_s, open_at_s, end_s.
    #[getter]
    fn schedule<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let schedule = self.0.schedule();
        let all = PyDict::new(py);
        all.set_item("close_at_s", schedule.close_at_s)?;
        all.set_item("open_at_s", schedule.open_at_s)?;
        all.set_item("end_s", schedule.end_s)?;
        Ok(all)
    }

    /// The longest acceptable stroke times, s: close_within_s, open_within_s.
    #[getter]
    fn limits<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let limits = self.0.limits();
        let all = PyDict::new(py);
        all.set_item("close_within_s", limits.close_within_s)?;
        all.set_item("open_within_s", limits.open_within_s)?;
        Ok(all)
    }

    /// The ids of the effects that the file adds to the base model.
    #[getter]
    fn effects(&self) -> Vec<String> {
        let custom = self.0.valve().custom().iter().map(|effect| effect.name().to_owned());
        self.0.valve().effects().iter().map(|effect| effect.kind().id().to_owned()).chain(custom).collect()
    }

    /// The file with other values of parameters, SI, by their dotted keys.
    fn with_parameters(&self, values: Bound<'_, PyDict>) -> PyResult<Self> {
        let mut moved = Vec::new();
        for (key, value) in values {
            moved.push((parameter(key.extract()?)?, value.extract()?));
        }
        self.0.with_parameters(&moved).map(Self).map_err(refused)
    }

    /// The file with an effect of the catalogue; its parameters, SI, by name, those that have a default may be left out.
    #[pyo3(signature = (id, **values))]
    fn with_effect(&self, id: &str, values: Option<Bound<'_, PyDict>>) -> PyResult<Self> {
        let kind = EffectKind::from_id(id).ok_or_else(|| {
            let known = EffectKind::ALL.iter().map(|kind| kind.id());
            refused(format!("there is no effect {id:?}{}", did_you_mean(id, known)))
        })?;
        let mut given = vec![None; kind.parameters().len()];
        for (name, value) in values.into_iter().flatten() {
            let name: String = name.extract()?;
            let names = || kind.parameters().iter().map(|parameter| parameter.name);
            let place = names().position(|known| known == name).ok_or_else(|| {
                refused(format!("{id}: there is no parameter {name:?}{}", did_you_mean(&name, names())))
            })?;
            given[place] = Some(value.extract()?);
        }
        let effect = Effect::new(kind, &given).map_err(refused)?;
        self.0.with_effect(&effect).map(Self).map_err(refused)
    }

    /// Write the file.
    fn write(&self, path: PathBuf) -> PyResult<()> {
        Ok(std::fs::write(path, self.0.text())?)
    }

    /// Simulate cycles from rest, each from where the one before ended.
    ///
    /// Parameters
    /// ----------
    /// supply_pressure_pa : float, optional
    ///     Absolute supply pressure, Pa; that of the file unless given.
    /// temperature_k : float, optional
    ///     Temperature, K; that of the file unless given.
    /// leak_to_atmosphere_m2, leak_from_supply_m2 : float
    ///     Areas of leaks from the pipe to the atmosphere and from the supply into it, m2.
    /// cycles : int
    ///     How many cycles.
    /// step_s : float
    ///     Longest step of the integrator, s.
    #[pyo3(signature = (*, supply_pressure_pa = None, temperature_k = None, leak_to_atmosphere_m2 = 0.0,
                        leak_from_supply_m2 = 0.0, cycles = 1, step_s = DEFAULT_STEP_S))]
    fn simulate(
        &self,
        py: Python<'_>,
        supply_pressure_pa: Option<f64>,
        temperature_k: Option<f64>,
        leak_to_atmosphere_m2: f64,
        leak_from_supply_m2: f64,
        cycles: u32,
        step_s: f64,
    ) -> PyResult<Simulation> {
        let conditions =
            conditions(&self.0, supply_pressure_pa, temperature_k, leak_to_atmosphere_m2, leak_from_supply_m2)?;
        Simulation::new(py, self.0.clone(), conditions, cycles, step_s)
    }

    /// Simulate many variants of the valve side by side, on all cores and without Python's lock.
    ///
    /// Parameters
    /// ----------
    /// parameters : dict of str to array of shape (n,), optional
    ///     Values of parameters by their dotted keys, SI; a number stands for all variants.
    /// supply_pressure_pa, temperature_k, leak_to_atmosphere_m2, leak_from_supply_m2 : float or array of shape (n,)
    ///     Conditions of each variant; pressure and temperature are the variant's own parameters unless given.
    /// cycles : int
    ///     Cycles of each variant; cycles that repeat are not simulated again.
    /// step_s : float
    ///     Longest step of the integrator, s.
    ///
    /// Returns
    /// -------
    /// Strokes
    ///     Arrays of shape (n, cycles), s; NaN where a stroke did not get there.
    #[pyo3(signature = (parameters = None, *, supply_pressure_pa = None, temperature_k = None,
                        leak_to_atmosphere_m2 = None, leak_from_supply_m2 = None, cycles = 1, step_s = DEFAULT_STEP_S))]
    fn simulate_many(
        &self,
        py: Python<'_>,
        parameters: Option<Bound<'_, PyDict>>,
        supply_pressure_pa: Option<Given<'_>>,
        temperature_k: Option<Given<'_>>,
        leak_to_atmosphere_m2: Option<Given<'_>>,
        leak_from_supply_m2: Option<Given<'_>>,
        cycles: usize,
        step_s: f64,
    ) -> PyResult<Strokes> {
        let mut spread = Spread::default();
        for (key, values) in parameters.into_iter().flatten() {
            let key: String = key.extract()?;
            let given: Given<'_> = values.extract()?;
            spread.parameters.push((parameter(&key)?, given.values(&key, &mut spread.count)?));
        }
        let given = [
            ("supply_pressure_pa", supply_pressure_pa),
            ("temperature_k", temperature_k),
            ("leak_to_atmosphere_m2", leak_to_atmosphere_m2),
            ("leak_from_supply_m2", leak_from_supply_m2),
        ];
        for (place, (name, given)) in given.into_iter().enumerate() {
            spread.conditions[place] = given.map(|given| given.values(name, &mut spread.count)).transpose()?;
        }
        simulate(py, &self.0, &spread, cycles, step_s)
    }

    /// Build tables from leaks and other wear to stroke times.
    ///
    /// Parameters
    /// ----------
    /// wears : sequence of str
    ///     "all", "leaks", or ids of kinds of wear; the leaks are always among them. All unless given, as in the program.
    /// supply_pressure_pa, temperature_k : (float, float), optional
    ///     Build them over conditions too: absolute pressure, Pa, and temperature, K, from and to.
    #[pyo3(signature = (wears = vec!["all".to_owned()], *, supply_pressure_pa = None, temperature_k = None))]
    fn build_tables(
        &self,
        py: Python<'_>,
        wears: Vec<String>,
        supply_pressure_pa: Option<(f64, f64)>,
        temperature_k: Option<(f64, f64)>,
    ) -> PyResult<Tables> {
        let wears = answers::tables::wears(&wears).map_err(refused)?;
        let own = self.0.valve().parameters();
        let conditions = if supply_pressure_pa.is_none() && temperature_k.is_none() {
            None
        } else {
            let range = leak_table::ConditionRange {
                supply_pressure_pa: supply_pressure_pa.unwrap_or((own.supply_pressure_pa, own.supply_pressure_pa)),
                temperature_k: temperature_k.unwrap_or((own.temperature_k, own.temperature_k)),
            };
            range.check_ends().map_err(refused)?;
            Some(range)
        };
        let request = Request { wears, conditions, both_leaks: true };
        let built = py.detach(|| answers::tables::build(&self.0, &request, &|_| {})).map_err(refused)?;
        Ok(Tables::built(built))
    }

    fn __str__(&self) -> &str {
        self.0.text()
    }

    fn __repr__(&self) -> String {
        format!("<ValveFile {:?} from {}>", self.0.name(), self.0.file_name())
    }

    fn __reduce__<'py>(&self, py: Python<'py>) -> PyResult<(Bound<'py, PyAny>, (String, String))> {
        let parse = py.get_type::<Self>().getattr("parse")?;
        Ok((parse, (self.0.text().to_owned(), self.0.file_name().to_owned())))
    }
}

/// One value for all variants, or one for each.
#[derive(FromPyObject)]
enum Given<'py> {
    All(f64),
    Each(PyArrayLike1<'py, f64, numpy::AllowTypeChange>),
}

impl Given<'_> {
    /// The values; `count` is how many variants there are, once that is known.
    fn values(self, name: &str, count: &mut Option<usize>) -> PyResult<Vec<f64>> {
        let values = match self {
            Self::All(value) => return Ok(vec![value]),
            Self::Each(values) => values.as_array().to_vec(),
        };
        match count {
            Some(count) if *count != values.len() => {
                Err(refused(format!("{name}: found {} values, expected {count} as in the others", values.len())))
            }
            _ => {
                *count = Some(values.len());
                Ok(values)
            }
        }
    }
}
