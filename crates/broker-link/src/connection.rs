//! One connection after the other.

use std::sync::mpsc::Sender;
use std::time::{Duration, Instant};

use rumqttc::Outgoing;
use rumqttc::v5::mqttbytes::QoS;
use rumqttc::v5::mqttbytes::v5::{
    ConnectReturnCode, DisconnectReasonCode, Filter, Packet, PubAckReason, Publish, RetainForwardRule, SubAck,
    SubscribeReasonCode,
};
use rumqttc::v5::{AsyncClient, ConnectionError, Event as ClientEvent, EventLoop, MqttOptions, StateError};
use tokio::time::sleep;

use crate::backoff::Backoff;
use crate::error::LinkError;
use crate::event::{Event, Message, Receipt};
use crate::options::{LinkOptions, Session};
use crate::shared::Shared;

/// After so long without a word from either side, this one asks whether the other is there.
const KEEP_ALIVE: Duration = Duration::from_secs(15);
/// A connection that takes longer is tried again.
const CONNECT_S: u64 = 10;
/// Requests that wait for the connection: more than there can be acknowledgements.
const REQUESTS: usize = 1 << 12;
/// A connection that stood for so long was none that others cut off at once.
const STANDS: Duration = Duration::from_secs(1);
/// So many in a row that the broker closed before that are somebody's doing.
const SUSPICIOUS: u32 = 3;
/// Largest pause between looks at whether the link was ended.
const LOOK: Duration = Duration::from_millis(50);

/// How a connection ended.
enum End {
    /// As asked for.
    Asked,
    /// By a failure that may pass.
    Lost(String),
    /// By one that does not.
    Final(LinkError),
}

/// Connects, and connects again, until the link is ended.
pub(crate) async fn run(options: &LinkOptions, shared: &Shared, events: &Sender<Event>) {
    let mut backoff = Backoff::new();
    let mut stood = false;
    let mut cut_off = 0;
    while !shared.is_ended() {
        let connections = Connection { options, shared, events };
        let before = stood;
        let (end, since) = connections.once(&mut stood).await;
        shared.lost();
        let standing = since.map(|since| since.elapsed());
        match standing {
            Some(standing) if standing < STANDS => cut_off += 1,
            Some(_) => {
                cut_off = 0;
                backoff.succeeded();
            }
            None => {}
        }
        match end {
            End::Asked => return,
            // Who has been let in before may be refused while a broker starts.
            End::Final(error @ LinkError::Refused { .. }) if before => {
                lost(error.to_string(), &mut backoff, shared, events).await;
            }
            End::Final(error) => {
                shared.end();
                let _ = events.send(Event::Ended(error));
                return;
            }
            // Not every broker says why it closes a connection.
            End::Lost(reason) if cut_off >= SUSPICIOUS => {
                let client = &options.client_id;
                let reason =
                    format!("{reason}, {cut_off} times at once; perhaps another process has connected as {client:?}");
                lost(reason, &mut backoff, shared, events).await;
            }
            End::Lost(reason) => lost(reason, &mut backoff, shared, events).await,
        }
    }
}

async fn lost(reason: String, backoff: &mut Backoff, shared: &Shared, events: &Sender<Event>) {
    let wait = backoff.wait();
    // Without an owner nobody needs to know; the link has ended then.
    let _ = events.send(Event::Lost { reason, wait });
    let mut left = wait;
    while !left.is_zero() && !shared.is_ended() {
        let pause = left.min(LOOK);
        sleep(pause).await;
        left -= pause;
    }
}

struct Connection<'a> {
    options: &'a LinkOptions,
    shared: &'a Shared,
    events: &'a Sender<Event>,
}

