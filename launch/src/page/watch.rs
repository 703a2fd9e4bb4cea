//! `alliance watch`: the page of a live run, in a process that only observes. Its failure does not affect the run.

use std::process::ExitCode;
use std::time::Duration;

use clap::Args;
use cluster::rendezvous::Rendezvous;
use terminal::stderr_line;
use tokio::signal::ctrl_c;
use tokio::time::{Instant, sleep};

use super::link::{LinkArgs, PageLink};
use super::live::Live;
use super::server::{END_OF_RUN_TIMEOUT, INTERRUPT_TIMEOUT, Shown, serve};
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
    shows_log_afterwards: bool,
}

impl WatchCommand {
    /// Serves the page until the run ends or the command is interrupted.
    ///
    /// Exit status 0, 2 if the port is in use, 3 if no run is live or the bus fails.
    #[must_use]
    pub fn run(&self) -> ExitCode {
        let link = if self.inherited {
            PageLink::inherited()
        } else {
            PageLink::new(self.link.port)
        };
        let watched = match link {
            Ok(link) => self.serve(link),
            Err(error) => {
                stderr_line!("alliance watch: {error:#}");
                return ExitCode::from(2);
            }
        };
        match watched {
            Ok(()) => ExitCode::SUCCESS,
            Err(error) => {
                stderr_line!("alliance watch: {error:#}");
                ExitCode::from(3)
            }
        }
    }

    fn serve(&self, link: PageLink) -> anyhow::Result<()> {
        let runtime = runtime::start_runtime()?;
        runtime.block_on(async {
            let run = self.find().await?;
            let id = run.run.clone();
            let live = Live::join(run, self.shows_log_afterwards).await?;
            if !self.inherited {
                stderr_line!("run {id}: {}", link.url());
                if self.link.open {
                    // The link has been printed in any case.
                    let _ = link.open().map_err(|error| stderr_line!("{error:#}"));
                }
            }
            let (listener, token) = link.into_server()?;
            let watched = live.clone();
            let until = async move {
                tokio::select! {
                    _ = watched.over() => END_OF_RUN_TIMEOUT,
                    _ = ctrl_c() => {
                        watched.close_pages();
                        INTERRUPT_TIMEOUT
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
