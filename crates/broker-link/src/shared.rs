//! What the link's owner and its thread both see.

use std::sync::atomic::{AtomicBool, AtomicU64, AtomicUsize, Ordering};
use std::sync::{Condvar, Mutex, MutexGuard, PoisonError};

use rumqttc::v5::AsyncClient;
use rumqttc::v5::mqttbytes::QoS;
use rumqttc::v5::mqttbytes::v5::Publish;

/// Messages that may wait unasked for: of those that need no acknowledgement, brokers send any number.
const MOST_WAITING: usize = 1 << 14;

/// What both threads see.
#[derive(Default)]
pub(crate) struct Shared {
    state: Mutex<State>,
    pub(crate) changed: Condvar,
    pub(crate) ended: AtomicBool,
    /// Messages that nobody has taken yet.
    pub(crate) waiting: AtomicUsize,
    /// Messages without acknowledgement that came too fast and are gone.
    pub(crate) dropped: AtomicU64,
}

/// How the connection stands.
#[derive(Default)]
pub(crate) struct State {
    /// Number of the connection, from 1.
    pub(crate) connection: u64,
    /// Its client, while it stands.
    pub(crate) client: Option<AsyncClient>,
    /// Messages that the broker has taken, of all connections.
    pub(crate) taken: u64,
    /// Messages that it has refused, of those.
    pub(crate) refused: u64,
}

impl Shared {
    pub(crate) fn state(&self) -> MutexGuard<'_, State> {
        // Nobody panics while holding it; what is in it is whole in any case.
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    pub(crate) fn is_ended(&self) -> bool {
        self.ended.load(Ordering::Relaxed)
    }

    pub(crate) fn end(&self) {
        self.ended.store(true, Ordering::Relaxed);
        self.changed.notify_all();
    }

    /// A connection stands; gives its number.
    pub(crate) fn connected(&self, client: AsyncClient) -> u64 {
        let mut state = self.state();
        state.connection += 1;
        state.client = Some(client);
        self.changed.notify_all();
        state.connection
    }

    pub(crate) fn lost(&self) {
        self.state().client = None;
        self.changed.notify_all();
    }

    /// Whether there is room for a message; those that the broker sends again always have it.
    pub(crate) fn takes(&self, publish: &Publish) -> bool {
        if publish.qos == QoS::AtMostOnce && self.waiting.load(Ordering::Relaxed) >= MOST_WAITING {
            self.dropped.fetch_add(1, Ordering::Relaxed);
            return false;
        }
        self.waiting.fetch_add(1, Ordering::Relaxed);
        true
    }

    /// The broker has answered to a delivered message.
    pub(crate) fn answered(&self, refused: bool) {
        let mut state = self.state();
        state.taken += 1;
        state.refused += u64::from(refused);
        self.changed.notify_all();
    }
}
