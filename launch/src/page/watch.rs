//! `alliance watch`: the page of a live run, in a process that only observes. Its failure does not affect the run.

use std::process::ExitCode;
use std::time::Duration;

use clap::Args;
use cluster::rendezvous::Rendezvous;
use terminal::tell;
use tokio::signal::ctrl_c;
use tokio::time::{Instant, sleep};

use super::link::{Link, LinkArgs};
use super::live::Live;
use super::server::{FAREWELL, LEAVE, Shown, serve};
use crate::runtime;

/// The time for a run given by id to be announced.
const PATIENCE: Duration = Duration::from_secs(10);

/// Serve a page to watch and control a live run.
#[derive(Args, Clone, Debug)]
pub struct WatchCommand {
    /// Id of the run [default: the newest live run]
    run: Option<String>,
    #[command(flatten)]
    link: LinkArgs,
    /// Use the socket that the launcher opened
    #[arg(long, hide = true)]
    inherited: bool,
    /// Announce that the launcher shows the log at the same link afterwards
    #[arg(long, hide = true)]
    stays: bool,
}

impl WatchCommand {
    /// Serves the page until the run ends or the command is interrupted.
    ///
    /// Exit status 0, 2 if the port is in use, 3 if no run is live or the bus fails.
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
                    // The link has been printed in any case.
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

    /// Finds the run. Waits a while for a run given by id, because it may be starting.
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
