//! What can be wrong with a link.

use thiserror::Error;

/// Why a text is no address of a broker.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
pub enum AddressError {
    /// It begins with something else.
    #[error("found {found:?}, expected the address of a broker, such as mqtt://plant-broker:1883")]
    Scheme {
        /// The text.
        found: String,
    },
    /// This build speaks without encryption alone.
    #[error(
        "found mqtts://, expected mqtt://; this program was built without encryption: build it with `--features tls`"
    )]
    NoTls,
    /// A name or a password stands in it.
    #[error(
        "found a user name or password in the address, where others on this machine can read it; expected \
         mqtt://HOST:PORT, and both in a file or in the environment"
    )]
    Credentials,
    /// Something stands behind host and port.
    #[error("found {found:?} behind host and port, expected nothing there; topics have an option of their own")]
    Path {
        /// What stands there.
        found: String,
    },
    /// The host is missing.
    #[error("found no host, expected one, such as mqtt://plant-broker:1883")]
    Host,
    /// The port is none.
    #[error("found the port {found:?}, expected a number from 1 to 65535")]
    Port {
        /// What stands there.
        found: String,
    },
}

/// Why a text is no topic filter.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[error("topic {found:?}: {problem}")]
pub struct FilterError {
    /// The text.
    pub found: String,
    /// What is wrong with it, and what would be right.
    pub problem: &'static str,
}

/// Why a link cannot be, or not any longer.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
pub enum LinkError {
    /// The broker does not let this client in.
    #[error("{broker}: the broker refuses the connection: {reason}")]
    Refused {
        /// The broker.
        broker: String,
        /// What it says.
        reason: String,
    },
    /// The broker does not let this client read a topic.
    #[error("{broker}: the broker refuses the subscription to {filter:?}: {reason}")]
    Subscription {
        /// The broker.
        broker: String,
        /// The filter.
        filter: String,
        /// What it says.
        reason: String,
    },
    /// Another process has the name of this client.
    #[error(
        "{broker}: another process has connected as {client:?}, so that the broker ended this one's connection; end that one, or give this one a name of its own"
    )]
    TakenOver {
        /// The broker.
        broker: String,
        /// The name of the client.
        client: String,
    },
    /// The system gives no thread.
    #[error("no connection can be made: {0}")]
    System(String),
}
