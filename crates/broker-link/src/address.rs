//! Where a broker is.

use std::fmt;

use crate::error::AddressError;

/// Ports where brokers listen if nothing is said: plain and encrypted.
const PORTS: [u16; 2] = [1883, 8883];

/// The address of a broker.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct BrokerAddress {
    /// Name or number of the machine.
    pub host: String,
    /// The port.
    pub port: u16,
    /// Whether the connection is encrypted.
    pub tls: bool,
}

impl BrokerAddress {
    /// Whether a text is meant as the address of a broker.
    pub fn is_meant(text: &str) -> bool {
        text.starts_with("mqtt://") || text.starts_with("mqtts://")
    }

    /// Reads an address such as `mqtt://plant-broker:1883`.
    pub fn parse(text: &str) -> Result<Self, AddressError> {
        let (scheme, rest) =
            text.split_once("://").ok_or_else(|| AddressError::Scheme { found: without_secrets(text) })?;
        let tls = match scheme {
            "mqtt" => false,
            "mqtts" if cfg!(feature = "tls") => true,
            "mqtts" => return Err(AddressError::NoTls),
            _ => return Err(AddressError::Scheme { found: without_secrets(text) }),
        };
        let end = rest.find(['/', '?', '#']).unwrap_or(rest.len());
        let (authority, behind) = rest.split_at(end);
        if authority.contains('@') {
            return Err(AddressError::Credentials);
        }
        if !matches!(behind, "" | "/") {
            return Err(AddressError::Path { found: behind.to_owned() });
        }
        // The colons of a number such as [::1] stand in brackets.
        let after_host = authority.rfind(']').map_or(0, |bracket| bracket + 1);
        let colon = authority[after_host..].find(':').map(|colon| after_host + colon);
        let (host, port) = match colon {
            Some(colon) => (&authority[..colon], Some(&authority[colon + 1..])),
            None => (authority, None),
        };
        let is_plain = |letter: char| letter.is_ascii_alphanumeric() || "-._[]:%".contains(letter);
        if host.is_empty() || !host.chars().all(is_plain) {
            return Err(AddressError::Host);
        }
        let port = match port {
            None => PORTS[usize::from(tls)],
            Some(port) => match port.parse() {
                Ok(port) if port > 0 => port,
                _ => return Err(AddressError::Port { found: port.to_owned() }),
            },
        };
        Ok(Self { host: host.to_owned(), port, tls })
    }
}

impl fmt::Display for BrokerAddress {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(formatter, "{}://{}:{}", if self.tls { "mqtts" } else { "mqtt" }, self.host, self.port)
    }
}

/// A text for a message, cut where a password may stand in it.
fn without_secrets(text: &str) -> String {
    text.split_once('@').map_or_else(|| text.to_owned(), |(_, host)| format!("...@{host}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn reads_host_and_port() {
        for (text, host, port) in [
            ("mqtt://plant-broker:1884", "plant-broker", 1884),
            ("mqtt://10.0.0.7", "10.0.0.7", 1883),
            ("mqtt://[::1]:1885/", "[::1]", 1885),
            ("mqtt://[::1]", "[::1]", 1883),
        ] {
            let address = BrokerAddress::parse(text).expect(text);
            assert_eq!((address.host.as_str(), address.port), (host, port), "{text}");
        }
    }

    #[test]
    fn refuses_what_is_none_and_never_repeats_a_password() {
        for (text, expected) in [
            ("http://host", AddressError::Scheme { found: "http://host".into() }),
            ("mqtt://", AddressError::Host),
            ("mqtt://:1883", AddressError::Host),
            ("mqtt://a b", AddressError::Host),
            ("mqtt://host:0", AddressError::Port { found: "0".into() }),
            ("mqtt://host:70000", AddressError::Port { found: "70000".into() }),
            ("mqtt://host/plant/#", AddressError::Path { found: "/plant/#".into() }),
            ("mqtt://me:secret@host", AddressError::Credentials),
        ] {
            assert_eq!(BrokerAddress::parse(text), Err(expected), "{text}");
        }
        let told = BrokerAddress::parse("tcp://me:secret@host").expect_err("is no address").to_string();
        assert!(!told.contains("secret"), "{told}");
    }

    #[test]
    #[cfg(not(feature = "tls"))]
    fn encryption_is_refused_where_it_was_not_built_in() {
        assert_eq!(BrokerAddress::parse("mqtts://host"), Err(AddressError::NoTls));
    }
}
