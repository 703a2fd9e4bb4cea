//! The thin shell around an agent: a zenoh session, signals, and the one lock behind which the agent steps.
//!
//! Everything happens inside zenoh's callbacks, on its one worker: measured a third faster than handing samples to a task.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use alliance_proto::codec::CodecError;
use alliance_proto::ids::{Incarnation, RobotId, Tick};
use alliance_proto::ignored::Ignored;
use alliance_proto::join::{JoinReply, JoinRequest, PROTOCOL_VERSION, Refusal};
use alliance_proto::keys::Keys;
use alliance_proto::member::Member;
use alliance_proto::panics;
use alliance_proto::scenario::{Setup, Vocabulary};
use alliance_proto::secret::{self, OpenError, Pairs, Secret};
use alliance_proto::session;
use alliance_proto::team::{Broadcast, BroadcastKind};
use alliance_proto::tick::{Outcome, TickMessage, ToAgent};
use tokio::signal::unix::{SignalKind, signal};
use tokio::sync::oneshot;
use tokio::time::{Instant, sleep, sleep_until, timeout};
use zenoh::pubsub::Publisher;
use zenoh::qos::Priority;
use zenoh::query::{ConsolidationMode, QueryTarget};
use zenoh::sample::{Locality, SampleKind};
use zenoh::{Session, Wait};

use crate::agent::{Agent, TeamConfig, TentativeAgent, Workspace};
use crate::allocator::{AgentRegistry, ConfigError};
use crate::far;
use crate::radio::Radio;

/// How long listed broadcasts are waited for before they count as lost. In the star they are there before the tick is; this
/// wait ends otherwise only when something is badly wrong, and well before the world's stall deadline.
const MANIFEST_DEADLINE: Duration = Duration::from_secs(2);

/// How long an agent asks again for a robot that is taken.
const TAKEN_PATIENCE: Duration = Duration::from_secs(1);

/// How long a session may take to close.
const CLOSE_DEADLINE: Duration = Duration::from_secs(1);

/// How the agent's incarnation ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum End {
    /// The run is over.
    RunOver(Outcome),
    /// A newer agent has the robot.
    Superseded,
    /// Somebody sent SIGTERM or SIGINT.
    Asked,
    /// The world is no longer there.
    WorldGone,
}

