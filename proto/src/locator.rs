//! Where routers are reached over a network, in words of zenoh.

/// Why that is none.
#[derive(Debug, PartialEq, Eq, thiserror::Error)]
pub enum LocatorError {
    /// It has no address or port, or something besides.
    #[error("{0}: use tls/HOST:PORT with a port from 1 to 65535")]
    Form(String),
    /// It is not encrypted.
    #[error("{0}: that is not encrypted; use tls, or say --unencrypted too")]
    Unencrypted(String),
    /// Neither tls nor tcp.
    #[error("{0}: is neither tls nor tcp; use tls/HOST:PORT")]
    Protocol(String),
}

/// Whether a locator, that of this option, is one of TLS, or of TCP where that is asked for.
///
/// # Errors
/// One line that says what would be right.
pub fn check(option: &str, locator: &str, unencrypted: bool) -> Result<(), LocatorError> {
    let named = || format!("{option} {locator}");
    let parts = locator.split_once('/').and_then(|(protocol, address)| {
        let (host, port) = address.rsplit_once(':')?;
        let fits = !host.is_empty() && !address.contains(['?', '#', ';', '/', '"', '\\']);
        (fits && port.parse::<u16>().is_ok_and(|port| port > 0)).then_some(protocol)
    });
    match parts {
        None => Err(LocatorError::Form(named())),
        Some("tls") => Ok(()),
        Some("tcp") if unencrypted => Ok(()),
        Some("tcp") => Err(LocatorError::Unencrypted(named())),
        Some(_) => Err(LocatorError::Protocol(named())),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_not_encrypted_has_to_be_asked_for() {
        let said = |locator, unencrypted| {
            check("--listen", locator, unencrypted).map_err(|error| error.to_string())
        };
        assert_eq!(said("tls/10.0.0.1:7447", false), Ok(()));
        assert_eq!(said("tls/[::1]:7447", false), Ok(()));
        assert_eq!(said("tcp/10.0.0.1:7447", true), Ok(()));
        assert_eq!(
            said("tcp/10.0.0.1:7447", false).unwrap_err(),
            "--listen tcp/10.0.0.1:7447: that is not encrypted; use tls, or say --unencrypted too"
        );
        for wrong in [
            "10.0.0.1:7447",
            "tls/10.0.0.1",
            "tls/:7447",
            "tls/a:0",
            "tls/a:70000",
            "tls/a:1?b=c",
        ] {
            let form = "use tls/HOST:PORT with a port from 1 to 65535";
            assert_eq!(
                said(wrong, false).unwrap_err(),
                format!("--listen {wrong}: {form}")
            );
        }
        assert!(
            said("quic/a:1", true)
                .unwrap_err()
                .contains("neither tls nor tcp")
        );
    }
}
