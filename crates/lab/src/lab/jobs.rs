//! Work that takes seconds: a fit, a search. One at a time, told of as it goes, stopped when somebody asks.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread;
use std::time::Instant;

use answers::{CampaignInput, calibration, explanation, steps};
use identify::Stop;
use model_lab::calibrate::Calibration;
use model_lab::diagnosis::adopt::sequence;
use model_lab::diagnosis::{DiagnoseOptions, Progress, explain};
use model_lab::errors::StepReport;
use model_lab::space::Target;
use serde::{Deserialize, Serialize};
use serde_json::{Map, Value, json};
use valve_model::EffectKind;

use super::answer::{Found, answer, sliders};
use super::model::Model;
use super::subject::Subject;
use super::told::Told;
use crate::events::Events;
use crate::site::Refusal;

/// What is wanted.
#[derive(Debug, Clone, Deserialize)]
#[serde(tag = "job", rename_all = "kebab-case", deny_unknown_fields)]
pub enum Wanted {
    /// Fits the tolerated parameters and the effects of a model that are on.
    Fit {
        /// The model.
        model: Model,
    },
    /// Searches for what the valve file's model lacks.
    Explain,
}

/// What runs, for the pages.
#[derive(Debug, Clone, Serialize)]
pub struct Status {
    number: u64,
    running: Option<Running>,
}

#[derive(Debug, Clone, Serialize)]
struct Running {
    kind: &'static str,
    seconds: f64,
}

/// A job that has begun.
#[derive(Debug, Clone, Serialize)]
pub struct Started {
    job: u64,
    kind: &'static str,
}

/// How a job has ended.
#[derive(Debug, Serialize)]
struct Answer {
    job: u64,
    seconds: Option<f64>,
    #[serde(flatten)]
    outcome: Outcome,
}

#[derive(Debug, Serialize)]
#[serde(untagged)]
enum Outcome {
    Done {
        version: u64,
        #[serde(flatten)]
        result: JobResult,
    },
    Failed {
        error: String,
    },
}

#[derive(Debug, Serialize)]
#[serde(untagged)]
enum JobResult {
    Fitted(Box<Fitted>),
    Explained(Box<Found>),
}

/// What a fit has found.
#[derive(Debug, Serialize)]
struct Fitted {
    how: &'static str,
    headline: String,
    model: Model,
    steps: Vec<steps::StepDocument>,
    /// Of a fit with effects: their values.
    #[serde(skip_serializing_if = "Option::is_none")]
    parameters: Option<Vec<explanation::EffectParameterDocument>>,
    /// Of a fit without: what `valve calibrate` tells programs.
    #[serde(skip_serializing_if = "Option::is_none")]
    calibration: Option<Value>,
}

/// A job as the pages know it.
#[derive(Debug, Default)]
struct State {
    number: u64,
    running: Option<(&'static str, Instant, Arc<Stop>)>,
    /// The last answer of each kind, by its name.
    answers: Map<String, Value>,
}

/// The jobs of a lab.
#[derive(Debug, Clone)]
pub struct Jobs {
    events: Events,
    state: Arc<Mutex<State>>,
}

impl Jobs {
    /// None yet.
    pub fn new(events: Events) -> Self {
        Self { events, state: Arc::default() }
    }

