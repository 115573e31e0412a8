//! Results to stdout and to files.

mod figure;
mod manner;
mod next;
mod number;
mod paint;
mod progress;
mod sketch;
mod staged;
mod table;
mod units;
mod wrap;

use std::ffi::OsStr;
use std::io::{self, BufWriter, IsTerminal, StdoutLock, Write};
use std::path::Path;

use anyhow::Context;
use serde::Serialize;

pub use figure::PlotFile;
pub use manner::{ColorWhen, manner, set_manner};
pub use next::{command, free_name, free_name_beside, next_step};
pub use number::push_number;
pub use paint::paint;
pub use progress::ProgressLine;
pub use sketch::sketch;
pub use staged::{Outputs, StagedFile};
pub use table::{Align, TextTable};
pub use units::{Units, set_units, told_in};

/// Stdout, buffered; the caller flushes it.
pub fn stdout() -> BufWriter<StdoutLock<'static>> {
    BufWriter::new(io::stdout().lock())
}

/// Prints a JSON document.
pub fn print_json(value: &impl Serialize) -> anyhow::Result<()> {
    let mut out = stdout();
    serde_json::to_writer_pretty(&mut out, value)?;
    writeln!(out)?;
    out.flush()?;
    Ok(())
}

/// Prints a JSON document with its keys in alphabetical order, at every depth.
pub fn print_document(document: &impl Serialize) -> anyhow::Result<()> {
    print_json(&serde_json::to_value(document)?)
}

/// Prints text; prose that is too long for a line is broken.
pub fn print_text(text: &str) -> anyhow::Result<()> {
    let mut out = stdout();
    out.write_all(wrapped(text).as_bytes())?;
    out.flush().context("stdout cannot be written")
}

/// Text whose prose is broken to the columns there are.
pub fn wrapped(text: &str) -> String {
    wrap::wrapped(text, manner().columns)
}

/// Broken to the columns of a terminal; in a file a message stays one line, which is easier to search.
pub fn laid_out_for_stderr(text: &str) -> String {
    if io::stderr().is_terminal() { wrapped(text) } else { text.to_owned() }
}

/// What a file is called where it stands, without the way to it.
pub fn short_name(path: &str) -> &str {
    Path::new(path).file_name().and_then(OsStr::to_str).unwrap_or(path)
}

/// Tells the user something beside the result, unless results alone are wanted.
pub fn note(text: &str) {
    if !manner().quiet {
        // A note that nobody can read is not worth failing for.
        let _ = writeln!(io::stderr().lock(), "{}", wrapped(text));
    }
}

/// Tells what is being done, to those who asked for it.
pub fn detail(text: &str) {
    if is_verbose() {
        note(text);
    }
}

/// Whether somebody asked for all that there is to tell.
pub fn is_verbose() -> bool {
    manner().verbose
}
