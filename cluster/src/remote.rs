//! Connection from another host: options, and the search for the run.

use std::path::PathBuf;
use std::time::Duration;

use crate::key_files::KeyFiles;
use crate::keyring::Keyring;
use crate::locator::Locator;
use crate::member::Login;
use crate::session;
use anyhow::Context;
use clap::Args;
use proto::keys::{ALIVE_WORLDS, KeyExpressions, run_of_world};
use tokio::time::{Instant, sleep};
use zenoh::Session;

use crate::{ConnectError, silence, try_open};

const LOOK_INTERVAL: Duration = Duration::from_millis(200);

/// The time in which a lost run can return.
const RETURN_LIMIT: Duration = Duration::from_secs(30);

/// The time to wait for the world behind a router.
const WORLD_PATIENCE: Duration = Duration::from_secs(10);

#[derive(Args, Clone, Debug)]
#[command(next_help_heading = "Network")]
pub struct RemoteArgs {
    /// Address of the world or of a router, such as tls/10.0.0.1:7447
    #[arg(long, value_name = "LOCATOR", requires = "keys")]
    pub connect: Option<String>,
    /// Folder of this member's keys, from `alliance cluster keys`; - for standard input
    #[arg(long, value_name = "DIR")]
    pub keys: Option<PathBuf>,
    /// Do not encrypt; everyone on the network can read the messages
    #[arg(long)]
    pub unencrypted: bool,
}

impl RemoteArgs {
    /// Returns the login and the key files of the member with that identity; `None` without `--connect`.
    ///
    /// # Errors
    /// Fails with one line if the locator or the keys are invalid.
    pub fn login(&self, identity: &str) -> anyhow::Result<Option<(Login, KeyFiles)>> {
        let (Some(endpoint), Some(keys)) = (&self.connect, &self.keys) else {
            return Ok(None);
        };
        silence::watch();
        let locator = Locator::from_option(endpoint, self.unencrypted).context("--connect")?;
        let files = KeyFiles::from_option(keys).context("--keys")?;
        let keyring = Keyring::read(&files, identity).context("--keys")?;
        let login = Login {
            endpoint: locator.to_string(),
            user: identity.to_owned(),
            password: keyring.secret.clone(),
            keyring: Some(keyring),
        };
        Ok(Some((login, files)))
    }
}

/// Returns the run of the world at the endpoint. Waits until a world appears there.
///
/// # Errors
/// Fails if the endpoint refuses this member.
pub async fn find_run(login: &Login) -> anyhow::Result<String> {
    let mut reported = None;
    loop {
        let why = match look_for_run(login).await {
            Ok(Some(run)) => return Ok(run),
            Ok(None) => format!("{}: no world is reachable there yet", login.endpoint),
            Err(refused @ ConnectError::Refused { .. }) => return Err(refused.into()),
            Err(error) => error.to_string(),
        };
        if reported.as_ref() != Some(&why) {
            tracing::info!("{why}; trying again");
            reported = Some(why);
        }
        sleep(LOOK_INTERVAL).await;
    }
}

/// Returns the run of the world at the endpoint, or `None` if a router there has no world.
async fn look_for_run(login: &Login) -> Result<Option<String>, ConnectError> {
    let config = session::client(login, true);
    let session = try_open(&config, &login.endpoint).await?;
    let found = world_of(&session).await;
    let _ = session.close().await;
    found.map_err(|error| ConnectError::NotThere {
        endpoint: login.endpoint.clone(),
        reason: error.to_string(),
    })
}

/// Returns whether a lost run appears again at the endpoint within `RETURN_LIMIT`. It does not if no program listens
/// there, or if there is another run.
pub async fn does_return(login: &Login, run: &str) -> bool {
    let until = Instant::now() + RETURN_LIMIT;
    while Instant::now() < until {
        match look_for_run(login).await {
            Ok(Some(found)) => return found == run,
            Err(error) if error.is_unused() => return false,
            Ok(None) | Err(_) => sleep(LOOK_INTERVAL).await,
        }
    }
    false
}

/// Returns whether the liveliness token of the run's world is present.
pub async fn is_world_there(session: &Session, keys: &KeyExpressions) -> bool {
    let Ok(tokens) = session.liveliness().get(keys.alive_world()).await else {
        return false;
    };
    let first = tokens.recv_async().await;
    first.is_ok_and(|reply| reply.result().is_ok())
}

/// Waits for the world's token, because a router may start before it reaches the world. Returns whether the token
/// appeared.
pub async fn wait_for_world(session: &Session, keys: &KeyExpressions) -> bool {
    let until = Instant::now() + WORLD_PATIENCE;
    while Instant::now() < until {
        if is_world_there(session, keys).await {
            return true;
        }
        sleep(LOOK_INTERVAL / 10).await;
    }
    false
}

async fn world_of(session: &Session) -> zenoh::Result<Option<String>> {
    let tokens = session.liveliness().get(ALIVE_WORLDS).await?;
    while let Ok(reply) = tokens.recv_async().await {
        if let Ok(token) = reply.result()
            && let Some(run) = run_of_world(token.key_expr())
        {
            return Ok(Some(run.to_owned()));
        }
    }
    Ok(None)
}
