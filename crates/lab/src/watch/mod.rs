//! The watch: valves that wear, worst first, as their logs grow.

pub mod fleet;
mod reader;

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::thread;
use std::time::Duration;

use axum::extract::{DefaultBodyLimit, State};
use axum::routing::{get, post};
use axum::{Json, Router};
use leak_table::{BundleEntry, TableBundle, TableError, mm2_from_m2};
use prognoser::Method;
use serde::{Deserialize, Serialize};

use crate::assets;
use crate::events::Events;
use crate::site::{Address, Refusal, ServeError, Site, announce, answered};

use self::fleet::{Fleet, FleetRow, ValvePast, limits_s};
use self::reader::follow_all;

/// How often pages are told of what has changed.
const TELL: Duration = Duration::from_millis(400);

/// A request is the name of a valve.
const LARGEST_REQUEST: usize = 1 << 16;

/// What to watch.
#[derive(Debug, Clone)]
pub struct WatchOptions {
    /// Timing logs, or folders whose CSV files are logs.
    pub logs: Vec<PathBuf>,
    /// The folder with the tables.
    pub tables: PathBuf,
    /// How the remaining life is estimated.
    pub method: Method,
    /// Where to serve it.
    pub address: Address,
    /// Whether to open it in the user's browser.
    pub open: bool,
}

/// Why nothing is watched.
#[derive(Debug, thiserror::Error)]
pub enum WatchError {
    /// The tables cannot be used.
    #[error(transparent)]
    Tables(#[from] TableError),
    /// A log is not there.
    #[error("{path}: {reason}; expected a timing log (CSV) or a folder of them")]
    Log {
        /// The log.
        path: String,
        /// What the system says.
        reason: std::io::Error,
    },
    /// The page cannot be served.
    #[error(transparent)]
    Serve(#[from] ServeError),
}

/// What all requests share.
struct Watch {
    tables: Arc<TableBundle>,
    logs: Vec<String>,
    fleet: Arc<Fleet>,
    events: Events,
}

type Shared = State<Arc<Watch>>;

/// What the pages are told without asking.
#[derive(Debug, Clone, Serialize)]
#[serde(tag = "event", rename_all = "kebab-case")]
enum Told {
    /// The first thing that a page hears.
    Hello,
    /// Valves have changed, or something went wrong.
    Rows { rows: Vec<FleetRow>, troubles: Vec<String> },
}

/// All that a page shows before a valve is looked at.
#[derive(Debug, Clone, Serialize)]
struct Standing {
    tables: Vec<TableEntry>,
    limits_s: [f64; 2],
    logs: Vec<String>,
    rows: Vec<FleetRow>,
    troubles: Vec<String>,
}

/// A kind of wear that there is a table for, and its limit.
#[derive(Debug, Clone, Serialize)]
struct TableEntry {
    id: &'static str,
    limit: f64,
}

/// Follows the logs and serves the page until the process ends.
pub fn watch(options: WatchOptions) -> Result<(), WatchError> {
    for path in &options.logs {
        let reason = |reason| WatchError::Log { path: path.display().to_string(), reason };
        std::fs::metadata(path).map_err(reason)?;
    }
    let tables = Arc::new(TableBundle::read(&options.tables)?);
    let site = Site::bind(&options.address)?;
    let fleet = Arc::new(Fleet::new(Arc::clone(&tables), &options.method));
    let watch = Arc::new(Watch {
        tables,
        logs: options.logs.iter().map(|path| shown(path)).collect(),
        fleet: Arc::clone(&fleet),
        events: Events::new(),
    });
    follow_all(options.logs, fleet);
    tell(Arc::clone(&watch));
    announce(&site.url(), "the watch is open", options.open);
    let router = routes(&site, watch);
    site.serve(router)?;
    Ok(())
}

fn shown(path: &Path) -> String {
    path.display().to_string()
}

/// Tells the pages now and then which valves have changed and how they stand.
fn tell(watch: Arc<Watch>) {
    thread::spawn(move || {
        loop {
            thread::sleep(TELL);
            let (rows, troubles) = watch.fleet.changed();
            if !(rows.is_empty() && troubles.is_empty()) {
                watch.events.tell(&Told::Rows { rows, troubles });
            }
        }
    });
}

fn routes(site: &Site, watch: Arc<Watch>) -> Router {
    let path = |rest: &str| site.path(rest);
    Router::new()
        .route(&path("/api/events"), get(events))
        .route(&path("/api/fleet"), get(all))
        .route(&path("/api/valve"), post(one))
        .layer(DefaultBodyLimit::max(LARGEST_REQUEST))
        .merge(assets::routes(site, &assets::WATCH))
        .with_state(watch)
}

async fn events(State(watch): Shared) -> impl axum::response::IntoResponse {
    watch.events.stream(&Told::Hello)
}

async fn all(State(watch): Shared) -> Result<Json<Standing>, Refusal> {
    answered(move || {
        let entry =
            |entry: BundleEntry<'_>| TableEntry { id: entry.degradation.id.name(), limit: entry.limit_severity };
        Ok(Standing {
            tables: watch.tables.entries().map(entry).collect(),
            limits_s: limits_s(&watch.tables),
            logs: watch.logs.clone(),
            rows: watch.fleet.rows(),
            troubles: watch.fleet.troubles(),
        })
    })
    .await
}

/// The valve that a page looks at.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct Wanted {
    valve: String,
}

async fn one(State(watch): Shared, Json(wanted): Json<Wanted>) -> Result<Json<ValvePast>, Refusal> {
    let known = watch.fleet.valve(&wanted.valve);
    known.map(Json).ok_or_else(|| Refusal::new(format!("no row of a valve {:?} has come", wanted.valve)))
}

/// The leak at which a valve's life ends, mm2, where its fault is a leak.
fn leak_limit_mm2(tables: &TableBundle, fault: prognoser::FaultCall) -> Option<f64> {
    fault.fault().map(|fault| mm2_from_m2(tables.limit_area_m2(fault)))
}
