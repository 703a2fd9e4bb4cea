//! Commands of programs of others to a live run.

use std::time::Duration;

use anyhow::bail;
use cluster::rendezvous::{Rendezvous, RendezvousError};
use proto::control::{ControlCommand, Reply};
use tokio::time::{Instant, sleep};

use crate::control::send_command;

/// The time within which a run must be live. Its services exist while the world starts.
const PATIENCE: Duration = Duration::from_secs(10);

/// The interval at which a command looks for its run.
const LOOK_INTERVAL: Duration = Duration::from_millis(50);

/// Sends a command to the run with this id. Returns the reply as JSON.
///
/// # Errors
/// As [`send_command`], if the world refuses the command, and if the run is not live in time.
pub async fn relay_command(run: &str, command: ControlCommand) -> anyhow::Result<String> {
    let reply = send_command(wait_for_run(run).await?, command).await?;
    if let Reply::Refused(why) = &reply {
        bail!("{why}");
    }
    Ok(serde_json::to_string(&reply)?)
}

async fn wait_for_run(run: &str) -> Result<Rendezvous, RendezvousError> {
    let until = Instant::now() + PATIENCE;
    loop {
        match Rendezvous::find(Some(run)) {
            Err(RendezvousError::Unknown { .. }) if Instant::now() < until => {
                sleep(LOOK_INTERVAL).await;
            }
            found => return found,
        }
    }
}
