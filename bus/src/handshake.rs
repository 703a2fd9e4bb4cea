//! Why somebody could not connect, in words for people: what zenoh and its TLS say, translated.

/// Why there is no session.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum ConnectError {
    /// One of the two does not accept the other, and will not when it is asked again.
    #[error("{endpoint}: {reason}")]
    Refused {
        /// Zenoh locator that was tried.
        endpoint: String,
        /// What is wrong, and what would be right.
        reason: String,
    },
    /// Nobody has answered, which may be otherwise in a moment.
    #[error("{endpoint}: {reason}")]
    NotThere {
        /// Zenoh locator that was tried.
        endpoint: String,
        /// What the network says.
        reason: String,
    },
}

/// What they say of one who is there and does not want, or is not wanted. The first that fits holds.
const REFUSED: &[(&str, &str)] = &[
    // Of files on this side.
    (
        "KeyMismatch",
        "the private key here is not that of the certificate; copy both files again",
    ),
    (
        "No private key found",
        "the .key file here holds no private key; copy it again",
    ),
    // Of the other side's certificate, by this side.
    (
        "invalid peer certificate: UnknownIssuer",
        "its certificate is not signed by the ca.pem here; copy the files of one `alliance keys` to both sides",
    ),
    (
        "invalid peer certificate: BadSignature",
        "its certificate is not signed by the ca.pem here; copy the files of one `alliance keys` to both sides",
    ),
    (
        "invalid peer certificate: certificate expired",
        "by this machine's clock its certificate has expired; set the clock right, or make new keys",
    ),
    (
        "invalid peer certificate: certificate not valid yet",
        "by this machine's clock its certificate is not valid yet; set the clock right, or make new keys",
    ),
    (
        "extended key usage for server authentication",
        "its certificate is not that of one who listens; make keys that say where it is reached",
    ),
    // Of this side's certificate, by the other.
    (
        "received fatal alert: CertificateRequired",
        "it asks for a certificate, and none is shown; connect with --keys DIR",
    ),
    (
        "received fatal alert: UnknownCA",
        "its ca.pem has not signed the certificate here; copy the files of one `alliance keys` to both sides",
    ),
    (
        "received fatal alert: DecryptError",
        "its ca.pem has not signed the certificate here; copy the files of one `alliance keys` to both sides",
    ),
    (
        "received fatal alert: CertificateExpired",
        "by its clock the certificate here has expired or is not valid yet; set both clocks right, or make new keys",
    ),
    (
        "received fatal alert: UnsupportedCertificate",
        "the certificate here is not that of one who connects; use those of `alliance keys`",
    ),
    // Of the rest.
    (
        "received corrupt message",
        "who answers there does not speak TLS; is that the port of a world or a host?",
    ),
    (
        "Received a close message (reason GENERIC)",
        "it does not know this name and secret; copy the .secret file of its `alliance keys` again",
    ),
];

/// What they say where nobody has answered yet.
const NOT_THERE: &[(&str, &str)] = &[
    ("Connection refused", "nobody listens there"),
    (
        "failed to lookup address",
        "the network knows no machine of that name",
    ),
    ("No route to host", "the network has no way there"),
    ("Network is unreachable", "the network has no way there"),
    ("deadline has elapsed", SILENT),
    ("timed out", SILENT),
    ("Connection reset", CLOSED),
    ("handshake eof", CLOSED),
    ("early eof", CLOSED),
];

/// Each of two that speak differently waits for the other to go on.
const SILENT: &str = "nobody answers there; do both sides say tls, or both tcp?";

const CLOSED: &str =
    "the connection was closed before it stood; do both sides say tls, or both tcp?";

/// What zenoh said when it could not connect there.
pub(crate) fn failure(endpoint: &str, said: &str) -> ConnectError {
    let endpoint = endpoint.to_owned();
    let heard = |(words, _): &&(&str, &str)| said.contains(words);
    if let Some(reason) = wrong_name(said) {
        return ConnectError::Refused { endpoint, reason };
    }
    if let Some((_, reason)) = REFUSED.iter().find(heard) {
        let reason = (*reason).to_owned();
        return ConnectError::Refused { endpoint, reason };
    }
    if let Some((_, reason)) = NOT_THERE.iter().find(heard) {
        let reason = (*reason).to_owned();
        return ConnectError::NotThere { endpoint, reason };
    }
    // Better the words of a library than none: its first line, without the place in its source.
    let line = said.lines().next().unwrap_or_default();
    let line = line.split(" at /").next().unwrap_or_default();
    ConnectError::Refused {
        endpoint,
        reason: format!("{}; zenoh says no more", line.trim()),
    }
}

/// `… not valid for name "10.0.0.1"; certificate is only valid for IpAddress(10.0.0.9) at …`.
fn wrong_name(said: &str) -> Option<String> {
    let (_, rest) = said.split_once("not valid for name \"")?;
    let (asked, rest) = rest.split_once('"')?;
    let holds = rest.split_once("only valid for ").map(|(_, names)| names);
    let holds = holds.and_then(|names| names.split(" at /").next());
    let holds = holds
        .unwrap_or("another")
        .replace("IpAddress(", "")
        .replace("DnsName(", "")
        .replace(['(', ')', '"'], "");
    Some(format!(
        "its certificate is for {}, not for {asked}; connect by a name that it has, or make keys in which it is reached at {asked}",
        holds.trim()
    ))
}

#[cfg(test)]
mod tests {
    use super::*;

    const PLACE: &str = " at /home/somebody/zenoh-link-tls/src/unicast.rs:378.";

    #[track_caller]
    fn refused(said: &str, expected: &str) {
        let error = failure("tls/h:1", said);
        assert!(matches!(error, ConnectError::Refused { .. }), "{error:?}");
        assert_eq!(error.to_string(), format!("tls/h:1: {expected}"));
    }

    /// Texts as zenoh 1.10.2 with rustls 0.23 has them. That these are what it says, handshakes on loopback tell in `launch`.
    #[test]
    fn one_line_says_what_is_wrong_and_what_would_be_right() {
        refused(
            &format!(
                "Unable to connect to tls/h:1! received fatal alert: CertificateRequired{PLACE}\nUnable"
            ),
            "it asks for a certificate, and none is shown; connect with --keys DIR",
        );
        refused(
            &format!(
                "certificate not valid for name \"10.0.0.1\"; certificate is only valid for IpAddress(10.0.0.9){PLACE}"
            ),
            "its certificate is for 10.0.0.9, not for 10.0.0.1; connect by a name that it has, or make keys in which it is reached at 10.0.0.1",
        );
        refused(
            &format!(
                "not valid for name \"a\"; certificate is only valid for DnsName(\"b\") or IpAddress(::1){PLACE}"
            ),
            "its certificate is for b or ::1, not for a; connect by a name that it has, or make keys in which it is reached at a",
        );
        refused(
            "not valid for name \"a\"",
            "its certificate is for another, not for a; connect by a name that it has, or make keys in which it is reached at a",
        );
    }

    #[test]
    fn what_is_not_known_is_passed_on_in_one_line() {
        refused(
            &format!("received fatal alert: ProtocolVersion{PLACE}\nand more"),
            "received fatal alert: ProtocolVersion; zenoh says no more",
        );
        refused("", "; zenoh says no more");
    }

    #[test]
    fn who_does_not_answer_may_answer_later() {
        let error = failure("tls/h:1", "Connection refused (os error 111)");
        assert!(matches!(error, ConnectError::NotThere { .. }), "{error:?}");
        assert_eq!(error.to_string(), "tls/h:1: nobody listens there");
    }
}
