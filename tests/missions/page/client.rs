//! A client of a page's server that is no browser, and can send requests that a browser would not send.

use std::io::{Read, Write};
use std::net::TcpStream;

use serde_json::Value;
use tungstenite::client::IntoClientRequest;
use tungstenite::stream::MaybeTlsStream;
use tungstenite::{Message, WebSocket};

/// The link that a command has printed.
#[derive(Clone, Debug)]
pub struct Page {
    /// The server's port on 127.0.0.1.
    pub port: u16,
    pub token: String,
}

impl Page {
    #[track_caller]
    pub fn from_output(output: &str) -> Self {
        let link = output.split("http://127.0.0.1:").nth(1).unwrap();
        let link = link.split_whitespace().next().unwrap();
        let (port, token) = link.split_once("/#").unwrap();
        Self {
            port: port.parse().unwrap(),
            token: token.to_owned(),
        }
    }

    pub fn link(&self) -> String {
        format!("http://{}/#{}", self.host(), self.token)
    }

    pub fn host(&self) -> String {
        format!("127.0.0.1:{}", self.port)
    }

    /// Sends a request with exactly these headers. Returns status and body of the response.
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

    /// Sends a GET request like the page itself.
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

    /// Sends a command like the page itself.
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

    /// Opens a WebSocket with this origin and token. Returns `None` if the server refuses it.
    pub fn connect(&self, origin: &str, token: &str) -> Option<LiveStream> {
        self.connect_to("/api/live", origin, token)
    }

    fn connect_to(&self, path: &str, origin: &str, token: &str) -> Option<LiveStream> {
        let mut request = format!("ws://{}{path}", self.host())
            .into_client_request()
            .unwrap();
        let headers = request.headers_mut();
        headers.insert("origin", origin.parse().unwrap());
        let protocols = format!("alliance, {token}");
        headers.insert("sec-websocket-protocol", protocols.parse().unwrap());
        let (socket, _) = tungstenite::connect(request).ok()?;
        Some(LiveStream { socket })
    }

    /// Opens the connection that marks a page of a log as open, until it is dropped.
    pub fn open_page(&self) -> LiveStream {
        let origin = format!("http://{}", self.host());
        self.connect_to("/api/page", &origin, &self.token).unwrap()
    }

    /// Opens a WebSocket like the page itself.
    pub fn live(&self) -> LiveStream {
        let origin = format!("http://{}", self.host());
        self.connect(&origin, &self.token).unwrap()
    }
}

/// The stream of frames that the server sends to a live page.
pub struct LiveStream {
    socket: WebSocket<MaybeTlsStream<TcpStream>>,
}

impl LiveStream {
    /// Returns the next frame, or `None` after the server has closed the stream.
    pub fn next(&mut self) -> Option<Value> {
        loop {
            match self.socket.read() {
                Ok(Message::Text(text)) => return Some(serde_json::from_str(&text).unwrap()),
                Ok(Message::Close(_)) => {
                    // The server may have ended already.
                    let _ = self.socket.flush();
                    return None;
                }
                Err(_) => return None,
                Ok(_) => {}
            }
        }
    }

    /// Returns the content of the next frame of this kind.
    #[track_caller]
    pub fn wait_for(&mut self, kind: &str) -> Value {
        loop {
            let mut frame = self.next().unwrap();
            if let Some(content) = frame.get_mut(kind) {
                return content.take();
            }
        }
    }

    #[track_caller]
    pub fn wait_for_view(&mut self, condition: impl Fn(&Value) -> bool) -> Value {
        loop {
            let view = self.wait_for("view");
            if condition(&view) {
                return view;
            }
        }
    }
}
