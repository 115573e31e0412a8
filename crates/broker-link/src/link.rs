//! The link as its owner has it.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, channel};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

use rumqttc::v5::mqttbytes::QoS;

use crate::connection;
use crate::error::LinkError;
use crate::event::{Event, Receipt};
use crate::options::LinkOptions;
use crate::shared::Shared;

/// How long what waits looks around for changes that nobody tells of.
const LOOK: Duration = Duration::from_millis(20);
/// How long the end of a link may take.
const FAREWELL: Duration = Duration::from_secs(2);

/// A link to a broker, with a thread of its own.
pub struct Link {
    shared: Arc<Shared>,
    events: Receiver<Event>,
    thread: Option<JoinHandle<()>>,
}

impl Link {
    /// Begins to connect, and goes on doing so until [`Event::Ended`].
    ///
    /// # Errors
    /// If the system gives no thread.
    pub fn start(options: LinkOptions) -> Result<Self, LinkError> {
        let shared = Arc::new(Shared::default());
        let (sender, events) = channel();
        let theirs = Arc::clone(&shared);
        let runtime = tokio::runtime::Builder::new_current_thread()
            .enable_all()
            .build()
            .map_err(|error| LinkError::System(error.to_string()))?;
        let work = move || runtime.block_on(connection::run(&options, &theirs, &sender));
        let thread = thread::Builder::new()
            .name("broker link".to_owned())
            .spawn(work)
            .map_err(|error| LinkError::System(error.to_string()))?;
        Ok(Self { shared, events, thread: Some(thread) })
    }

    /// What has happened next; none if nothing does for so long.
    pub fn next(&self, wait: Duration) -> Option<Event> {
        match self.events.recv_timeout(wait) {
            Ok(event) => {
                if matches!(event, Event::Message(_)) {
                    self.shared.waiting.fetch_sub(1, Ordering::Relaxed);
                }
                Some(event)
            }
            // After the end nothing happens any more, as slowly as before.
            Err(RecvTimeoutError::Disconnected) => {
                thread::sleep(wait);
                None
            }
            Err(RecvTimeoutError::Timeout) => None,
        }
    }

    /// Tells the broker that a message is done with. Where its connection is gone this does nothing: the broker sends it
    /// again.
    pub fn acknowledge(&self, receipt: &Receipt) {
        loop {
            let state = self.shared.state();
            match &state.client {
                Some(client) if state.connection == receipt.connection => {
                    if client.try_ack(&receipt.publish).is_ok() {
                        return;
                    }
                }
                _ => return,
            }
            // The queue is full; the connection empties it.
            let _ = self.shared.changed.wait_timeout(state, LOOK);
        }
    }

    /// Hands messages, topic and payload, to the broker and returns when it has them all, after broken connections too;
    /// false if `stop` was set before. A message may reach it twice, and then is the same.
    pub fn deliver(&self, messages: &[(String, Vec<u8>)], stop: &AtomicBool) -> bool {
        let before = self.shared.state().taken;
        let (mut connection, mut sent) = (0, 0);
        loop {
            let state = self.shared.state();
            // Brokers answer in the order in which they were sent.
            let taken = usize::try_from(state.taken - before).unwrap_or(usize::MAX);
            if taken >= messages.len() {
                return true;
            }
            if stop.load(Ordering::Relaxed) || self.shared.ended.load(Ordering::Relaxed) {
                return false;
            }
            if state.connection != connection {
                (connection, sent) = (state.connection, taken);
            }
            if let Some(client) = &state.client {
                while let Some((topic, payload)) = messages.get(sent) {
                    if client.try_publish(topic, QoS::AtLeastOnce, false, payload.clone()).is_err() {
                        break;
                    }
                    sent += 1;
                }
            }
            let _ = self.shared.changed.wait_timeout(state, LOOK);
        }
    }

    /// How many delivered messages the broker has refused so far, such as those to topics that this client may not write to.
    pub fn refused(&self) -> u64 {
        self.shared.state().refused
    }

    /// Messages of QoS 0 that came faster than they were taken and are gone.
    pub fn dropped(&self) -> u64 {
        self.shared.dropped.load(Ordering::Relaxed)
    }

    /// Whether a connection stands.
    pub fn is_connected(&self) -> bool {
        self.shared.state().client.is_some()
    }
}

impl Drop for Link {
    /// Says goodbye to the broker, behind the acknowledgements that are still to go out.
    fn drop(&mut self) {
        self.shared.ended.store(true, Ordering::Relaxed);
        if let Some(client) = &self.shared.state().client {
            let _ = client.try_disconnect();
        }
        let Some(thread) = self.thread.take() else { return };
        let begun = Instant::now();
        while !thread.is_finished() && begun.elapsed() < FAREWELL {
            thread::sleep(Duration::from_millis(5));
        }
    }
}
