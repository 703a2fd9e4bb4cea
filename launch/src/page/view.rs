//! `alliance view`: a finished run on the page, with its time to go back and forth in.

use std::path::PathBuf;
use std::process::ExitCode;

use alliance_proto::tell;
use anyhow::Context;
use clap::Args;
use tokio::signal::ctrl_c;

use super::link::{Link, LinkArgs};
use super::logged::Logged;
use super::server::{LEAVE, Shown, serve};

/// Show a finished run on a page.
#[derive(Args, Clone, Debug)]
pub struct ViewCommand {
    /// Folder of the run
    folder: PathBuf,
    #[command(flatten)]
    link: LinkArgs,
}

impl ViewCommand {
    /// Serves until somebody ends it.
    ///
    /// Exit status 0, 2 when the folder holds no run that can be shown or the port is taken, 3 when the server fails.
    #[must_use]
    pub fn run(&self) -> ExitCode {
        let prepared =
            Link::new(self.link.port).and_then(|link| Ok((link, Logged::open(&self.folder)?)));
        let (link, logged) = match prepared {
            Ok(prepared) => prepared,
            Err(error) => {
                tell!("alliance view: {error:#}");
                return ExitCode::from(2);
            }
        };
        match self.serve(link, logged) {
            Ok(()) => ExitCode::SUCCESS,
            Err(error) => {
                tell!("alliance view: {error:#}");
                ExitCode::from(3)
            }
        }
    }

    fn serve(&self, link: Link, logged: Logged) -> anyhow::Result<()> {
        if let Some(warning) = &logged.warning {
            tell!("{warning}");
        }
        tell!("{}: {} (Ctrl-C ends it)", self.folder.display(), link.url());
        if self.link.open {
            // The link stands there all the same.
            let _ = link.open().map_err(|error| tell!("{error:#}"));
        }
        let runtime = tokio::runtime::Builder::new_current_thread()
            .enable_all()
            .build()
            .context("starting the runtime")?;
        runtime.block_on(async {
            let (listener, token) = link.into_server()?;
            let until = async {
                // Without signals only the process's end is left.
                let _ = ctrl_c().await;
                LEAVE
            };
            serve(listener, token, Shown::Logged(logged), until).await
        })
    }
}
