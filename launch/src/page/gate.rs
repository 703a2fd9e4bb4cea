//! Access control of the page's server.
//!
//! Any page in the same browser can send requests to this server, but it cannot choose the headers `HostEntry` and `Origin`. The origin
//! detects pages of other sites. The host detects sites whose name resolves to this machine (DNS rebinding). The token, which only the
//! link contains, excludes other users and programs.

use axum::http::header::{AUTHORIZATION, HOST, ORIGIN, SEC_WEBSOCKET_PROTOCOL, UPGRADE};
use axum::http::{HeaderMap, Method, StatusCode};

/// The subprotocol of the page's WebSocket. The token is a second subprotocol, because a browser lets a page set no other header.
pub const SUBPROTOCOL: &str = "alliance";

#[derive(Clone, Debug)]
pub struct AccessControl {
    hosts: [String; 2],
    token: String,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum AccessError {
    /// The header `HostEntry` contains another name.
    #[error("this server accepts only the address in its link")]
    Host,
    /// The header `Origin` is missing or contains another site.
    #[error("this server accepts only requests from its own page")]
    Origin,
    #[error("the token is missing or wrong: open the link that the command printed")]
    Token,
}

impl AccessError {
    #[must_use]
    pub fn status(self) -> StatusCode {
        match self {
            Self::Host | Self::Origin => StatusCode::FORBIDDEN,
            Self::Token => StatusCode::UNAUTHORIZED,
        }
    }
}

impl AccessControl {
    /// Creates the gate of a server on this port of the loopback interface.
    #[must_use]
    pub fn new(port: u16, token: String) -> Self {
        Self {
            hosts: [format!("127.0.0.1:{port}"), format!("localhost:{port}")],
            token,
        }
    }

    /// Checks a request. The page's files need no token; data and commands of the run do.
    pub fn check(
        &self,
        method: &Method,
        path: &str,
        headers: &HeaderMap,
    ) -> Result<(), AccessError> {
        let text = |name| headers.get(name).and_then(|value| value.to_str().ok());
        let host = text(HOST).unwrap_or_default();
        if !self.hosts.iter().any(|name| name == host) {
            return Err(AccessError::Host);
        }
        // Browsers omit the origin if a page only reads from its own server.
        let needs_origin = headers.contains_key(UPGRADE) || !method.is_safe();
        match headers.get(ORIGIN) {
            None if needs_origin => return Err(AccessError::Origin),
            Some(origin) if *origin != format!("http://{host}") => return Err(AccessError::Origin),
            _ => {}
        }
        if path.starts_with("/api/") {
            let bearer = text(AUTHORIZATION).and_then(|value| value.strip_prefix("Bearer "));
            let mut offered = text(SEC_WEBSOCKET_PROTOCOL)
                .unwrap_or_default()
                .split(',')
                .map(str::trim)
                .chain(bearer);
            if !offered.any(|token| token == self.token) {
                return Err(AccessError::Token);
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use axum::http::{HeaderName, HeaderValue};

    use super::*;

    /// Returns a header by its name in the test, such as `evil-origin`.
    fn header(word: &str) -> (HeaderName, HeaderValue) {
        let (name, value) = match word {
            "host" => (HOST, "127.0.0.1:4711"),
            "localhost" => (HOST, "localhost:4711"),
            "evil-host" => (HOST, "evil.example:4711"),
            "other-port" => (HOST, "127.0.0.1:80"),
            "origin" => (ORIGIN, "http://127.0.0.1:4711"),
            "evil-origin" => (ORIGIN, "http://evil.example:4711"),
            "null-origin" => (ORIGIN, "null"),
            "https-origin" => (ORIGIN, "https://127.0.0.1:4711"),
            "port-origin" => (ORIGIN, "http://127.0.0.1:4712"),
            "token" => (AUTHORIZATION, "Bearer 0123456789abcdef"),
            "no-token" => (AUTHORIZATION, "Bearer "),
            "upgrade" => (UPGRADE, "websocket"),
            "protocol" => (SEC_WEBSOCKET_PROTOCOL, "alliance, 0123456789abcdef"),
            "bare-protocol" => (SEC_WEBSOCKET_PROTOCOL, "alliance"),
            other => panic!("{other}"),
        };
        (name, HeaderValue::from_static(value))
    }

    #[test]
    fn only_the_page_itself_passes() {
        use AccessError::{Host, Origin, Token};
        let gate = AccessControl::new(4711, "0123456789abcdef".to_owned());
        for (request, words, expected) in [
            ("GET /", "host", Ok(())),
            ("GET /assets/main.js", "localhost", Ok(())),
            ("GET /api/run", "host token", Ok(())),
            ("POST /api/control", "host token origin", Ok(())),
            ("GET /api/live", "host upgrade origin protocol", Ok(())),
            ("GET /api/run", "host", Err(Token)),
            ("GET /api/run", "host no-token", Err(Token)),
            ("POST /api/control", "host origin", Err(Token)),
            (
                "GET /api/live",
                "host origin upgrade bare-protocol",
                Err(Token),
            ),
            // Other origins are refused even with the token.
            ("POST /api/control", "host token evil-origin", Err(Origin)),
            ("POST /api/control", "host token null-origin", Err(Origin)),
            ("POST /api/control", "host token https-origin", Err(Origin)),
            ("POST /api/control", "host token port-origin", Err(Origin)),
            ("POST /api/control", "host token", Err(Origin)),
            ("GET /api/run", "host token evil-origin", Err(Origin)),
            ("GET /api/live", "host upgrade protocol", Err(Origin)),
            // Another name for this machine.
            ("GET /", "evil-host", Err(Host)),
            (
                "POST /api/control",
                "evil-host evil-origin token",
                Err(Host),
            ),
            ("GET /", "", Err(Host)),
            ("GET /", "other-port", Err(Host)),
        ] {
            let (method, path) = request.split_once(' ').unwrap();
            let headers = words.split_whitespace().map(header).collect();
            let found = gate.check(&method.parse().unwrap(), path, &headers);
            assert_eq!(found, expected, "{request} {words}");
        }
    }
}
