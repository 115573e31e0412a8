//! The model beside recorded strokes.

use std::path::PathBuf;
use std::thread;
use std::time::Duration;

use answers::adoption::{Adoption, AdoptionError, needs_formula, with_formula};
use answers::comparison::Compared;
use answers::{CampaignInput, calibration, comparison, error, explanation, figures};
use identify::Stop;
use model_lab::calibrate::Calibration;
use model_lab::diagnosis::{DiagnoseOptions, Explanation, explain};
use model_lab::residual_force::ResidualForce;
use pyo3::prelude::*;

use crate::answer::Answer;
use crate::error::{refused, refused_with_hint};
use crate::valve::ValveFile;

/// How often a search looks whether somebody wants it to end.
const LOOK: Duration = Duration::from_millis(100);

/// Recorded strokes beside the valve on which they were recorded.
#[pyclass(frozen, module = "valve_prognosis")]
pub struct Campaign(CampaignInput);

fn adoption_error(error: AdoptionError) -> PyErr {
    let hint = error.hint();
    refused_with_hint(error, hint)
}

/// Whether somebody wants the call to end.
#[expect(clippy::redundant_closure_for_method_calls, reason = "the method is of one lifetime, the call of any")]
fn python_signals() -> PyResult<()> {
    Python::attach(|py| py.check_signals())
}

impl Campaign {
    /// Searches for what is missing; Ctrl-C ends the search, and the call.
    fn search(&self, py: Python<'_>, options: &DiagnoseOptions) -> PyResult<Explanation> {
        let (input, stop) = (&self.0, Stop::new());
        let answer = py.detach(|| {
            thread::scope(|scope| {
                let search = scope.spawn(|| explain(&input.file, &input.campaign, options, &|_| (), &stop));
                let mut wanted = Ok(());
                while !search.is_finished() && wanted.is_ok() {
                    thread::park_timeout(LOOK);
                    wanted = python_signals();
                }
                if wanted.is_err() {
                    stop.ask();
                }
                let answer =
                    search.join().map_err(|_| refused("the search ended with a fault of its own; please report it"))?;
                wanted.map(|()| answer)
            })
        })?;
        answer.ok_or_else(|| refused(format!("{}: its strokes cannot be simulated", input.file.file_name())))
    }
}

#[pymethods]
impl Campaign {
    /// Read a campaign file beside a valve file.
    #[staticmethod]
    fn read(valve: &ValveFile, path: PathBuf) -> PyResult<Self> {
        CampaignInput::of(valve.0.clone(), &path).map(Self).map_err(|error| {
            let hint = error.hint();
            refused_with_hint(error, hint)
        })
    }

    /// The campaign's name.
    #[getter]
    fn name(&self) -> &str {
        &self.0.campaign.name
    }

    /// The valve file.
    #[getter]
    fn valve(&self) -> ValveFile {
        ValveFile(self.0.file.clone())
    }

    /// What looks wrong in either file and can be used all the same, a sentence each.
    #[getter]
    fn doubts(&self) -> Vec<String> {
        self.0.doubts()
    }

    /// How large the model's error is, in which phase and under which conditions.
    ///
    /// Parameters
    /// ----------
    /// against : ValveFile, optional
    ///     Another model of the same valve, beside the same strokes.
    /// residual_force : bool
    ///     Tell the force that the model lacks, too.
    ///
    /// Returns
    /// -------
    /// Answer
    ///     With the figures "strokes" and "strips", and "missing_force" if it was asked for.
    #[pyo3(signature = (*, against = None, residual_force = false))]
    fn compare(&self, py: Python<'_>, against: Option<ValveFile>, residual_force: bool) -> PyResult<Answer> {
        let input = &self.0;
        let beside = |file: &valve_file::ValveFile| {
            Compared::new(input, file)
                .ok_or_else(|| refused(format!("{}: its strokes cannot be simulated", file.file_name())))
        };
        let (compared, against, force) = py.detach(|| -> PyResult<_> {
            let compared = beside(&input.file)?;
            let against = against.as_ref().map(|file| Ok::<_, PyErr>((&file.0, beside(&file.0)?))).transpose()?;
            let force = residual_force
                .then(|| ResidualForce::new(&input.data, input.file.valve(), input.file.tolerances()))
                .flatten();
            Ok((compared, against, force))
        })?;
        let comparison = &compared.comparison;
        let told = error::words(&comparison.overall.errors, &|metres| format!("{:.4} mm", 1e3 * metres));
        let mut drawn = Vec::new();
        if !input.data.runs.is_empty() {
            drawn.push(("strokes", figures::comparison::overlay(input, comparison, &told).figure()));
            drawn.push(("strips", figures::comparison::strips(input, comparison, against.as_ref()).figure()));
        }
        if let Some(force) = &force {
            drawn.push(("missing_force", figures::comparison::missing_force(force).figure()));
        }
        let headline = comparison.words().first().cloned().unwrap_or_else(|| format!("error: {told}"));
        let document = comparison::document(input, &compared, against.as_ref(), force.as_ref());
        Answer::new(py, headline, document, drawn, None)
    }

