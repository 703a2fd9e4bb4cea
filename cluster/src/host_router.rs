//! The router of a host. It connects the agents of the host's robots to the world.

use std::collections::BTreeMap;
use std::sync::Arc;
use std::time::Duration;

use crate::access::{self, LinkMembers};
use crate::key_files::KeyFiles;
use crate::keyring::Keyring;
use crate::member::Login;
use crate::remote;
use crate::rendezvous::{Announcement, ConnectionRole, JoinEndpoint, RemoteWorld, Rendezvous};
use crate::router::RouterConfig;
use crate::session;
use anyhow::{Context, bail};
use proto::identity;
use proto::join::PROTOCOL_VERSION;
use proto::keys::KeyExpressions;
use proto::membership::{EnlistReply, EnlistRequest, HostRobots};
use proto::secret::{Secret, random};
use tokio::sync::Notify;
use tokio::time::timeout;
use zenoh::Session;
use zenoh::query::{ConsolidationMode, QueryTarget};
use zenoh::sample::SampleKind;

/// The time for the world to return the robots of a host.
const PATIENCE: Duration = Duration::from_secs(10);

const CLOSE_DEADLINE: Duration = Duration::from_secs(1);

pub struct Relay {
    pub session: Session,
    pub keys: KeyExpressions,
    pub run: String,
    /// The secret that seals messages between host and world.
    pub secret: Secret,
    /// The robots that the world assigns to this host.
    pub enlisted: HostRobots,
    /// A permit when the token of the world has disappeared.
    lost: Arc<Notify>,
    _announcement: Announcement,
}

impl Relay {
    /// Waits for a run at the world of `login` and requests the robots of this host. Then opens a router for them, also at `listen`, and
    /// announces the run on this machine.
    ///
    /// # Errors
    /// If the world refuses this host, a robot's secret is missing, or the bus fails.
    pub async fn open(
        host: &str,
        login: &Login,
        key_files: &KeyFiles,
        listen: &[String],
    ) -> anyhow::Result<Self> {
        let run = remote::find_run(login).await?;
        let keys = KeyExpressions::new(&run);
        let secret = Secret::from_token(&login.password);
        let enlisted = enlist(host, login, &keys, &secret).await?;
        let mut robots = BTreeMap::new();
        for robot in &enlisted.robots {
            let secret = Keyring::secret(key_files, &identity::robot(robot)).context("--keys")?;
            robots.insert(robot.clone(), secret);
        }
        let speakers: Vec<LinkMembers> = robots
            .keys()
            .map(|robot| LinkMembers::robot(robot))
            .collect();
        let (protocol, _) = login.endpoint.split_once('/').unwrap_or_default();
        let users = robots.iter();
        let users = users.map(|(robot, secret)| (identity::robot(robot), secret.clone()));
        let plan = RouterConfig {
            listen: listen.to_vec(),
            uplink: Some(login.clone()),
            users: users.collect(),
            keyring: login.keyring.clone(),
            access: access::team_rules(
                &keys,
                &speakers,
                ConnectionRole::Team.name(),
                Some(protocol),
            ),
        };
        let pid = std::process::id();
        let (session, endpoint) = plan.open(&run, pid, ConnectionRole::Team).await?;
        if !remote::wait_for_world(&session, &keys).await {
            bail!(
                "the world at {} cannot be reached through this host's router",
                login.endpoint
            );
        }
        let lost = watch_world(&session, &keys)
            .await
            .map_err(anyhow::Error::from_boxed)?;
        let mut rendezvous = Rendezvous::new(run.clone())?;
        rendezvous.endpoint.clone_from(&endpoint);
        rendezvous.token = String::new();
        rendezvous.team = JoinEndpoint {
            endpoint,
            password: String::new(),
        };
        rendezvous.remote = Some(RemoteWorld {
            host: host.to_owned(),
            world: login.endpoint.clone(),
            robots,
        });
        Ok(Self {
            _announcement: rendezvous.announce()?,
            session,
            keys,
            run,
            secret,
            enlisted,
            lost,
        })
    }

    /// Waits until the connection to the world is closed. A stopped world and a short outage of the network do not close it.
    pub async fn lost(&self) {
        self.lost.notified().await;
    }

    pub async fn close(self) {
        // Closing may hang, so its time is limited.
        let _ = timeout(CLOSE_DEADLINE, self.session.close()).await;
    }
}

/// Watches the token of the world. The result has a permit once the token has disappeared.
async fn watch_world(session: &Session, keys: &KeyExpressions) -> zenoh::Result<Arc<Notify>> {
    let lost = Arc::new(Notify::new());
    let notify = Arc::clone(&lost);
    session
        .liveliness()
        .declare_subscriber(keys.alive_world())
        .history(true)
        .callback(move |sample| {
            if sample.kind() == SampleKind::Delete {
                notify.notify_one();
            }
        })
        .background()
        .await?;
    Ok(lost)
}

/// Requests the robots of this host from the world.
async fn enlist(
    host: &str,
    login: &Login,
    keys: &KeyExpressions,
    secret: &Secret,
) -> anyhow::Result<HostRobots> {
    let bus_error = anyhow::Error::from_boxed;
    let session = crate::open(&session::client(login, false))
        .await
        .map_err(bus_error)?;
    // Certificates depend on wall-clock time; the simulation does not.
    #[allow(clippy::disallowed_methods)]
    let now = std::time::SystemTime::now();
    let since = now
        .duration_since(std::time::UNIX_EPOCH)
        .unwrap_or_default();
    let request = EnlistRequest {
        version: PROTOCOL_VERSION,
        nonce: random()?,
        unix_ms: since.as_millis() as u64,
    };
    let key = keys.enlist(host);
    let replies = session
        .get(&key)
        .payload(secret.seal(&key, &request)?)
        .target(QueryTarget::All)
        .consolidation(ConsolidationMode::None)
        .timeout(PATIENCE)
        .await
        .map_err(bus_error)?;
    let mut answer: Option<EnlistReply> = None;
    while let Ok(reply) = replies.recv_async().await {
        let Ok(sample) = reply.into_result() else {
            continue;
        };
        let bytes = sample.payload().to_bytes();
        // The world answers an unreadable request with nonce 0.
        let opened = [request.nonce, 0]
            .iter()
            .find_map(|nonce| secret.open(&keys.enlist_answer(host, *nonce), &bytes).ok());
        answer = answer.or(opened);
    }
    let _ = timeout(CLOSE_DEADLINE, session.close()).await;
    match answer {
        Some(Ok(enlisted)) => Ok(enlisted),
        Some(Err(why)) => bail!(
            "the world at {} refuses host '{host}': {why}",
            login.endpoint
        ),
        None => bail!(
            "the world at {} has no host '{host}'; start it with --place {host}=ROBOT,ROBOT",
            login.endpoint
        ),
    }
}
