//! A log on all cores: its valves are shared out among them, its rows come out
//! in the order in which they went in, the same bytes whatever the number.

use std::collections::HashSet;
use std::hash::{BuildHasher, BuildHasherDefault, DefaultHasher};
use std::ops::Range;
use std::sync::Arc;

use leak_table::TableBundle;
use prognoser::{LogRow, Method, Notice, Prognoser, Prognosis, Reading, Status};
use rayon::prelude::*;
use state_store::{Fingerprint, Progress, Reader, Store};

use super::remarks::{Remark, remark};
use super::rows::{Next, Rows};
use super::vital::{Batch, Vital};
use super::writer::RowFormat;
use crate::commands::log_input::Skips;
use crate::commands::same_names::SameNames;
use answers::figures::life::History;

/// Valves that are in memory while the others are in a store.
const MOST_AT_HAND: usize = 1 << 14;

/// Rows that are read before they are worked on: so many that their results take some megabytes. Where neither rows nor
/// states are told, more of them, of which most valves have several then.
const CHUNK: usize = 1 << 14;
const UNTOLD_CHUNK: usize = 1 << 16;

/// Shards for each thread: so that one that has been kept waiting leaves its work to others.
const SHARDS_A_THREAD: usize = 4;

/// What a step came to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Step {
    /// There may be more rows.
    More,
    /// There are none for now.
    Idle,
    /// There are none.
    End,
    /// A valve came to the end of its life, and that was to end the stream.
    EndOfLife,
}

/// How a stream of rows is worked on.
#[derive(Debug, Clone, Copy)]
pub struct Way {
    /// How rows are written.
    pub format: RowFormat,
    /// A row at a time.
    pub one_by_one: bool,
    /// What is no row ends the stream.
    pub strict: bool,
    /// So many lines that are no rows are told one by one.
    pub most_skips: u64,
    /// The first end of life ends the stream.
    pub until_end_of_life: bool,
    /// What a row stands in: a line, or a message.
    pub unit: &'static str,
}

/// Rows of a log, their texts one after the other.
#[derive(Default)]
struct Chunk {
    texts: String,
    rows: Vec<Row>,
}

struct Row {
    shard: usize,
    valve: Range<usize>,
    time: Option<Range<usize>>,
    reading: Reading,
    line: u64,
}

/// Some of the valves.
struct Shard {
    prognoser: Prognoser,
    history: Option<History>,
    out: Vec<u8>,
    remarks: Vec<Remark>,
    /// What came out, for each of the shard's rows in the order of the log.
    spans: Vec<Span>,
    /// The order in which they are worked on: hash of the valve, place among the shard's rows, place in the chunk.
    order: Vec<(u64, usize, usize)>,
    /// What the rows came to.
    batch: Batch,
    /// Whether a valve came to the end of its life.
    ended: bool,
    /// Valves with rows since the last commit.
    touched: HashSet<String>,
    /// Valves that were not there before, with the place of their row in the chunk.
    fresh: Vec<(usize, String)>,
}

/// Where a row and its remarks stand, and whether it repeats a cycle.
#[derive(Debug, Clone, Default)]
struct Span {
    out: Range<usize>,
    remarks: Range<usize>,
    repeats: bool,
}

/// A row that was worked on.
#[derive(Debug, Clone, Copy)]
pub struct Done<'a> {
    /// The valve.
    pub valve: &'a str,
    /// What was measured.
    pub reading: &'a Reading,
    /// The row that goes out.
    pub row: &'a [u8],
    /// What is to be said of it.
    pub remarks: &'a [Remark],
    /// Whether its cycle was there before.
    pub repeats: bool,
}

/// All valves of a log.
pub struct Shards {
    /// Where valves are that are not in memory.
    store: Option<Arc<Store>>,
    log: String,
    way: Way,
    vital: Arc<Vital>,
    all: Vec<Shard>,
    chunk: Chunk,
    /// Lines that were no rows.
    skips: Skips,
    names: SameNames,
}

impl Shards {
    /// Some shards for each thread; a single one where rows come one by one, a valve is drawn, or there is one thread.
    pub fn new(
        log: String,
        tables: &Arc<TableBundle>,
        method: &Method,
        way: Way,
        history: Option<History>,
        store: Option<Arc<Store>>,
        vital: Arc<Vital>,
    ) -> Self {
        let threads = rayon::current_num_threads();
        let count = if way.one_by_one || history.is_some() || threads < 2 { 1 } else { SHARDS_A_THREAD * threads };
        let mut history = history;
        let shards = (0..count).map(|_| Shard {
            prognoser: Prognoser::new(Arc::clone(tables), *method),
            history: history.take(),
            out: Vec::new(),
            remarks: Vec::new(),
            spans: Vec::new(),
            order: Vec::new(),
            batch: Batch::default(),
            ended: false,
            touched: HashSet::new(),
            fresh: Vec::new(),
        });
        Self {
            store,
            log,
            way,
            vital,
            all: shards.collect(),
            chunk: Chunk::default(),
            skips: Skips::default(),
            names: SameNames::default(),
        }
    }

