//! How good the prognosis of a valve is.

use answers::evaluation::Study;
use lut_builder::Request;
use prognoser::study::StudyConfig;
use pyo3::prelude::*;

use crate::answer::Answer;
use crate::error::refused;
use crate::valve::ValveFile;

/// Run many lives with known ends through the prognosis, as ``valve evaluate`` does.
///
/// Parameters
/// ----------
/// valve : ValveFile
///     The valve.
/// cycles : float
///     Cycles of each life.
/// noise_variance_s2 : sequence of float
///     Variances of a time's noise, s2.
/// seeds, first_seed : int
///     Lives for each fault and noise, and the first of their seeds.
/// alpha : float
///     Half width of the accuracy cone, a fraction.
///
/// Returns
/// -------
/// Answer
///     With the figure "accuracy".
#[pyfunction]
#[pyo3(signature = (valve, *, cycles = 25.0, noise_variance_s2 = vec![0.0, 1e-4, 1e-3, 1e-2], seeds = 300, first_seed = 1,
                    alpha = 0.1))]
pub fn evaluate(
    py: Python<'_>,
    valve: &ValveFile,
    cycles: f64,
    noise_variance_s2: Vec<f64>,
    seeds: u64,
    first_seed: u64,
    alpha: f64,
) -> PyResult<Answer> {
    let positive = |value: f64| value > 0.0 && value.is_finite();
    let noise_is_fine = noise_variance_s2.iter().all(|value| *value >= 0.0 && value.is_finite());
    if !positive(cycles) || !positive(alpha) || seeds == 0 || !noise_is_fine {
        return Err(refused("expected cycles, alpha and seeds above 0 and noise variances of 0 or more"));
    }
    let config = StudyConfig {
        end_cycle: cycles,
        noise_variances_s2: noise_variance_s2,
        seeds,
        first_seed,
        alpha,
        ..StudyConfig::default()
    };
    let study = py.detach(|| {
        let built = answers::tables::build(&valve.0, &Request::default(), &|_| {}).map_err(refused)?;
        Ok::<_, PyErr>(Study::run(&valve.0, &built.bundle, &config, &|_, _| ()))
    })?;
    let figure = study.figure().figure();
    let headline = format!("{}: relative accuracy of the remaining life over {seeds} lives", study.valve);
    Answer::new(py, headline, serde_json::to_value(&study).map_err(refused)?, vec![("accuracy", figure)], None)
}
