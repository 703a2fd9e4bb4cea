//! The world as minds see it that are asked once more: they find its run, join it, and get ticks and broadcasts from it.

use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use alliance_proto::ids::{Incarnation, RobotId};
use alliance_proto::join::{JoinReply, JoinRequest, PROTOCOL_VERSION, Refusal, Welcome};
use alliance_proto::keys::Keys;
use alliance_proto::rendezvous::{Announcement, Rendezvous};
use alliance_proto::scenario::Setup;
use alliance_proto::secret::Secret;
use alliance_proto::team::Broadcast;
use alliance_proto::tick::Report;
use anyhow::Context;
use serde::Serialize;
use tokio::sync::Notify;
use tokio::time::{Instant, timeout};
use world_server::router;
use zenoh::liveliness::LivelinessToken;
use zenoh::qos::Priority;
use zenoh::sample::SampleKind;
use zenoh::{Session, Wait};

use crate::run::children::Process;

/// How long a mind may take to join, or for a step.
const PATIENCE: Duration = Duration::from_secs(60);

/// How often it is looked whether its process still lives.
const GLANCE: Duration = Duration::from_millis(50);

/// The world as the minds see it.
pub(super) struct Stage {
    /// Id of the run, by which minds find it.
    pub run: String,
    pub session: Session,
    pub keys: Keys,
    /// Of the run.
    token: String,
    /// Logs of the minds.
    pub logs: PathBuf,
    pub heard: Arc<Heard>,
    _token: LivelinessToken,
    _announcement: Announcement,
}

/// What has come from minds.
#[derive(Default)]
pub(super) struct Heard {
    state: Mutex<State>,
    news: Notify,
}

#[derive(Default)]
pub(super) struct State {
    /// Who may join, by name, and what it is welcomed with.
    pub invited: BTreeMap<String, Welcome>,
    /// Who has shown its token, by name.
    pub present: BTreeMap<String, Incarnation>,
    /// The latest report of each, and the broadcasts of its tick.
    pub reports: BTreeMap<RobotId, Report>,
    pub broadcasts: BTreeMap<RobotId, Vec<Broadcast>>,
}

impl Heard {
    pub fn lock(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn note(&self, change: impl FnOnce(&mut State)) {
        change(&mut self.lock());
        self.news.notify_one();
    }
}

impl Stage {
    /// Announces a run of its own, which minds find.
    pub async fn open(setup: &Setup) -> anyhow::Result<Self> {
        let run = format!("replay-{}", std::process::id());
        let mut rendezvous = Rendezvous::new(run.clone())?;
        let session = router::open_for_team(&mut rendezvous, None).await?;
        let (keys, token) = (Keys::new(&run), rendezvous.token.clone());
        let heard = Arc::new(Heard::default());
        subscribe(&session, &keys, &token, &heard, setup)
            .await
            .map_err(anyhow::Error::from_boxed)?;
        let alive = session.liveliness().declare_token(keys.alive_world());
        let alive = alive.await.map_err(anyhow::Error::from_boxed)?;
        let announcement = rendezvous.announce()?;
        let logs = std::env::temp_dir().join(format!("alliance-{run}"));
        std::fs::create_dir_all(&logs).with_context(|| logs.display().to_string())?;
        Ok(Self {
            run,
            session,
            keys,
            token,
            logs,
            heard,
            _token: alive,
            _announcement: announcement,
        })
    }

    /// Tells a robot what the world would.
    pub fn tell<T: Serialize>(&self, robot: &str, message: &T) -> Result<(), String> {
        let secret = Secret::of_robot(&self.token, robot);
        self.put(&self.keys.tick(robot), &secret, message)
    }

    /// Says what a teammate would.
    pub fn say<T: Serialize>(&self, key: &str, message: &T) -> Result<(), String> {
        self.put(key, &Secret::of(&self.token), message)
    }

