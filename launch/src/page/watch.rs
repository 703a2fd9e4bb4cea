//! `alliance watch`: a page for a live run, served by a process that only observes. Whatever becomes of it, the run is the same.

use std::process::ExitCode;
use std::time::Duration;

use alliance_proto::rendezvous::Rendezvous;
use alliance_proto::tell;
use clap::Args;
use tokio::signal::ctrl_c;
use tokio::time::{Instant, sleep};

use super::link::{Link, LinkArgs};
use super::live::Live;
use super::server::{FAREWELL, LEAVE, Shown, serve};
use crate::runtime;

/// How long a run that is named may take to be there.
const PATIENCE: Duration = Duration::from_secs(10);

/// Serve a page on which a live run is watched and interfered with.
#[derive(Args, Clone, Debug)]
pub struct WatchCommand {
    /// Id of the run [default: the newest live one]
    run: Option<String>,
    #[command(flatten)]
    link: LinkArgs,
    /// The launcher has made the page's socket
    #[arg(long, hide = true)]
    inherited: bool,
    /// The launcher shows the log at the same link afterwards
    #[arg(long, hide = true)]
    stays: bool,
}

impl WatchCommand {
    /// Serves until the run ends, or until somebody ends it.
    ///
    /// Exit status 0, 2 when the port is taken, 3 when no run is live or the bus fails.
    #[must_use]
    pub fn run(&self) -> ExitCode {
        let link = if self.inherited {
            Link::inherited()
        } else {
            Link::new(self.link.port)
        };
        let watched = match link {
            Ok(link) => self.serve(link),
            Err(error) => {
                tell!("alliance watch: {error:#}");
                return ExitCode::from(2);
            }
        };
        match watched {
            Ok(()) => ExitCode::SUCCESS,
            Err(error) => {
                tell!("alliance watch: {error:#}");
                ExitCode::from(3)
            }
        }
    }

    fn serve(&self, link: Link) -> anyhow::Result<()> {
        let runtime = runtime::start()?;
        runtime.block_on(async {
            let run = self.find().await?;
            let id = run.run.clone();
            let live = Live::join(run, self.stays).await?;
            if !self.inherited {
                tell!("run {id}: {}", link.url());
                if self.link.open {
                    // The link stands there all the same.
                    let _ = link.open().map_err(|error| tell!("{error:#}"));
                }
            }
            let (listener, token) = link.into_server()?;
            let watched = live.clone();
            let until = async move {
                tokio::select! {
                    _ = watched.over() => FAREWELL,
                    _ = ctrl_c() => {
                        watched.leave();
                        LEAVE
                    }
                }
            };
            serve(listener, token, Shown::Live(live), until).await
        })
    }

    /// The run; one that is named may be about to begin.
    async fn find(&self) -> anyhow::Result<Rendezvous> {
        let until = Instant::now() + PATIENCE;
        loop {
            match Rendezvous::find(self.run.as_deref()) {
                Ok(run) => return Ok(run),
                Err(_) if self.run.is_some() && Instant::now() < until => {
                    sleep(PATIENCE / 500).await;
                }
                Err(error) => return Err(error.into()),
            }
        }
    }
}
