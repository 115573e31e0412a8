//! A log that is still being written, read as it grows, for years: over rotations, cuts and restarts, no row lost and
//! none twice.
//!
//! What is read goes on in the order in which it was written: the file that is open to its end, then the files that came
//! beside the log since it was opened, the one last written to last, then the log itself. Nothing depends on a clock but
//! the order of several files that were rotated away while nobody looked. A file is left for the next one only once a row
//! stands in that: until then the writer may still go on in the old one.

mod notice;
mod position;
mod siblings;
mod window;

use std::fs::{self, File};
use std::io;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;
use std::time::Duration;

pub use notice::FollowNotice;
pub use position::LogPosition;

use self::siblings::{FileId, HEAD, Known, Sibling};
use self::window::{Grown, Window, holds};
use super::error::{LogError, LogErrorKind};
use super::layout::{Layout, Line};
use super::lines::LONGEST_LINE;
use super::reader::LogRow;

/// Bytes that no two logs have in common by chance, though they begin alike.
const SURELY: u64 = 256;
/// How long a rotation takes at most, looked at so often: files that are renamed and copied have no name, or not all of
/// their bytes, for a moment.
const SOON: Duration = Duration::from_millis(20);
const TRIES: usize = 25;

/// How a log is followed.
#[derive(Debug, Clone)]
pub struct FollowOptions {
    /// Whether more is waited for at the end; else the log ends there.
    pub forever: bool,
    /// How often is looked for more.
    pub poll: Duration,
    /// Ends the log, as far as the reader sees, once it is set.
    pub stop: Arc<AtomicBool>,
    /// An empty time means that the stroke did not arrive.
    pub empty_is_stalled: bool,
}

/// What comes next of a log that is followed.
#[derive(Debug)]
pub enum Followed<'a> {
    /// A row.
    Row(LogRow<'a>),
    /// A line that is no row; the ones behind it may be.
    Skipped(LogError),
    /// Something happened to the file.
    Notice(FollowNotice),
    /// There is nothing more for now; the next call waits.
    Idle,
    /// The log has ended.
    End,
}

/// A log that is followed.
#[derive(Debug)]
#[expect(clippy::struct_excessive_bools, reason = "five things that may be so at the same time")]
pub struct FollowedLog {
    path: PathBuf,
    name: String,
    options: FollowOptions,
    open: Open,
    /// Files beside the log that are older than the one that is open.
    known: Vec<Known>,
    layout: Option<Layout>,
    line: Vec<u8>,
    /// What the last file ended with, without an end of line.
    half: Vec<u8>,
    /// Whether the header of the open file may still come.
    at_top: bool,
    /// Within a line that is too long.
    discarding: bool,
    /// The place in the last file, until a row of the open one was given: a header alone is no place to go on from.
    before: Option<LogPosition>,
    /// The line at hand is looked at once more.
    again: bool,
    waiting: bool,
    gone: bool,
    notices: Vec<FollowNotice>,
}

/// The file that is open.
#[derive(Debug)]
struct Open {
    path: PathBuf,
    id: FileId,
    head: Vec<u8>,
    line: u64,
    /// Whether a row of it was given.
    told: bool,
    /// Whether nothing that came before it was overlooked.
    sure: bool,
    window: Window,
}

impl Open {
    fn from(path: &Path, file: File) -> io::Result<Self> {
        let id = FileId::of(&file.metadata()?);
        Ok(Self {
            path: path.to_path_buf(),
            id,
            head: Vec::new(),
            line: 0,
            told: false,
            sure: true,
            window: Window::at(file, 0)?,
        })
    }

    fn at(path: &Path, file: File, position: &LogPosition) -> io::Result<Self> {
        let id = FileId::of(&file.metadata()?);
        let window = Window::at(file, position.offset)?;
        Ok(Self {
            path: path.to_path_buf(),
            id,
            head: position.head.clone(),
            line: position.line,
            told: true,
            sure: true,
            window,
        })
    }

    /// Looks for more of the file.
    fn grow(&mut self) -> io::Result<Grown> {
        let (end, _) = self.window.read_to();
        // So few bytes another file may have too.
        if end < SURELY && !siblings::head(&self.window.file)?.starts_with(&self.head) {
            return Ok(Grown::Changed);
        }
        let grown = self.window.grow()?;
        if grown == Grown::More && self.head.len() < HEAD {
            // What was read by an earlier run is known already.
            let new = self.window.from(end.max(self.head.len() as u64));
            self.head.extend_from_slice(&new[..new.len().min(HEAD - self.head.len())]);
        }
        Ok(grown)
    }

