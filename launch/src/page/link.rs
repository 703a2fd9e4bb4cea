//! The link of a page: socket and token.

use std::io;
use std::net::{Ipv4Addr, TcpListener};
use std::os::fd::AsFd;

use anyhow::{Context, anyhow, bail};
use clap::Args;
use proto::secret;

/// The environment variable with the token, for a process that inherits the page's socket.
const TOKEN: &str = "ALLIANCE_PAGE_TOKEN";

#[derive(Args, Clone, Debug)]
#[command(next_help_heading = "Page")]
pub struct LinkArgs {
    /// Port of the page on this machine [default: a free port]
    #[arg(long, value_name = "PORT")]
    pub port: Option<u16>,
    /// Open the page in a browser; the process list then shows the link
    #[arg(long)]
    pub open: bool,
}

/// A listening socket with the token that protects its page.
pub struct PageLink {
    listener: TcpListener,
    port: u16,
    token: String,
}

impl PageLink {
    /// Opens a socket on the loopback interface and creates a token.
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

    /// Takes over the link of the launcher: the socket is this process's standard input. Thus the launcher can print the link before this
    /// process runs, and no other process can take the port meanwhile.
    ///
    /// # Errors
    /// If no launcher started this process, or its standard input is not a socket.
    pub fn inherited() -> anyhow::Result<Self> {
        let Ok(token) = std::env::var(TOKEN) else {
            bail!("this process was not started by a launcher");
        };
        let socket = io::stdin().as_fd().try_clone_to_owned();
        let listener = TcpListener::from(socket.context("the page's socket")?);
        Ok(Self {
            port: listener.local_addr().context("the page's socket")?.port(),
            listener,
            token,
        })
    }

    /// Returns the standard input and the environment variable for a process that inherits the link. Other users cannot read the
    /// variable, unlike an argument.
    #[must_use]
    pub fn into_inherited(self) -> (TcpListener, (&'static str, String)) {
        (self.listener, (TOKEN, self.token))
    }

    /// Duplicates the link for another server after this one.
    pub fn try_clone(&self) -> anyhow::Result<Self> {
        Ok(Self {
            listener: self.listener.try_clone().context("the page's socket")?,
            port: self.port,
            token: self.token.clone(),
        })
    }

    #[must_use]
    pub fn url(&self) -> String {
        format!("http://127.0.0.1:{}/#{}", self.port, self.token)
    }

    /// Opens the page in the user's browser.
    pub fn open(&self) -> anyhow::Result<()> {
        // The original error would repeat the entire link.
        open::that_detached(self.url())
            .map_err(|_| anyhow!("no browser can be opened here; open the link yourself"))
    }

    pub fn into_server(self) -> anyhow::Result<(tokio::net::TcpListener, String)> {
        self.listener
            .set_nonblocking(true)
            .and_then(|()| tokio::net::TcpListener::from_std(self.listener))
            .map(|listener| (listener, self.token))
            .context("the page's socket")
    }
}
