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
    use super::*;

    const TOKEN: &str = "0123456789abcdef";

    #[track_caller]
    fn check(request: &str, headers: &[(&str, &str)], expected: Result<(), AccessError>) {
        let gate = AccessControl::new(4711, TOKEN.to_owned());
        let (method, path) = request.split_once(' ').unwrap();
        let mut map = HeaderMap::new();
        for (name, value) in headers {
            let name: axum::http::HeaderName = name.parse().unwrap();
            map.append(name, value.parse().unwrap());
        }
        assert_eq!(
            gate.check(&method.parse().unwrap(), path, &map),
            expected,
            "{request} {headers:?}"
        );
    }

    #[test]
    fn the_page_itself_passes() {
        let host = ("host", "127.0.0.1:4711");
        let bearer = ("authorization", "Bearer 0123456789abcdef");
        let origin = ("origin", "http://127.0.0.1:4711");
        check("GET /", &[host], Ok(()));
        check("GET /assets/main.js", &[("host", "localhost:4711")], Ok(()));
        check("GET /api/run", &[host, bearer], Ok(()));
        check("POST /api/control", &[host, bearer, origin], Ok(()));
        let upgrade = ("upgrade", "websocket");
        let protocol = ("sec-websocket-protocol", "alliance, 0123456789abcdef");
        check("GET /api/live", &[host, upgrade, origin, protocol], Ok(()));
    }

    #[test]
    fn requests_without_the_token_are_refused() {
        let host = ("host", "127.0.0.1:4711");
        let origin = ("origin", "http://127.0.0.1:4711");
        let refused = Err(AccessError::Token);
        check("GET /api/run", &[host], refused);
        check(
            "GET /api/run",
            &[host, ("authorization", "Bearer ")],
            refused,
        );
        check("POST /api/control", &[host, origin], refused);
        let protocol = ("sec-websocket-protocol", "alliance");
        check(
            "GET /api/live",
            &[host, origin, ("upgrade", "websocket"), protocol],
            refused,
        );
    }

    #[test]
    fn other_origins_are_refused_even_with_the_token() {
        let host = ("host", "127.0.0.1:4711");
        let bearer = ("authorization", "Bearer 0123456789abcdef");
        let refused = Err(AccessError::Origin);
        for origin in [
            "http://evil.example",
            "null",
            "https://127.0.0.1:4711",
            "http://127.0.0.1:4712",
        ] {
            check(
                "POST /api/control",
                &[host, bearer, ("origin", origin)],
                refused,
            );
            check("GET /api/run", &[host, bearer, ("origin", origin)], refused);
        }
        check("POST /api/control", &[host, bearer], refused);
        let protocol = ("sec-websocket-protocol", "alliance, 0123456789abcdef");
        check(
            "GET /api/live",
            &[host, ("upgrade", "websocket"), protocol],
            refused,
        );
    }

    #[test]
    fn another_name_for_this_machine_is_refused() {
        let bearer = ("authorization", "Bearer 0123456789abcdef");
        let evil = [
            ("host", "evil.example:4711"),
            ("origin", "http://evil.example:4711"),
            bearer,
        ];
        check("GET /", &evil[..1], Err(AccessError::Host));
        check("POST /api/control", &evil, Err(AccessError::Host));
        check("GET /", &[], Err(AccessError::Host));
        check("GET /", &[("host", "127.0.0.1:80")], Err(AccessError::Host));
    }
}
