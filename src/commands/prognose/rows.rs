//! Where rows come from: a log as it is, one that grows, another program, or a broker.

use std::io::{self, BufRead, BufReader, Read};
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, SyncSender, sync_channel};
use std::thread;
use std::time::Duration;

use broker_link::BrokerAddress;
use prognoser::{FollowOptions, Followed, FollowedLog, LogError, LogErrorKind, LogPosition, LogRow, TimingLog};
use state_store::Store;

use super::subscribed::Subscribed;
use super::vital::Vital;
use crate::cli::PrognoseArgs;
use crate::commands::log_input::{Line, LogInput};
use crate::failure::Hinted;

/// How often a growing log is looked at.
const POLL: Duration = Duration::from_millis(100);
/// Bytes that are read at once, and how many such pieces may wait.
const PIECE: usize = 1 << 16;
const WAITING: usize = 4;

/// A source of rows.
pub enum Rows {
    /// A file that is read to its end.
    Whole(LogInput),
    /// What another program writes.
    Piped(Box<TimingLog<BufReader<Pipe>>>, Arc<AtomicBool>),
    /// A file that is followed.
    Followed(Box<FollowedLog>),
    /// Messages of a broker.
    Subscribed(Box<Subscribed>),
}

/// What comes next.
pub enum Next<'a> {
    /// A row.
    Row(LogRow<'a>),
    /// A line or message that is no row; those behind it may be.
    Skipped(anyhow::Error),
    /// Something happened to the source.
    Notice(String),
    /// Nothing more for now: what there is can go out.
    Idle,
    /// Nothing more.
    End,
}

impl Rows {
    /// Opens what the call wants to be read, until `stop` is set; with a state, from where that is.
    pub fn open(
        args: &PrognoseArgs,
        from: Option<LogPosition>,
        store: Option<&Store>,
        vital: &Arc<Vital>,
        stop: &Arc<AtomicBool>,
    ) -> anyhow::Result<Self> {
        if from_broker(args) {
            return Ok(Self::Subscribed(Box::new(Subscribed::open(args, store, vital)?)));
        }
        let name = args.log.display().to_string();
        let empty_is_stalled = args.empty_is_stalled;
        if args.log == Path::new("-") {
            let source = BufReader::new(Pipe::stdin(Arc::clone(stop)));
            let log = TimingLog::new(name, source).map_err(only_plain)?.with_empty_as_stalled(empty_is_stalled);
            return Ok(Self::Piped(Box::new(log), Arc::clone(stop)));
        }
        if args.follow || args.state.is_some() {
            let options = FollowOptions { forever: args.follow, poll: POLL, stop: Arc::clone(stop), empty_is_stalled };
            let log = FollowedLog::open(&args.log, from, options).map_err(only_plain)?;
            return Ok(Self::Followed(Box::new(log)));
        }
        let mut log = LogInput::open(&args.log, &args.columns, empty_is_stalled)?;
        log.announce();
        Ok(Self::Whole(log))
    }

    /// Whether rows go out as soon as they come in.
    pub fn is_live(&self) -> bool {
        !matches!(self, Self::Whole(_))
    }

    /// Whether a row must be worked on before the next one is asked for, since that may be long in coming.
    pub fn one_by_one(&self) -> bool {
        matches!(self, Self::Piped(..))
    }

    /// How far it was read, where it can be gone on from there.
    pub fn position(&self) -> Option<LogPosition> {
        match self {
            Self::Followed(log) => Some(log.position()),
            Self::Whole(_) | Self::Piped(..) | Self::Subscribed(_) => None,
        }
    }

    /// The columns that are not understood and not used.
    pub fn unknown_columns(&self) -> &[String] {
        match self {
            Self::Piped(log, _) => log.unknown_columns(),
            Self::Followed(log) => log.unknown_columns(),
            // Of a file these are told as it is opened.
            Self::Whole(_) | Self::Subscribed(_) => &[],
        }
    }

