//! A stream of rows, round by round: rows in, results out, then what is kept, then what is acknowledged.
//!
//! The order is the guarantee. A result is out before its row is kept, and a row is kept before its message is acknowledged:
//! what breaks off in between comes again, and is known or made again as it was.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use super::keeping::Keeping;
use super::remarks::Remarks;
use super::rows::Rows;
use super::shards::{Done, Shards, Step};
use super::vital::Vital;
use super::writer::Writer;
use crate::output;

/// All that a row goes through.
pub struct Stream {
    /// Where rows come from.
    pub rows: Rows,
    /// What works on them.
    pub shards: Shards,
    /// Where they go.
    pub writer: Writer,
    /// What is said of them.
    pub remarks: Remarks,
    /// Where states are kept, if they are.
    pub keeping: Option<Keeping>,
    /// What is told of the stream while it runs.
    pub vital: Arc<Vital>,
    /// Set when it is to end.
    pub stop: Arc<AtomicBool>,
    /// Whether rows go out as soon as they come in.
    pub live: bool,
}

/// How a stream of rows came to its end.
pub enum Ended {
    /// With all that was to come.
    Whole,
    /// Before that, because it was asked to.
    Interrupted,
    /// With the end of a valve's life.
    EndOfLife,
    /// With what cannot be gone on from, when rows had gone out.
    Failed(anyhow::Error),
}

impl Stream {
    /// Goes round until the end.
    pub fn run(&mut self) -> anyhow::Result<Ended> {
        loop {
            if let Some(ended) = self.round()? {
                return Ok(ended);
            }
        }
    }

    fn round(&mut self) -> anyhow::Result<Option<Ended>> {
        let (step, results) = self.work();
        self.vital.beat();
        if step.is_ok() {
            // What is not delivered is neither kept nor acknowledged: its readings come again.
            if !self.deliver(results) {
                return Ok(self.is_stopped().then_some(Ended::Whole));
            }
        }
        if let (Some(keeping), Ok(step)) = (&mut self.keeping, &step) {
            let position = self.rows.position();
            let broker = self.rows.broker();
            let stopped = self.stop.load(Ordering::Relaxed);
            let at_once = *step != Step::More || stopped || broker.is_some();
            let taken = broker.map_or(&[][..], |broker| broker.fresh());
            keeping.step(at_once, position, taken, &mut self.writer, &mut self.shards)?;
        } else if self.live {
            self.writer.flush()?;
        }
        if let (Some(broker), Ok(_)) = (self.rows.broker(), &step) {
            broker.acknowledge();
        }
        Ok(match step {
            Ok(Step::More | Step::Idle) if self.is_stopped() => {
                Some(if self.live { Ended::Whole } else { Ended::Interrupted })
            }
            Ok(Step::More | Step::Idle) => None,
            Ok(Step::End) => Some(Ended::Whole),
            Ok(Step::EndOfLife) => Some(Ended::EndOfLife),
            Err(error) if self.live => Some(Ended::Failed(error)),
            Err(error) => return Err(error),
        })
    }

    /// Works on the next rows; gives those that are to go back to a broker, with their valve.
    fn work(&mut self) -> (anyhow::Result<Step>, Vec<(String, Vec<u8>)>) {
        let publishes = self.rows.broker().is_some_and(|broker| broker.publishes());
        let mut results = Vec::new();
        let each = |done: Done<'_>| {
            self.remarks.take(done.valve, done.reading, done.remarks);
            if publishes && !done.repeats {
                results.push((done.valve.to_owned(), done.row.to_vec()));
            }
            self.writer.write(done.row)
        };
        let step = self.shards.step(&mut self.rows, each, output::note);
        (step, results)
    }

    fn deliver(&mut self, results: Vec<(String, Vec<u8>)>) -> bool {
        let Some(broker) = self.rows.broker() else { return true };
        let (delivered, word) = broker.deliver(results, &self.stop);
        if let Some(word) = word {
            output::note(&word);
        }
        delivered
    }

    fn is_stopped(&self) -> bool {
        self.stop.load(Ordering::Relaxed)
    }
}
