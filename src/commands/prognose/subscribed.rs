//! Readings of a broker as rows, and results back to it.
//!
//! A message is acknowledged when its row is in the results and in the states that are kept. What the broker sends again
//! after a connection or the program broke off is known by its fingerprint and not taken twice.

use std::fs;
use std::hash::{BuildHasher, RandomState};
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::time::Duration;

use anyhow::Context;
use broker_link::{BrokerAddress, Credentials, Event, Link, LinkOptions, Message, Receipt, Session, TopicFilter};
use checked_toml::Document;
use payload_map::{MappedRow, PayloadMap, ResultTopic, TopicPattern};
use prognoser::LogRow;
use state_store::{Fingerprint, Store, Taken};

use super::rows::Next;
use super::vital::Vital;
use crate::cli::{BrokerArgs, PrognoseArgs};
use crate::failure::Hinted;

/// Where name and password are if no file has them.
const USERNAME: &str = "VALVE_MQTT_USERNAME";
/// See [`USERNAME`].
const PASSWORD: &str = "VALVE_MQTT_PASSWORD";
/// Messages that are on their way at once.
const WINDOW: u16 = 512;
/// Largest message, bytes: as a line of a log.
const LARGEST: u32 = 1 << 16;
/// How long a broker keeps messages for a program that is away: 30 days.
const EXPIRY_S: u32 = 30 * 24 * 3600;
/// How long nothing has to come until what has come goes on.
const PAUSE: Duration = Duration::from_millis(2);
/// How often a quiet link is looked at.
const POLL: Duration = Duration::from_millis(100);

/// Rows from a broker.
pub struct Subscribed {
    link: Link,
    /// What messages are called in notices: the topic that was asked for.
    name: String,
    pattern: TopicPattern,
    map: PayloadMap,
    publish: Option<ResultTopic>,
    empty_is_stalled: bool,
    /// Whether the broker keeps messages while the program is away.
    kept: bool,
    vital: Arc<Vital>,
    taken: Taken,
    /// Messages since the last acknowledgement: those with rows, and all.
    fresh: Vec<Fingerprint>,
    receipts: Vec<Receipt>,
    /// Results that the broker had refused when that was said last.
    refused: u64,
    row: MappedRow,
    /// Messages so far.
    count: u64,
    idle: bool,
}

impl Subscribed {
    /// Begins to connect; with states, as the client that they were kept by.
    pub fn open(args: &PrognoseArgs, store: Option<&Store>, vital: &Arc<Vital>) -> anyhow::Result<Self> {
        let options = &args.broker;
        let address = BrokerAddress::parse(&args.log.display().to_string())?;
        let Some(topic) = &options.topic else {
            return Err(Hinted::error(
                format!("{address}: found no --topic, expected the topics of the readings"),
                "add --topic plant/{valve}/stroke, with {valve} where the valve's name stands",
            ));
        };
        let pattern = TopicPattern::parse(topic).context("--topic")?;
        let filter = TopicFilter::parse(pattern.filter()).context("--topic")?;
        let map = match &options.map {
            None => PayloadMap::plain(),
            Some(path) => read_map(path)?,
        };
        if !pattern.names_valves() && !map.names_valves() {
            return Err(Hinted::error(
                format!(
                    "--topic {topic:?}: found no {{valve}} there and no \"valve\" in the map, expected one of them"
                ),
                "write {valve} for the level of the topic that is the valve's name, or name its field in the map",
            ));
        }
        let publish = options.publish.as_deref().map(ResultTopic::parse).transpose().context("--publish")?;
        let made_up = || format!("valve-{:016x}", RandomState::new().hash_one(std::process::id()));
        let client_id = match (&options.client_id, store) {
            (Some(name), _) => name.clone(),
            (None, Some(store)) => store.name("mqtt client", made_up)?,
            (None, None) => made_up(),
        };
        let session = if store.is_some() { Session::Kept { expiry_s: EXPIRY_S } } else { Session::Fleeting };
        let link = Link::start(LinkOptions {
            address,
            client_id,
            credentials: credentials(options)?,
            filters: vec![filter],
            session,
            window: WINDOW,
            largest: LARGEST,
        })?;
        Ok(Self {
            link,
            name: topic.clone(),
            pattern,
            map,
            publish,
            empty_is_stalled: args.empty_is_stalled,
            kept: store.is_some(),
            vital: Arc::clone(vital),
            taken: store.map(Store::taken).transpose()?.unwrap_or_default(),
            fresh: Vec::new(),
            receipts: Vec::new(),
            refused: 0,
            row: MappedRow { valve: String::new(), reading: prognoser::Reading::default(), time: None },
            count: 0,
            idle: true,
        })
    }

