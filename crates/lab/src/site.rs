//! The server: where it listens, who may ask, and how an answer or a refusal goes out.

use std::io::Write;
use std::net::{IpAddr, Ipv4Addr, SocketAddr, TcpListener};

use axum::Json;
use axum::Router;
use axum::http::{HeaderName, HeaderValue, StatusCode, header};
use axum::middleware::map_response;
use axum::response::{IntoResponse, Response};
use serde::Serialize;
use serde_json::json;

/// A token of the user's own has at least this many characters: others must not guess it.
const SHORTEST_TOKEN: usize = 16;

/// Where a page is served.
#[derive(Debug, Clone)]
pub struct Address {
    /// The address to listen at.
    pub host: IpAddr,
    /// The port; 0 for any that is free.
    pub port: u16,
    /// What the address of the page must hold; made up at random where it is not given.
    pub token: Option<String>,
}

impl Default for Address {
    fn default() -> Self {
        Self { host: IpAddr::V4(Ipv4Addr::LOCALHOST), port: 0, token: None }
    }
}

/// Why nothing is served.
#[derive(Debug, thiserror::Error)]
pub enum ServeError {
    /// Others would reach the page.
    #[error("--host {host}: others can reach the page there; expected --token with a secret of your own beside it")]
    TokenNeeded {
        /// The address asked for.
        host: IpAddr,
    },
    /// The token is none.
    #[error("--token: found {found}; expected at least {SHORTEST_TOKEN} characters of a to z, A to Z, 0 to 9, - and _")]
    Token {
        /// What is wrong with it.
        found: String,
    },
    /// The address is taken or is not this machine's.
    #[error(
        "{address}: {reason}; expected an address of this machine and a port that is free (leave --port out for any)"
    )]
    Unavailable {
        /// The address asked for.
        address: SocketAddr,
        /// What the system says.
        reason: std::io::Error,
    },
    /// The system gives no random numbers or no threads.
    #[error("no server can be started: {0}")]
    System(String),
}

/// A place at which a page is about to be served.
#[derive(Debug)]
pub struct Site {
    listener: TcpListener,
    address: SocketAddr,
    token: String,
}

impl Site {
    /// Takes the address.
    pub fn bind(wanted: &Address) -> Result<Self, ServeError> {
        let token = match &wanted.token {
            Some(token) => checked(token)?,
            None if wanted.host.is_loopback() => random_token()?,
            None => return Err(ServeError::TokenNeeded { host: wanted.host }),
        };
        let address = SocketAddr::new(wanted.host, wanted.port);
        let unavailable = |reason| ServeError::Unavailable { address, reason };
        let listener = TcpListener::bind(address).map_err(unavailable)?;
        listener.set_nonblocking(true).map_err(unavailable)?;
        let address = listener.local_addr().map_err(unavailable)?;
        Ok(Self { listener, address, token })
    }

    /// The address of the page, token included.
    pub fn url(&self) -> String {
        format!("http://{}/{}/", self.address, self.token)
    }

    /// The path of something of the page: "/" and what follows.
    pub(crate) fn path(&self, rest: &str) -> String {
        format!("/{}{rest}", self.token)
    }

    /// Serves until the process ends. Paths of the router are those of [`Site::path`]; any other is refused.
    pub(crate) fn serve(self, router: Router) -> Result<(), ServeError> {
        let system = |error: std::io::Error| ServeError::System(error.to_string());
        let runtime =
            tokio::runtime::Builder::new_multi_thread().worker_threads(2).enable_all().build().map_err(system)?;
        let router = router.fallback(nothing_here).layer(map_response(guarded));
        runtime.block_on(async {
            let listener = tokio::net::TcpListener::from_std(self.listener).map_err(system)?;
            axum::serve(listener, router).await.map_err(system)
        })
    }
}

async fn nothing_here() -> impl IntoResponse {
    (StatusCode::NOT_FOUND, "Nothing is here. Open the whole address that the program printed, with its token.\n")
}

/// What every answer says to the browser: ask nobody else, keep nothing, tell nobody where you are.
async fn guarded(mut response: Response) -> Response {
    const HEADERS: [(HeaderName, &str); 5] = [
        (
            header::CONTENT_SECURITY_POLICY,
            "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' data:; connect-src 'self'; \
             base-uri 'none'; form-action 'none'; frame-ancestors 'none'",
        ),
        (header::CACHE_CONTROL, "no-store"),
        (header::REFERRER_POLICY, "no-referrer"),
        (header::X_CONTENT_TYPE_OPTIONS, "nosniff"),
        (header::X_FRAME_OPTIONS, "DENY"),
    ];
    for (name, value) in HEADERS {
        response.headers_mut().insert(name, HeaderValue::from_static(value));
    }
    response
}