impl Connection<'_> {
    /// How a connection ended, and since when it had stood, if it did.
    async fn once(&self, stood: &mut bool) -> (End, Option<Instant>) {
        let mut since = None;
        (self.until_end(stood, &mut since).await, since)
    }

    async fn until_end(&self, stood: &mut bool, since: &mut Option<Instant>) -> End {
        let (client, mut events) = AsyncClient::new(mqtt_options(self.options), REQUESTS);
        let mut number = 0;
        loop {
            let event = match events.poll().await {
                Ok(event) => event,
                Err(error) => return self.end_of(&error),
            };
            match event {
                ClientEvent::Incoming(Packet::ConnAck(accepted)) => {
                    *since = Some(Instant::now());
                    number = self.shared.connected(client.clone());
                    let filters = self.filters();
                    if !filters.is_empty()
                        && let Err(error) = client.try_subscribe_many(filters)
                    {
                        return End::Lost(error.to_string());
                    }
                    let _ =
                        self.events.send(Event::Connected { again: *stood, session_kept: accepted.session_present });
                    *stood = true;
                }
                ClientEvent::Incoming(Packet::SubAck(answer)) => {
                    if let Some(error) = self.refusal(&answer) {
                        return End::Final(error);
                    }
                }
                ClientEvent::Incoming(Packet::Publish(publish)) => self.hand_on(number, &publish),
                ClientEvent::Incoming(Packet::PubAck(answer)) => {
                    let taken = matches!(answer.reason, PubAckReason::Success | PubAckReason::NoMatchingSubscribers);
                    self.shared.answered(!taken);
                }
                ClientEvent::Outgoing(Outgoing::Disconnect) => {
                    farewell(&mut events).await;
                    return End::Asked;
                }
                _ => {}
            }
        }
    }

    fn hand_on(&self, connection: u64, publish: &Publish) {
        if !self.shared.takes(publish) {
            return;
        }
        let message = Message {
            topic: String::from_utf8_lossy(&publish.topic).into_owned(),
            payload: publish.payload.clone(),
            receipt: Receipt::of(connection, publish),
        };
        let _ = self.events.send(Event::Message(message));
    }

    fn filters(&self) -> Vec<Filter> {
        let filters = self.options.filters.iter();
        filters
            .map(|filter| Filter {
                // What brokers keep of a topic is sent once, not again at every connection.
                retain_forward_rule: RetainForwardRule::OnNewSubscribe,
                // What this client delivers does not come back to it; a group may not ask for that.
                nolocal: !filter.is_shared(),
                ..Filter::new(filter.as_str(), QoS::AtLeastOnce)
            })
            .collect()
    }

    fn refusal(&self, answer: &SubAck) -> Option<LinkError> {
        let codes = answer.return_codes.iter().zip(&self.options.filters);
        let mut refused = codes.filter(|(code, _)| !matches!(code, SubscribeReasonCode::Success(_)));
        refused.next().map(|(code, filter)| LinkError::Subscription {
            broker: self.options.address.to_string(),
            filter: filter.as_str().to_owned(),
            reason: in_words(code),
        })
    }

    fn end_of(&self, error: &ConnectionError) -> End {
        let broker = self.options.address.to_string();
        match error {
            ConnectionError::ConnectionRefused(code) if is_final(*code) => {
                End::Final(LinkError::Refused { broker, reason: in_words(code) })
            }
            ConnectionError::ConnectionRefused(code) => End::Lost(in_words(code)),
            ConnectionError::MqttState(StateError::ServerDisconnect { reason_code, .. }) => match reason_code {
                DisconnectReasonCode::SessionTakenOver => {
                    End::Final(LinkError::TakenOver { broker, client: self.options.client_id.clone() })
                }
                code => End::Lost(in_words(code)),
            },
            ConnectionError::MqttState(StateError::Io(error)) | ConnectionError::Io(error) => {
                End::Lost(error.to_string())
            }
            ConnectionError::MqttState(StateError::ConnectionAborted) => {
                End::Lost("the broker closed the connection".to_owned())
            }
            ConnectionError::MqttState(StateError::AwaitPingResp) | ConnectionError::Timeout(_) => {
                End::Lost("the broker does not answer".to_owned())
            }
            other => End::Lost(other.to_string()),
        }
    }
}

/// Lets what was written reach the broker, which then closes the connection.
async fn farewell(events: &mut EventLoop) {
    let until_closed = async { while events.poll().await.is_ok() {} };
    let _ = tokio::time::timeout(Duration::from_millis(300), until_closed).await;
}

fn mqtt_options(options: &LinkOptions) -> MqttOptions {
    let mut mqtt = MqttOptions::new(&options.client_id, &options.address.host, options.address.port);
    mqtt.set_keep_alive(KEEP_ALIVE)
        .set_connection_timeout(CONNECT_S)
        .set_manual_acks(true)
        .set_clean_start(options.session == Session::Fleeting)
        .set_receive_maximum(Some(options.window))
        .set_max_packet_size(Some(options.largest));
    if let Session::Kept { expiry_s } = options.session {
        mqtt.set_session_expiry_interval(Some(expiry_s));
    }
    if let Some(credentials) = &options.credentials {
        mqtt.set_credentials(&credentials.username, &credentials.password);
    }
    #[cfg(feature = "tls")]
    if options.address.tls {
        mqtt.set_transport(rumqttc::Transport::tls_with_default_config());
    }
    mqtt
}

/// Whether trying again cannot help.
fn is_final(code: ConnectReturnCode) -> bool {
    matches!(
        code,
        ConnectReturnCode::RefusedProtocolVersion
            | ConnectReturnCode::UnsupportedProtocolVersion
            | ConnectReturnCode::BadClientId
            | ConnectReturnCode::ClientIdentifierNotValid
            | ConnectReturnCode::BadUserNamePassword
            | ConnectReturnCode::NotAuthorized
            | ConnectReturnCode::Banned
            | ConnectReturnCode::BadAuthenticationMethod
    )
}

/// A reason as people read it: `NotAuthorized` is "not authorized".
fn in_words(code: &impl std::fmt::Debug) -> String {
    let mut words = String::new();
    for letter in format!("{code:?}").chars() {
        if letter.is_ascii_uppercase() && !words.is_empty() {
            words.push(' ');
        }
        words.push(letter.to_ascii_lowercase());
    }
    words
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn reasons_are_told_in_words() {
        assert_eq!(in_words(&ConnectReturnCode::BadUserNamePassword), "bad user name password");
        assert_eq!(in_words(&DisconnectReasonCode::ServerShuttingDown), "server shutting down");
    }
}