    fn state(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// What runs, if anything does.
    pub fn status(&self) -> Status {
        let state = self.state();
        let running = state.running.as_ref();
        Status {
            number: state.number,
            running: running.map(|(kind, since, _)| Running { kind, seconds: since.elapsed().as_secs_f64() }),
        }
    }

    /// The last answers, each by the kind of its job.
    pub fn last(&self) -> Value {
        Value::Object(self.state().answers.clone())
    }

    /// Asks the job that runs to stop.
    pub fn stop(&self) -> Value {
        let asked = self.state().running.as_ref().map(|(_, _, stop)| stop.ask()).is_some();
        json!({ "asked": asked })
    }

    /// Starts a job; refused while another runs.
    pub fn start(&self, subject: Arc<Subject>, wanted: Wanted) -> Result<Started, Refusal> {
        let kind = match wanted {
            Wanted::Fit { .. } => "fit",
            Wanted::Explain => "explain",
        };
        let stop = Arc::new(Stop::new());
        let number = {
            let mut state = self.state();
            if let Some((kind, ..)) = &state.running {
                return Err(Refusal::conflict(format!("wait for what runs ({kind}), or stop it")));
            }
            state.number += 1;
            state.running = Some((kind, Instant::now(), Arc::clone(&stop)));
            state.number
        };
        self.events.tell(&Told::Started { job: number, kind });
        let jobs = self.clone();
        thread::spawn(move || {
            // A job that panics is over as well.
            let done = std::panic::catch_unwind(std::panic::AssertUnwindSafe(|| match wanted {
                Wanted::Fit { model } => fitted(&subject, &model, &stop),
                Wanted::Explain => jobs.explained(&subject, &stop),
            }));
            let failed = |error: &str| Outcome::Failed { error: error.to_owned() };
            let outcome = match done {
                Ok(Ok(result)) => Outcome::Done { version: subject.version, result },
                Ok(Err(_)) if stop.is_asked() => failed("stopped before there was anything to show"),
                Ok(Err(refusal)) => failed(&refusal),
                Err(_) => failed("the work broke off; what it said is in the terminal"),
            };
            jobs.finish(kind, number, outcome);
        });
        Ok(Started { job: number, kind })
    }

    fn finish(&self, kind: &'static str, number: u64, outcome: Outcome) {
        {
            let mut state = self.state();
            let seconds = state.running.take().map(|(_, since, _)| since.elapsed().as_secs_f64());
            state.answers.insert(kind.to_owned(), json!(Answer { job: number, seconds, outcome }));
        }
        self.events.tell(&Told::Finished { job: number, kind });
    }

    fn explained(&self, subject: &Subject, stop: &Stop) -> Result<JobResult, String> {
        let ids = |kinds: &[EffectKind]| kinds.iter().map(|kind| kind.id()).collect::<Vec<_>>();
        let tell = |progress: Progress| {
            self.events.tell(&match progress {
                Progress::Tried { kinds, log_evidence, error, of } => {
                    Told::Tried { effects: ids(&kinds), log_evidence, error, of }
                }
                Progress::Reached { kinds, gain } => Told::Reached { effects: ids(&kinds), gain },
                Progress::Doing(what) => Told::Doing { what },
            });
        };
        let input = &subject.input;
        let found = explain(&input.file, &input.campaign, &DiagnoseOptions::default(), &tell, stop)
            .ok_or_else(|| cannot_be_simulated(input))?;
        Ok(JobResult::Explained(Box::new(answer(&found, input))))
    }
}

fn cannot_be_simulated(input: &CampaignInput) -> String {
    format!("{}: its strokes cannot be simulated; look at the valve with `valve simulate`", input.file.file_name())
}

/// A fit: of the tolerated parameters alone as `valve calibrate` does it, with effects as `valve adopt` does it.
fn fitted(subject: &Subject, model: &Model, stop: &Stop) -> Result<JobResult, String> {
    let input = &subject.input;
    let words = |refusal: Refusal| refusal.message();
    let file = model.without_the_rest(&input.file).map_err(words)?;
    let additions = model.additions(&input.file).map_err(words)?;
    if additions.is_empty() {
        let calibration = Calibration::new(&file, &input.campaign, stop).map_err(|error| error.to_string())?;
        let fitted =
            sliders(&calibration.valve, calibration.found().map(|parameter| (parameter.id.key(), parameter.after)));
        let plain = CampaignInput { file, ..input.clone() };
        let document = calibration::document(&plain, &calibration);
        return Ok(JobResult::Fitted(Box::new(Fitted {
            how: "as `valve calibrate` does it",
            headline: calibration::verdict_words(&calibration).to_owned(),
            model: fitted,
            steps: steps::documents(&calibration.steps),
            parameters: None,
            calibration: Some(document),
        })));
    }
    let mut base = file;
    for effect in &model.custom {
        base = base.without_custom(&effect.name).map_err(|error| error.to_string())?;
    }
    let sequence = sequence(&base, &input.campaign, &additions, stop).ok_or_else(|| cannot_be_simulated(input))?;
    let last = sequence.rungs.last().ok_or_else(|| cannot_be_simulated(input))?;
    let valve = last.space.valve(&last.u).ok_or_else(|| cannot_be_simulated(input))?;
    let moved = last.space.coordinates.iter().filter_map(|coordinate| match coordinate.target {
        Target::Base(id) => Some((id.key(), valve.parameters().get(id))),
        _ => None,
    });
    let reports: Vec<StepReport> = sequence.rungs.iter().map(|rung| rung.step.clone()).collect();
    let names: Vec<&str> = additions.iter().map(model_lab::diagnosis::adopt::Addition::name).collect();
    Ok(JobResult::Fitted(Box::new(Fitted {
        how: "as `valve adopt` does it",
        headline: format!("everything refitted with {}", names.join(" and ")),
        model: sliders(&valve, moved),
        steps: steps::documents(&reports),
        parameters: Some(explanation::parameters(&sequence.parameters)),
        calibration: None,
    })))
}
