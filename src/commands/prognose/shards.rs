//! A log on all cores: its valves are shared out among them, its rows come out
//! in the order in which they went in, the same bytes whatever the number.

use std::hash::{BuildHasher, BuildHasherDefault, DefaultHasher};
use std::io::BufRead;
use std::ops::Range;
use std::sync::Arc;

use leak_table::TableBundle;
use prognoser::{LogError, LogRow, Method, Prognoser, Prognosis, Reading, TimingLog};
use rayon::prelude::*;

use super::history::History;
use super::writer::RowFormat;

/// Rows that are read before they are worked on.
const CHUNK: usize = 1 << 14;

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
    notes: String,
    /// Where the row and its notes end, for each of the shard's rows.
    ends: Vec<(usize, usize)>,
}

/// All valves of a log.
pub struct Shards {
    log: String,
    format: RowFormat,
    all: Vec<Shard>,
    chunk: Chunk,
    size: usize,
}

impl Shards {
    /// As many shards as there are threads; a single one, a row at a time, for
    /// a live log; a single one where a valve is drawn.
    pub fn new(
        log: String,
        tables: &Arc<TableBundle>,
        method: &Method,
        format: RowFormat,
        live: bool,
        history: Option<History>,
    ) -> Self {
        let count = if live || history.is_some() { 1 } else { rayon::current_num_threads().max(1) };
        let mut history = history;
        let shards = (0..count).map(|_| Shard {
            prognoser: Prognoser::new(Arc::clone(tables), *method),
            history: history.take(),
            out: Vec::new(),
            notes: String::new(),
            ends: Vec::new(),
        });
        Self { log, format, all: shards.collect(), chunk: Chunk::default(), size: if live { 1 } else { CHUNK } }
    }

    /// Reads and works on the next rows of a log, and gives every row with its
    /// notes. Says whether there may be more. What was read before an error is
    /// given as well.
    pub fn step<R: BufRead>(
        &mut self,
        log: &mut TimingLog<R>,
        mut each: impl FnMut(&[u8], &str) -> anyhow::Result<()>,
    ) -> anyhow::Result<bool> {
        let read = self.read(log);
        let chunk = &self.chunk;
        let (name, format) = (self.log.as_str(), self.format);
        let work = |(index, shard): (usize, &mut Shard)| shard.work(index, chunk, name, format);
        if self.all.len() == 1 {
            self.all.iter_mut().enumerate().try_for_each(work)?;
        } else {
            self.all.par_iter_mut().enumerate().try_for_each(work)?;
        }
        let mut next = vec![(0, (0, 0)); self.all.len()];
        for row in &self.chunk.rows {
            let shard = &self.all[row.shard];
            let (index, (out, note)) = &mut next[row.shard];
            let (row_end, note_end) = shard.ends[*index];
            each(&shard.out[*out..row_end], &shard.notes[*note..note_end])?;
            *index += 1;
            (*out, *note) = (row_end, note_end);
        }
        Ok(read?)
    }

    fn read<R: BufRead>(&mut self, log: &mut TimingLog<R>) -> Result<bool, LogError> {
        self.chunk.texts.clear();
        self.chunk.rows.clear();
        let hasher = BuildHasherDefault::<DefaultHasher>::default();
        while self.chunk.rows.len() < self.size {
            let Some(row) = log.next_row()? else { return Ok(false) };
            let texts = &mut self.chunk.texts;
            let mut keep = |text: &str| {
                let start = texts.len();
                texts.push_str(text);
                start..texts.len()
            };
            let (valve, time) = (keep(row.valve), row.time.map(&mut keep));
            #[expect(clippy::cast_possible_truncation, reason = "a remainder by a small number")]
            let shard = (hasher.hash_one(row.valve) % self.all.len() as u64) as usize;
            self.chunk.rows.push(Row { shard, valve, time, reading: row.reading, line: row.line });
        }
        Ok(true)
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
    fn work(&mut self, index: usize, chunk: &Chunk, log: &str, format: RowFormat) -> anyhow::Result<()> {
        self.out.clear();
        self.notes.clear();
        self.ends.clear();
        for row in chunk.rows.iter().filter(|row| row.shard == index) {
            let valve = &chunk.texts[row.valve.clone()];
            let time = row.time.clone().map(|time| &chunk.texts[time]);
            let prognosis = self.prognoser.push(&LogRow { valve, reading: row.reading, time, line: row.line });
            for notice in &prognosis.notices {
                let note = format!("{log}:{}: valve {valve}, cycle {}: {notice}\n", row.line, prognosis.cycle);
                self.notes.push_str(&note);
            }
            if let Some(history) = &mut self.history {
                history.add(&row.reading, &prognosis);
            }
            format.row(&mut self.out, &prognosis)?;
            self.ends.push((self.out.len(), self.notes.len()));
        }
        Ok(())
    }
}
