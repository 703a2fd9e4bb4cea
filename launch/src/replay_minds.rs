//! `alliance replay --mind`: minds that are programs of their own are started once more and asked what they were asked in the logged
//! run, tick by tick. What they answer must be what they answered then.
//!
//! The run itself is made again in this process, from the answers that the log has kept: so the minds are asked as they were, whatever
//! stalled, died or got lost then. To them this process is the world.

use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use alliance_proto::codec::encode;
use alliance_proto::ids::{Incarnation, RobotId};
use alliance_proto::join::{JoinReply, JoinRequest, PROTOCOL_VERSION, Refusal, Welcome};
use alliance_proto::keys::Keys;
use alliance_proto::log::RunLog;
use alliance_proto::os_process::OsProcess;
use alliance_proto::rendezvous::{Announcement, Entrance, Rendezvous, User};
use alliance_proto::scenario::Setup;
use alliance_proto::secret::{self, Secret};
use alliance_proto::team::Broadcast;
use alliance_proto::tick::{Report, TickMessage, ToAgent};
use anyhow::{Context, bail};
use nix::sys::signal::Signal;
use serde::Serialize;
use serde_json::Value;
use study::diff::Difference;
use study::in_process::{Foreign, ForeignError, Kept};
use tokio::runtime::Runtime;
use tokio::sync::Notify;
use tokio::time::{Instant, timeout};
use world_server::router;
use zenoh::liveliness::LivelinessToken;
use zenoh::qos::Priority;
use zenoh::sample::SampleKind;
use zenoh::{Session, Wait};

use crate::run::children::Process;
use crate::run::minds::MindCommand;
use crate::runtime;

/// How long a mind may take to join, or for a step.
const PATIENCE: Duration = Duration::from_secs(60);

/// How often it is looked whether its process still lives.
const GLANCE: Duration = Duration::from_millis(50);

/// Starts the minds that `words`, those of `--mind`, have commands for, and asks them beside the log.
///
/// # Errors
/// When a word is none, nobody has that mind, or the bus fails.
pub fn ask(logged: &RunLog, words: &[String], kept: Kept) -> anyhow::Result<Box<dyn Foreign>> {
    let setup = logged.run.setup.clone();
    let minds = setup.scenario.minds();
    let mut commands = BTreeMap::new();
    for word in words {
        let mind =
            MindCommand::parse(word).map_err(|why| anyhow::anyhow!("--mind {word}: {why}"))?;
        if !minds.contains(mind.name.as_str()) {
            let names: Vec<&str> = minds.iter().copied().collect();
            bail!(
                "--mind {}: no robot of this run has that mind; there are {}",
                mind.name,
                names.join(", ")
            );
        }
        commands.insert(mind.name, mind.command);
    }
    let runtime = runtime::start()?;
    let stage = runtime.block_on(Stage::open(&setup))?;
    Ok(Box::new(Asked {
        kept,
        commands,
        lives: BTreeMap::new(),
        failed: None,
        stage,
        setup,
        runtime,
    }))
}

/// Minds that are asked, and what they must answer.
struct Asked {
    kept: Kept,
    /// By mind.
    commands: BTreeMap<String, String>,
    lives: BTreeMap<RobotId, Process>,
    /// Why a mind could not be started.
    failed: Option<String>,
    stage: Stage,
    setup: Setup,
    runtime: Runtime,
}

/// The world as the minds see it.
struct Stage {
    run: String,
    session: Session,
    keys: Keys,
    secret: Secret,
    /// Logs of the minds.
    logs: PathBuf,
    heard: Arc<Heard>,
    _token: LivelinessToken,
    _announcement: Announcement,
}

/// What has come from minds.
#[derive(Default)]
struct Heard {
    state: Mutex<State>,
    news: Notify,
}

#[derive(Default)]
struct State {
    /// Who may join, by name, and what it is welcomed with.
    invited: BTreeMap<String, Welcome>,
    /// Who has shown its token, by name.
    present: BTreeMap<String, Incarnation>,
    /// The latest report of each, and the broadcasts of its tick.
    reports: BTreeMap<RobotId, Report>,
    broadcasts: BTreeMap<RobotId, Vec<Broadcast>>,
}

