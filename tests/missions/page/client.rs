//! A page's server asked by a program that is no browser: it can send what a browser would not.

use std::io::{Read, Write};
use std::net::TcpStream;

use serde_json::Value;
use tungstenite::client::IntoClientRequest;
use tungstenite::stream::MaybeTlsStream;
use tungstenite::{Message, WebSocket};

/// A link that a command has printed.
#[derive(Clone, Debug)]
pub struct Page {
    /// Of 127.0.0.1.
    pub port: u16,
    pub token: String,
}

impl Page {
    /// The link in what a command has said.
    #[track_caller]
    pub fn in_words(said: &str) -> Self {
        let link = said.split("http://127.0.0.1:").nth(1).unwrap();
        let link = link.split_whitespace().next().unwrap();
        let (port, token) = link.split_once("/#").unwrap();
        Self {
            port: port.parse().unwrap(),
            token: token.to_owned(),
        }
    }

    /// The link itself.
    pub fn link(&self) -> String {
        format!("http://{}/#{}", self.host(), self.token)
    }

    /// The address of its server.
    pub fn host(&self) -> String {
        format!("127.0.0.1:{}", self.port)
    }

    /// A request with exactly these headers: status and body of the answer.
    pub fn ask(&self, request: &str, headers: &[(&str, &str)], body: &str) -> (u16, String) {
        let mut stream = TcpStream::connect(("127.0.0.1", self.port)).unwrap();
        let mut text = format!("{request} HTTP/1.1\r\nConnection: close\r\n");
        for (name, value) in headers {
            text += &format!("{name}: {value}\r\n");
        }
        text += &format!("Content-Length: {}\r\n\r\n{body}", body.len());
        stream.write_all(text.as_bytes()).unwrap();
        let mut answer = String::new();
        stream.read_to_string(&mut answer).unwrap();
        let (head, body) = answer.split_once("\r\n\r\n").unwrap();
        let status = head.split(' ').nth(1).unwrap().parse().unwrap();
        (status, body.to_owned())
    }

    /// What the page itself would get.
    #[track_caller]
    pub fn get(&self, path: &str) -> Value {
        let bearer = format!("Bearer {}", self.token);
        let headers = [("Host", self.host()), ("Authorization", bearer)];
        let headers = headers
            .each_ref()
            .map(|(name, value)| (*name, value.as_str()));
        let (status, body) = self.ask(&format!("GET {path}"), &headers, "");
        assert_eq!(status, 200, "{path}: {body}");
        serde_json::from_str(&body).unwrap()
    }

    /// A command as the page itself would send it.
    #[track_caller]
    pub fn control(&self, command: &str) -> Value {
        let bearer = format!("Bearer {}", self.token);
        let origin = format!("http://{}", self.host());
        let headers = [
            ("Host", self.host()),
            ("Origin", origin),
            ("Authorization", bearer),
        ];
        let headers = headers
            .each_ref()
            .map(|(name, value)| (*name, value.as_str()));
        let (status, body) = self.ask("POST /api/control", &headers, command);
        assert_eq!(status, 200, "{command}: {body}");
        serde_json::from_str(&body).unwrap()
    }

    /// A WebSocket as that origin would open it, with that token; `None` when it is refused.
    pub fn connect(&self, origin: &str, token: &str) -> Option<Ears> {
        self.connect_to("/api/live", origin, token)
    }

    fn connect_to(&self, path: &str, origin: &str, token: &str) -> Option<Ears> {
        let mut request = format!("ws://{}{path}", self.host())
            .into_client_request()
            .unwrap();
        let headers = request.headers_mut();
        headers.insert("origin", origin.parse().unwrap());
        let protocols = format!("alliance, {token}");
        headers.insert("sec-websocket-protocol", protocols.parse().unwrap());
        let (socket, _) = tungstenite::connect(request).ok()?;
        Some(Ears { socket })
    }

    /// What tells the server of a log that a page is open, until it is dropped.
    pub fn accompany(&self) -> Ears {
        let origin = format!("http://{}", self.host());
        self.connect_to("/api/page", &origin, &self.token).unwrap()
    }

    /// A WebSocket as the page itself opens it.
    pub fn live(&self) -> Ears {
        let origin = format!("http://{}", self.host());
        self.connect(&origin, &self.token).unwrap()
    }
}

/// What the server tells a live page.
pub struct Ears {
    socket: WebSocket<MaybeTlsStream<TcpStream>>,
}

impl Ears {
    /// The next frame; `None` when the server has closed, which is answered as a browser does.
    pub fn next(&mut self) -> Option<Value> {
        loop {
            match self.socket.read() {
                Ok(Message::Text(text)) => return Some(serde_json::from_str(&text).unwrap()),
                Ok(Message::Close(_)) => {
                    // The server may be gone already.
                    let _ = self.socket.flush();
                    return None;
                }
                Err(_) => return None,
                Ok(_) => {}
            }
        }
    }

    /// The next frame of that kind.
    #[track_caller]
    pub fn wait_for(&mut self, kind: &str) -> Value {
        loop {
            let mut frame = self.next().unwrap();
            if let Some(content) = frame.get_mut(kind) {
                return content.take();
            }
        }
    }

    /// The next view of which this is true.
    #[track_caller]
    pub fn wait_for_view(&mut self, wanted: impl Fn(&Value) -> bool) -> Value {
        loop {
            let view = self.wait_for("view");
            if wanted(&view) {
                return view;
            }
        }
    }
}
