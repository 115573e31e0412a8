//! How the program speaks: what the user asked of all output, set once at the start.

use std::io::{self, IsTerminal};
use std::sync::OnceLock;

/// What holds for all output of a call.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Manner {
    /// Results and errors only.
    pub quiet: bool,
    /// Also what is being done.
    pub verbose: bool,
    /// Colours and bold letters in results.
    pub coloured: bool,
    /// Columns that text may take.
    pub columns: usize,
}

/// Columns where nobody says how many there are.
const USUAL_COLUMNS: usize = 80;
/// Columns of text that are still read with ease.
const MOST_COLUMNS: usize = 120;
/// Columns below which nothing fits.
const LEAST_COLUMNS: usize = 40;

/// When results are coloured.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, clap::ValueEnum)]
pub enum ColorWhen {
    /// On a terminal, unless NO_COLOR is set
    #[default]
    Auto,
    /// Always, even into a pipe
    Always,
    /// Never
    Never,
}

static MANNER: OnceLock<Manner> = OnceLock::new();

/// Sets the manner of this call. Only the first call counts.
pub fn set_manner(quiet: bool, verbose: bool, color: ColorWhen) {
    let coloured = match color {
        ColorWhen::Always => true,
        ColorWhen::Never => false,
        ColorWhen::Auto => is_coloured_by_itself(),
    };
    MANNER.get_or_init(|| Manner { quiet, verbose, coloured, columns: columns() });
}

/// The manner of this call.
pub fn manner() -> Manner {
    *MANNER.get_or_init(|| Manner {
        quiet: false,
        verbose: false,
        coloured: is_coloured_by_itself(),
        columns: columns(),
    })
}

fn is_coloured_by_itself() -> bool {
    let set = |name: &str| std::env::var_os(name).is_some_and(|value| !value.is_empty());
    io::stdout().is_terminal() && !set("NO_COLOR") && std::env::var_os("TERM").is_none_or(|term| term != "dumb")
}

/// COLUMNS if it is set, else those of the terminal, else the usual ones: into a pipe or file the same for everybody.
fn columns() -> usize {
    let stated = std::env::var("COLUMNS").ok().and_then(|text| text.parse().ok());
    let seen = || terminal_size::terminal_size_of(io::stdout()).map(|(width, _)| usize::from(width.0));
    stated.or_else(seen).unwrap_or(USUAL_COLUMNS).clamp(LEAST_COLUMNS, MOST_COLUMNS)
}
