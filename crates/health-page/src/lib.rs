//! What a process that runs unattended tells of itself, over HTTP.
//!
//! `/health` answers 200 while all is well and 503 while it is not, with a JSON document either way; `/metrics` answers with
//! the text that Prometheus reads. What the numbers mean is unknown here.

mod metrics;
mod page;

pub use metrics::{Kind, MetricsText};
pub use page::{Health, HealthPage, PageError, Source};
