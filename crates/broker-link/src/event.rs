//! What happens on a link.

use std::time::Duration;

use bytes::Bytes;
use rumqttc::v5::mqttbytes::v5::Publish;

use crate::error::LinkError;

/// What the broker needs to hear that a message is done with.
#[derive(Debug, Clone)]
pub struct Receipt {
    pub(crate) connection: u64,
    pub(crate) publish: Box<Publish>,
}

/// A message of the broker.
#[derive(Debug, Clone)]
pub struct Message {
    /// Its topic.
    pub topic: String,
    /// What it holds.
    pub payload: Bytes,
    /// To be handed to [`crate::Link::acknowledge`].
    pub receipt: Receipt,
}

/// Something that happened.
#[derive(Debug, Clone)]
pub enum Event {
    /// A message came.
    Message(Message),
    /// A connection stands.
    Connected {
        /// Whether one stood before.
        again: bool,
        /// Whether the broker has kept this client's session.
        session_kept: bool,
    },
    /// A connection broke or could not be made.
    Lost {
        /// What is known of why.
        reason: String,
        /// When it is tried again.
        wait: Duration,
    },
    /// The link has ended.
    Ended(LinkError),
}

impl Receipt {
    pub(crate) fn of(connection: u64, publish: &Publish) -> Self {
        Self { connection, publish: Box::new(Publish { payload: Bytes::new(), ..publish.clone() }) }
    }
}