    /// Fit the parameters that have a tolerance.
    ///
    /// Returns
    /// -------
    /// Answer
    ///     With the figure "parameters"; its ``valve`` has the fitted values, and is None where they would only stand in
    ///     for what is missing.
    fn calibrate(&self, py: Python<'_>) -> PyResult<Answer> {
        let input = &self.0;
        let calibration =
            py.detach(|| Calibration::new(&input.file, &input.campaign, Stop::never())).map_err(refused)?;
        let valve = if calibration.has_prior_conflict {
            None
        } else {
            Some(ValveFile(calibration.adopted(&input.file, &input.campaign.name).map_err(refused)?))
        };
        let drawn = vec![("parameters", figures::calibration::shifts(input, &calibration).figure())];
        let headline = calibration::verdict_words(&calibration).to_owned();
        Answer::new(py, headline, calibration::document(input, &calibration), drawn, valve)
    }

    /// Which physical effect the model lacks.
    ///
    /// Parameters
    /// ----------
    /// good_enough_m : float, optional
    ///     An error on what was held out that is good enough, m.
    ///
    /// Returns
    /// -------
    /// Answer
    ///     With the figures "candidates" and "steps", and where there is one "missing" and "experiment".
    #[pyo3(signature = (*, good_enough_m = None))]
    fn explain(&self, py: Python<'_>, good_enough_m: Option<f64>) -> PyResult<Answer> {
        let options = DiagnoseOptions { good_enough_m, ..DiagnoseOptions::default() };
        let answer = self.search(py, &options)?;
        let (name, headline) = (&self.0.campaign.name, explanation::headline(&answer));
        let steps = figures::explanation::steps(&answer);
        let mut drawn = vec![
            ("candidates", figures::explanation::leaderboard(&answer, name, &headline).figure()),
            ("steps", figures::explanation::staircase(name, &headline, &steps).figure()),
        ];
        if let Some(discrepancy) = &answer.discrepancy {
            drawn.push(("missing", figures::explanation::unexplained(discrepancy, name).figure()));
        }
        drawn.extend(figures::explanation::next_experiment(&answer).map(|figure| ("experiment", figure.figure())));
        Answer::new(py, headline, explanation::document(&answer, &self.0), drawn, None)
    }

    /// Add effects and refit everything.
    ///
    /// Parameters
    /// ----------
    /// effects : sequence of str
    ///     Ids of effects of the catalogue, names of the valve file's own, or "unexplained" for the formula that
    ///     `explain` finds where no effect fits.
    ///
    /// Returns
    /// -------
    /// Answer
    ///     Its ``valve`` is the new valve file, with the step in its history; with the figure "steps".
    fn adopt(&self, py: Python<'_>, effects: Vec<String>) -> PyResult<Answer> {
        let input = &self.0;
        let file = if needs_formula(&input.file, &effects) {
            let answer = self.search(py, &DiagnoseOptions::default())?;
            with_formula(&input.file, &answer).map_err(adoption_error)?
        } else {
            input.file.clone()
        };
        let adoption = py.detach(|| Adoption::new(&file, &input.campaign, &effects)).map_err(adoption_error)?;
        let figure = figures::explanation::staircase(&input.campaign.name, &adoption.action, &adoption.steps());
        let headline = format!("{} on {}", adoption.action, input.campaign.name);
        let valve = ValveFile(adoption.file.clone());
        Answer::new(py, headline, adoption.document(), vec![("steps", figure.figure())], Some(valve))
    }

    fn __repr__(&self) -> String {
        format!("<Campaign {:?}: {} runs>", self.0.campaign.name, self.0.campaign.runs.len())
    }
}
