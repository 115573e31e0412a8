//! Questions at a terminal.

use std::io::{self, BufRead, IsTerminal, Write};

use anyhow::Context;

/// Whether there is somebody to ask.
pub fn is_possible() -> bool {
    io::stdin().is_terminal() && io::stderr().is_terminal()
}

/// Asks until the answer can be used. An empty answer is `None` where that is allowed.
pub fn ask<T>(
    question: &str,
    may_be_empty: bool,
    read: impl Fn(&str) -> Result<T, String>,
) -> anyhow::Result<Option<(String, T)>> {
    loop {
        let shown = crate::output::laid_out_for_stderr(&format!("{question} >"));
        let mut stderr = io::stderr().lock();
        write!(stderr, "{shown} ").and_then(|()| stderr.flush()).context("the terminal cannot be written")?;
        drop(stderr);
        let mut line = String::new();
        let length = io::stdin().lock().read_line(&mut line).context("the terminal cannot be read")?;
        anyhow::ensure!(length > 0, "the answers ended before the questions; nothing was written");
        let answer = line.trim();
        if answer.is_empty() && may_be_empty {
            return Ok(None);
        }
        match read(answer) {
            Ok(value) => return Ok(Some((answer.to_owned(), value))),
            Err(reason) => crate::output::note(&format!("  {reason}")),
        }
    }
}

/// Refuses wrong options: all of them at once, a line each.
pub fn all_right(wrong: &[String]) -> anyhow::Result<()> {
    anyhow::ensure!(wrong.is_empty(), "{}", wrong.join("\n"));
    Ok(())
}
