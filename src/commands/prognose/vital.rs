//! What a prognosis that runs on tells of itself: counts, and whether it is well.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicI64, AtomicU64, Ordering};
use std::time::{Duration, Instant};

use health_page::{Health, HealthPage, Kind, MetricsText, Source};
use prognoser::Status;
use serde::Serialize;

use crate::cli::PrognoseArgs;
use crate::output;

/// A stream that has not gone round for so long hangs.
const HANGS_AFTER: Duration = Duration::from_mins(1);
/// Milliseconds since the start that stand for "never".
const NEVER: u64 = u64::MAX;

/// Counts of a stream of rows, for whoever asks while it runs.
#[derive(Debug)]
pub struct Vital {
    started: Instant,
    rows: AtomicU64,
    skipped: AtomicU64,
    duplicates: AtomicU64,
    valves: [AtomicI64; Status::ALL.len()],
    /// Milliseconds from the start to the last row and to the last time round.
    last_row: AtomicU64,
    last_round: AtomicU64,
    broker: Option<Broker>,
}

/// Counts of a connection to a broker.
#[derive(Debug, Default)]
struct Broker {
    connected: AtomicBool,
    reconnects: AtomicU64,
    published: AtomicU64,
    refused: AtomicU64,
    dropped: AtomicU64,
}

/// What a batch of rows came to.
#[derive(Debug, Default)]
pub struct Batch {
    /// Rows.
    pub rows: u64,
    /// Of those, the ones that repeat a cycle.
    pub duplicates: u64,
    /// By how much the number of valves in each state has changed.
    pub valves: [i64; Status::ALL.len()],
}

impl Batch {
    /// A valve went from one state to another; none if it was not known.
    pub fn moved(&mut self, before: Option<Status>, after: Status) {
        if let Some(before) = before {
            self.valves[before as usize] -= 1;
        }
        self.valves[after as usize] += 1;
    }
}

impl Vital {
    /// Nothing has happened yet; `with_broker` where rows come from one.
    pub fn new(with_broker: bool) -> Self {
        Self {
            started: Instant::now(),
            rows: AtomicU64::default(),
            skipped: AtomicU64::default(),
            duplicates: AtomicU64::default(),
            valves: Default::default(),
            last_row: AtomicU64::new(NEVER),
            last_round: AtomicU64::default(),
            broker: with_broker.then(Broker::default),
        }
    }

    /// Begins to answer whoever asks, if the call wants that.
    pub fn serve(self: &Arc<Self>, args: &PrognoseArgs) -> anyhow::Result<()> {
        if let Some(address) = args.listen {
            let page =
                HealthPage::serve(address, Arc::clone(self)).map_err(|error| anyhow::anyhow!("--listen: {error}"))?;
            output::note(&format!("http://{0}/health and http://{0}/metrics tell how this program is", page.address()));
        }
        Ok(())
    }

    /// Rows were worked on.
    pub fn add(&self, batch: &Batch) {
        if batch.rows > 0 {
            self.last_row.store(self.now(), Ordering::Relaxed);
        }
        self.rows.fetch_add(batch.rows, Ordering::Relaxed);
        self.duplicates.fetch_add(batch.duplicates, Ordering::Relaxed);
        for (count, change) in self.valves.iter().zip(batch.valves) {
            count.fetch_add(change, Ordering::Relaxed);
        }
    }

    /// So many lines or messages were no rows.
    pub fn skipped(&self, count: u64) {
        self.skipped.store(count, Ordering::Relaxed);
    }

    /// A message came again.
    pub fn came_again(&self) {
        self.duplicates.fetch_add(1, Ordering::Relaxed);
    }

    /// The stream has gone round.
    pub fn beat(&self) {
        self.last_round.store(self.now(), Ordering::Relaxed);
    }

    /// A connection stands; whether one did before.
    pub fn connected(&self, again: bool) {
        if let Some(broker) = &self.broker {
            broker.connected.store(true, Ordering::Relaxed);
            broker.reconnects.fetch_add(u64::from(again), Ordering::Relaxed);
        }
    }

    /// No connection stands.
    pub fn disconnected(&self) {
        if let Some(broker) = &self.broker {
            broker.connected.store(false, Ordering::Relaxed);
        }
    }

    /// So many results have gone out, and of all so far, so many were refused; so many messages were lost.
    pub fn handed_on(&self, published: u64, refused: u64, dropped: u64) {
        if let Some(broker) = &self.broker {
            broker.published.fetch_add(published, Ordering::Relaxed);
            broker.refused.store(refused, Ordering::Relaxed);
            broker.dropped.store(dropped, Ordering::Relaxed);
        }
    }

