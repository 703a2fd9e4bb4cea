//! The world's side of the bus for a replay with external controllers: announcement, joins, ticks and broadcasts.

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use anyhow::Context;
use cluster::rendezvous::{Announcement, Rendezvous};
use cluster::router;
use proto::join::{JoinReply, JoinRequest, PROTOCOL_VERSION, Refusal, Welcome};
use proto::keys::KeyExpressions;
use proto::secret::Secret;
use proto::team::Broadcast;
use proto::tick::{Report, TICK_LIMIT_BYTES};
use scenario::Setup;
use scenario::ids::{Incarnation, RobotId};
use serde::Serialize;
use tempfile::TempDir;
use tokio::sync::Notify;
use tokio::time::{Instant, timeout};
use zenoh::liveliness::LivelinessToken;
use zenoh::sample::SampleKind;
use zenoh::{Session, Wait};

use crate::run::child_processes::Process;

/// The time for a controller to join or to answer a tick.
const PATIENCE: Duration = Duration::from_secs(60);

/// The interval between checks of the controller's process.
const GLANCE: Duration = Duration::from_millis(50);

/// The announced run that the controllers join.
pub(super) struct Stage {
    /// The id of the run, by which controllers find it.
    pub run: String,
    pub session: Session,
    pub keys: KeyExpressions,
    token: String,
    /// The folder for the output of the controllers. Other users cannot create it in advance.
    pub logs: TempDir,
    pub received: Arc<ReceivedMessages>,
    _token: LivelinessToken,
    _announcement: Announcement,
}

#[derive(Default)]
pub(super) struct ReceivedMessages {
    state: Mutex<State>,
    changed: Notify,
}

#[derive(Default)]
pub(super) struct State {
    /// The robots that may join, by name, with their welcome messages.
    pub welcomes: BTreeMap<String, Welcome>,
    /// The robots whose liveliness token has appeared, by name.
    pub present: BTreeMap<String, Incarnation>,
    /// The latest report of each robot. `broadcasts` contains those of the same tick.
    pub reports: BTreeMap<RobotId, Report>,
    pub broadcasts: BTreeMap<RobotId, Vec<Broadcast>>,
}

impl ReceivedMessages {
    pub fn lock(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn note(&self, change: impl FnOnce(&mut State)) {
        change(&mut self.lock());
        self.changed.notify_one();
    }
}

impl Stage {
    /// Opens a router and announces a new run for the controllers.
    pub async fn open(setup: &Setup) -> anyhow::Result<Self> {
        let run = format!("replay-{}", std::process::id());
        let mut rendezvous = Rendezvous::new(run.clone())?;
        let session = router::open_for_team(&mut rendezvous, None).await?;
        let (keys, token) = (KeyExpressions::new(&run), rendezvous.token.clone());
        let received = Arc::new(ReceivedMessages::default());
        subscribe(&session, &keys, &token, &received, setup)
            .await
            .map_err(anyhow::Error::from_boxed)?;
        let alive = session.liveliness().declare_token(keys.alive_world());
        let alive = alive.await.map_err(anyhow::Error::from_boxed)?;
        let announcement = rendezvous.announce()?;
        let logs = TempDir::with_prefix("alliance-replay-").context("folder for logs")?;
        Ok(Self {
            run,
            session,
            keys,
            token,
            logs,
            received,
            _token: alive,
            _announcement: announcement,
        })
    }

    /// Sends a message of the world to a robot.
    pub fn send_to_robot<T: Serialize>(&self, robot: &str, message: &T) -> Result<(), String> {
        let (key, secret) = (self.keys.tick(robot), Secret::of_robot(&self.token, robot));
        let sealed = secret
            .seal_within::<T, TICK_LIMIT_BYTES>(&key, message)
            .map_err(|error| error.to_string())?;
        let put = self.session.put(key, sealed);
        put.wait().map_err(|error| error.to_string())
    }

