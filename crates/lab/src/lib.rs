//! Pages: a model held against its measurements, and valves that wear, live: the native engine behind a browser.
//!
//! [`lab`] serves a valve file and a campaign. Whatever the page shows is computed by the same code as on the command line
//! (`valve compare`, `calibrate`, `explain`, `adopt`), so that the numbers are the same. The page is inside the program
//! and asks nobody but this server. [`watch`] serves how the valves of growing logs stand. [`frozen`]
//! has the same views for a page without a server.

mod assets;
mod events;
pub mod frozen;
mod lab;
mod site;
mod thin;
mod watch;

pub use lab::{LabError, LabOptions, LifeTeller, Output, Writer, lab};
pub use site::{Address, ServeError, Site};
pub use watch::{WatchError, WatchOptions, watch};
