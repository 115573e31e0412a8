//! The lab: a valve file and a campaign side by side, with the physics to try out.

mod adopt;
pub mod answer;
pub mod describe;
mod jobs;
pub mod model;
pub mod simulate;
pub mod subject;
mod told;

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::SystemTime;

use axum::extract::{DefaultBodyLimit, State};
use axum::routing::{get, post};
use axum::{Json, Router};
use rayon::ThreadPool;
use serde_json::Value;
use valve_file::ValveFile;

use crate::assets;
use crate::events::Events;
use crate::site::{Address, Refusal, ServeError, Site, announce, answered};
use answers::InputError;

use self::jobs::Jobs;
use self::subject::{Current, Subject};
use self::told::Told;

/// A request is a few numbers; nothing larger is read.
const LARGEST_REQUEST: usize = 1 << 20;

/// A file that the user wants written.
#[derive(Debug, Clone, Copy)]
pub struct Output<'a> {
    /// Where.
    pub path: &'a Path,
    /// All of it.
    pub bytes: &'a [u8],
    /// Whether the user has agreed to replace what is there.
    pub replace: bool,
    /// Files that must stay whatever the user has agreed to.
    pub keep: &'a [PathBuf],
}

/// How files are written: whole or not at all; an error is a sentence for the user.
pub type Writer = dyn Fn(&Output<'_>) -> Result<(), String> + Send + Sync;

/// What models, each with its name, say of the life in a timing log: the document of `valve adopt --log`; an error is a
/// sentence for the user.
pub type LifeTeller = dyn Fn(&[(String, ValveFile)]) -> Result<Value, String> + Send + Sync;

/// What to open.
pub struct LabOptions {
    /// The valve file.
    pub valve: PathBuf,
    /// The campaign file.
    pub campaign: PathBuf,
    /// Where to serve it.
    pub address: Address,
    /// Whether to open it in the user's browser.
    pub open: bool,
    /// How files are written.
    pub writer: Box<Writer>,
    /// What reads the timing log, where one is given.
    pub lives: Option<Box<LifeTeller>>,
}

/// Why there is no lab.
#[derive(Debug, thiserror::Error)]
pub enum LabError {
    /// The files cannot be used.
    #[error(transparent)]
    Input(#[from] InputError),
    /// The page cannot be served.
    #[error(transparent)]
    Serve(#[from] ServeError),
}

/// What all requests share.
pub struct Lab {
    current: Current,
    events: Events,
    jobs: Jobs,
    writer: Box<Writer>,
    lives: Option<Box<LifeTeller>>,
    /// Which start of the program this is: pages that outlive it are told apart from those that only lost the line.
    started_ms: u64,
    /// Threads for what a hand waits for, so that a search that runs does not hold it up.
    hands: ThreadPool,
}

type Shared = State<Arc<Lab>>;

/// Reads both files and serves the page until the process ends. `doubt` is told what looks wrong in the files.
pub fn lab(options: LabOptions, doubt: &dyn Fn(&str)) -> Result<(), LabError> {
    let subject = Subject::read(&options.valve, &options.campaign)?;
    subject.input.doubts().iter().for_each(|text| doubt(text));
    let site = Site::bind(&options.address)?;
    let events = Events::new();
    let hands = rayon::ThreadPoolBuilder::new().build().map_err(|error| ServeError::System(error.to_string()))?;
    let lab = Arc::new(Lab {
        current: Current::new(subject, &options.valve, &options.campaign),
        jobs: Jobs::new(events.clone()),
        events,
        writer: options.writer,
        lives: options.lives,
        started_ms: now_ms(),
        hands,
    });
    subject::watch(Arc::downgrade(&lab));
    announce(&site.url(), "the lab is open", options.open);
    let routes = routes(&site, lab);
    site.serve(routes)?;
    Ok(())
}

fn routes(site: &Site, lab: Arc<Lab>) -> Router {
    let path = |rest: &str| site.path(rest);
    Router::new()
        .route(&path("/api/events"), get(events))
        .route(&path("/api/lab"), get(description))
        .route(&path("/api/measured"), post(measured))
        .route(&path("/api/simulate"), post(simulated))
        .route(&path("/api/missing"), post(missing))
        .route(&path("/api/predict"), post(predicted))
        .route(&path("/api/job"), get(last_job).post(start_job))
        .route(&path("/api/stop"), post(stop_job))
        .route(&path("/api/lives"), post(lives))
        .route(&path("/api/preview"), post(preview))
        .route(&path("/api/write"), post(write))
        .layer(DefaultBodyLimit::max(LARGEST_REQUEST))
        .merge(assets::routes(site, &assets::LAB))
        .with_state(lab)
}

/// Milliseconds since 1970.
fn now_ms() -> u64 {
    let since = SystemTime::now().duration_since(SystemTime::UNIX_EPOCH).unwrap_or_default();
    u64::try_from(since.as_millis()).unwrap_or(u64::MAX)
}

impl Lab {
    /// Does what a hand waits for.
    fn by_hand<T: Send>(&self, work: impl FnOnce() -> T + Send) -> T {
        self.hands.install(work)
    }
}

async fn events(State(lab): Shared) -> impl axum::response::IntoResponse {
    lab.events.stream(&Told::Hello {
        started_ms: lab.started_ms,
        version: lab.current.get().version,
        trouble: lab.current.trouble(),
        job: lab.jobs.status(),
    })
}

async fn description(State(lab): Shared) -> Result<Json<describe::Description>, Refusal> {
    answered(move || {
        let mut description = describe::Description::new(&lab.current.get());
        description.has_log = Some(lab.lives.is_some());
        Ok(description)
    })
    .await
}

async fn measured(
    State(lab): Shared,
    Json(wanted): Json<simulate::Selection>,
) -> Result<Json<simulate::Measured>, Refusal> {
    answered(move || Ok(simulate::measured(&lab.current.get(), &wanted))).await
}

async fn simulated(State(lab): Shared, Json(request): Json<simulate::Request>) -> Result<Json<Value>, Refusal> {
    answered(move || lab.by_hand(|| simulate::simulated(&lab.current.get(), &request))).await
}

async fn missing(State(lab): Shared, Json(model): Json<model::Model>) -> Result<Json<simulate::Missing>, Refusal> {
    answered(move || lab.by_hand(|| simulate::missing(&lab.current.get(), &model))).await
}

async fn predicted(
    State(lab): Shared,
    Json(request): Json<simulate::Plan>,
) -> Result<Json<simulate::Prediction>, Refusal> {
    answered(move || lab.by_hand(|| simulate::predicted(&lab.current.get(), &request))).await
}

async fn last_job(State(lab): Shared) -> Json<Value> {
    Json(lab.jobs.last())
}

async fn start_job(State(lab): Shared, Json(wanted): Json<jobs::Wanted>) -> Result<Json<jobs::Started>, Refusal> {
    lab.jobs.start(lab.current.get(), wanted).map(Json)
}

async fn stop_job(State(lab): Shared) -> Json<Value> {
    Json(lab.jobs.stop())
}

async fn lives(State(lab): Shared, Json(model): Json<model::Model>) -> Result<Json<Value>, Refusal> {
    answered(move || {
        let told =
            lab.lives.as_ref().ok_or_else(|| Refusal::new("start the lab with --log to see the remaining life"))?;
        adopt::lives(&lab.current.get(), &model, told)
    })
    .await
}

async fn preview(State(lab): Shared, Json(model): Json<model::Model>) -> Result<Json<adopt::Preview>, Refusal> {
    answered(move || adopt::preview(&lab.current.get(), &model)).await
}

async fn write(State(lab): Shared, Json(request): Json<adopt::Request>) -> Result<Json<adopt::Written>, Refusal> {
    answered(move || adopt::write(&lab.current.get(), &request, &*lab.writer)).await
}
