//! What the page is told without asking: changes of the files, progress of a job (server-sent events).

use std::convert::Infallible;
use std::time::Duration;

use axum::response::Sse;
use axum::response::sse::{Event, KeepAlive};
use futures_util::stream::{self, Stream};
use serde::Serialize;
use serde_json::json;
use tokio::sync::broadcast;
use tokio::sync::broadcast::error::RecvError;

/// Events that a slow page may lag behind by; older ones are dropped, and the page is told to look anew.
const BACKLOG: usize = 1024;

/// To every page that is open.
#[derive(Debug, Clone)]
pub struct Events(broadcast::Sender<String>);

impl Events {
    /// Nobody listens yet.
    pub fn new() -> Self {
        Self(broadcast::channel(BACKLOG).0)
    }

    /// Tells all pages.
    pub fn tell(&self, event: &impl Serialize) {
        // It is no failure that no page is open.
        let _ = self.0.send(json!(event).to_string());
    }

    /// What one page receives, its first event given.
    pub fn stream<T: Serialize>(&self, hello: &T) -> Sse<impl Stream<Item = Result<Event, Infallible>> + use<T>> {
        let receiver = self.0.subscribe();
        let next = |(hello, mut receiver): (Option<String>, broadcast::Receiver<String>)| async move {
            let text = match hello {
                Some(hello) => hello,
                None => match receiver.recv().await {
                    Ok(text) => text,
                    Err(RecvError::Lagged(_)) => json!({ "event": "lagged" }).to_string(),
                    Err(RecvError::Closed) => return None,
                },
            };
            Some((Ok(Event::default().data(text)), (None, receiver)))
        };
        Sse::new(stream::unfold((Some(json!(hello).to_string()), receiver), next))
            .keep_alive(KeepAlive::new().interval(Duration::from_secs(5)))
    }
}