fn checked(token: &str) -> Result<String, ServeError> {
    let is_plain = |character: char| character.is_ascii_alphanumeric() || matches!(character, '-' | '_');
    if let Some(other) = token.chars().find(|character| !is_plain(*character)) {
        return Err(ServeError::Token { found: format!("the character {other:?}") });
    }
    if token.len() < SHORTEST_TOKEN {
        return Err(ServeError::Token { found: format!("{} characters", token.len()) });
    }
    Ok(token.to_owned())
}

fn random_token() -> Result<String, ServeError> {
    let mut bytes = [0_u8; 16];
    getrandom::fill(&mut bytes).map_err(|error| ServeError::System(error.to_string()))?;
    Ok(format!("{:032x}", u128::from_ne_bytes(bytes)))
}

/// An answer that the page shows as a sentence: what was asked for cannot be done.
#[derive(Debug)]
pub(crate) struct Refusal {
    status: StatusCode,
    message: String,
}

impl Refusal {
    /// The request is understood and cannot be met.
    pub fn new(message: impl std::fmt::Display) -> Self {
        Self { status: StatusCode::UNPROCESSABLE_ENTITY, message: message.to_string() }
    }

    /// The sentence.
    pub fn message(self) -> String {
        self.message
    }

    /// The request clashes with what is there.
    pub fn conflict(message: impl std::fmt::Display) -> Self {
        Self { status: StatusCode::CONFLICT, message: message.to_string() }
    }
}

impl IntoResponse for Refusal {
    fn into_response(self) -> Response {
        (self.status, Json(json!({ "error": self.message }))).into_response()
    }
}

/// Does work that takes its time on a thread of its own, and answers with its result.
pub(crate) async fn answered<T: Serialize + Send + 'static>(
    work: impl FnOnce() -> Result<T, Refusal> + Send + 'static,
) -> Result<Json<T>, Refusal> {
    match tokio::task::spawn_blocking(work).await {
        Ok(answer) => answer.map(Json),
        Err(error) => Err(Refusal { status: StatusCode::INTERNAL_SERVER_ERROR, message: error.to_string() }),
    }
}

/// Tells where the page is, on stdout for whoever reads it there, and opens it in the user's browser if asked to.
pub fn announce(url: &str, what: &str, open: bool) {
    // Without a stdout there is nobody to tell; the server runs all the same.
    let mut out = std::io::stdout().lock();
    let _ = writeln!(out, "{what}: {url}\nCtrl-C ends it.").and_then(|()| out.flush());
    if open {
        let opener = if cfg!(target_os = "macos") {
            Some(("open", &[][..]))
        } else if cfg!(target_os = "windows") {
            Some(("cmd", &["/C", "start", ""][..]))
        } else {
            Some(("xdg-open", &[][..]))
        };
        if let Some((program, arguments)) = opener {
            let quiet = std::process::Stdio::null;
            // Without a browser the printed address is all that is needed.
            let _ = std::process::Command::new(program)
                .args(arguments)
                .arg(url)
                .stdin(quiet())
                .stdout(quiet())
                .stderr(quiet())
                .spawn();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn others_need_a_token_of_the_users_own() {
        let everywhere = Address { host: "0.0.0.0".parse().unwrap(), ..Address::default() };
        assert!(matches!(Site::bind(&everywhere), Err(ServeError::TokenNeeded { .. })));
        let short = Address { token: Some("abc".into()), ..Address::default() };
        assert!(matches!(Site::bind(&short), Err(ServeError::Token { .. })));
        let slash = Address { token: Some("0123456789abcdef/x".into()), ..Address::default() };
        assert!(matches!(Site::bind(&slash), Err(ServeError::Token { .. })));
    }

    #[test]
    fn tokens_differ_from_start_to_start() {
        let (one, other) = (Site::bind(&Address::default()).unwrap(), Site::bind(&Address::default()).unwrap());
        assert!(one.url().starts_with("http://127.0.0.1:"));
        assert_ne!(one.token, other.token);
        assert_eq!(one.token.len(), 32);
    }
}
