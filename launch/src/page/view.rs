//! The page of a finished run.

use std::future::Future;
use std::path::Path;
use std::process::ExitCode;

use analysis::announce_reading;
use anyhow::Context;
use terminal::{fail, stderr_line};
use tokio::signal::ctrl_c;

use super::link::{LinkArgs, PageLink};
use super::logged::Logged;
use super::server::{INTERRUPT_TIMEOUT, Shown, serve};

/// Shows the finished run in `folder` until it is interrupted.
///
/// Exit status 0, 2 if the folder contains no usable run or the port is in use, 3 if the server fails.
pub fn show_folder(folder: &Path, options: &LinkArgs) -> ExitCode {
    announce_reading(folder);
    let prepared = PageLink::new(options.port).and_then(|link| Ok((link, Logged::open(folder)?)));
    let (status, shown) = match prepared {
        Ok((link, logged)) => (3, show(folder, options, link, logged)),
        Err(error) => (2, Err(error)),
    };
    match shown {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => fail("alliance watch", &error, status),
    }
}

fn show(folder: &Path, options: &LinkArgs, link: PageLink, logged: Logged) -> anyhow::Result<()> {
    if let Some(warning) = &logged.warning {
        stderr_line!("{warning}");
    }
    stderr_line!("{}: {} (press Ctrl-C to end)", folder.display(), link.url());
    if options.open {
        // The link has been printed in any case.
        let _ = link.open().map_err(|error| stderr_line!("{error:#}"));
    }
    serve_log(link, logged, std::future::pending())
}

/// Shows the log of a run at the link of its live page, until it is interrupted or no page is open. A run that the user ended is not
/// shown.
pub fn show_log(link: PageLink, folder: &Path) -> anyhow::Result<()> {
    let logged = Logged::open(folder)?;
    if logged.was_interrupted() {
        return Ok(());
    }
    stderr_line!(
        "page    {} shows the log (press Ctrl-C or close the page to end)",
        link.url()
    );
    let deserted = logged.wait_until_deserted();
    serve_log(link, logged, deserted)
}

/// Serves a log until Ctrl-C or until `over` resolves.
fn serve_log(
    link: PageLink,
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
            // If signals are unavailable, only `over` or the end of the process stops the server.
            tokio::select! {
                _ = ctrl_c() => {}
                () = over => {}
            }
            INTERRUPT_TIMEOUT
        };
        serve(listener, token, Shown::Logged(Box::new(logged)), until).await
    })
}