    fn is_at(&self, path: &Path) -> io::Result<bool> {
        match fs::metadata(path) {
            Ok(metadata) => Ok(FileId::of(&metadata) == self.id),
            Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(false),
            Err(error) => Err(error),
        }
    }
}

impl FollowedLog {
    /// Opens a log and reads its header, from the beginning or from where an earlier reading got to.
    ///
    /// # Errors
    /// If the log is not there, or its header is no header.
    pub fn open(path: &Path, from: Option<LogPosition>, options: FollowOptions) -> Result<Self, LogError> {
        let name = path.display().to_string();
        let unreadable = |error: io::Error| LogError { log: name.clone(), line: 1, kind: error.into() };
        let Some(position) = from else {
            return Self::begin(path, name.clone(), options).map_err(unreadable)?.with_header();
        };
        // A log that was there before will be there again, and one that is just being rotated is in its place soon.
        for tries in 0.. {
            let stopped = options.stop.load(Ordering::Relaxed);
            if options.forever && !stopped && !path.exists() {
                thread::sleep(options.poll);
                continue;
            }
            let mut begun = Self::begin(path, name.clone(), options.clone()).map_err(unreadable)?;
            if begun.resumed(&position).map_err(unreadable)? {
                return Ok(begun);
            }
            if tries >= TRIES || stopped {
                return begun.gone(position).map_err(unreadable);
            }
            thread::sleep(SOON);
        }
        unreachable!("it returns after a number of tries")
    }

    fn begin(path: &Path, name: String, options: FollowOptions) -> io::Result<Self> {
        let (open, beside) = open_with_siblings(path)?;
        let known = beside.iter().map(Sibling::known).collect();
        Ok(Self {
            path: path.to_path_buf(),
            name,
            options,
            open,
            known,
            layout: None,
            line: Vec::new(),
            half: Vec::new(),
            at_top: true,
            discarding: false,
            before: None,
            again: false,
            waiting: false,
            gone: false,
            notices: Vec::new(),
        })
    }

    /// Reads on until the header is there.
    fn with_header(mut self) -> Result<Self, LogError> {
        while self.layout.is_none() && !self.stopped() {
            if self.take_line() {
                self.judge()?;
            } else if self.read_more()? == More::End {
                return Err(self.error(1, LogErrorKind::Empty));
            }
        }
        Ok(self)
    }

    /// Goes on from a place: in the file of that identity, or in one that holds what was read. Says whether there is one.
    fn resumed(&mut self, position: &LogPosition) -> io::Result<bool> {
        self.layout = Layout::new(&position.header).ok();
        self.at_top = false;
        self.known.clone_from(&position.known);
        let found = |one: &Sibling| -> io::Result<bool> {
            Ok(one.head.starts_with(&position.head) && holds(&one.file, position.offset, &position.trace)?)
        };
        let log = Sibling::of(self.path.clone(), self.open.window.file.try_clone()?)?;
        let mut candidates: Vec<Sibling> = siblings::with_id(&self.path, position.id)?.into_iter().collect();
        for copy in siblings::siblings(&self.path)? {
            // A copy is younger than the place. One of a log that is still whole is no longer than that.
            let of_whole = log.id == position.id && copy.length <= log.length && copy.is_copy_of(&log.file)?;
            if !self.known.contains(&copy.known()) && !of_whole {
                candidates.push(copy);
            }
        }
        candidates.retain(|one| one.id != log.id);
        candidates.push(log);
        for one in candidates {
            if found(&one)? {
                self.open = Open::at(&one.path, one.file, position)?;
                return Ok(true);
            }
        }
        Ok(false)
    }

    /// Goes on with the oldest file that has come since that of a place.
    fn gone(mut self, position: LogPosition) -> io::Result<Self> {
        self.notices.push(FollowNotice::Lost { line: position.line });
        (self.open.id, self.open.head, self.open.told) = (position.id, position.head, true);
        self.next_file()?;
        Ok(self)
    }

    /// The columns that are not understood and not used.
    pub fn unknown_columns(&self) -> &[String] {
        self.layout.as_ref().map_or(&[], Layout::unknown)
    }

    /// Where the reading has got to: behind the last row or line that was given.
    pub fn position(&self) -> LogPosition {
        match &self.before {
            Some(before) => before.clone(),
            None => self.place(),
        }
    }

