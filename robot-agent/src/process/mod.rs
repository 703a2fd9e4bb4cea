//! The process of an agent: a zenoh session, signals, and one lock around the agent.
//!
//! Zenoh's callbacks do all work, on its single worker, without a handover to a task.

mod state;

use std::sync::{Arc, Mutex};
use std::time::Duration;

use cluster::ignored::IgnoredMessages;
use cluster::member::Member;
use cluster::session;
use proto::join::{JoinReply, JoinRequest, PROTOCOL_VERSION, Refusal};
use proto::keys::KeyExpressions;
use proto::program_build;
use proto::secret::{self, Secret};
use proto::team::BroadcastKind;
use proto::tick::TICK_LIMIT_BYTES;
use scenario::ids::{Incarnation, RobotId, Tick};
use scenario::{Setup, Vocabulary};
use terminal::panics;
use tokio::signal::unix::{SignalKind, signal};
use tokio::sync::oneshot;
use tokio::time::{Instant, sleep, timeout};
use zenoh::Session;
use zenoh::qos::Priority;
use zenoh::query::{ConsolidationMode, QueryTarget};
use zenoh::sample::SampleKind;

use crate::agent::{Agent, AgentSnapshot, TeamConfig, TentativeAgent, Workspace};
use crate::allocator::ConfigError;
use crate::registry::AgentRegistry;
use cluster::remote;

pub use state::AgentEnd;
use state::{AgentState, Alive, Ignore, Publishers, lock};

/// The time an agent repeats its request for a robot that is still taken.
const TAKEN_PATIENCE: Duration = Duration::from_secs(1);

const CLOSE_DEADLINE: Duration = Duration::from_secs(1);

#[derive(Debug, thiserror::Error)]
pub enum AgentError {
    #[error("bus at {endpoint}: {error}")]
    Bus {
        endpoint: String,
        error: zenoh::Error,
    },
    #[error("the world at {0} does not answer")]
    NoAnswer(String),
    #[error("refused")]
    Refused(#[from] Refusal),
    /// The answer is malformed or incomplete.
    #[error("the world's answer could not be read: {0}")]
    Answer(String),
    /// The world does not continue the run at the tick of this agent's state.
    #[error("the world does not continue the run that this agent repeated")]
    OtherState,
    /// The registry lacks the mission or the allocator, or a parameter is invalid.
    #[error(transparent)]
    Unknown(#[from] ConfigError),
    /// Signal handlers or random numbers are not available.
    #[error("system")]
    System(#[from] std::io::Error),
}

/// Controls the robot until the run, the world or this process ends. Uses the registry's controller with that name,
/// else the scenario's allocator. With a snapshot, it continues that agent.
///
/// # Errors
/// Returns any [`AgentError`], also if the world refuses the agent.
pub async fn run_agent(
    robot: &str,
    run: &Member,
    registry: &AgentRegistry,
    controller: Option<&str>,
    snapshot: Option<AgentSnapshot>,
) -> Result<AgentEnd, AgentError> {
    let bus_error = |error| AgentError::Bus {
        endpoint: run.login.endpoint.clone(),
        error,
    };
    let keys = KeyExpressions::new(&run.run);
    let secret = Secret::from_token(&run.secret);
    let config = session::client(&run.login, false);
    let session = cluster::open(&config).await.map_err(bus_error)?;

    let (ended, end) = oneshot::channel();
    let shared = Arc::new(Mutex::new(AgentState::Joining { ended: Some(ended) }));
    let ignored = Arc::new(Mutex::new(IgnoredMessages::default()));

    // The subscribers must exist before the handshake, because the world sends messages right after it.
    subscribe(&session, &keys, &secret, robot, &shared, &ignored)
        .await
        .map_err(bus_error)?;
    if run.is_remote && !remote::wait_for_world(&session, &keys).await {
        return Err(AgentError::NoAnswer(run.login.endpoint.clone()));
    }
    let vocabulary = registry.vocabulary();
    let (welcome, mut setup) = join_patiently(&session, &keys, robot, run, &vocabulary).await?;
    let publishers = declare_publishers(&session, &keys, robot, &setup)
        .await
        .map_err(bus_error)?;
    setup.scenario.robots[welcome.robot.index()].controller = controller.map(ToOwned::to_owned);
    let team = TeamConfig::new(&setup, registry)?;
    let spec = &setup.scenario.robots[welcome.robot.index()];
    panics::set_process_name(format!(
        "robot-agent {robot} (mission {}, allocator {})",
        setup.catalog.mission.name(),
        setup.scenario.decider_of(spec),
    ));
    let agent = match snapshot {
        None => Agent::new(welcome.robot, welcome.incarnation, &setup, &team),
        Some(snapshot) => {
            let own = (snapshot.agent.incarnation(), snapshot.first_tick);
            if own != (welcome.incarnation, welcome.first_tick) {
                return Err(AgentError::OtherState);
            }
            snapshot.agent
        }
    };
    {
        let mut state = lock(&shared);
        let AgentState::Joining { ended } = &mut *state else {
            return Ok(AgentEnd::WorldLost);
        };
        let ended = ended.take();
        *state = AgentState::Alive(Box::new(Alive {
            secret: secret.clone(),
            incarnation: welcome.incarnation,
            agent: TentativeAgent::new(agent),
            space: Workspace::default(),
            latest: None,
            publishers,
            ended,
        }));
    }
    // From here on the world requires a report for each tick. The token disappears together with the socket.
    let _token = session
        .liveliness()
        .declare_token(secret.stamp(&keys.alive(robot, welcome.incarnation)))
        .await
        .map_err(bus_error)?;
    tracing::info!(robot, incarnation = welcome.incarnation, "joined");

    let end = wait_for_end(end).await?;
    for (kind, count) in lock(&ignored).counts() {
        tracing::warn!(kind, count, "messages ignored in this incarnation");
    }
    // Closing may hang, so the process ends after a time limit.
    let _ = timeout(CLOSE_DEADLINE, session.close()).await;
    Ok(end)
}

async fn wait_for_end(end: oneshot::Receiver<AgentEnd>) -> Result<AgentEnd, AgentError> {
    let mut terminate = signal(SignalKind::terminate())?;
    let mut interrupt = signal(SignalKind::interrupt())?;
    Ok(tokio::select! {
        end = end => end.unwrap_or(AgentEnd::WorldLost),
        _ = terminate.recv() => AgentEnd::Signaled,
        _ = interrupt.recv() => AgentEnd::Signaled,
    })
}

struct Welcomed {
    robot: RobotId,
    incarnation: Incarnation,
    first_tick: Tick,
}

/// Sends the request to join, and repeats it for a while if the robot is taken. The world may not have noticed yet
/// that the previous agent died.
async fn join_patiently(
    session: &Session,
    keys: &KeyExpressions,
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
    keys: &KeyExpressions,
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
    let secret = Secret::from_token(&run.secret);
    let payload = secret
        .seal(&keys.join(robot), &request)
        .map_err(|error| AgentError::Answer(error.to_string()))?;
    // The build is an attachment of the request, so that external controllers can leave it out.
    let build = secret
        .seal(&keys.join(robot), &program_build::get())
        .map_err(|error| AgentError::Answer(error.to_string()))?;
    let replies = session
        .get(keys.join(robot))
        .payload(payload)
        .attachment(build)
        // Any member may answer, so all answers are collected. Only an answer that the world sealed counts.
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
                // A world of another version may not understand the nonce of the request. An attacker could replay
                // such an answer, so a correct answer has precedence.
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
                first_tick: welcome.first_tick,
            },
            Setup::from_json(&welcome.setup, vocabulary).map_err(AgentError::Answer)?,
        )),
    }
}

