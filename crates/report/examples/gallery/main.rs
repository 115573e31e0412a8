//! Draws one of each figure from made-up numbers: `cargo run -p report --example
//! gallery -- DIR`. It is for looking at the design, not at a valve.

mod samples;

use std::error::Error;
use std::fs;
use std::path::PathBuf;

fn main() -> Result<(), Box<dyn Error>> {
    let dir = PathBuf::from(std::env::args().nth(1).unwrap_or_else(|| "gallery".to_owned()));
    fs::create_dir_all(&dir)?;
    for (name, figure) in samples::all() {
        fs::write(dir.join(format!("{name}.svg")), figure.to_svg())?;
        fs::write(dir.join(format!("{name}.png")), figure.to_png(1.5)?)?;
    }
    Ok(())
}
