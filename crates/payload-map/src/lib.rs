//! Messages to readings.
//!
//! A [`TopicPattern`] such as `plant/{valve}/stroke` says what to subscribe to and where the valve's name stands in a topic;
//! a [`PayloadMap`] says which field of a JSON payload is what, in which unit. Without one of its own, a payload has the
//! names of a timing log's columns. Values are checked as those of a log are.

mod error;
mod field;
mod map;
mod message;
mod topic;

pub use error::{PatternError, PayloadError};
pub use map::PayloadMap;
pub use message::MappedRow;
pub use topic::{ResultTopic, TopicPattern};