/// Why an agent could not do its work.
#[derive(Debug, thiserror::Error)]
pub enum AgentError {
    /// The bus failed.
    #[error("bus at {endpoint}: {error}")]
    Bus {
        /// Locator of the world.
        endpoint: String,
        /// What zenoh said.
        error: zenoh::Error,
    },
    /// The world did not answer the request to join.
    #[error("the world at {0} does not answer")]
    NoAnswer(String),
    /// The world said no.
    #[error("refused")]
    Refused(#[from] Refusal),
    /// The world's answer could not be read.
    #[error("the world's answer could not be read: {0}")]
    Answer(String),
    /// This program does not know the mission or the robot's allocator, or not with these parameters.
    #[error(transparent)]
    Unknown(#[from] ConfigError),
    /// Signals could not be caught, or random numbers not be had.
    #[error("system")]
    System(#[from] std::io::Error),
}

/// Lives as that robot until the run, the world or this agent ends, with the registry's mind of that name, or else the scenario's
/// allocator.
///
/// # Errors
/// Any [`AgentError`]; refused agents end here.
pub async fn live(
    robot: &str,
    run: &Member,
    registry: &AgentRegistry,
    mind: Option<&str>,
) -> Result<End, AgentError> {
    let bus_error = |error| AgentError::Bus {
        endpoint: run.login.endpoint.clone(),
        error,
    };
    let keys = Keys::new(&run.run);
    let secret = Secret::of(&run.secret);
    let config = session::client(&run.login, false);
    let session = bus::open(&config).await.map_err(bus_error)?;

    let (ended, end) = oneshot::channel();
    let shared = Arc::new(Mutex::new(Mind::Joining { ended: Some(ended) }));
    let ignored = Arc::new(Mutex::new(Ignored::default()));

    // Whatever is sent to this robot after the handshake finds its subscribers there: they are declared before it.
    subscribe(&session, &keys, &secret, robot, &shared, &ignored)
        .await
        .map_err(bus_error)?;
    if run.is_far && !far::wait_for_world(&session, &keys).await {
        return Err(AgentError::NoAnswer(run.login.endpoint.clone()));
    }
    let vocabulary = registry.vocabulary();
    let (welcome, mut setup) = join_patiently(&session, &keys, robot, run, &vocabulary).await?;
    let publishers = declare_publishers(&session, &keys, robot, &setup)
        .await
        .map_err(bus_error)?;
    setup.scenario.robots[welcome.robot.index()].mind = mind.map(ToOwned::to_owned);
    let team = TeamConfig::of(&setup, registry)?;
    let own = &setup.scenario.robots[welcome.robot.index()];
    panics::this_is(format!(
        "robot-agent {robot} (mission {}, allocator {})",
        setup.catalog.mission.name(),
        setup.scenario.allocator_of(own),
    ));
    let agent = Agent::new(welcome.robot, welcome.incarnation, &setup, &team);
    let voice = Voice::of(run, welcome.robot, welcome.pairs)
        .ok_or_else(|| AgentError::Answer("it has no keys of pairs".to_owned()))?;
    {
        let mut mind = lock(&shared);
        let Mind::Joining { ended } = &mut *mind else {
            return Ok(End::WorldGone);
        };
        let ended = ended.take();
        let robot = welcome.robot;
        *mind = Mind::Alive(Box::new(Alive {
            secret: secret.clone(),
            voice,
            robot,
            incarnation: welcome.incarnation,
            names: setup
                .scenario
                .robots
                .iter()
                .map(|r| r.name.clone())
                .collect(),
            agent: TentativeAgent::new(agent),
            radio: Radio::default(),
            space: Workspace::default(),
            latest: None,
            pending: None,
            publishers,
            ended,
        }));
    }
    // From here on the world counts on this agent; the token goes when the socket does.
    let _token = session
        .liveliness()
        .declare_token(secret.stamp(&keys.alive(robot, welcome.incarnation)))
        .await
        .map_err(bus_error)?;
    tracing::info!(robot, incarnation = welcome.incarnation, "joined");

    let end = wait_for_end(end, &shared).await?;
    for (kind, count) in lock(&ignored).counts() {
        tracing::warn!(kind, count, "messages ignored in this incarnation");
    }
    // Teardown may hang; the process ends whether or not it does.
    let _ = timeout(CLOSE_DEADLINE, session.close()).await;
    Ok(end)
}

async fn wait_for_end(
    mut end: oneshot::Receiver<End>,
    shared: &Mutex<Mind>,
) -> Result<End, AgentError> {
    let mut terminate = signal(SignalKind::terminate())?;
    let mut interrupt = signal(SignalKind::interrupt())?;
    loop {
        tokio::select! {
            end = &mut end => return Ok(end.unwrap_or(End::WorldGone)),
            _ = terminate.recv() => return Ok(End::Asked),
            _ = interrupt.recv() => return Ok(End::Asked),
            () = sleep_until(Instant::now() + MANIFEST_DEADLINE / 4) => lock(shared).give_up_waiting(),
        }
    }
}

struct Welcomed {
    robot: RobotId,
    incarnation: Incarnation,
    pairs: Option<Vec<u128>>,
}

/// What broadcasts are sealed with.
enum Voice {
    /// On one machine.
    Token(Secret),
    /// Over a network.
    Pairs(Pairs),
}

impl Voice {
    /// `None` where neither is known.
    fn of(run: &Member, robot: RobotId, pairs: Option<Vec<u128>>) -> Option<Self> {
        match (pairs, &run.token) {
            (Some(keys), _) if robot.index() < keys.len() => {
                Some(Self::Pairs(Pairs::new(robot.index(), keys)))
            }
            (None, Some(token)) => Some(Self::Token(Secret::of(token))),
            _ => None,
        }
    }

    fn seal(&self, key: &str, broadcast: &Broadcast) -> Result<Vec<u8>, CodecError> {
        match self {
            Self::Token(token) => token.seal(key, broadcast),
            Self::Pairs(pairs) => pairs.seal(key, broadcast),
        }
    }

    fn open(&self, key: &str, sealed: &[u8], sender: usize) -> Result<Broadcast, OpenError> {
        match self {
            Self::Token(token) => token.open(key, sealed),
            Self::Pairs(pairs) => pairs.open(key, sealed, sender),
        }
    }
}

/// A robot whose agent has just died may seem taken until the world has noticed, so that refusal is not believed at once.
async fn join_patiently(
    session: &Session,
    keys: &Keys,
    robot: &str,
    run: &Member,
    vocabulary: &Vocabulary,
) -> Result<(Welcomed, Setup), AgentError> {
    let patience = Instant::now() + TAKEN_PATIENCE;
    loop {
        match join(session, keys, robot, run, vocabulary).await {
            Err(AgentError::Refused(Refusal::Taken { .. })) if Instant::now() < patience => {
                sleep(TAKEN_PATIENCE / 20).await;
            }
            joined => return joined,
        }
    }
}

async fn join(
    session: &Session,
    keys: &Keys,
    robot: &str,
    run: &Member,
    vocabulary: &Vocabulary,
) -> Result<(Welcomed, Setup), AgentError> {
    let request = JoinRequest {
        version: PROTOCOL_VERSION,
        robot: robot.to_owned(),
        pid: std::process::id(),
        nonce: secret::random()?,
    };
    let secret = Secret::of(&run.secret);
    let payload = secret
        .seal(&keys.join(robot), &request)
        .map_err(|error| AgentError::Answer(error.to_string()))?;
    let replies = session
        .get(keys.join(robot))
        .payload(payload)
        // Anybody may answer; only what the world sealed is an answer, and nobody else shall stand before it.
        .target(QueryTarget::All)
        .consolidation(ConsolidationMode::None)
        .await
        .map_err(|error| AgentError::Bus {
            endpoint: run.login.endpoint.clone(),
            error,
        })?;
    let mut other_version = None;
    let answer: JoinReply = loop {
        let Ok(reply) = replies.recv_async().await else {
            return Err(
                other_version.unwrap_or_else(|| AgentError::NoAnswer(run.login.endpoint.clone()))
            );
        };
        let Ok(sample) = reply.into_result() else {
            continue;
        };
        let bytes = sample.payload().to_bytes();
        match secret.open(&keys.join_answer(robot, request.nonce), &bytes) {
            Ok(answer) => break answer,
            Err(error) => match secret.open(&keys.join_answer(robot, 0), &bytes) {
                // A world of another version may not have understood whose request it answers. Such an answer may also be an
                // old one that somebody puts again, so that any other goes before it.
                Ok(JoinReply::Refused(refusal @ Refusal::Version { .. })) => {
                    other_version = Some(refusal.into());
                }
                _ => tracing::warn!(%error, "answer to the join request ignored"),
            },
        }
    };
    match answer {
        JoinReply::Refused(refusal) => Err(refusal.into()),
        JoinReply::Welcome(welcome) => Ok((
            Welcomed {
                robot: welcome.robot,
                incarnation: welcome.incarnation,
                pairs: welcome.pairs,
            },
            Setup::from_json(&welcome.setup, vocabulary).map_err(AgentError::Answer)?,
        )),
    }
}

async fn subscribe(
    session: &Session,
    keys: &Keys,
    secret: &Secret,
    robot: &str,
    shared: &Arc<Mutex<Mind>>,
    ignored: &Arc<Mutex<Ignored>>,
) -> zenoh::Result<()> {
    let (mind, log) = (Arc::clone(shared), Arc::clone(ignored));
    let (opener, key) = (secret.clone(), keys.tick(robot));
    session
        .declare_subscriber(key.clone())
        .callback(move |sample| {
            let heard = match opener.open(&key, &sample.payload().to_bytes()) {
                Ok(message) => lock(&mind).hear_world(message),
                Err(error) => Err(error.into()),
            };
            note(&log, "tick", heard);
        })
        .background()
        .await?;

    let (mind, log) = (Arc::clone(shared), Arc::clone(ignored));
    let team = keys.clone();
    session
        .declare_subscriber(keys.team_all())
        // A robot does not hear itself: zenoh would call back from inside its own put, while the lock is held.
        .allowed_origin(Locality::Remote)
        .callback(move |sample| {
            let key = sample.key_expr().as_str();
            let name = team.parse_robot(key).unwrap_or_default();
            let heard = lock(&mind).hear_teammate(name, key, &sample.payload().to_bytes());
            note(&log, "team", heard);
        })
        .background()
        .await?;

    let mind = Arc::clone(shared);
    session
        .liveliness()
        .declare_subscriber(keys.alive_world())
        .history(true)
        .callback(move |sample| {
            if sample.kind() == SampleKind::Delete {
                lock(&mind).end(End::WorldGone);
            }
        })
        .background()
        .await
}

/// The agent's publishers, declared once.
struct Publishers {
    report: Publisher<'static>,
    /// By [`BroadcastKind`], in the order of its declaration.
    team: Vec<Publisher<'static>>,
}

async fn declare_publishers(
    session: &Session,
    keys: &Keys,
    robot: &str,
    setup: &Setup,
) -> zenoh::Result<Publishers> {
    // One priority for all of them, and for ticks: so they keep their order, and nobody else's messages delay them.
    let publisher = |key| {
        let declared = session.declare_publisher(key);
        declared.priority(Priority::InteractiveHigh)
    };
    let report = publisher(keys.report(robot)).await?;
    let bulletins = setup.catalog.mission.terms().bulletins;
    let mut team = Vec::new();
    for kind in BroadcastKind::ALL {
        team.push(publisher(keys.team(robot, kind.name(bulletins))).await?);
    }
    Ok(Publishers { report, team })
}

/// What the callbacks share.
enum Mind {
    /// The handshake is under way.
    Joining { ended: Option<oneshot::Sender<End>> },
    /// The agent works.
    Alive(Box<Alive>),
}

struct Alive {
    secret: Secret,
    voice: Voice,
    robot: RobotId,
    incarnation: Incarnation,
    /// Names of all robots, by rank: a broadcast must come on its sender's key.
    names: Vec<String>,
    agent: TentativeAgent,
    radio: Radio,
    space: Workspace,
    /// Number of the latest tick that the world sent to this incarnation. An older one is put again by somebody; this one is asked again.
    latest: Option<Tick>,
    /// A tick whose broadcasts have not all arrived, and until when they are waited for.
    pending: Option<(Box<TickMessage>, Instant)>,
    publishers: Publishers,
    ended: Option<oneshot::Sender<End>>,
}

/// A panic ends the process, so a poisoned lock is never seen.
fn lock<T>(shared: &Mutex<T>) -> MutexGuard<'_, T> {
    shared.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Why a message is ignored.
#[derive(Debug, thiserror::Error)]
enum Ignore {
    #[error(transparent)]
    Unread(#[from] OpenError),
    #[error("{0}")]
    Unfit(&'static str),
}

/// Counts a message that was ignored, and warns about it at a bounded rate.
fn note(ignored: &Mutex<Ignored>, kind: &'static str, heard: Result<(), Ignore>) {
    if let Err(why) = heard
        && let Some(count) = lock(ignored).count(kind, Instant::now().into_std())
    {
        tracing::warn!(kind, count, %why, "message ignored");
    }
}

impl Mind {
    fn hear_world(&mut self, message: ToAgent) -> Result<(), Ignore> {
        match (message, self) {
            (ToAgent::End(outcome), mind) => mind.end(End::RunOver(outcome)),
            (ToAgent::Dismissed(incarnation), Mind::Alive(alive)) => {
                if alive.incarnation == incarnation {
                    alive.end(End::Superseded);
                }
            }
            (ToAgent::Tick(tick), Mind::Alive(alive)) => return alive.hear_tick(tick),
            (ToAgent::Informed(mut tick, truth), Mind::Alive(alive)) => {
                tick.truth = truth;
                return alive.hear_tick(tick);
            }
            (_, Mind::Joining { .. }) => {}
        }
        Ok(())
    }

    fn hear_teammate(&mut self, name: &str, key: &str, sealed: &[u8]) -> Result<(), Ignore> {
        match self {
            Mind::Alive(alive) => alive.hear_teammate(name, key, sealed),
            Mind::Joining { .. } => Ok(()),
        }
    }

    fn give_up_waiting(&mut self) {
        if let Mind::Alive(alive) = self
            && let Some((_, until)) = &alive.pending
            && *until <= Instant::now()
            && let Some((tick, _)) = alive.pending.take()
        {
            tracing::warn!(tick = tick.tick, "listed broadcasts did not arrive");
            alive.step(tick);
        }
    }

    fn end(&mut self, end: End) {
        let ended = match self {
            Mind::Joining { ended } => ended,
            Mind::Alive(alive) => &mut alive.ended,
        };
        if let Some(ended) = ended.take() {
            // The receiver is gone only when the process is ending anyway.
            let _ = ended.send(end);
        }
    }
}

impl Alive {
    fn hear_tick(&mut self, tick: Box<TickMessage>) -> Result<(), Ignore> {
        if tick.incarnation > self.incarnation {
            self.end(End::Superseded);
            return Ok(());
        }
        if tick.incarnation < self.incarnation || Some(tick.tick) < self.latest {
            return Err(Ignore::Unfit("stale"));
        }
        if Some(tick.tick) == self.latest {
            // The world has had no answer: what came of the step is lost, or on its way.
            if self.pending.is_none() {
                self.publish();
            }
            return Ok(());
        }
        self.latest = Some(tick.tick);
        if self.radio.has_all(&tick.manifest) {
            self.step(tick);
        } else {
            self.pending = Some((tick, Instant::now() + MANIFEST_DEADLINE));
        }
        Ok(())
    }

    fn hear_teammate(&mut self, name: &str, key: &str, sealed: &[u8]) -> Result<(), Ignore> {
        let sender = self.names.iter().position(|each| each == name);
        let sender = sender.ok_or(Ignore::Unfit("of no teammate"))?;
        let broadcast = self.voice.open(key, sealed, sender)?;
        if broadcast.sender.index() != sender {
            return Err(Ignore::Unfit("on another robot's key"));
        }
        if broadcast.sender == self.robot {
            return Err(Ignore::Unfit("this robot's own"));
        }
        if !self.radio.receive(broadcast) {
            return Err(Ignore::Unfit("stale"));
        }
        if let Some((tick, _)) = &self.pending
            && self.radio.has_all(&tick.manifest)
            && let Some((tick, _)) = self.pending.take()
        {
            self.step(tick);
        }
        Ok(())
    }

    fn step(&mut self, tick: Box<TickMessage>) {
        let space = &mut self.space;
        self.radio.collect(&tick.manifest, &mut space.arrived);
        self.agent.step(tick, space);
        self.publish();
    }

    /// What came of the latest step.
    fn publish(&self) {
        for broadcast in &self.space.broadcasts {
            let publisher = &self.publishers.team[broadcast.body.kind() as usize];
            publish(publisher, self.voice.seal(publisher.key_expr(), broadcast));
        }
        let publisher = &self.publishers.report;
        let report = self.secret.seal(publisher.key_expr(), &self.space.report);
        publish(publisher, report);
    }

    fn end(&mut self, end: End) {
        if let Some(ended) = self.ended.take() {
            let _ = ended.send(end);
        }
    }
}

/// A message that cannot be sent is a loss like any other: the world or the teammates will see it missing.
fn publish(publisher: &Publisher<'_>, sealed: Result<Vec<u8>, CodecError>) {
    match sealed {
        Ok(bytes) => {
            if let Err(error) = publisher.put(bytes).wait() {
                tracing::warn!(%error, key = %publisher.key_expr(), "not published");
            }
        }
        Err(error) => tracing::error!(%error, key = %publisher.key_expr(), "not published"),
    }
}