    /// Waits until `look` returns a value. Returns an error if the process ends or takes too long.
    pub async fn wait_for<T>(
        &self,
        process: &mut Process,
        look: impl Fn(&mut State) -> Option<T>,
    ) -> Result<T, String> {
        let until = Instant::now() + PATIENCE;
        loop {
            if let Some(found) = look(&mut self.received.lock()) {
                return Ok(found);
            }
            if timeout(GLANCE, self.received.changed.notified())
                .await
                .is_ok()
            {
                continue;
            }
            while let Ok(Some(_)) = process.poll() {}
            if let Some(ending) = process.ending() {
                let output = process.last_log_lines();
                return Err(format!(
                    "its controller {}: {}",
                    ending.describe(),
                    output.trim()
                ));
            }
            if Instant::now() > until {
                return Err(format!(
                    "its controller has not answered for {} s",
                    PATIENCE.as_secs()
                ));
            }
        }
    }
}

async fn subscribe(
    session: &Session,
    keys: &KeyExpressions,
    token: &str,
    messages: &Arc<ReceivedMessages>,
    setup: &Setup,
) -> zenoh::Result<()> {
    for robot in &setup.scenario.robots {
        let (received, opener) = (Arc::clone(messages), Secret::of_robot(token, &robot.name));
        session
            .declare_subscriber(keys.report(&robot.name))
            .callback(move |sample| {
                let report = opener.open::<Report>(sample.key_expr(), &sample.payload().to_bytes());
                if let Ok(report) = report {
                    received.note(|state| {
                        state.reports.insert(report.robot, report);
                    });
                }
            })
            .background()
            .await?;

        let (received, opener) = (Arc::clone(messages), Secret::of_robot(token, &robot.name));
        session
            .declare_subscriber(keys.team(&robot.name, "*"))
            .callback(move |sample| {
                let broadcast =
                    opener.open::<Broadcast>(sample.key_expr(), &sample.payload().to_bytes());
                if let Ok(broadcast) = broadcast {
                    let broadcasts = &mut received.lock().broadcasts;
                    broadcasts
                        .entry(broadcast.sender)
                        .or_default()
                        .push(broadcast);
                }
            })
            .background()
            .await?;
    }

    let (received, run_token, run_keys) = (Arc::clone(messages), token.to_owned(), keys.clone());
    session
        .liveliness()
        .declare_subscriber(keys.alive_agents())
        .callback(move |sample| {
            let key = sample.key_expr().as_str();
            let plain = key
                .rsplit_once('/')
                .and_then(|(plain, _)| run_keys.parse_alive(plain));
            if let (Some((name, incarnation)), SampleKind::Put) = (plain, sample.kind())
                && Secret::of_robot(&run_token, name).stamped(key).is_some()
            {
                received.note(|state| {
                    state.present.insert(name.to_owned(), incarnation);
                });
            }
        })
        .background()
        .await?;

    let (received, run_token, run_keys) = (Arc::clone(messages), token.to_owned(), keys.clone());
    session
        .declare_queryable(keys.joins())
        .callback(move |query| {
            let payload = query.payload().map(|payload| payload.to_bytes());
            let key = query.key_expr().as_str();
            let name = KeyExpressions::parse_sender(key);
            let secret = Secret::of_robot(&run_token, name);
            let request = secret.open::<JoinRequest>(key, &payload.unwrap_or_default());
            let Ok(request) = request else { return };
            let reply = answer(&request, &mut received.lock());
            if let Ok(bytes) = secret.seal(&run_keys.join_answer(name, request.nonce), &reply) {
                // If the reply is lost, the controller repeats its request or times out.
                let _ = query.reply(key, bytes).wait();
            }
        })
        .background()
        .await
}

fn answer(request: &JoinRequest, state: &mut State) -> JoinReply {
    if request.version != PROTOCOL_VERSION {
        return JoinReply::Refused(Refusal::Version {
            agent: request.version,
            world: PROTOCOL_VERSION,
        });
    }
    match state.welcomes.remove(&request.robot) {
        Some(welcome) => JoinReply::Welcome(welcome),
        None => JoinReply::Refused(Refusal::Absent {
            robot: request.robot.clone(),
        }),
    }
}
