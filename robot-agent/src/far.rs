//! From another host: how a world is reached over a network, and how its run is found.

use std::path::PathBuf;
use std::time::Duration;

use alliance_proto::key_files::KeyFiles;
use alliance_proto::keyring::Keyring;
use alliance_proto::keys::{ALIVE_WORLDS, Keys, run_of_world};
use alliance_proto::locator::Locator;
use alliance_proto::member::Login;
use alliance_proto::session;
use anyhow::Context;
use clap::Args;
use tokio::time::{Instant, sleep};
use zenoh::Session;

use bus::{ConnectError, open_once};

/// How often a world is looked for that is not there.
const LOOK_INTERVAL: Duration = Duration::from_millis(200);

/// How long the world is waited for behind a router.
const WORLD_PATIENCE: Duration = Duration::from_secs(10);

/// How a world on another host is reached.
#[derive(Args, Clone, Debug)]
pub struct FarArgs {
    /// Where the world, or a router on the way to it, is reached from other hosts, such as tls/10.0.0.1:7447
    #[arg(long, value_name = "LOCATOR", requires = "keys")]
    pub connect: Option<String>,
    /// Folder with this member's keys, as `alliance keys` makes them; or -: they come by standard input, as `cluster up --start` gives them
    #[arg(long, value_name = "DIR")]
    pub keys: Option<PathBuf>,
    /// Take a way over the network that is not encrypted; everybody on it can read along
    #[arg(long)]
    pub unencrypted: bool,
}

impl FarArgs {
    /// How the member of that identity connects, and where its keys are; `None` on the world's own machine.
    ///
    /// # Errors
    /// One line that says what is wrong with the locator or the keys.
    pub fn login(&self, identity: &str) -> anyhow::Result<Option<(Login, KeyFiles)>> {
        let (Some(endpoint), Some(keys)) = (&self.connect, &self.keys) else {
            return Ok(None);
        };
        let locator = Locator::of_option(endpoint, self.unencrypted).context("--connect")?;
        let files = KeyFiles::of_option(keys).context("--keys")?;
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

/// The run of the world that is reached so; waits until one is there.
///
/// # Errors
/// When the world, or who is there instead, does not let this member in.
pub async fn find_run(login: &Login) -> anyhow::Result<String> {
    let config = session::client(login, true);
    let mut said = None;
    loop {
        let why = match open_once(&config, &login.endpoint) {
            Ok(session) => {
                let found = world_of(&session).await;
                let _ = session.close().await;
                if let Some(run) = found.map_err(anyhow::Error::from_boxed)? {
                    return Ok(run);
                }
                format!("{}: no world is reached there yet", login.endpoint)
            }
            Err(refused @ ConnectError::Refused { .. }) => return Err(refused.into()),
            Err(error) => error.to_string(),
        };
        if said.as_ref() != Some(&why) {
            tracing::info!("{why}; trying again");
            said = Some(why);
        }
        sleep(LOOK_INTERVAL).await;
    }
}

/// Whether the world of the run shows its token.
pub async fn is_world_there(session: &Session, keys: &Keys) -> bool {
    let Ok(tokens) = session.liveliness().get(keys.alive_world()).await else {
        return false;
    };
    let first = tokens.recv_async().await;
    first.is_ok_and(|reply| reply.result().is_ok())
}

/// Waits until it does: a router on the way may be there before it has reached the world. Says whether it came.
pub async fn wait_for_world(session: &Session, keys: &Keys) -> bool {
    let until = Instant::now() + WORLD_PATIENCE;
    while Instant::now() < until {
        if is_world_there(session, keys).await {
            return true;
        }
        sleep(LOOK_INTERVAL / 10).await;
    }
    false
}

/// The run whose world shows its token.
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