    /// What comes next. When nothing does, what has come can go out.
    pub fn next(&mut self) -> anyhow::Result<Next<'_>> {
        loop {
            let wait = if self.idle { POLL } else { PAUSE };
            let Some(event) = self.link.next(wait) else {
                self.idle = true;
                return Ok(Next::Idle);
            };
            self.idle = false;
            match event {
                Event::Message(message) => match self.take(message) {
                    Ok(false) => {}
                    Ok(true) => break,
                    Err(error) => return Ok(Next::Skipped(error)),
                },
                Event::Connected { again, session_kept } => {
                    self.vital.connected(again);
                    return Ok(Next::Notice(self.connected(again, session_kept)));
                }
                Event::Lost { reason, wait } => {
                    self.vital.disconnected();
                    let wait_s = wait.as_secs_f64();
                    return Ok(Next::Notice(format!(
                        "no connection to the broker ({reason}); tried again in {wait_s:.1} s"
                    )));
                }
                Event::Ended(error) => {
                    self.vital.disconnected();
                    return Err(error.into());
                }
            }
        }
        let row = &self.row;
        Ok(Next::Row(LogRow { valve: &row.valve, reading: row.reading, time: row.time.as_deref(), line: self.count }))
    }

    /// Makes a message the row; false if it was there before.
    fn take(&mut self, message: Message) -> anyhow::Result<bool> {
        let fingerprint = fingerprint(&message);
        self.receipts.push(message.receipt);
        if !self.taken.add(fingerprint) {
            self.vital.came_again();
            return Ok(false);
        }
        self.count += 1;
        let name = self.pattern.name_in(&message.topic);
        match self.map.row(name, &message.payload, self.empty_is_stalled) {
            Ok(row) => {
                self.row = row;
                self.fresh.push(fingerprint);
                Ok(true)
            }
            // A topic is other people's text.
            Err(error) => anyhow::bail!("{}: {error}", message.topic.escape_debug()),
        }
    }

    fn connected(&self, again: bool, session_kept: bool) -> String {
        let again = again || !self.taken.is_empty();
        match (again, session_kept) {
            (true, false) if self.kept => {
                "connected again; the broker has forgotten this program: what came while it was away may be lost"
                    .to_owned()
            }
            (true, false) => {
                "connected again; what came meanwhile is lost (--state lets the broker keep it)".to_owned()
            }
            (true, true) => "connected again".to_owned(),
            (false, _) => "connected".to_owned(),
        }
    }

    /// Whether results go back to the broker.
    pub fn publishes(&self) -> bool {
        self.publish.is_some()
    }

    /// Hands results, each of a valve, to the broker; false if it has not taken them all when `stop` was set or the link has
    /// ended. Then neither they nor their readings are done with. A refusal comes with a word.
    pub fn deliver(&mut self, results: Vec<(String, Vec<u8>)>, stop: &AtomicBool) -> (bool, Option<String>) {
        let Some(topic) = &self.publish else { return (true, None) };
        let messages: Vec<(String, Vec<u8>)> =
            results.into_iter().map(|(valve, result)| (topic.of(&valve), result)).collect();
        if !self.link.deliver(&messages, stop) {
            return (false, None);
        }
        let refused = self.link.refused();
        self.vital.handed_on(messages.len() as u64, refused, self.link.dropped());
        let word = (refused > self.refused).then(|| {
            let topic = topic.of("...");
            format!("the broker has refused {refused} results so far; may this program write to {topic:?}?")
        });
        self.refused = refused;
        (true, word)
    }

    /// Messages with rows since the last acknowledgement.
    pub fn fresh(&self) -> &[Fingerprint] {
        &self.fresh
    }

    /// Tells the broker that everything so far is done with.
    pub fn acknowledge(&mut self) {
        for receipt in self.receipts.drain(..) {
            self.link.acknowledge(&receipt);
        }
        self.fresh.clear();
    }

    /// What messages are called in notices.
    pub fn name(&self) -> &str {
        &self.name
    }
}

fn fingerprint(message: &Message) -> Fingerprint {
    let mut hasher = blake3::Hasher::new();
    hasher.update(&(message.topic.len() as u64).to_le_bytes());
    hasher.update(message.topic.as_bytes());
    hasher.update(&message.payload);
    let mut fingerprint = Fingerprint::default();
    fingerprint.copy_from_slice(&hasher.finalize().as_bytes()[..16]);
    fingerprint
}

fn read_map(path: &Path) -> anyhow::Result<PayloadMap> {
    Ok(PayloadMap::parse(&checked_toml::read_text(path)?, &path.display().to_string())?)
}

/// Name and password, from a file or the environment.
fn credentials(options: &BrokerArgs) -> anyhow::Result<Option<Credentials>> {
    let Some(path) = &options.credentials else {
        let of = |name| std::env::var(name).ok();
        return Ok(of(USERNAME).map(|username| Credentials { username, password: of(PASSWORD).unwrap_or_default() }));
    };
    let file = path.display().to_string();
    let text = fs::read_to_string(path).with_context(|| format!("{file}: cannot be read"))?;
    let document = Document::parse(&text, &file)?;
    let root = document.root();
    root.allow_only(&["username", "password"])?;
    let text = |key: &str| {
        let expected = "a text, such as \"prognoser\"";
        // What was found may be the password.
        let found = root.text(key, expected).map_err(|_| root.wrong(key, "no text", expected))?;
        found.map(str::to_owned).ok_or_else(|| root.missing(key, expected))
    };
    Ok(Some(Credentials { username: text("username")?, password: text("password")? }))
}
