//! `valve completions` and `valve man`: made from the definition of the command line.

use std::io::Write;
use std::path::Path;

use anyhow::Context;
use clap::CommandFactory;
use clap_complete::Shell;

use crate::cli::Cli;
use crate::failure::Answer;
use crate::output;

/// Prints the completions for a shell.
pub fn completions(shell: Shell) -> anyhow::Result<Answer> {
    let mut script = Vec::new();
    clap_complete::generate(shell, &mut Cli::command(), "valve", &mut script);
    write_out(&script)
}

/// Prints the page of the program, or writes a page for each verb into a directory.
pub fn pages(dir: Option<&Path>) -> anyhow::Result<Answer> {
    if let Some(dir) = dir {
        std::fs::create_dir_all(dir).with_context(|| format!("{}: cannot be made", dir.display()))?;
        clap_mangen::generate_to(Cli::command(), dir)
            .with_context(|| format!("{}: the pages cannot be written", dir.display()))?;
        return Ok(Answer::Fine);
    }
    let mut page = Vec::new();
    clap_mangen::Man::new(Cli::command()).render(&mut page)?;
    write_out(&page)
}

fn write_out(bytes: &[u8]) -> anyhow::Result<Answer> {
    let mut out = output::stdout();
    out.write_all(bytes)?;
    out.flush()?;
    Ok(Answer::Fine)
}
