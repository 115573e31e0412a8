//! A link to an MQTT broker that outlives its connections.
//!
//! [`Link`] subscribes with QoS 1 and hands on what comes as [`Event`]s. A message is acknowledged by whoever took it, once
//! it is done with ([`Link::acknowledge`]); what was not acknowledged when a connection or the program ended, the broker
//! sends again. [`Link::deliver`] hands messages to the broker and returns when it has them all. A connection that breaks is
//! made again, later and later while that fails.
//!
//! Every connection has a client of its own: an acknowledgement of an earlier connection can never reach a later one, where
//! its number may stand for another message.
//!
//! What messages mean is unknown here.

mod address;
mod backoff;
mod connection;
mod error;
mod event;
mod filter;
mod link;
mod options;
mod shared;

pub use address::BrokerAddress;
pub use error::{AddressError, FilterError, LinkError};
pub use event::{Event, Message, Receipt};
pub use filter::TopicFilter;
pub use link::Link;
pub use options::{Credentials, LinkOptions, Session};
