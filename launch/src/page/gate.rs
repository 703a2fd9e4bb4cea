//! Who may ask the page's server for what.
//!
//! Any page in the same browser can send requests to a server on this machine. It cannot choose the `Host` and `Origin` that
//! the browser sends, so a page elsewhere is told by its origin, one that has made its own name point to this machine by its
//! host; and it does not know the token, which stands in the link that the person was given.

use axum::http::header::{AUTHORIZATION, HOST, ORIGIN, SEC_WEBSOCKET_PROTOCOL, UPGRADE};
use axum::http::{HeaderMap, Method, StatusCode};

/// The subprotocol of the page's WebSocket; the token comes as a second one, for a browser lets a page set no other header.
pub const SUBPROTOCOL: &str = "alliance";

/// What a request must show.
#[derive(Clone, Debug)]
pub struct Gate {
    hosts: [String; 2],
    token: String,
}

/// Why a request is refused.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum Refusal {
    /// It was sent to another name.
    #[error("this server answers to the address in its link only")]
    Host,
    /// Another page sent it.
    #[error("requests are taken from this server's own page only")]
    Origin,
    /// It does not bear the token.
    #[error("the token is missing or wrong: open the link that the command has printed")]
    Token,
}

impl Refusal {
    /// As HTTP says it.
    #[must_use]
    pub fn status(self) -> StatusCode {
        match self {
            Self::Host | Self::Origin => StatusCode::FORBIDDEN,
            Self::Token => StatusCode::UNAUTHORIZED,
        }
    }
}

impl Gate {
    /// Of a server on that port of this machine.
    #[must_use]
    pub fn new(port: u16, token: String) -> Self {
        Self {
            hosts: [format!("127.0.0.1:{port}"), format!("localhost:{port}")],
            token,
        }
    }

    /// Whether a request may pass. The page's files are anybody's on this machine; what the run tells, and what changes it,
    /// is not.
    ///
    /// # Errors
    /// Why it may not.
    pub fn check(&self, method: &Method, path: &str, headers: &HeaderMap) -> Result<(), Refusal> {
        let text = |name| headers.get(name).and_then(|value| value.to_str().ok());
        let host = text(HOST).unwrap_or_default();
        if !self.hosts.iter().any(|own| own == host) {
            return Err(Refusal::Host);
        }
        // Browsers leave the origin out where a page only reads from its own server.
        let needs_origin = headers.contains_key(UPGRADE) || !method.is_safe();
        match headers.get(ORIGIN) {
            None if needs_origin => return Err(Refusal::Origin),
            Some(origin) if *origin != format!("http://{host}") => return Err(Refusal::Origin),
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
                return Err(Refusal::Token);
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
    fn check(request: &str, headers: &[(&str, &str)], expected: Result<(), Refusal>) {
        let gate = Gate::new(4711, TOKEN.to_owned());
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
    fn who_does_not_know_the_token_learns_and_changes_nothing() {
        let host = ("host", "127.0.0.1:4711");
        let origin = ("origin", "http://127.0.0.1:4711");
        let refused = Err(Refusal::Token);
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
    fn pages_elsewhere_are_refused_even_with_the_token() {
        let host = ("host", "127.0.0.1:4711");
        let bearer = ("authorization", "Bearer 0123456789abcdef");
        let refused = Err(Refusal::Origin);
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
        check("GET /", &evil[..1], Err(Refusal::Host));
        check("POST /api/control", &evil, Err(Refusal::Host));
        check("GET /", &[], Err(Refusal::Host));
        check("GET /", &[("host", "127.0.0.1:80")], Err(Refusal::Host));
    }
}
