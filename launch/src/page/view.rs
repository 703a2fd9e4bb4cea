//! `alliance view`: a finished run on the page, with its time to go back and forth in.

use std::future::Future;
use std::path::{Path, PathBuf};
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
        serve_log(link, logged, std::future::pending())
    }
}

/// Shows a run that was just watched as a log, at the same link, until somebody ends it or no page looks at it any more. A run
/// that somebody has ended is not shown: whoever did so wants to go.
///
/// # Errors
/// When the run cannot be shown, or the server fails.
pub fn stay_with_log(link: Link, folder: &Path) -> anyhow::Result<()> {
    let logged = Logged::open(folder)?;
    if logged.was_interrupted() {
        return Ok(());
    }
    tell!(
        "page    {} shows the log (Ctrl-C, or closing it, ends this)",
        link.url()
    );
    let deserted = logged.deserted();
    serve_log(link, logged, deserted)
}

/// Serves it until Ctrl-C, or until then.
fn serve_log(
    link: Link,
    logged: Logged,
    over: impl Future<Output = ()> + Send + 'static,
) -> anyhow::Result<()> {
    let runtime = tokio::runtime::Builder::new_current_thread()
        .enable_all()
        .build()
        .context("starting the runtime")?;
    runtime.block_on(async {
        let (listener, token) = link.into_server()?;
        let until = async {
            // Without signals only the process's end is left.
            tokio::select! {
                _ = ctrl_c() => {}
                () = over => {}
            }
            LEAVE
        };
        serve(listener, token, Shown::Logged(logged), until).await
    })
}
