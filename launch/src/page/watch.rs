//! `alliance watch`: the page of a live run, in a process that only observes, or of a finished run. Its failure does not affect a
//! live run.

use std::net::SocketAddr;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::Duration;

use analysis::LATEST;
use anyhow::anyhow;
use clap::{Args, ValueHint};
use cluster::rendezvous::Rendezvous;
use scenario::names::is_name;
use terminal::{fail, stderr_line};
use tokio::signal::ctrl_c;
use tokio::time::{Instant, sleep};
use world_server::args::address;

use super::link::{LinkArgs, PageLink};
use super::live::Live;
use super::server::{END_OF_RUN_TIMEOUT, INTERRUPT_TIMEOUT, Shown, serve};
use super::view::show_folder;
use crate::foxglove::{ADDRESS as FOXGLOVE_ADDRESS, FoxgloveCommand};
use crate::runtime;

/// The time for a run given by id to be announced.
const PATIENCE: Duration = Duration::from_secs(10);

/// Show a live or finished run on a page
#[derive(Args, Clone, Debug)]
pub struct WatchCommand {
    /// Id of a live run, or folder of a finished one [default: the newest live run, else runs/latest]
    #[arg(value_name = "RUN", value_hint = ValueHint::AnyPath)]
    run: Option<String>,
    #[command(flatten)]
    link: LinkArgs,
    /// Serve the run in the folder to Foxglove at this address instead [default: 127.0.0.1:8765]
    #[arg(
        long,
        value_name = "ADDRESS",
        num_args = 0..=1,
        require_equals = true,
        default_missing_value = FOXGLOVE_ADDRESS,
        value_parser = address,
        conflicts_with_all = ["open", "port"],
        hide = !cfg!(feature = "foxglove")
    )]
    foxglove: Option<SocketAddr>,
    /// Use the socket that the launcher opened
    #[arg(long, hide = true)]
    inherited: bool,
    /// Announce that the launcher shows the log at the same link afterwards
    #[arg(long = "stays", hide = true)]
    shows_log_afterwards: bool,
}

impl WatchCommand {
    /// Serves the page until a live run ends or the command is interrupted.
    ///
    /// Exit status 0, 2 if the folder contains no usable run or the port is in use, 3 if no run is live or the bus fails.
    #[must_use]
    pub fn run(&self) -> ExitCode {
        if let Some(address) = self.foxglove {
            let folder = PathBuf::from(self.run.as_deref().unwrap_or(LATEST));
            return FoxgloveCommand::new(folder, address).run("alliance watch");
        }
        if let Some(folder) = self.folder() {
            return show_folder(folder, &self.link);
        }
        let link = if self.inherited {
            PageLink::inherited()
        } else {
            PageLink::new(self.link.port)
        };
        let watched = match link {
            Ok(link) => self.serve(link),
            Err(error) => {
                return fail("alliance watch", &error, 2);
            }
        };
        match watched {
            Ok(()) => ExitCode::SUCCESS,
            Err(error) => fail("alliance watch", &error, 3),
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

    /// Returns the folder of the finished run to show, or `None` for a live run. A live run precedes a folder of the same name.
    fn folder(&self) -> Option<&Path> {
        let run = self.run.as_deref();
        if self.inherited || Rendezvous::find(run).is_ok() {
            return None;
        }
        let folder = Path::new(run.unwrap_or(LATEST));
        // Text that cannot be an id is a path, so that the message is about a folder.
        let is_path = folder.exists() || run.is_some_and(|run| !is_name(run));
        is_path.then_some(folder)
    }

    /// Finds the run. Waits a while for a run given by id, because it may be starting.
    async fn find(&self) -> anyhow::Result<Rendezvous> {
        let find = || Rendezvous::find(self.run.as_deref());
        let mut found = find();
        if self.run.is_none() {
            return Ok(found?);
        }
        if let Err(error) = &found
            && !self.inherited
        {
            let patience_s = PATIENCE.as_secs();
            stderr_line!("{error}; waiting {patience_s} s for it");
        }
        let until = Instant::now() + PATIENCE;
        // A world that first repeats another run is announced late: the page of a launcher waits for it without a limit.
        while found.is_err() && (self.inherited || Instant::now() < until) {
            sleep(PATIENCE / 500).await;
            found = find();
        }
        found.map_err(|error| anyhow!("{error}; there is no such folder either"))
    }
}
