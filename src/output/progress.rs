//! A progress line on stderr, only where somebody looks at it.

use std::io::{self, IsTerminal, Write};
use std::sync::{Mutex, PoisonError};

const WIDTH: usize = 30;

/// A line that is rewritten in place, from any thread; it is gone at the end.
#[derive(Debug)]
pub struct ProgressLine {
    enabled: bool,
    percent: Mutex<Option<u32>>,
}

impl ProgressLine {
    /// A line that shows itself if stderr is a terminal.
    pub fn new() -> Self {
        Self { enabled: io::stderr().is_terminal() && !super::manner().quiet, percent: Mutex::new(None) }
    }

    /// Shows how far the work is, from 0 to 1, and what is being done.
    pub fn show(&self, share: f64, what: &str) {
        if !self.enabled {
            return;
        }
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "0 to 100")]
        let percent = (100.0 * share.clamp(0.0, 1.0)) as u32;
        // A thread that panicked while it printed does not make the number wrong.
        let mut shown = self.percent.lock().unwrap_or_else(PoisonError::into_inner);
        if *shown == Some(percent) {
            return;
        }
        *shown = Some(percent);
        let full = percent as usize * WIDTH / 100;
        let bar: String = (0..WIDTH).map(|place| if place < full { '#' } else { '.' }).collect();
        // The work goes on whether or not the line can be written.
        let _ = write!(io::stderr().lock(), "\r[{bar}] {percent:>3} %  {what}\u{1b}[K");
    }
}

impl Drop for ProgressLine {
    fn drop(&mut self) {
        let shown = self.percent.lock().unwrap_or_else(PoisonError::into_inner);
        if shown.is_some() {
            let _ = write!(io::stderr().lock(), "\r\u{1b}[K");
        }
    }
}