    /// What comes next.
    pub fn next(&mut self) -> anyhow::Result<Next<'_>> {
        match self {
            Self::Whole(log) => Ok(match log.next()? {
                Line::Row(row) => Next::Row(row),
                Line::Skipped(error) => Next::Skipped(error),
                Line::End => Next::End,
            }),
            Self::Piped(log, stop) => piped(log, stop),
            Self::Followed(log) => Ok(match log.next()? {
                Followed::Row(row) => Next::Row(row),
                Followed::Skipped(error) => Next::Skipped(error.into()),
                Followed::Notice(notice) => Next::Notice(notice.to_string()),
                Followed::Idle => Next::Idle,
                Followed::End => Next::End,
            }),
            Self::Subscribed(messages) => messages.next(),
        }
    }

    /// The broker that rows come from, if they come from one.
    pub fn broker(&mut self) -> Option<&mut Subscribed> {
        match self {
            Self::Subscribed(messages) => Some(messages),
            Self::Whole(_) | Self::Piped(..) | Self::Followed(_) => None,
        }
    }
}

/// A log that grows must be plain, and what is not may be read once.
fn only_plain(error: LogError) -> anyhow::Error {
    match error.kind {
        LogErrorKind::MissingColumn { .. } | LogErrorKind::NotText => Hinted::error(
            error.to_string(),
            "a log with other columns, units or separators is read as a whole: give it as a file, without --follow and --state",
        ),
        _ => error.into(),
    }
}

/// Whether a call wants readings from a broker.
pub fn from_broker(args: &PrognoseArgs) -> bool {
    args.log.to_str().is_some_and(BrokerAddress::is_meant)
}

fn piped<'a, R: BufRead>(log: &'a mut TimingLog<R>, stop: &AtomicBool) -> anyhow::Result<Next<'a>> {
    let next = log.next_row();
    // The last line may be cut off where the reading was stopped.
    if stop.load(Ordering::Relaxed) {
        return Ok(Next::End);
    }
    match next {
        Ok(row) => Ok(row.map_or(Next::End, Next::Row)),
        Err(error) if error.kind.is_row() => Ok(Next::Skipped(error.into())),
        Err(error) => Err(error.into()),
    }
}

/// Bytes of another program, read by a thread of its own, so that waiting for them can be ended.
pub struct Pipe {
    pieces: Receiver<io::Result<Vec<u8>>>,
    at_hand: io::Cursor<Vec<u8>>,
    stop: Arc<AtomicBool>,
}

impl Pipe {
    fn stdin(stop: Arc<AtomicBool>) -> Self {
        let (sender, pieces) = sync_channel(WAITING);
        thread::spawn(move || hand_on(&sender));
        Self { pieces, at_hand: io::Cursor::default(), stop }
    }
}

fn hand_on(sender: &SyncSender<io::Result<Vec<u8>>>) {
    let mut stdin = io::stdin().lock();
    let mut buffer = vec![0; PIECE];
    loop {
        let piece = match stdin.read(&mut buffer) {
            Ok(0) => return,
            Ok(count) => Ok(buffer[..count].to_vec()),
            Err(error) if error.kind() == io::ErrorKind::Interrupted => continue,
            Err(error) => Err(error),
        };
        let failed = piece.is_err();
        if sender.send(piece).is_err() || failed {
            return;
        }
    }
}

impl Read for Pipe {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        loop {
            let count = self.at_hand.read(buffer)?;
            if count > 0 || buffer.is_empty() {
                return Ok(count);
            }
            match self.pieces.recv_timeout(POLL) {
                Ok(piece) => self.at_hand = io::Cursor::new(piece?),
                Err(RecvTimeoutError::Timeout) if !self.stop.load(Ordering::Relaxed) => {}
                Err(RecvTimeoutError::Timeout | RecvTimeoutError::Disconnected) => return Ok(0),
            }
        }
    }
}
