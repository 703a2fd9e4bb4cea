//! Where somebody is reached over a network, in zenoh's words: `tls/10.0.0.1:7447`.

use std::fmt;
use std::net::{IpAddr, Ipv6Addr};
use std::str::FromStr;

/// How bytes go over the network.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Transport {
    /// Encrypted, and both ends prove who they are.
    Tls,
    /// As they are, for everybody on the way to read.
    Tcp,
}

/// A place where somebody listens.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Locator {
    /// How.
    pub transport: Transport,
    /// Address or name of the machine; an IPv6 address has no brackets here.
    pub host: String,
    /// Port, not 0: others are told of it.
    pub port: u16,
}

/// Why a locator is refused.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum LocatorError {
    /// It is none.
    #[error("'{0}' is no place on a network; write tls/HOST:PORT, such as tls/10.0.0.1:7447")]
    Shape(String),
    /// Everybody on the way could read what is said.
    #[error("'{0}' is not encrypted; write tls/…, or say that this is wanted: {1}")]
    Plain(String, &'static str),
}

impl Locator {
    /// Reads what an option of the command line names, which `--unencrypted` may accompany.
    ///
    /// # Errors
    /// Any [`LocatorError`].
    pub fn of_option(text: &str, unencrypted: bool) -> Result<Self, LocatorError> {
        text.parse::<Self>()?.allowed(unencrypted, "--unencrypted")
    }

    /// The same, if it is encrypted, stays on this machine, or may be unencrypted; `word` is how people say so.
    ///
    /// # Errors
    /// [`LocatorError::Plain`].
    pub fn allowed(self, unencrypted: bool, word: &'static str) -> Result<Self, LocatorError> {
        let is_safe = self.transport == Transport::Tls || self.is_loopback() || unencrypted;
        match is_safe {
            true => Ok(self),
            false => Err(LocatorError::Plain(self.to_string(), word)),
        }
    }

    /// Whether nothing leaves this machine.
    #[must_use]
    pub fn is_loopback(&self) -> bool {
        let is_loopback = |address: IpAddr| address.is_loopback();
        self.host == "localhost" || self.host.parse().is_ok_and(is_loopback)
    }

    /// Whether it stands for all addresses of a machine: to be listened at, but not to be connected to.
    #[must_use]
    pub fn is_everywhere(&self) -> bool {
        let is_unspecified = |address: IpAddr| address.is_unspecified();
        self.host.parse().is_ok_and(is_unspecified)
    }
}

impl fmt::Display for Locator {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { host, port, .. } = self;
        let transport = match self.transport {
            Transport::Tls => "tls",
            Transport::Tcp => "tcp",
        };
        if host.contains(':') {
            write!(f, "{transport}/[{host}]:{port}")
        } else {
            write!(f, "{transport}/{host}:{port}")
        }
    }
}

impl FromStr for Locator {
    type Err = LocatorError;

    fn from_str(text: &str) -> Result<Self, LocatorError> {
        read(text).ok_or_else(|| LocatorError::Shape(text.escape_default().to_string()))
    }
}

fn read(text: &str) -> Option<Locator> {
    let (transport, address) = text.split_once('/')?;
    let transport = match transport {
        "tls" => Transport::Tls,
        "tcp" => Transport::Tcp,
        _ => return None,
    };
    let (host, port) = address.rsplit_once(':')?;
    let bracketed = host.strip_prefix('[').and_then(|it| it.strip_suffix(']'));
    let host = match bracketed {
        Some(inner) => inner.parse::<Ipv6Addr>().ok()?.to_string(),
        None if host.contains(':') || !is_address(host) => return None,
        None => host.to_owned(),
    };
    let is_number = port.bytes().all(|byte| byte.is_ascii_digit());
    let port = port.parse().ok().filter(|port| is_number && *port > 0)?;
    Some(Locator {
        transport,
        host,
        port,
    })
}

/// Whether this may stand in a certificate as the place of a machine: an IP address without brackets, or a name as of DNS.
#[must_use]
pub fn is_address(text: &str) -> bool {
    const LONGEST_NAME: usize = 253;
    let is_label = |label: &str| {
        let inner = |c: char| c.is_ascii_alphanumeric() || c == '-' || c == '_';
        let ends = |c: char| c != '-';
        (1..=63).contains(&label.len())
            && label.chars().all(inner)
            && label.starts_with(ends)
            && label.ends_with(ends)
    };
    // A name whose last part is a number is an address with a mistake in it.
    let is_number = |label: &str| label.bytes().all(|byte| byte.is_ascii_digit());
    let is_name = text.len() <= LONGEST_NAME
        && text.split('.').all(is_label)
        && !text.rsplit('.').next().is_some_and(is_number);
    is_name || text.parse::<IpAddr>().is_ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_written_is_read_and_written_the_same() {
        for text in [
            "tls/10.0.0.1:7447",
            "tcp/127.0.0.1:1",
            "tls/[2001:db8::1]:65535",
            "tls/robots.example.org:7447",
            "tls/alliance_world-1:7447",
        ] {
            assert_eq!(text.parse::<Locator>().unwrap().to_string(), text);
        }
        let six: Locator = "tls/[::1]:7447".parse().unwrap();
        assert_eq!((six.host.as_str(), six.port), ("::1", 7447));
    }

    #[test]
    fn what_is_no_place_is_refused_with_one_that_is() {
        for text in [
            "",
            "tls",
            "10.0.0.1:7447",
            "quic/10.0.0.1:7447",
            "tls/10.0.0.1",
            "tls/10.0.0.1:",
            "tls/10.0.0.1:0",
            "tls/10.0.0.1:+1",
            "tls/10.0.0.1:65536",
            "tls/:7447",
            "tls/10.0.0.300:7447",
            "tls/::1:7447",
            "tls/[10.0.0.1]:7447",
            "tls/a b:7447",
            "tls/-a:7447",
            "tls/a..b:7447",
            "tls/10.0.0.1:7447?x=1",
            "tls/10.0.0.1#iface=lo:7447",
            "tls/10.0.0.1:7447\n",
        ] {
            let error = text.parse::<Locator>().unwrap_err();
            assert!(matches!(error, LocatorError::Shape(_)), "{text}");
            assert_eq!(error.to_string().lines().count(), 1);
        }
    }

    #[test]
    fn what_leaves_the_machine_unencrypted_must_be_said_twice() {
        let allowed = |text: &str, unencrypted| {
            let locator: Locator = text.parse().unwrap();
            locator.allowed(unencrypted, "--unencrypted").is_ok()
        };
        for local in ["tcp/127.0.0.1:7447", "tcp/[::1]:7447", "tcp/localhost:7447"] {
            assert!(allowed(local, false), "{local}");
        }
        for far in [
            "tcp/10.0.0.1:7447",
            "tcp/0.0.0.0:7447",
            "tcp/localhost.example.org:7447",
        ] {
            assert!(!allowed(far, false), "{far}");
            assert!(allowed(far, true), "{far}");
        }
        assert!(allowed("tls/10.0.0.1:7447", false));
        let far: Locator = "tcp/10.0.0.1:7447".parse().unwrap();
        let error = far.allowed(false, "--unencrypted").unwrap_err();
        assert_eq!(
            error.to_string(),
            "'tcp/10.0.0.1:7447' is not encrypted; write tls/…, or say that this is wanted: --unencrypted"
        );
    }
}
