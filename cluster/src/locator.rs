//! Network addresses in zenoh's locator format, for example `tls/10.0.0.1:7447`.

use std::fmt;
use std::net::{IpAddr, Ipv6Addr};
use std::str::FromStr;

use scenario::Problem;

/// The transport protocol of a connection.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Transport {
    /// Encrypted, with certificates on both sides.
    Tls,
    /// Unencrypted: every machine on the path can read the data.
    Tcp,
}

/// The network address of a listener.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Locator {
    pub transport: Transport,
    /// The address or name of the machine. An IPv6 address has no brackets here.
    pub host: String,
    /// The port. It is not 0, because other processes connect to it.
    pub port: u16,
}

impl Locator {
    /// Parses a command-line option; `unencrypted` is the state of the option `--unencrypted`.
    pub fn from_option(text: &str, unencrypted: bool) -> Result<Self, Problem> {
        text.parse::<Self>()?.allowed(unencrypted, "--unencrypted")
    }

    /// Accepts the locator if it is encrypted, stays on this machine, or `unencrypted` is set. The error recommends
    /// `word`, the option or key for `unencrypted`.
    pub fn allowed(self, unencrypted: bool, word: &str) -> Result<Self, Problem> {
        let is_safe = self.transport == Transport::Tls || self.is_loopback() || unencrypted;
        if is_safe {
            return Ok(self);
        }
        let remedy = format!("use tls/…, or allow it with {word}");
        Err(Problem::of_value(
            format!("'{self}' is not encrypted"),
            remedy,
        ))
    }

    /// Returns whether the connection stays on this machine.
    #[must_use]
    pub fn is_loopback(&self) -> bool {
        let is_loopback = |address: IpAddr| address.is_loopback();
        self.host == "localhost" || self.host.parse().is_ok_and(is_loopback)
    }

    /// Returns whether the locator means all addresses of a machine. It is then valid for listening only.
    #[must_use]
    pub fn is_unspecified(&self) -> bool {
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
    type Err = Problem;

    fn from_str(text: &str) -> Result<Self, Problem> {
        read(text).ok_or_else(|| {
            let what = format!("'{}' is not a network address", text.escape_default());
            let remedy = "write tls/HOST:PORT, for example tls/10.0.0.1:7447";
            Problem::of_value(what, remedy)
        })
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
    let bracketed = host
        .strip_prefix('[')
        .and_then(|host| host.strip_suffix(']'));
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

/// Returns whether a text is valid as the machine address in a certificate: an IP address without brackets, or a DNS
/// name.
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
    // A name with a number as its last part is a malformed IP address.
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
    fn locators_survive_a_round_trip() {
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
    fn malformed_locators_are_rejected() {
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
            let line = error.to_string();
            assert!(
                line.contains("' is not a network address; "),
                "{text}: {line}"
            );
            assert_eq!(line.lines().count(), 1);
        }
    }

    #[test]
    fn unencrypted_connections_to_other_machines_need_permission() {
        let allowed = |text: &str, unencrypted| {
            let locator: Locator = text.parse().unwrap();
            locator.allowed(unencrypted, "--unencrypted").is_ok()
        };
        for local in ["tcp/127.0.0.1:7447", "tcp/[::1]:7447", "tcp/localhost:7447"] {
            assert!(allowed(local, false), "{local}");
        }
        for remote in [
            "tcp/10.0.0.1:7447",
            "tcp/0.0.0.0:7447",
            "tcp/localhost.example.org:7447",
        ] {
            assert!(!allowed(remote, false), "{remote}");
            assert!(allowed(remote, true), "{remote}");
        }
        assert!(allowed("tls/10.0.0.1:7447", false));
        let remote: Locator = "tcp/10.0.0.1:7447".parse().unwrap();
        let error = remote.allowed(false, "--unencrypted").unwrap_err();
        assert_eq!(
            error.to_string(),
            "'tcp/10.0.0.1:7447' is not encrypted; use tls/…, or allow it with --unencrypted"
        );
    }
}
