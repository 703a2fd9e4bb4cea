//! Messages for people about failed connections, translated from the errors of zenoh and its TLS library.

/// An error of opening a session.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum ConnectError {
    /// A side rejects the other; a retry fails as well.
    #[error("{endpoint}: {reason}")]
    Refused {
        endpoint: String,
        /// The problem and the remedy.
        reason: String,
    },
    /// The other side did not answer; a retry can succeed.
    #[error("{endpoint}: {reason}")]
    NotThere {
        endpoint: String,
        /// The problem as the network reports it.
        reason: String,
    },
}

impl ConnectError {
    /// Returns whether the machine answers, but no program listens there.
    #[must_use]
    pub fn is_unused(&self) -> bool {
        matches!(self, Self::NotThere { reason, .. } if reason == UNUSED)
    }
}

/// Error texts of permanent failures with their messages. The first match applies.
const REFUSED: &[(&str, &str)] = &[
    // Errors of local files.
    (
        "KeyMismatch",
        "the local private key does not match the local certificate; copy both files again",
    ),
    (
        "No private key found",
        "the local .key file contains no private key; copy it again",
    ),
    // Errors of the other side's certificate, found by this side.
    (
        "invalid peer certificate: UnknownIssuer",
        "its certificate is not signed by the local ca.pem; copy the files of one `alliance cluster keys` run to both sides",
    ),
    (
        "invalid peer certificate: BadSignature",
        "its certificate is not signed by the local ca.pem; copy the files of one `alliance cluster keys` run to both sides",
    ),
    (
        "invalid peer certificate: certificate expired",
        "its certificate has expired according to this machine's clock; correct the clock or create new keys",
    ),
    (
        "invalid peer certificate: certificate not valid yet",
        "its certificate is not valid yet according to this machine's clock; correct the clock or create new keys",
    ),
    (
        "extended key usage for server authentication",
        "its certificate is not valid for a listener; create keys that contain its address",
    ),
    // Errors of this side's certificate, found by the other side.
    (
        "received fatal alert: CertificateRequired",
        "the other side requires a certificate; connect with --keys DIR",
    ),
    (
        "received fatal alert: UnknownCA",
        "its ca.pem has not signed the local certificate; copy the files of one `alliance cluster keys` run to both sides",
    ),
    (
        "received fatal alert: DecryptError",
        "its ca.pem has not signed the local certificate; copy the files of one `alliance cluster keys` run to both sides",
    ),
    (
        "received fatal alert: CertificateExpired",
        "the local certificate has expired or is not valid yet according to its clock; correct both clocks or create new keys",
    ),
    (
        "received fatal alert: UnsupportedCertificate",
        "the local certificate is not valid for a client; use the certificates of `alliance cluster keys`",
    ),
    // Other errors of the handshake.
    (
        "received corrupt message",
        "the listener there does not use TLS; check that the port belongs to a world or a host",
    ),
    (
        "Received a close message (reason GENERIC)",
        "it rejects this name and secret; copy the .secret file of its `alliance cluster keys` again",
    ),
];

/// Error texts of temporary failures with their messages.
const NOT_THERE: &[(&str, &str)] = &[
    ("Connection refused", UNUSED),
    (
        "failed to lookup address",
        "the network has no machine with that name",
    ),
    ("No route to host", "the network has no route there"),
    ("Network is unreachable", "the network has no route there"),
    ("deadline has elapsed", SILENT),
    ("timed out", SILENT),
    ("Connection reset", CLOSED),
    ("handshake eof", CLOSED),
    ("early eof", CLOSED),
];

const UNUSED: &str = "no program listens there";

/// The cause can be different transports: each side then waits for the other one.
const SILENT: &str = "no answer from there; check that both sides use tls, or both tcp";

const CLOSED: &str =
    "the connection was closed during setup; check that both sides use tls, or both tcp";

