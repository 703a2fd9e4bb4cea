//! Where a page is found: socket, token, link.

use std::io;
use std::net::{Ipv4Addr, TcpListener};
use std::os::fd::AsFd;

use alliance_proto::secret;
use anyhow::{Context, anyhow, bail};
use clap::Args;

/// Tells a process that inherits its page's socket the token of the link.
const TOKEN: &str = "ALLIANCE_PAGE_TOKEN";

/// Where the page is served, and whether it is opened.
#[derive(Args, Clone, Debug)]
pub struct LinkArgs {
    /// Port of the page on this machine [default: a free one]
    #[arg(long, value_name = "PORT")]
    pub port: Option<u16>,
    /// Open the page in a browser; other users of this machine may then see the link among its processes
    #[arg(long)]
    pub open: bool,
}

/// A socket that listens, and the secret that makes its page somebody's own.
pub struct Link {
    listener: TcpListener,
    port: u16,
    token: String,
}

impl Link {
    /// A new one, on loopback.
    ///
    /// # Errors
    /// When the port is taken.
    pub fn new(port: Option<u16>) -> anyhow::Result<Self> {
        let port = port.unwrap_or(0);
        let listener = TcpListener::bind((Ipv4Addr::LOCALHOST, port))
            .with_context(|| format!("--port {port}: the page cannot be served there"))?;
        Ok(Self {
            port: listener.local_addr().context("the page's socket")?.port(),
            listener,
            token: format!("{:032x}", secret::random()?),
        })
    }

    /// The one that the launcher has made: its socket is this process's standard input, for a link that is printed before
    /// the page's process runs, and that no other process can take meanwhile.
    ///
    /// # Errors
    /// When there is none.
    pub fn inherited() -> anyhow::Result<Self> {
        let Ok(token) = std::env::var(TOKEN) else {
            bail!("no launcher has started this process");
        };
        let socket = io::stdin().as_fd().try_clone_to_owned();
        let listener = TcpListener::from(socket.context("the page's socket")?);
        Ok(Self {
            port: listener.local_addr().context("the page's socket")?.port(),
            listener,
            token,
        })
    }

    /// What a process needs to inherit it: its standard input, and an environment variable, which unlike an argument other
    /// users cannot see.
    #[must_use]
    pub fn into_heritage(self) -> (TcpListener, (&'static str, String)) {
        (self.listener, (TOKEN, self.token))
    }

    /// The same socket once more, for another server after this one.
    ///
    /// # Errors
    /// When the operating system refuses it.
    pub fn try_clone(&self) -> anyhow::Result<Self> {
        Ok(Self {
            listener: self.listener.try_clone().context("the page's socket")?,
            port: self.port,
            token: self.token.clone(),
        })
    }

    /// The link for a browser.
    #[must_use]
    pub fn url(&self) -> String {
        format!("http://127.0.0.1:{}/#{}", self.port, self.token)
    }

    /// Opens it in the person's browser.
    ///
    /// # Errors
    /// When there is none.
    pub fn open(&self) -> anyhow::Result<()> {
        // The error would say the whole link again.
        open::that_detached(self.url())
            .map_err(|_| anyhow!("no browser can be opened here; use the link"))
    }

    /// Socket and token for a server.
    ///
    /// # Errors
    /// When the runtime refuses the socket.
    pub fn into_server(self) -> anyhow::Result<(tokio::net::TcpListener, String)> {
        self.listener
            .set_nonblocking(true)
            .and_then(|()| tokio::net::TcpListener::from_std(self.listener))
            .map(|listener| (listener, self.token))
            .context("the page's socket")
    }
}
