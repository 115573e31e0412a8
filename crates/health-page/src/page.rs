//! The server.

use std::io;
use std::net::{SocketAddr, TcpListener};
use std::sync::Arc;
use std::thread;

use axum::Router;
use axum::http::{StatusCode, header};
use axum::response::{IntoResponse, Response};
use axum::routing::get;
use thiserror::Error;

/// How a process is.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Health {
    /// Whether all is well.
    pub well: bool,
    /// A JSON document that says so.
    pub document: String,
}

/// What is told, made anew for each answer.
pub trait Source: Send + Sync + 'static {
    /// Answer to `/health`.
    fn health(&self) -> Health;
    /// Answer to `/metrics`.
    fn metrics(&self) -> String;
}

/// Why nothing is served.
#[derive(Debug, Error)]
pub enum PageError {
    /// The address is taken or is not this machine's.
    #[error("{address}: {reason}; expected an address of this machine and a port that is free")]
    Unavailable {
        /// The address asked for.
        address: SocketAddr,
        /// What the system says.
        reason: io::Error,
    },
    /// The system gives no thread.
    #[error("no server can be started: {0}")]
    System(io::Error),
}

/// A server on a thread of its own, until the process ends.
#[derive(Debug)]
pub struct HealthPage {
    address: SocketAddr,
}

impl HealthPage {
    /// Begins to serve.
    ///
    /// # Errors
    /// If the address cannot be had.
    pub fn serve(address: SocketAddr, source: Arc<impl Source>) -> Result<Self, PageError> {
        let unavailable = |reason| PageError::Unavailable { address, reason };
        let listener = TcpListener::bind(address).map_err(unavailable)?;
        listener.set_nonblocking(true).map_err(unavailable)?;
        let address = listener.local_addr().map_err(unavailable)?;
        let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build().map_err(PageError::System)?;
        let (of_health, of_metrics) = (Arc::clone(&source), source);
        let router = Router::new()
            .route("/health", get(async move || health(of_health.health())))
            .route("/metrics", get(async move || metrics(of_metrics.metrics())));
        let serve = async {
            let listener = tokio::net::TcpListener::from_std(listener)?;
            axum::serve(listener, router).await
        };
        // What the server says when it ends has no reader: it ends with the process.
        let work = move || drop(runtime.block_on(serve));
        thread::Builder::new().name("health page".to_owned()).spawn(work).map_err(PageError::System)?;
        Ok(Self { address })
    }

    /// Where it listens.
    pub fn address(&self) -> SocketAddr {
        self.address
    }
}

fn health(health: Health) -> Response {
    let status = if health.well { StatusCode::OK } else { StatusCode::SERVICE_UNAVAILABLE };
    (status, [(header::CONTENT_TYPE, "application/json"), (header::CACHE_CONTROL, "no-store")], health.document)
        .into_response()
}

fn metrics(text: String) -> Response {
    let kind = "text/plain; version=0.0.4; charset=utf-8";
    ([(header::CONTENT_TYPE, kind), (header::CACHE_CONTROL, "no-store")], text).into_response()
}

#[cfg(test)]
mod tests {
    use std::io::{Read, Write};
    use std::net::TcpStream;
    use std::sync::atomic::{AtomicBool, Ordering};

    use super::*;

    struct Told(AtomicBool);

    impl Source for Told {
        fn health(&self) -> Health {
            let well = self.0.load(Ordering::Relaxed);
            Health { well, document: format!("{{\"well\": {well}}}") }
        }

        fn metrics(&self) -> String {
            "rows_total 7\n".to_owned()
        }
    }

    fn ask(address: SocketAddr, path: &str) -> String {
        let mut stream = TcpStream::connect(address).expect("listens");
        write!(stream, "GET {path} HTTP/1.1\r\nHost: here\r\nConnection: close\r\n\r\n").expect("asked");
        let mut answer = String::new();
        stream.read_to_string(&mut answer).expect("answered");
        answer
    }

    #[test]
    fn says_how_it_is_and_counts() {
        let told = Arc::new(Told(AtomicBool::new(true)));
        let page = HealthPage::serve("127.0.0.1:0".parse().expect("an address"), Arc::clone(&told)).expect("serves");
        let health = ask(page.address(), "/health");
        assert!(health.starts_with("HTTP/1.1 200") && health.ends_with("{\"well\": true}"), "{health}");
        told.0.store(false, Ordering::Relaxed);
        let health = ask(page.address(), "/health");
        assert!(health.starts_with("HTTP/1.1 503") && health.ends_with("{\"well\": false}"), "{health}");
        let metrics = ask(page.address(), "/metrics");
        assert!(metrics.contains("text/plain; version=0.0.4") && metrics.ends_with("rows_total 7\n"), "{metrics}");
        assert!(ask(page.address(), "/").starts_with("HTTP/1.1 404"));
    }

    #[test]
    fn an_address_that_is_taken_is_told() {
        let taken = TcpListener::bind("127.0.0.1:0").expect("a free port");
        let address = taken.local_addr().expect("an address");
        let error = HealthPage::serve(address, Arc::new(Told(AtomicBool::new(true)))).expect_err("is taken");
        assert!(error.to_string().contains(&address.to_string()), "{error}");
    }
}