    fn place(&self) -> LogPosition {
        let window = &self.open.window;
        LogPosition {
            id: self.open.id,
            offset: window.offset(),
            line: self.open.line,
            head: self.open.head.clone(),
            trace: window.trace().to_vec(),
            known: self.known.clone(),
            header: self.layout.as_ref().map_or_else(String::new, |layout| layout.header().to_owned()),
        }
    }

    /// What comes next.
    ///
    /// # Errors
    /// If the file cannot be read, or the first line of the log is no header.
    #[expect(clippy::should_implement_trait, reason = "what it gives borrows from the log")]
    pub fn next(&mut self) -> Result<Followed<'_>, LogError> {
        loop {
            if !self.notices.is_empty() {
                return Ok(Followed::Notice(self.notices.remove(0)));
            }
            if self.take_line() {
                match self.judge()? {
                    Some(Judged::Row) => {
                        self.before = None;
                        self.open.told = true;
                        let line = self.open.line;
                        let layout = self.layout.as_ref().expect("a row was read by it");
                        let text = std::str::from_utf8(&self.line).expect("a row was read from it");
                        let row = layout.row(text, line, self.options.empty_is_stalled);
                        return Ok(Followed::Row(row.expect("it was read before")));
                    }
                    Some(Judged::Skipped(line, kind)) => return Ok(Followed::Skipped(self.error(line, kind))),
                    None => continue,
                }
            }
            match self.read_more()? {
                More::Read => {}
                More::Idle => return Ok(Followed::Idle),
                More::End => return Ok(Followed::End),
            }
        }
    }

    fn read_more(&mut self) -> Result<More, LogError> {
        self.more().map_err(|error| self.error(self.open.line + 1, error.into()))
    }

    fn error(&self, line: u64, kind: LogErrorKind) -> LogError {
        let name = if self.open.path == self.path { self.name.clone() } else { self.open.path.display().to_string() };
        LogError { log: name, line, kind }
    }

    /// Takes the next whole line to look at; says whether there is one.
    fn take_line(&mut self) -> bool {
        if std::mem::take(&mut self.again) {
            return true;
        }
        let Some(line) = self.open.window.line() else {
            if self.open.window.rest().len() > LONGEST_LINE {
                self.discarding = true;
                self.open.window.skip_rest();
            }
            return false;
        };
        self.line.clear();
        self.line.extend_from_slice(line);
        self.open.line += 1;
        if self.open.line == 1 && self.line.starts_with(b"\xEF\xBB\xBF") {
            self.line.drain(..3);
        }
        let end = self.line.trim_ascii_end().len();
        self.line.truncate(end);
        true
    }

    /// Looks at the line at hand: whether it is a row, or none and worth a word.
    fn judge(&mut self) -> Result<Option<Judged>, LogError> {
        let line = self.open.line;
        if std::mem::take(&mut self.discarding) || self.line.len() > LONGEST_LINE {
            return Ok(Some(Judged::Skipped(line, LogErrorKind::LongLine { limit: LONGEST_LINE })));
        }
        let half = std::mem::take(&mut self.half);
        let Ok(text) = std::str::from_utf8(&self.line) else {
            // Without a header nothing behind it can be read either.
            return match self.layout {
                None => Err(self.error(line, LogErrorKind::NotText)),
                Some(_) => Ok(Some(Judged::Skipped(line, LogErrorKind::NotText))),
            };
        };
        if self.at_top {
            // A comment before the header.
            let ends_half = text.is_empty() && !half.is_empty();
            if !ends_half && (text.is_empty() || text.starts_with('#')) {
                self.half = half;
                return Ok(None);
            }
            match (Layout::new(text), &self.layout) {
                (Ok(layout), _) => {
                    (self.layout, self.at_top) = (Some(layout), false);
                    return Ok(unfinished(&half).map(|found| Judged::Skipped(line, found)));
                }
                (Err(kind), None) => return Err(self.error(line, kind)),
                // A log that was cut back goes on without another header.
                (Err(_), Some(_)) => self.at_top = false,
            }
        }
        let layout = self.layout.as_ref().expect("what is not at the top has a header above it");
        let stalled = self.options.empty_is_stalled;
        if !half.is_empty() {
            let joined = [&half[..], &self.line].concat();
            let whole = std::str::from_utf8(&joined).is_ok_and(|text| layout.row(text, line, stalled).is_ok());
            if whole {
                self.line = joined;
                return Ok(Some(Judged::Row));
            }
            if let Some(found) = unfinished(&half) {
                // The line at hand comes next.
                self.again = true;
                return Ok(Some(Judged::Skipped(line, found)));
            }
        }
        Ok(match layout.line(text, line, stalled) {
            Line::Row => Some(Judged::Row),
            Line::Nothing => None,
            Line::Bad(kind) => Some(Judged::Skipped(line, kind)),
        })
    }

    /// Looks for more: in the file that is open, then in the one that comes after it.
    fn more(&mut self) -> io::Result<More> {
        if std::mem::take(&mut self.waiting) && !self.stopped() {
            thread::sleep(self.options.poll);
        }
        match self.open.grow()? {
            Grown::More => {
                if !std::mem::replace(&mut self.open.sure, true)
                    && let Some(next) = self.overlooked()?
                {
                    (self.open, self.known, self.at_top) = (next.open, next.known, true);
                }
                return Ok(More::Read);
            }
            Grown::Changed => {
                self.was_cut()?;
                return Ok(More::Read);
            }
            Grown::End if self.stopped() => return Ok(More::End),
            Grown::End => {}
        }
        if self.open.is_at(&self.path)? {
            self.gone = false;
            return Ok(self.rest());
        }
        // An editor writes a file anew under the old name.
        if self.open.window.read_to().0 >= SURELY
            && let Ok(log) = Sibling::open(self.path.clone())
            && self.goes_on_in(log)?
        {
            return Ok(More::Read);
        }
        let Some(next) = self.successor(false)? else {
            if !self.gone && !self.path.exists() {
                self.gone = true;
                self.notices.push(FollowNotice::Vanished);
                return Ok(More::Read);
            }
            return Ok(self.rest());
        };
        // What was written to the old file before the first row of the new one.
        if self.open.grow()? != Grown::More {
            self.enter(next);
            self.notices.push(FollowNotice::Rotated);
        }
        Ok(More::Read)
    }

    fn stopped(&self) -> bool {
        self.options.stop.load(Ordering::Relaxed)
    }

    fn rest(&mut self) -> More {
        if self.options.forever {
            self.waiting = true;
            More::Idle
        } else {
            More::End
        }
    }

    /// The open file became shorter, or holds something else: it was copied and cut back. The copy is read on where there
    /// is one.
    fn was_cut(&mut self) -> io::Result<()> {
        for _ in 0..TRIES {
            for one in siblings::siblings(&self.path)? {
                if one.id != self.open.id && !self.known.contains(&one.known()) && self.goes_on_in(one)? {
                    return Ok(());
                }
            }
            thread::sleep(SOON.min(self.options.poll));
        }
        self.notices.push(FollowNotice::CutBack);
        self.next_file()
    }

    /// Changes over to a copy of the open file that holds all that was read; says whether it does.
    fn goes_on_in(&mut self, one: Sibling) -> io::Result<bool> {
        let same = self.open.told && one.head.starts_with(&self.open.head) && self.open.window.holds(&one.file)?;
        if same {
            (self.open.id, self.open.path) = (one.id, one.path);
            self.open.window.file = one.file;
        }
        Ok(same)
    }

    /// Leaves a file of which nothing is left for the one after it, whether or not that has a row yet.
    fn next_file(&mut self) -> io::Result<()> {
        let next = if let Some(next) = self.successor(true)? {
            next
        } else {
            let (open, beside) = open_with_siblings(&self.path)?;
            Next { known: self.older(&beside, &open.window.file)?, open }
        };
        self.enter(next);
        Ok(())
    }

    /// A file that came between the last one and the open one, of which only now a first piece was read: a log that was
    /// copied and cut back in between.
    fn overlooked(&self) -> io::Result<Option<Next>> {
        for one in siblings::siblings(&self.path)? {
            let known = one.id == self.open.id || self.known.contains(&one.known());
            if !known && !one.begins_as(&self.open.head) && self.kind(&one)? != Kind::Other {
                let open = Open::from(&one.path, one.file)?;
                return Ok(Some(Next { open, known: self.known.clone() }));
            }
        }
        Ok(None)
    }

    fn enter(&mut self, next: Next) {
        if self.before.is_none() {
            self.before = Some(self.place());
        }
        self.half.extend_from_slice(self.open.window.rest());
        (self.open, self.known) = (next.open, next.known);
        self.open.sure = self.open.path != self.path;
        (self.at_top, self.gone, self.discarding) = (true, false, false);
    }

    /// The file that comes after the open one, if a row stands in it: the oldest of those that have come since, or the log
    /// itself. `cut` says that nothing is left of the open one.
    fn successor(&self, cut: bool) -> io::Result<Option<Next>> {
        let (log, beside) = match open_with_siblings(&self.path) {
            Ok((log, beside)) => (Some(log), beside),
            Err(error) if error.kind() == io::ErrorKind::NotFound => (None, siblings::siblings(&self.path)?),
            Err(error) => return Err(error),
        };
        let all = log.as_ref().map(|log| self.older(&beside, &log.window.file)).transpose()?.unwrap_or_default();
        let mut known = self.known.clone();
        known.push(Known::of(self.open.id, &self.open.head));
        let has_row = match &log {
            Some(log) => self.kind(&Sibling::of(self.path.clone(), log.window.file.try_clone()?)?)? == Kind::Rows,
            None => false,
        };
        for one in beside {
            if one.id == self.open.id || known.contains(&one.known()) {
                continue;
            }
            let kind = self.kind(&one)?;
            // What has no row may begin as any other file.
            let is_copy = kind == Kind::Rows && {
                let of_open = || {
                    io::Result::Ok(one.begins_as(&self.open.head) && (cut || one.is_copy_of(&self.open.window.file)?))
                };
                let of_log = || log.as_ref().map_or(Ok(false), |log| one.is_copy_of(&log.window.file));
                (self.open.told && of_open()?) || (has_row && of_log()?)
            };
            if is_copy || kind == Kind::Other {
                known.push(one.known());
                continue;
            }
            return Ok(Some(Next { open: Open::from(&one.path, one.file)?, known }));
        }
        Ok(log.filter(|_| has_row).map(|open| Next { open, known: all }))
    }

    /// The files that are older than a log: those beside it that are no copies of it.
    fn older(&self, beside: &[Sibling], log: &File) -> io::Result<Vec<Known>> {
        let mut known = Vec::with_capacity(beside.len());
        for one in beside {
            if self.kind(one)? != Kind::Rows || !one.is_copy_of(log)? {
                known.push(one.known());
            }
        }
        Ok(known)
    }

    /// What the first lines of a file are.
    fn kind(&self, file: &Sibling) -> io::Result<Kind> {
        let lines = file.first_lines()?;
        let mut layout = None;
        let mut kind = Kind::NoRowYet;
        for (index, line) in lines.split(|byte| *byte == b'\n').enumerate() {
            let text = String::from_utf8_lossy(line);
            let text = text.trim_start_matches('\u{feff}').trim_ascii_end();
            if layout.is_none()
                && let Ok(header) = Layout::new(text)
            {
                layout = Some(header);
                continue;
            }
            let Some(layout) = layout.as_ref().or(self.layout.as_ref()) else { continue };
            match layout.line(text, 1, self.options.empty_is_stalled) {
                Line::Row => return Ok(Kind::Rows),
                // The first one may end what the file before ends with.
                Line::Bad(_) if index > 0 => kind = Kind::Other,
                Line::Bad(_) | Line::Nothing => {}
            }
        }
        Ok(kind)
    }
}

/// What a file is, by its first lines.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Kind {
    /// A log with a row in it.
    Rows,
    /// Perhaps a log: its first row is not whole, or not there yet.
    NoRowYet,
    /// No log.
    Other,
}

/// What a line is.
enum Judged {
    Row,
    Skipped(u64, LogErrorKind),
}

/// The file to read next, and the files that are older.
struct Next {
    open: Open,
    known: Vec<Known>,
}

/// What came of looking for more.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum More {
    Read,
    Idle,
    End,
}

fn unfinished(half: &[u8]) -> Option<LogErrorKind> {
    let text = String::from_utf8_lossy(half);
    let text = text.trim();
    (!text.is_empty()).then(|| LogErrorKind::unfinished(text))
}

/// A log and the files beside it, as they were while the log had its name.
fn open_with_siblings(path: &Path) -> io::Result<(Open, Vec<Sibling>)> {
    loop {
        let before = FileId::of(&fs::metadata(path)?);
        let beside = siblings::siblings(path)?;
        let open = Open::from(path, File::open(path)?)?;
        if open.id == before {
            return Ok((open, beside));
        }
    }
}