impl Heard {
    fn lock(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn note(&self, change: impl FnOnce(&mut State)) {
        change(&mut self.lock());
        self.news.notify_one();
    }
}

impl Stage {
    async fn open(setup: &Setup) -> anyhow::Result<Self> {
        let pid = std::process::id();
        let run = format!("replay-{pid}");
        let random = || secret::random().map(|number| format!("{number:032x}"));
        let mut rendezvous = Rendezvous {
            run: run.clone(),
            endpoint: String::new(),
            pid,
            token: random()?,
            team: Entrance {
                endpoint: String::new(),
                password: random()?,
            },
            started: OsProcess::of(pid).map_or(0, |me| me.started),
        };
        let session = router::open(&mut rendezvous, User::Team).await?;
        let (keys, secret) = (Keys::new(&run), Secret::of(&rendezvous.token));
        let heard = Arc::new(Heard::default());
        subscribe(&session, &keys, &secret, &heard, setup)
            .await
            .map_err(anyhow::Error::from_boxed)?;
        let token = session.liveliness().declare_token(keys.alive_world());
        let token = token.await.map_err(anyhow::Error::from_boxed)?;
        let announcement = rendezvous.announce()?;
        let logs = std::env::temp_dir().join(format!("alliance-{run}"));
        std::fs::create_dir_all(&logs).with_context(|| logs.display().to_string())?;
        Ok(Self {
            run,
            session,
            keys,
            secret,
            logs,
            heard,
            _token: token,
            _announcement: announcement,
        })
    }

