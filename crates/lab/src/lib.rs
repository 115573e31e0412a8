//! A page on which a model is held against its measurements, live: the native engine behind a browser.
//!
//! [`lab`] serves a valve file and a campaign. Whatever the page shows is computed by the same code as on the command line
//! (`valve compare`, `calibrate`, `explain`, `adopt`), so that the numbers are the same. The page is inside the program
//! and asks nobody but this server.

mod assets;
mod lab;
mod site;

pub use lab::{LabError, LabOptions, Output, Writer, lab};
pub use site::{Address, ServeError, Site};
