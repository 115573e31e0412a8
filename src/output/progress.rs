//! Progress of long work on stderr, only where somebody looks at it: how far it is, how long it has taken, and how long
//! the rest will take at that pace.

use std::fmt::Write as _;
use std::io::{self, IsTerminal, Write};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

/// Columns of the bar.
const BAR: usize = 24;
/// Work that is over before this shows nothing.
const PATIENCE: Duration = Duration::from_millis(400);
/// The line is drawn anew this often, so that its time goes on where nothing else does.
const EVERY: Duration = Duration::from_millis(250);
/// Share of the work, and time, from which on the rest can be told.
const ENOUGH: (f64, Duration) = (0.02, Duration::from_secs(1));

/// A line that is rewritten in place, from any thread; it is gone at the end.
#[derive(Debug)]
pub struct ProgressLine {
    shared: Option<Arc<Shared>>,
    ticker: Option<JoinHandle<()>>,
}

#[derive(Debug)]
struct Shared {
    work: Mutex<Work>,
    ended: Condvar,
}

/// What the line tells.
#[derive(Debug)]
struct Work {
    started: Instant,
    /// When the stage began that the share is of, and what it is called where there are several.
    stage: (Instant, String),
    share: Option<f64>,
    what: String,
    is_over: bool,
}

impl ProgressLine {
    /// A line that shows itself if stderr is a terminal and the work takes a while.
    pub fn new(what: &str) -> Self {
        if !io::stderr().is_terminal() || super::manner().quiet {
            return Self { shared: None, ticker: None };
        }
        let now = Instant::now();
        let work =
            Work { started: now, stage: (now, String::new()), share: None, what: what.to_owned(), is_over: false };
        let shared = Arc::new(Shared { work: Mutex::new(work), ended: Condvar::new() });
        let drawn = Arc::clone(&shared);
        // Without a thread to draw it there is no line; the work goes on.
        let ticker = thread::Builder::new().spawn(move || drawn.draw_until_the_end()).ok();
        Self { shared: Some(shared), ticker }
    }

    /// Tells how far the work is, from 0 to 1, and what is being done.
    pub fn show(&self, share: f64, what: &str) {
        if let Some(shared) = &self.shared {
            let mut work = shared.work();
            work.share = Some(share.clamp(0.0, 1.0));
            what.clone_into(&mut work.what);
        }
    }

    /// The same where the share is of a stage of the work, which begins with its first share.
    pub fn show_stage(&self, stage: &str, share: f64, what: &str) {
        if let Some(shared) = &self.shared {
            let mut work = shared.work();
            if work.stage.1 != stage {
                work.stage = (Instant::now(), stage.to_owned());
            }
        }
        self.show(share, what);
    }

    /// Tells what is being done where nobody knows how much it is.
    pub fn doing(&self, what: &str) {
        if let Some(shared) = &self.shared {
            let mut work = shared.work();
            work.stage.1.clear();
            work.share = None;
            what.clone_into(&mut work.what);
        }
    }
}

impl Drop for ProgressLine {
    fn drop(&mut self) {
        if let Some(shared) = &self.shared {
            shared.work().is_over = true;
            shared.ended.notify_all();
        }
        if let Some(ticker) = self.ticker.take() {
            // A ticker that panicked has drawn its last line.
            let _ = ticker.join();
        }
    }
}

impl Shared {
    fn work(&self) -> MutexGuard<'_, Work> {
        // What a thread that panicked had to tell is still a number and a text.
        self.work.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn draw_until_the_end(&self) {
        let mut is_drawn = false;
        let mut work = self.work();
        let mut pause = PATIENCE;
        loop {
            let waited = self.ended.wait_timeout_while(work, pause, |work| !work.is_over);
            work = waited.unwrap_or_else(PoisonError::into_inner).0;
            if work.is_over {
                break;
            }
            let columns = terminal_size::terminal_size_of(io::stderr()).map_or(80, |(width, _)| usize::from(width.0));
            // The work goes on whether or not the line can be written.
            let _ = write!(io::stderr().lock(), "\r{}\u{1b}[K", work.line(Instant::now(), columns));
            is_drawn = true;
            pause = EVERY;
        }
        if is_drawn {
            let _ = write!(io::stderr().lock(), "\r\u{1b}[K");
        }
    }
}

impl Work {
    /// The line, one column shorter than the terminal.
    fn line(&self, now: Instant, columns: usize) -> String {
        let (began, stage) = &self.stage;
        let mut line = String::new();
        if let Some(share) = self.share {
            #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "0 to 100")]
            let percent = (100.0 * share) as usize;
            let full = percent * BAR / 100;
            line = format!("[{}{}] {percent:>3} %  ", "#".repeat(full), ".".repeat(BAR - full));
        }
        line.push_str(&clock(now - self.started));
        let gone = now - *began;
        if let Some(share) = self.share.filter(|share| *share >= ENOUGH.0 && gone >= ENOUGH.1) {
            let left = gone.mul_f64((1.0 - share) / share);
            // Writing to a string cannot fail.
            let _ = write!(line, ", about {} left", clock(left));
            if !stage.is_empty() {
                let _ = write!(line, " of {stage}");
            }
        } else if !stage.is_empty() {
            let _ = write!(line, ", {stage}");
        }
        line.push_str(": ");
        line.push_str(&self.what);
        line.chars().take(columns.saturating_sub(1)).collect()
    }
}

/// A time in seconds, from a minute on with minutes.
fn clock(time: Duration) -> String {
    let seconds = time.as_secs();
    match seconds {
        0..60 => format!("{seconds} s"),
        60..3600 => format!("{}:{:02} min", seconds / 60, seconds % 60),
        _ => format!("{}:{:02}:{:02} h", seconds / 3600, seconds / 60 % 60, seconds % 60),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn work(share: Option<f64>, stage: &str) -> (Work, Instant) {
        let now = Instant::now();
        let stage = (now + Duration::from_mins(1), stage.to_owned());
        let work = Work { started: now, stage, share, what: "trying seal-friction".to_owned(), is_over: false };
        (work, now + Duration::from_secs(80))
    }

    #[test]
    fn elapsed_and_remaining_time_are_told() {
        let (work, now) = work(Some(0.25), "round 2");
        assert_eq!(
            work.line(now, 100),
            "[######..................]  25 %  1:20 min, about 1:00 min left of round 2: trying seal-friction"
        );
        assert_eq!(work.line(now, 40).chars().count(), 39, "a line that is broken could not be rewritten");
    }

    #[test]
    fn what_cannot_be_told_is_not() {
        assert_eq!(work(None, "").0.line(work(None, "").1, 100), "1:20 min: trying seal-friction");
        let (early, now) = work(Some(0.001), "round 1");
        assert!(early.line(now, 100).ends_with("1:20 min, round 1: trying seal-friction"), "{}", early.line(now, 100));
        assert_eq!(clock(Duration::from_secs(3661)), "1:01:01 h");
    }
}
