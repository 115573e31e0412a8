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
use blind_benchmark::world::Recording;

/// Scores what the library says of a tidy campaign that went through the files of a folder.
pub fn score(drawn: &Campaign, parent: &Path) -> Result<Scored> {
    let wanted = Wanted::of_tidy(&drawn.name, &drawn.truth);
    Ok(Scored { tidy: Some(drawn.truth.clone()), ..scored(&drawn.write_to(parent)?, wanted)? })
}

/// The same of what a laboratory or a plant recorded.
pub fn score_recording(drawn: &Recording, parent: &Path) -> Result<Scored> {
    scored(&drawn.write_to(parent)?, Wanted::from_json(&drawn.name, &drawn.truth))
}

fn scored(folder: &Path, wanted: Wanted) -> Result<Scored> {
    let start = Instant::now();
    let answer = answer::from_library(folder).with_context(|| format!("{}, as it was drawn", folder.display()))?;
    Ok(Scored { wanted, tidy: None, answer, failure: None, seconds: start.elapsed().as_secs_f64() })
}