    /// Puts a message as the world or a teammate would.
    fn put<T: Serialize>(&self, key: &str, message: &T) -> Result<(), String> {
        let sealed = self
            .secret
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
    async fn wait_for<T>(
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
    secret: &Secret,
    heard: &Arc<Heard>,
    setup: &Setup,
) -> zenoh::Result<()> {
    let (place, opener) = (Arc::clone(heard), secret.clone());
    session
        .declare_subscriber(keys.reports())
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

    for robot in &setup.scenario.robots {
        let (place, opener) = (Arc::clone(heard), secret.clone());
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

    let (place, opener, own) = (Arc::clone(heard), secret.clone(), keys.clone());
    session
        .liveliness()
        .declare_subscriber(keys.alive_agents())
        .callback(move |sample| {
            let key = sample.key_expr().as_str();
            let life = opener.stamped(key).and_then(|plain| own.parse_alive(plain));
            if let (Some((name, incarnation)), SampleKind::Put) = (life, sample.kind()) {
                place.note(|state| {
                    state.present.insert(name.to_owned(), incarnation);
                });
            }
        })
        .background()
        .await?;

    let (place, opener, own) = (Arc::clone(heard), secret.clone(), keys.clone());
    session
        .declare_queryable(keys.join())
        .callback(move |query| {
            let payload = query.payload().map(|payload| payload.to_bytes());
            let request = opener.open::<JoinRequest>(&own.join(), &payload.unwrap_or_default());
            let Ok(request) = request else { return };
            let reply = answer(&request, &mut place.lock());
            if let Ok(bytes) = opener.seal(&own.join_answer(request.nonce), &reply) {
                // Who does not get it asks again, or is missed.
                let _ = query.reply(own.join(), bytes).wait();
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

impl Asked {
    fn name(&self, robot: RobotId) -> &str {
        self.setup.roster.name(robot)
    }

    /// The command of a robot's mind, if that is to be asked.
    fn command(&self, robot: RobotId) -> Option<&String> {
        let robot = self.setup.scenario.robots.get(robot.index())?;
        self.commands.get(robot.mind.as_ref()?)
    }

    /// Starts a life, and waits until it is there.
    fn start(&mut self, robot: RobotId, incarnation: Incarnation) -> Result<(), String> {
        let Some(command) = self.command(robot).cloned() else {
            return Ok(());
        };
        let name = self.name(robot).to_owned();
        let setup = serde_json::to_string(&self.setup.briefing_of(&name));
        let welcome = Welcome {
            robot,
            incarnation,
            first_tick: 0,
            setup: setup.map_err(|error| error.to_string())?,
        };
        self.stage
            .heard
            .lock()
            .invited
            .insert(name.clone(), welcome);
        let log = self.stage.logs.join(format!("{name}.log"));
        let started = Process::start_mind(&name, &log, &command, &self.stage.run);
        let mut life = started.map_err(|error| format!("{name}: {error:#}"))?;
        let is_there =
            |state: &mut State| (state.present.get(&name) == Some(&incarnation)).then_some(());
        let came = self.stage.wait_for(&mut life, is_there);
        let came = self.runtime.block_on(came);
        self.lives.insert(robot, life);
        came.map_err(|why| format!("{name}: {why}"))
    }

    /// What the mind itself answers.
    fn ask(
        &mut self,
        robot: RobotId,
        tick: &TickMessage,
        arrived: &[Option<Arc<Broadcast>>],
    ) -> Result<(Report, Vec<Broadcast>), String> {
        let (stage, setup) = (&self.stage, &self.setup);
        let Some(life) = self.lives.get_mut(&robot) else {
            return Err("its mind does not live".to_owned());
        };
        stage.heard.lock().broadcasts.remove(&robot);
        let bulletins = setup.catalog.mission.terms().bulletins;
        for broadcast in arrived.iter().flatten() {
            let kind = broadcast.body.kind().name(bulletins);
            let sender = setup.roster.name(broadcast.sender);
            stage.put(&stage.keys.team(sender, kind), &**broadcast)?;
        }
        let message = if tick.truth.is_empty() {
            ToAgent::Tick(tick)
        } else {
            ToAgent::Informed(tick, tick.truth.clone())
        };
        stage.put(&stage.keys.tick(setup.roster.name(robot)), &message)?;
        let is_it =
            |report: &Report| (report.tick, report.incarnation) == (tick.tick, tick.incarnation);
        let report = stage.wait_for(life, |state| {
            let report = state.reports.get(&robot).filter(|report| is_it(report))?;
            Some(report.clone())
        });
        let report = self.runtime.block_on(report)?;
        // They came before it.
        let said = stage.heard.lock().broadcasts.remove(&robot);
        let mut said = said.unwrap_or_default();
        said.retain(|it| (it.tick, it.incarnation) == (tick.tick, tick.incarnation));
        said.sort_by_key(|broadcast| broadcast.index);
        Ok((report, said))
    }

    /// The first field in which the two are not the same to the bit, with what each says.
    fn difference(
        &self,
        robot: RobotId,
        tick: &TickMessage,
        kept: (&Report, &[Broadcast]),
        now: (&Report, &[Broadcast]),
    ) -> Option<Difference> {
        let bytes =
            |(report, said): (&Report, &[Broadcast])| (encode(report).ok(), encode(&said).ok());
        if bytes(kept) == bytes(now) {
            return None;
        }
        let value = |(report, said): (&Report, &[Broadcast])| {
            let report = serde_json::to_value(report).unwrap_or_default();
            (report, serde_json::to_value(said).unwrap_or_default())
        };
        let ((report, said), (report_now, said_now)) = (value(kept), value(now));
        let found = first_difference("", &report, &report_now)
            .or_else(|| first_difference("broadcasts", &said, &said_now));
        // JSON has no NaN.
        let (field, a, b) = found.unwrap_or_else(|| {
            let text = |it: &Report| format!("{it:?}");
            ("report".to_owned(), text(kept.0), text(now.0))
        });
        Some(Difference {
            cause: None,
            tick: Some(tick.tick),
            t_ms: Some(tick.now),
            robot: self.name(robot).to_owned(),
            section: "mind".to_owned(),
            field: Some(field),
            a,
            b,
        })
    }
}

/// The first place where the two differ, with what stands there.
fn first_difference(path: &str, a: &Value, b: &Value) -> Option<(String, String, String)> {
    match (a, b) {
        (Value::Object(one), Value::Object(other)) if one.keys().eq(other.keys()) => {
            let dot = if path.is_empty() { "" } else { "." };
            let mut pairs = one.iter().zip(other.values());
            pairs.find_map(|((key, a), b)| first_difference(&format!("{path}{dot}{key}"), a, b))
        }
        (Value::Array(one), Value::Array(other)) => {
            let longest = one.len().max(other.len());
            (0..longest).find_map(|index| {
                let of = |list: &[Value]| list.get(index).cloned().unwrap_or(Value::Null);
                first_difference(&format!("{path}[{index}]"), &of(one), &of(other))
            })
        }
        _ => (a != b).then(|| (path.to_owned(), a.to_string(), b.to_string())),
    }
}

impl Foreign for Asked {
    fn spawn(&mut self, robot: RobotId, incarnation: Incarnation) {
        self.die(robot);
        if let Err(why) = self.start(robot, incarnation) {
            self.failed.get_or_insert(why);
        }
    }

    fn die(&mut self, robot: RobotId) {
        if let Some(mut life) = self.lives.remove(&robot) {
            end(&mut life);
        }
    }

    fn answer(
        &mut self,
        robot: RobotId,
        tick: &TickMessage,
        arrived: &[Option<Arc<Broadcast>>],
        report: &mut Report,
        broadcasts: &mut Vec<Broadcast>,
    ) -> Result<(), ForeignError> {
        if let Some(why) = self.failed.take() {
            return Err(ForeignError::Silent(why));
        }
        self.kept.answer(robot, tick, arrived, report, broadcasts)?;
        if self.command(robot).is_none() {
            return Ok(());
        }
        let (now, said) = self.ask(robot, tick, arrived).map_err(|why| {
            let name = self.name(robot);
            ForeignError::Silent(format!("{name}: tick {}: {why}", tick.tick))
        })?;
        match self.difference(robot, tick, (report, broadcasts), (&now, &said)) {
            None => Ok(()),
            Some(found) => Err(ForeignError::Differs(Box::new(found))),
        }
    }
}

/// At once: what it did is known.
fn end(life: &mut Process) {
    life.signal(Signal::SIGKILL);
    while life.ending().is_none() && life.poll().is_ok() {
        std::thread::sleep(Duration::from_millis(1));
    }
}

impl Drop for Asked {
    fn drop(&mut self) {
        self.lives.values_mut().for_each(end);
        let _ = std::fs::remove_dir_all(&self.stage.logs);
        // Teardown may hang; the process ends whether or not it does.
        let close = self.stage.session.close();
        let _ = self
            .runtime
            .block_on(async { timeout(Duration::from_secs(1), close).await });
    }
}