    /// Reads and works on the next rows of a log, and gives every row with its
    /// remarks. What was read before an error is given as well.
    pub fn step(
        &mut self,
        rows: &mut Rows,
        mut each: impl FnMut(Done<'_>) -> anyhow::Result<()>,
        mut note: impl FnMut(&str),
    ) -> anyhow::Result<Step> {
        let read = self.read(rows, &mut note);
        let chunk = &self.chunk;
        let (name, format) = (self.log.as_str(), self.way.format);
        let kept = self.store.as_deref().map(Store::reader).transpose()?;
        let work = |shard: &mut Shard| shard.work(chunk, name, format, kept.as_ref());
        if self.all.len() == 1 {
            self.all.iter_mut().try_for_each(work)?;
        } else {
            self.all.par_iter_mut().try_for_each(work)?;
        }
        let mut spans: Vec<_> = self.all.iter().map(|shard| shard.spans.iter()).collect();
        for row in &self.chunk.rows {
            let shard = &self.all[row.shard];
            let Some(Span { out, remarks, repeats }) = spans[row.shard].next() else { break };
            let (valve, reading) = (&chunk.texts[row.valve.clone()], &row.reading);
            let (row, remarks) = (&shard.out[out.clone()], &shard.remarks[remarks.clone()]);
            each(Done { valve, reading, row, remarks, repeats: *repeats })?;
        }
        self.meet_names(&mut note);
        for shard in &self.all {
            self.vital.add(&shard.batch);
        }
        let step = read?;
        Ok(if self.way.until_end_of_life && self.all.iter().any(|shard| shard.ended) { Step::EndOfLife } else { step })
    }

    fn read(&mut self, rows: &mut Rows, note: &mut impl FnMut(&str)) -> anyhow::Result<Step> {
        self.chunk.texts.clear();
        self.chunk.rows.clear();
        for shard in &mut self.all {
            shard.order.clear();
        }
        let size = match () {
            () if self.way.one_by_one => 1,
            () if self.way.format.tells_rows() || self.store.is_some() => CHUNK,
            () => UNTOLD_CHUNK,
        };
        let hasher = BuildHasherDefault::<DefaultHasher>::default();
        while self.chunk.rows.len() < size {
            let row = match rows.next()? {
                Next::Row(row) => row,
                Next::Skipped(error) if self.way.strict => return Err(error),
                Next::Skipped(error) => {
                    let words = self.skips.take(&error, self.way.unit);
                    self.vital.skipped(self.skips.count());
                    if self.skips.count() <= self.way.most_skips {
                        note(&words);
                    }
                    continue;
                }
                Next::Notice(notice) => {
                    note(&format!("{}: {notice}", self.log));
                    continue;
                }
                Next::Idle => return Ok(Step::Idle),
                Next::End => return Ok(Step::End),
            };
            let texts = &mut self.chunk.texts;
            let mut keep = |text: &str| {
                let start = texts.len();
                texts.push_str(text);
                start..texts.len()
            };
            let (valve, time) = (keep(row.valve), row.time.map(&mut keep));
            let hash = hasher.hash_one(row.valve);
            #[expect(clippy::cast_possible_truncation, reason = "a remainder by a small number")]
            let shard = (hash % self.all.len() as u64) as usize;
            let order = &mut self.all[shard].order;
            order.push((hash, order.len(), self.chunk.rows.len()));
            self.chunk.rows.push(Row { shard, valve, time, reading: row.reading, line: row.line });
        }
        Ok(Step::More)
    }

    /// Asks about names that differ in nothing but case and spaces, in the order of the rows.
    fn meet_names(&mut self, note: &mut impl FnMut(&str)) {
        let mut fresh: Vec<(usize, String)> = self.all.iter_mut().flat_map(|shard| shard.fresh.drain(..)).collect();
        fresh.sort_unstable();
        for (at, valve) in fresh {
            if let Some(words) = self.names.meet(&valve) {
                note(&format!("{}:{}: {words}", self.log, self.chunk.rows[at].line));
            }
        }
    }

    /// Valves with rows since the last commit.
    pub fn touched(&self) -> usize {
        self.all.iter().map(|shard| shard.touched.len()).sum()
    }

    /// Keeps the valves that had rows, and lets go of some where many are in memory.
    pub fn commit(&mut self, store: &Store, progress: &Progress, taken: &[Fingerprint]) -> anyhow::Result<()> {
        let mut names: Vec<(&str, &Prognoser)> = Vec::with_capacity(self.touched());
        for shard in &self.all {
            names.extend(shard.touched.iter().map(|name| (name.as_str(), &shard.prognoser)));
        }
        names.sort_unstable_by_key(|(name, _)| *name);
        let states = names.iter().filter_map(|(name, prognoser)| Some((*name, prognoser.state(name)?)));
        store.commit(progress, taken, states)?;
        let most = MOST_AT_HAND / self.all.len();
        for shard in &mut self.all {
            shard.let_go(most);
        }
        Ok(())
    }

    /// Lines that were no rows.
    pub fn skips(&self) -> &Skips {
        &self.skips
    }

    /// The names of the valves.
    pub fn names(&self) -> &SameNames {
        &self.names
    }

    /// The last prognosis of every valve, and the path of the one that is drawn.
    pub fn finish(self) -> (Vec<Prognosis>, Option<History>) {
        let mut history = None;
        let mut lasts = Vec::new();
        for shard in self.all {
            lasts.extend(shard.prognoser.lasts().cloned());
            history = history.or(shard.history);
        }
        (lasts, history)
    }
}

impl Shard {
    /// Keeps at most so many valves in memory, those with rows since the last commit if there are no more of them.
    fn let_go(&mut self, most: usize) {
        if self.prognoser.valves() > most {
            let all = self.touched.len() > most;
            let gone = |name: &&str| all || !self.touched.contains(*name);
            let gone: Vec<String> = self.prognoser.names().filter(gone).map(str::to_owned).collect();
            for name in &gone {
                self.prognoser.forget(name);
            }
        }
        self.touched.clear();
    }

