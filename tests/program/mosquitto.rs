//! A Mosquitto of a test's own: started, killed and started again. Where none is installed, a test says so and is over.

use std::fs;
use std::net::{Ipv4Addr, TcpListener, TcpStream};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::thread;
use std::time::{Duration, Instant, SystemTime};

use broker_link::{BrokerAddress, Link, LinkOptions, Session, TopicFilter};
use tempfile::TempDir;

/// Where it is installed, beside what the path has.
const PLACES: [&str; 3] = ["/usr/sbin/mosquitto", "/usr/local/sbin/mosquitto", "/opt/homebrew/sbin/mosquitto"];

/// A broker that keeps its sessions and messages in a directory.
pub struct Mosquitto {
    program: PathBuf,
    dir: TempDir,
    port: u16,
    child: Option<Child>,
}

impl Mosquitto {
    /// Starts one with more lines of configuration; none where it is not installed.
    pub fn start(more: &str) -> Option<Self> {
        let path = std::env::var_os("PATH").unwrap_or_default();
        let mut places: Vec<PathBuf> = std::env::split_paths(&path).map(|folder| folder.join("mosquitto")).collect();
        places.extend(PLACES.map(PathBuf::from));
        let Some(program) = places.into_iter().find(|place| place.is_file()) else {
            eprintln!("skipped: no Mosquitto is installed here");
            return None;
        };
        let dir = tempfile::tempdir().expect("a temporary directory");
        let free = TcpListener::bind((Ipv4Addr::LOCALHOST, 0)).expect("a free port");
        let port = free.local_addr().expect("an address").port();
        // Else the broker finds its port taken, or this one answers in its place.
        drop(free);
        let folder = dir.path().display();
        let anonymous = if more.contains("allow_anonymous") { "" } else { "allow_anonymous true\n" };
        let text = format!(
            "listener {port} 127.0.0.1\n{anonymous}persistence true\npersistence_location {folder}/\n\
             max_queued_messages 0\nmax_inflight_messages 100\nuser {}\n{more}",
            std::env::var("USER").unwrap_or_else(|_| "root".to_owned())
        );
        fs::write(dir.path().join("mosquitto.conf"), text).expect("written");
        let mut broker = Self { program, dir, port, child: None };
        broker.go_on();
        Some(broker)
    }

    /// Starts it again after it was stopped or killed.
    pub fn go_on(&mut self) {
        let config = self.dir.path().join("mosquitto.conf");
        let mut command = Command::new(&self.program);
        command.arg("-c").arg(config).stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null());
        self.child = Some(command.spawn().expect("Mosquitto starts"));
        let started = Instant::now();
        while TcpStream::connect((Ipv4Addr::LOCALHOST, self.port)).is_err() {
            assert!(started.elapsed() < Duration::from_secs(20), "Mosquitto does not listen");
            thread::sleep(Duration::from_millis(10));
        }
    }

    /// Kills it: all since the last save is gone.
    pub fn kill(&mut self) {
        let mut child = self.child.take().expect("runs");
        child.kill().expect("killed");
        child.wait().expect("ended");
    }

    /// Stops it, so that it saves what it has.
    pub fn stop(&mut self) {
        let mut child = self.child.take().expect("runs");
        signal(&child, "-TERM");
        child.wait().expect("ended");
    }

    /// Lets it save what it has, and waits until it has.
    pub fn save(&self) {
        let before = self.saved();
        signal(self.child.as_ref().expect("runs"), "-USR1");
        let started = Instant::now();
        while self.saved() == before {
            assert!(started.elapsed() < Duration::from_secs(20), "Mosquitto does not save");
            thread::sleep(Duration::from_millis(5));
        }
    }

    fn saved(&self) -> Option<SystemTime> {
        fs::metadata(self.dir.path().join("mosquitto.db")).and_then(|file| file.modified()).ok()
    }

    /// Its address.
    pub fn url(&self) -> String {
        format!("mqtt://127.0.0.1:{}", self.port)
    }

    /// Its directory.
    pub fn folder(&self) -> &Path {
        self.dir.path()
    }

    /// A client of the test's own, with or without a topic.
    pub fn client(&self, name: &str, filter: Option<&str>) -> Link {
        Link::start(LinkOptions {
            address: BrokerAddress::parse(&self.url()).expect("an address"),
            client_id: name.to_owned(),
            credentials: None,
            filters: filter.map(|filter| TopicFilter::parse(filter).expect("a filter")).into_iter().collect(),
            session: Session::Kept { expiry_s: 3600 },
            window: 1000,
            largest: 1 << 20,
        })
        .expect("a link")
    }
}

impl Drop for Mosquitto {
    fn drop(&mut self) {
        if let Some(mut child) = self.child.take() {
            let _ = child.kill();
            let _ = child.wait();
        }
    }
}

pub fn signal(child: &Child, name: &str) {
    let status = Command::new("kill").args([name, &child.id().to_string()]).status().expect("kill is there");
    assert!(status.success());
}