    fn now(&self) -> u64 {
        u64::try_from(self.started.elapsed().as_millis()).unwrap_or(NEVER)
    }

    fn since(&self, then: &AtomicU64) -> Option<f64> {
        let then = then.load(Ordering::Relaxed);
        (then != NEVER).then(|| self.now().saturating_sub(then) as f64 / 1e3)
    }
}

/// Whether it is well, for whoever asks; in alphabetical order.
#[derive(Serialize)]
struct HealthDocument {
    rows: u64,
    seconds_since_last_row: Option<f64>,
    status: &'static str,
}

impl Source for Vital {
    fn health(&self) -> Health {
        let hangs = self.since(&self.last_round).is_some_and(|age_s| age_s > HANGS_AFTER.as_secs_f64());
        let away = self.broker.as_ref().is_some_and(|broker| !broker.connected.load(Ordering::Relaxed));
        let status = if away {
            "no connection to the broker"
        } else if hangs {
            "rows are not worked on"
        } else {
            "ok"
        };
        let document = HealthDocument {
            rows: self.rows.load(Ordering::Relaxed),
            seconds_since_last_row: self.since(&self.last_row),
            status,
        };
        // Nothing in it can fail: three fields with names.
        let document = serde_json::to_string(&document).unwrap_or_default();
        Health { well: status == "ok", document: document + "\n" }
    }

    fn metrics(&self) -> String {
        let mut text = MetricsText::default();
        let count = |count: &AtomicU64| count.load(Ordering::Relaxed) as f64;
        let counters = [
            ("valve_prognose_rows_total", "Rows worked on.", &self.rows),
            ("valve_prognose_skipped_total", "Lines or messages that were no rows and were skipped.", &self.skipped),
            (
                "valve_prognose_duplicates_total",
                "Rows whose cycle was there before; they are not used.",
                &self.duplicates,
            ),
        ];
        for (name, help, value) in counters {
            text.metric(name, Kind::Counter, help).value(name, count(value));
        }
        let name = "valve_prognose_valves";
        text.metric(name, Kind::Gauge, "Valves by the status of their last row.");
        for status in Status::ALL {
            let valves = self.valves[status as usize].load(Ordering::Relaxed);
            text.labelled(name, ("status", status.name()), valves as f64);
        }
        let name = "valve_prognose_seconds_since_last_row";
        text.metric(name, Kind::Gauge, "Seconds since the last row; not there before the first.");
        if let Some(age_s) = self.since(&self.last_row) {
            text.value(name, age_s);
        }
        if let Some(broker) = &self.broker {
            let name = "valve_prognose_broker_connected";
            let connected = u8::from(broker.connected.load(Ordering::Relaxed));
            text.metric(name, Kind::Gauge, "Whether a connection to the broker stands.").value(name, connected.into());
            let counters = [
                ("valve_prognose_broker_reconnects_total", "Connections after the first.", &broker.reconnects),
                ("valve_prognose_results_total", "Results that the broker has taken or refused.", &broker.published),
                ("valve_prognose_results_refused_total", "Results that the broker has refused.", &broker.refused),
                ("valve_prognose_dropped_total", "Messages of QoS 0 that came too fast and are gone.", &broker.dropped),
            ];
            for (name, help, value) in counters {
                text.metric(name, Kind::Counter, help).value(name, count(value));
            }
        }
        text.into_text()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn valves_are_counted_where_they_are_now() {
        let vital = Vital::new(false);
        let mut batch = Batch { rows: 3, ..Batch::default() };
        batch.moved(None, Status::Healthy);
        batch.moved(None, Status::Healthy);
        batch.moved(Some(Status::Healthy), Status::ActNow);
        vital.add(&batch);
        let text = vital.metrics();
        for line in [
            "valve_prognose_rows_total 3",
            "valve_prognose_valves{status=\"healthy\"} 1",
            "valve_prognose_valves{status=\"act-now\"} 1",
            "valve_prognose_valves{status=\"watch\"} 0",
        ] {
            assert!(text.lines().any(|found| found == line), "{line} in\n{text}");
        }
        assert!(
            text.contains("\nvalve_prognose_seconds_since_last_row 0.") || text.contains("_last_row 0\n"),
            "{text}"
        );
        assert!(!text.contains("broker"), "{text}");
    }

    #[test]
    fn without_its_broker_it_is_not_well() {
        let vital = Vital::new(true);
        assert!(!vital.health().well);
        vital.connected(false);
        vital.connected(true);
        assert!(vital.health().well && vital.metrics().contains("\nvalve_prognose_broker_reconnects_total 1\n"));
        vital.disconnected();
        let health = vital.health();
        assert!(!health.well && health.document.contains("\"status\":\"no connection to the broker\""), "{health:?}");
    }
}