async fn subscribe(
    session: &Session,
    keys: &KeyExpressions,
    secret: &Secret,
    robot: &str,
    shared: &Arc<Mutex<AgentState>>,
    ignored: &Arc<Mutex<IgnoredMessages>>,
) -> zenoh::Result<()> {
    let (state, log) = (Arc::clone(shared), Arc::clone(ignored));
    let (opener, key) = (secret.clone(), keys.tick(robot));
    session
        .declare_subscriber(key.clone())
        .callback(move |sample| {
            let result = match opener
                .open_within::<_, TICK_LIMIT_BYTES>(&key, &sample.payload().to_bytes())
            {
                Ok(message) => lock(&state).receive_from_world(message),
                Err(error) => Err(error.into()),
            };
            note(&log, "tick", result);
        })
        .background()
        .await?;

    let state = Arc::clone(shared);
    session
        .liveliness()
        .declare_subscriber(keys.alive_world())
        .history(true)
        .callback(move |sample| {
            if sample.kind() == SampleKind::Delete {
                lock(&state).end(AgentEnd::WorldLost);
            }
        })
        .background()
        .await
}

async fn declare_publishers(
    session: &Session,
    keys: &KeyExpressions,
    robot: &str,
    setup: &Setup,
) -> zenoh::Result<Publishers> {
    // Reports, broadcasts and ticks have one priority. They keep their order, and messages of other programs do not
    // delay them.
    let publisher = |key| {
        let declared = session.declare_publisher(key);
        declared.priority(Priority::InteractiveHigh)
    };
    let report = publisher(keys.report(robot)).await?;
    let bulletins = setup.catalog.mission.vocabulary().bulletins;
    let mut team = Vec::new();
    for kind in BroadcastKind::ALL {
        team.push(publisher(keys.team(robot, kind.name(bulletins))).await?);
    }
    Ok(Publishers { report, team })
}

/// Counts an ignored message and logs a warning at a bounded rate.
fn note(ignored: &Mutex<IgnoredMessages>, kind: &'static str, result: Result<(), Ignore>) {
    if let Err(why) = result
        && let Some(count) = lock(ignored).count(kind, Instant::now().into_std())
    {
        tracing::warn!(kind, count, %why, "message ignored");
    }
}
