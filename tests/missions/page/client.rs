//! A client of a page's server that is no browser, and can send requests that a browser would not send.

use std::io::{Read, Write};
use std::net::TcpStream;

use alliance_tests::harness::{Lab, Process};
use alliance_tests::team::Team;
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

/// Serves the run of the lab with `alliance watch`.
pub fn watch(lab: &Lab, run: &str) -> (Process, Page) {
    let mut process = lab.start(format!("watch {run}"));
    process.wait_for_stderr("/#");
    let page = Page::from_output(&process.stderr());
    (process, page)
}

/// Returns the status and the body of a page of this machine, or `None` if nothing listens at the port.
pub fn get(port: u16, path: &str) -> Option<(u16, String)> {
    TcpStream::connect(("127.0.0.1", port)).ok()?;
    let page = Page {
        port,
        token: String::new(),
    };
    let host = page.host();
    Some(page.ask(&format!("GET {path}"), &[("Host", &host)], ""))
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

    /// Waits for the page of a live run. Returns it with the process id of its server.
    pub fn of(team: &mut Team<'_>) -> (Self, u32) {
        let server = team.wait_for_page();
        (Self::from_output(&team.launcher().stderr()), server)
    }

    pub fn host(&self) -> String {
        format!("127.0.0.1:{}", self.port)
    }

    fn origin(&self) -> String {
        format!("http://{}", self.host())
    }

    pub fn link(&self) -> String {
        format!("{}/#{}", self.origin(), self.token)
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

    /// Sends a request like the page itself, and returns its answer.
    #[track_caller]
    fn request(&self, request: &str, body: &str) -> Value {
        let bearer = format!("Bearer {}", self.token);
        let (host, origin) = (self.host(), self.origin());
        let headers = [
            ("Host", &host),
            ("Origin", &origin),
            ("Authorization", &bearer),
        ];
        let headers = headers.map(|(name, value)| (name, value.as_str()));
        let (status, answer) = self.ask(request, &headers, body);
        assert_eq!(status, 200, "{request} {body}: {answer}");
        serde_json::from_str(&answer).unwrap()
    }

    #[track_caller]
    pub fn get(&self, path: &str) -> Value {
        self.request(&format!("GET {path}"), "")
    }

    #[track_caller]
    pub fn control(&self, command: &str) -> Value {
        self.request("POST /api/control", command)
    }

    /// Opens a WebSocket with this origin and token. Returns `None` if the server refuses it.
    pub fn connect(&self, origin: &str, token: &str) -> Option<LiveStream> {
        self.connect_to("/api/live", origin, token)
    }

    fn connect_to(&self, path: &str, origin: &str, token: &str) -> Option<LiveStream> {
        let url = format!("ws://{}{path}", self.host());
        let mut request = url.into_client_request().unwrap();
        let headers = request.headers_mut();
        headers.insert("origin", origin.parse().unwrap());
        let protocols = format!("alliance, {token}");
        headers.insert("sec-websocket-protocol", protocols.parse().unwrap());
        let (socket, _) = tungstenite::connect(request).ok()?;
        Some(LiveStream { socket })
    }

    /// Opens the connection that marks a page of a log as open, until it is dropped.
    pub fn open_page(&self) -> LiveStream {
        let page = self.connect_to("/api/page", &self.origin(), &self.token);
        page.unwrap()
    }

    /// Opens a WebSocket like the page itself.
    pub fn live(&self) -> LiveStream {
        self.connect(&self.origin(), &self.token).unwrap()
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
