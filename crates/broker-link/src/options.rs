//! What a link is to be.

use crate::address::BrokerAddress;
use crate::filter::TopicFilter;

/// A name and a password.
#[derive(Clone, PartialEq, Eq)]
pub struct Credentials {
    /// The user's name.
    pub username: String,
    /// The password.
    pub password: String,
}

/// What a broker keeps for a client that is away.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Session {
    /// Nothing: it gets what comes while it is there.
    Fleeting,
    /// Its subscriptions and messages, for so long.
    Kept {
        /// Seconds after the connection has ended.
        expiry_s: u32,
    },
}

/// What a link is to be.
#[derive(Clone)]
pub struct LinkOptions {
    /// The broker.
    pub address: BrokerAddress,
    /// Name of this client, its own among all clients of the broker.
    pub client_id: String,
    /// As whom it connects.
    pub credentials: Option<Credentials>,
    /// What it subscribes to; nothing for a link that only delivers.
    pub filters: Vec<TopicFilter>,
    /// What the broker keeps for it.
    pub session: Session,
    /// Messages that the broker may send before earlier ones are acknowledged.
    pub window: u16,
    /// Largest message, bytes; the broker leaves larger ones out.
    pub largest: u32,
}