    fn work(&mut self, chunk: &Chunk, log: &str, format: RowFormat, kept: Option<&Reader<'_>>) -> anyhow::Result<()> {
        self.out.clear();
        self.remarks.clear();
        self.batch = Batch::default();
        // A valve's rows one after the other, so that what is known of it is fetched from memory once a chunk.
        self.order.sort_unstable();
        self.spans.clear();
        self.spans.resize(self.order.len(), Span::default());
        for (k, (_, place, at)) in self.order.iter().enumerate() {
            let row = &chunk.rows[*at];
            let next = self.order.get(k + 1).map(|(_, _, at)| &chunk.rows[*at]);
            let (out, remarks) = (self.out.len(), self.remarks.len());
            let valve = &chunk.texts[row.valve.clone()];
            let time = row.time.clone().map(|time| &chunk.texts[time]);
            if let Some(kept) = kept
                && !self.touched.contains(valve)
            {
                if !self.prognoser.knows(valve)
                    && let Some(state) = kept.valve(valve)?
                {
                    self.prognoser.resume(valve, state);
                }
                self.touched.insert(valve.to_owned());
            }
            let before = self.prognoser.last(valve).map(|last| last.status);
            if before.is_none() {
                self.fresh.push((*at, valve.to_owned()));
            }
            // Of a row that is not told and whose valve goes on within the chunk only the status is looked at.
            let passes = !format.tells_rows()
                && self.history.is_none()
                && next.is_some_and(|next| {
                    chunk.texts[next.valve.clone()] == *valve && next.reading.cycle > row.reading.cycle
                });
            let one = LogRow { valve, reading: row.reading, time, line: row.line };
            let prognosis = if passes { self.prognoser.pass(&one) } else { self.prognoser.push(&one) };
            let repeats = prognosis.notices.contains(&Notice::RepeatedCycle);
            self.batch.rows += 1;
            self.batch.duplicates += u64::from(repeats);
            self.batch.moved(before, prognosis.status);
            self.ended |= prognosis.status == Status::EolReached && before != Some(Status::EolReached);
            let notices = prognosis.notices.iter();
            self.remarks.extend(notices.map(|notice| remark(log, row.line, valve, prognosis.cycle, notice)));
            if let Some(history) = &mut self.history {
                history.add(&row.reading, &prognosis);
            }
            format.row(&mut self.out, &prognosis)?;
            self.spans[*place] = Span { out: out..self.out.len(), remarks: remarks..self.remarks.len(), repeats };
        }
        Ok(())
    }
}
