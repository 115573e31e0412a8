//! Many variants of a valve at once.

use numpy::{PyArray1, PyArray2};
use pyo3::prelude::*;
use rayon::prelude::*;
use valve_model::cycle::{CycleTimes, cycles};
use valve_model::real::LANES;
use valve_model::{Conditions, ParameterId, Valve};

use crate::error::refused;

/// Variants simulated as one batch: whole lanes, and enough of them that a lane that is done takes the next.
const BATCH: usize = 8 * LANES;

/// Closing and opening times, s, cycle by cycle.
type Times = (Vec<f64>, Vec<f64>);

/// What differs from variant to variant: as many values as there are variants, or one for all.
#[derive(Default)]
pub struct Spread {
    /// Number of variants, where anything tells it.
    pub count: Option<usize>,
    /// Parameters.
    pub parameters: Vec<(ParameterId, Vec<f64>)>,
    /// Supply pressure, temperature, leak to the atmosphere, leak from the supply.
    pub conditions: [Option<Vec<f64>>; 4],
}

impl Spread {
    fn variant(&self, file: &valve_file::ValveFile, index: usize) -> Result<(Valve, Conditions), String> {
        let at = |values: &[f64]| if values.len() == 1 { values[0] } else { values[index] };
        let base = file.valve();
        let mut parameters = base.parameters().clone();
        for (id, values) in &self.parameters {
            parameters.set(*id, at(values));
        }
        let mut conditions = Conditions::nominal(&parameters);
        let [supply, temperature, atmosphere, from_supply] =
            self.conditions.each_ref().map(|one| one.as_deref().map(at));
        conditions.supply_pressure_pa = supply.unwrap_or(conditions.supply_pressure_pa);
        conditions.temperature_k = temperature.unwrap_or(conditions.temperature_k);
        conditions.leak_to_atmosphere_m2 = atmosphere.unwrap_or(0.0);
        conditions.leak_from_supply_m2 = from_supply.unwrap_or(0.0);
        let valve = Valve::new(parameters, base.switches(), base.effects().to_vec(), base.custom().to_vec());
        let checked = valve.and_then(|valve| conditions.check().map(|()| (valve, conditions)));
        checked.map_err(|error| format!("variant {index}: {error}"))
    }
}

/// Stroke times of many variants.
#[pyclass(frozen, module = "valve_prognosis")]
pub struct Strokes {
    close: Py<PyArray2<f64>>,
    open: Py<PyArray2<f64>>,
}

#[pymethods]
impl Strokes {
    /// Closing times, s, shape (n, cycles); NaN where the valve did not get there.
    #[getter]
    fn close_time_s<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray2<f64>> {
        self.close.bind(py).clone()
    }

    /// Opening times, s, shape (n, cycles); NaN where the valve did not get there.
    #[getter]
    fn open_time_s<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray2<f64>> {
        self.open.bind(py).clone()
    }
}

/// Simulates all variants.
pub fn simulate(
    py: Python<'_>,
    file: &valve_file::ValveFile,
    spread: &Spread,
    wanted: usize,
    step_s: f64,
) -> PyResult<Strokes> {
    if wanted == 0 || !(step_s > 0.0 && step_s.is_finite()) {
        return Err(refused(format!("found cycles = {wanted} and step_s = {step_s}, expected both above 0")));
    }
    let count = spread.count.unwrap_or(1);
    let (close, open) = py
        .detach(|| {
            let indices: Vec<usize> = (0..count).collect();
            let batches: Result<Vec<Times>, String> = indices
                .par_chunks(BATCH)
                .map(|batch| {
                    let variants =
                        batch.iter().map(|index| spread.variant(file, *index)).collect::<Result<Vec<_>, _>>()?;
                    let runs: Vec<(&Valve, Conditions)> =
                        variants.iter().map(|(valve, conditions)| (valve, *conditions)).collect();
                    Ok(columns(&cycles(&runs, &file.schedule(), wanted, step_s), wanted))
                })
                .collect();
            let mut all = (Vec::with_capacity(count * wanted), Vec::with_capacity(count * wanted));
            for (close, open) in batches? {
                all.0.extend(close);
                all.1.extend(open);
            }
            Ok(all)
        })
        .map_err(|error: String| refused(error))?;
    let shaped = |values: Vec<f64>| -> PyResult<Py<PyArray2<f64>>> {
        use numpy::PyArrayMethods;
        Ok(PyArray1::from_vec(py, values).reshape([count, wanted])?.unbind())
    };
    Ok(Strokes { close: shaped(close)?, open: shaped(open)? })
}

/// Row by row, the last cycle repeated where cycles were periodic before.
fn columns(all: &[Vec<CycleTimes>], wanted: usize) -> Times {
    let time = |one: Option<f64>| one.unwrap_or(f64::NAN);
    let times = all.iter().flat_map(|times| (0..wanted).map(|cycle| times[cycle.min(times.len() - 1)]));
    times.map(|one| (time(one.close_time_s), time(one.open_time_s))).unzip()
}
