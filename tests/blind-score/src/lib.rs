//! What `explain` says of campaigns whose truth is known to the one who drew them.

pub mod answer;
pub mod program;
mod scored;
mod summary;
mod table;
pub mod wanted;

pub use answer::{Answer, Drawn};
pub use scored::Scored;
pub use summary::Summary;
pub use table::Table;
pub use wanted::{Kind, Wanted};

use std::path::Path;
use std::time::Instant;

use anyhow::{Context, Result};
use blind_benchmark::Campaign;

/// Scores what the library says of a tidy campaign that went through the files of a folder.
pub fn score(drawn: &Campaign, parent: &Path) -> Result<Scored> {
    let folder = drawn.write_to(parent)?;
    let start = Instant::now();
    let said = answer::from_library(&folder).with_context(|| format!("{}, as it was drawn", drawn.name))?;
    Ok(Scored {
        wanted: Wanted::of_tidy(&drawn.name, &drawn.truth),
        tidy: Some(drawn.truth.clone()),
        answer: said,
        failure: None,
        seconds: start.elapsed().as_secs_f64(),
    })
}
