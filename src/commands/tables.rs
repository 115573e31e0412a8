//! Tables built with a line of progress.

use std::sync::Mutex;

use lut_builder::{BuildError, Built, Progress, Request};
use valve_file::ValveFile;

use crate::output::ProgressLine;

/// Builds the tables of both kinds of leak.
pub fn build(file: &ValveFile) -> Result<Built, BuildError> {
    build_what(file, &Request::default())
}

/// Builds what is asked for.
pub fn build_what(file: &ValveFile, request: &Request) -> Result<Built, BuildError> {
    let line = ProgressLine::new("building tables");
    let shares = Mutex::new(vec![0.0; request.wears.len()]);
    answers::tables::build(file, request, &|progress: Progress| {
        let Ok(mut shares) = shares.lock() else { return };
        shares[progress.place] = progress.share;
        line.show(shares.iter().sum::<f64>() / shares.len() as f64, progress.stage.name());
    })
}