    fn put<T: Serialize>(&self, key: &str, secret: &Secret, message: &T) -> Result<(), String> {
        let sealed = secret
            .seal(key, message)
            .map_err(|error| error.to_string())?;
        // One priority for all, so that they keep their order.
        let put = self
            .session
            .put(key, sealed)
            .priority(Priority::InteractiveHigh);
        put.wait().map_err(|error| error.to_string())
    }

    /// Waits until that is there; why it will not be, if its process has ended or takes too long.
    pub async fn wait_for<T>(
        &self,
        life: &mut Process,
        look: impl Fn(&mut State) -> Option<T>,
    ) -> Result<T, String> {
        let until = Instant::now() + PATIENCE;
        loop {
            if let Some(found) = look(&mut self.heard.lock()) {
                return Ok(found);
            }
            if timeout(GLANCE, self.heard.news.notified()).await.is_ok() {
                continue;
            }
            while let Ok(Some(_)) = life.poll() {}
            if let Some(ending) = life.ending() {
                let words = life.last_words();
                return Err(format!("its mind {}: {}", ending.describe(), words.trim()));
            }
            if Instant::now() > until {
                return Err(format!(
                    "its mind has not answered for {} s",
                    PATIENCE.as_secs()
                ));
            }
        }
    }
}

async fn subscribe(
    session: &Session,
    keys: &Keys,
    token: &str,
    heard: &Arc<Heard>,
    setup: &Setup,
) -> zenoh::Result<()> {
    for robot in &setup.scenario.robots {
        let (place, opener) = (Arc::clone(heard), Secret::of_robot(token, &robot.name));
        session
            .declare_subscriber(keys.report(&robot.name))
            .callback(move |sample| {
                let report = opener.open::<Report>(sample.key_expr(), &sample.payload().to_bytes());
                if let Ok(report) = report {
                    place.note(|state| {
                        state.reports.insert(report.robot, report);
                    });
                }
            })
            .background()
            .await?;

        let (place, opener) = (Arc::clone(heard), Secret::of(token));
        session
            .declare_subscriber(keys.team(&robot.name, "*"))
            .allowed_origin(zenoh::sample::Locality::Remote)
            .callback(move |sample| {
                let said =
                    opener.open::<Broadcast>(sample.key_expr(), &sample.payload().to_bytes());
                if let Ok(said) = said {
                    let broadcasts = &mut place.lock().broadcasts;
                    broadcasts.entry(said.sender).or_default().push(said);
                }
            })
            .background()
            .await?;
    }

    let (place, token_of, own) = (Arc::clone(heard), token.to_owned(), keys.clone());
    session
        .liveliness()
        .declare_subscriber(keys.alive_agents())
        .callback(move |sample| {
            let key = sample.key_expr().as_str();
            let plain = key
                .rsplit_once('/')
                .and_then(|(plain, _)| own.parse_alive(plain));
            if let (Some((name, incarnation)), SampleKind::Put) = (plain, sample.kind())
                && Secret::of_robot(&token_of, name).stamped(key).is_some()
            {
                place.note(|state| {
                    state.present.insert(name.to_owned(), incarnation);
                });
            }
        })
        .background()
        .await?;

    let (place, token_of, own) = (Arc::clone(heard), token.to_owned(), keys.clone());
    session
        .declare_queryable(keys.joins())
        .callback(move |query| {
            let payload = query.payload().map(|payload| payload.to_bytes());
            let key = query.key_expr().as_str();
            let name = Keys::parse_speaker(key);
            let secret = Secret::of_robot(&token_of, name);
            let request = secret.open::<JoinRequest>(key, &payload.unwrap_or_default());
            let Ok(request) = request else { return };
            let reply = answer(&request, &mut place.lock());
            if let Ok(bytes) = secret.seal(&own.join_answer(name, request.nonce), &reply) {
                // Who does not get it asks again, or is missed.
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
    match state.invited.remove(&request.robot) {
        Some(welcome) => JoinReply::Welcome(welcome),
        None => JoinReply::Refused(Refusal::Absent {
            robot: request.robot.clone(),
        }),
    }
}