/// Translates the error text of zenoh for a connection to `endpoint`.
pub(crate) fn failure(endpoint: &str, text: &str) -> ConnectError {
    let endpoint = endpoint.to_owned();
    let is_contained = |(words, _): &&(&str, &str)| text.contains(words);
    if let Some(reason) = wrong_name(text) {
        return ConnectError::Refused { endpoint, reason };
    }
    if let Some((_, reason)) = REFUSED.iter().find(is_contained) {
        let reason = (*reason).to_owned();
        return ConnectError::Refused { endpoint, reason };
    }
    if let Some((_, reason)) = NOT_THERE.iter().find(is_contained) {
        let reason = (*reason).to_owned();
        return ConnectError::NotThere { endpoint, reason };
    }
    // An untranslated text is better than none: the first line, without the position in zenoh's source.
    let line = text.lines().next().unwrap_or_default();
    let line = line.split(" at /").next().unwrap_or_default();
    ConnectError::Refused {
        endpoint,
        reason: format!("{}; zenoh gives no further reason", line.trim()),
    }
}

/// Parses `… not valid for name "10.0.0.1"; certificate is only valid for IpAddress(10.0.0.9) at …`.
fn wrong_name(text: &str) -> Option<String> {
    let (_, rest) = text.split_once("not valid for name \"")?;
    let (requested, rest) = rest.split_once('"')?;
    let names = rest.split_once("only valid for ").map(|(_, names)| names);
    let names = names.and_then(|names| names.split(" at /").next());
    let names = names
        .unwrap_or("another")
        .replace("IpAddress(", "")
        .replace("DnsName(", "")
        .replace(['(', ')', '"'], "");
    Some(format!(
        "its certificate is for {}, not for {requested}; connect by one of its names, or create keys for {requested}",
        names.trim()
    ))
}

#[cfg(test)]
mod tests {
    use super::*;

    const PLACE: &str = " at /home/somebody/zenoh-link-tls/src/unicast.rs:378.";

    #[track_caller]
    fn refused(text: &str, expected: &str) {
        let error = failure("tls/h:1", text);
        assert!(matches!(error, ConnectError::Refused { .. }), "{error:?}");
        assert_eq!(error.to_string(), format!("tls/h:1: {expected}"));
    }

    /// The texts are those of zenoh 1.10.2 with rustls 0.23. Handshakes on loopback in the crate `launch` check them.
    #[test]
    fn a_known_error_becomes_one_line_with_the_remedy() {
        refused(
            &format!(
                "Unable to connect to tls/h:1! received fatal alert: CertificateRequired{PLACE}\nUnable"
            ),
            "the other side requires a certificate; connect with --keys DIR",
        );
        refused(
            &format!(
                "certificate not valid for name \"10.0.0.1\"; certificate is only valid for IpAddress(10.0.0.9){PLACE}"
            ),
            "its certificate is for 10.0.0.9, not for 10.0.0.1; connect by one of its names, or create keys for 10.0.0.1",
        );
        refused(
            &format!(
                "not valid for name \"a\"; certificate is only valid for DnsName(\"b\") or IpAddress(::1){PLACE}"
            ),
            "its certificate is for b or ::1, not for a; connect by one of its names, or create keys for a",
        );
        refused(
            "not valid for name \"a\"",
            "its certificate is for another, not for a; connect by one of its names, or create keys for a",
        );
    }

    #[test]
    fn an_unknown_error_is_shortened_to_one_line() {
        refused(
            &format!("received fatal alert: ProtocolVersion{PLACE}\nand more"),
            "received fatal alert: ProtocolVersion; zenoh gives no further reason",
        );
        refused("", "; zenoh gives no further reason");
    }

    #[test]
    fn a_refused_connection_is_a_temporary_failure() {
        let error = failure("tls/h:1", "Connection refused (os error 111)");
        assert!(matches!(error, ConnectError::NotThere { .. }), "{error:?}");
        assert_eq!(error.to_string(), "tls/h:1: no program listens there");
    }
}
