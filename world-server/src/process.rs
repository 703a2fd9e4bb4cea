//! The process of a world: a Zenoh session, a run folder, signals and timers.

use std::collections::BTreeMap;
use std::net::SocketAddr;
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex};
use std::time::{Duration, SystemTime, UNIX_EPOCH};

use cluster::rendezvous::Rendezvous;
use proto::control::wire::Format;
use proto::keys::KeyExpressions;
use proto::program_build;
use proto::tick::Outcome;
use run_log::{LogLevel, Table};
use scenario::ids::RobotId;
use scenario::{Scenario, Setup, listed};
use serde_json::json;
use terminal::panics;
use tokio::signal::unix::{SignalKind, signal};
use tokio::sync::oneshot;
use tokio::time::{Instant, sleep, sleep_until, timeout};
use zenoh::bytes::Encoding;
use zenoh::qos::Priority;
use zenoh::sample::SampleKind;
use zenoh::{Session, Wait};

use crate::bridge;
use crate::error::WorldError;
use crate::gateway::supervisor::{Gateway, StartedGateway};
use crate::interruption::InterruptionHandler;
use crate::invocation;
use crate::latest::link_latest;
use crate::metrics::Metrics;
use crate::mission::WorldKind;
use crate::pace::{Pace, Speed};
use crate::run_state::RunState;
use crate::server::{Bus, Ended, NAMES, Publishers, Seals, Server, lock};
use crate::simulation::Simulation;
use cluster::network::Network;
use cluster::process_log;
use cluster::router;
use run_log::recorder::{Folder, Recorder};

/// The interval at which deadlines are checked and the log is flushed.
const CLOCK_INTERVAL: Duration = Duration::from_millis(100);

/// The maximum time for agents to leave after the run has ended.
const FAREWELL: Duration = Duration::from_secs(2);

const CLOSE_DEADLINE: Duration = Duration::from_secs(1);

#[derive(Clone, Debug)]
pub struct Options {
    /// The run's id, which is part of every topic key.
    pub run: String,
    /// The folder of the log. It must not contain a run.
    pub folder: PathBuf,
    pub speed: Speed,
    pub paused: bool,
    pub log: LogLevel,
    /// `true` if a launcher started this world. The launcher then applies process faults to the agents.
    pub launched: bool,
    /// The robots whose allocators receive the ground truth.
    pub ground_truth_robots: Vec<RobotId>,
    /// The known versions of external controllers, by name.
    pub controller_versions: BTreeMap<String, String>,
    /// The network settings; `None` if the run stays on this machine.
    pub network: Option<Network>,
    /// The wall-clock time after which an agent that does not answer is out of the barrier.
    pub stall_after: Duration,
    /// The address at which the process serves metrics; `None` without metrics.
    pub metrics: Option<SocketAddr>,
    /// `true` if the bodies move in another world. The standard input is then a socket to its bridge.
    pub external_bodies: bool,
}

#[derive(Clone, Debug)]
pub struct RunResult {
    pub outcome: Outcome,
    pub hash: String,
    /// `true` if the scenario did not cause everything that happened.
    pub unscripted: bool,
}

/// Runs a mission to its end: listens, waits for the robots, steps the clock and writes the log. `handlers` are additional
/// interruption handlers of an experiment.
pub async fn serve(
    setup: Setup,
    mission: WorldKind,
    options: &Options,
    handlers: Vec<Box<dyn InterruptionHandler>>,
) -> Result<RunResult, WorldError> {
    let folder = Folder::create(&options.folder)?;
    let recorder = Recorder::with_controller_versions(
        &setup,
        options.log,
        &options.controller_versions,
        folder,
    )?;
    let mut simulation = Simulation::new(setup, mission, options.launched);
    simulation.send_ground_truth_to(options.ground_truth_robots.clone());
    if options.log.keeps(Table::AllocationMessages) {
        simulation.record_allocation_messages();
    }
    for handler in handlers {
        simulation.add_handler(handler);
    }
    let start = RunState {
        simulation,
        recorder,
        broadcasts: Vec::new(),
    };
    serve_from(start, options).await
}

/// Runs a mission like [`serve`], from the start of a tick. Robots that take part in that tick join with their incarnations.
pub async fn serve_from(start: RunState, options: &Options) -> Result<RunResult, WorldError> {
    let started = Instant::now();
    let setup = start.simulation.setup().clone();
    panics::set_process_name(format!("world (mission {})", setup.catalog.mission.name()));
    process_log::set_run(&options.run);
    let mut metrics = None;
    if let Some(address) = options.metrics {
        let served = Metrics::new(&options.run, setup.catalog.mission.name());
        served.serve(address)?;
        metrics = Some(served);
    }
    // The link is a convenience. The run continues without it.
    let _ = link_latest(Path::new("runs"), &options.folder);
    let keys = KeyExpressions::new(&options.run);
    let network = options.network.as_ref();
    let (session, rendezvous, gateway) = open(&options.run, network, &setup.scenario).await?;
    let seals = Seals::new(&rendezvous.token, keys.clone(), &setup.scenario, network);
    let seals = Arc::new(seals);
    let endpoint = rendezvous.endpoint.clone();
    let publishers = declare_publishers(&session, &keys, &setup).await?;
    let (ended, end) = oneshot::channel();
    let mut pace = Pace::new(options.speed, setup.scenario.step_ms, started);
    if options.paused {
        pace.pause();
    }
    let server = Server::new(
        start,
        Bus {
            run: options.run.clone(),
            session: session.clone(),
            keys: keys.clone(),
            seals: Arc::clone(&seals),
            publishers,
        },
        pace,
        options.stall_after,
        ended,
    )?;
    let server = Server::shared(server);
    if options.external_bodies {
        bridge::connect(&server)?;
    }
    subscribe(&session, &keys, &seals, &server).await?;
    let _token = session
        .liveliness()
        .declare_token(keys.alive_world())
        .await?;
    let announcement = rendezvous.announce()?;
    tracing::info!(run = options.run, endpoint, "waiting for robots");

    let outcome = supervise(&server, metrics.as_mut(), end).await?;
    let ended = Instant::now();
    drop(announcement);
    wait_for_agents(&server).await;
    let refused = gateway.close().await;
    let (unscripted, hash) = {
        let mut server = lock(&server);
        server.add_refused("control", refused);
        let ending = server.ending();
        let unscripted = ending.unscripted;
        let host = host(&server, options, &endpoint, started..ended);
        let mut recorder = server.take_recorder()?;
        recorder.finish(outcome, ending)?;
        recorder.write_host(&host)?;
        (unscripted, recorder.hash())
    };
    // Closing may hang, so the process does not wait for it without limit.
    let _ = timeout(CLOSE_DEADLINE, session.close()).await;
    Ok(RunResult {
        outcome,
        hash,
        unscripted,
    })
}

/// Opens the team's router and starts the gateway.
async fn open(
    run: &str,
    network: Option<&Network>,
    scenario: &Scenario,
) -> Result<(Session, Rendezvous, Gateway), WorldError> {
    let gateway = StartedGateway::start()?;
    let mut rendezvous = Rendezvous::new(run.to_owned())?;
    if let Some(network) = network {
        // The secrets of robots and hosts are derived from this one.
        rendezvous.token.clone_from(&network.keyring.secret);
    }
    let network = network.map(|network| (network, scenario));
    let session = router::open_for_team(&mut rendezvous, network).await?;
    let gateway = gateway.open(&mut rendezvous).await?;
    Ok((session, rendezvous, gateway))
}

async fn declare_publishers(
    session: &Session,
    keys: &KeyExpressions,
    setup: &Setup,
) -> zenoh::Result<Publishers> {
    let mut ticks = Vec::new();
    for robot in &setup.scenario.robots {
        let tick = session.declare_publisher(keys.tick(&robot.name));
        ticks.push(tick.priority(Priority::InteractiveHigh).await?);
    }
    let view = session.declare_publisher(keys.view()).await?;
    let events = session.declare_publisher(keys.event()).await?;
    Ok(Publishers {
        ticks,
        view,
        events,
    })
}

async fn subscribe(
    session: &Session,
    keys: &KeyExpressions,
    seals: &Arc<Seals>,
    server: &Arc<Mutex<Server>>,
) -> zenoh::Result<()> {
    let (shared, opener) = (Arc::clone(server), Arc::clone(seals));
    session
        .declare_subscriber(keys.reports())
        .callback(move |sample| {
            let key = sample.key_expr();
            // Opened before the lock, because threads that wait for the lock sleep.
            let report = opener.open(key, &sample.payload().to_bytes());
            lock(&shared).report(key, report);
        })
        .background()
        .await?;

    let (shared, opener) = (Arc::clone(server), Arc::clone(seals));
    session
        .declare_subscriber(keys.team_all())
        .callback(move |sample| {
            let key = sample.key_expr();
            let broadcast = opener.open(key, &sample.payload().to_bytes());
            lock(&shared).broadcast(key, broadcast);
        })
        .background()
        .await?;

    let shared = Arc::clone(server);
    session
        .declare_subscriber(keys.processes())
        .callback(move |sample| {
            lock(&shared).process(sample.key_expr(), &sample.payload().to_bytes());
        })
        .background()
        .await?;

    let shared = Arc::clone(server);
    session
        .liveliness()
        .declare_subscriber(keys.alive_agents())
        .callback(move |sample| {
            lock(&shared).token(sample.key_expr(), sample.kind() == SampleKind::Put);
        })
        .background()
        .await?;

    let shared = Arc::clone(server);
    session
        .declare_subscriber(keys.control())
        .callback(move |sample| {
            let form = Format::from_zenoh(&sample.encoding().to_string());
            let attachment = sample.attachment().map(|seal| seal.to_bytes());
            // A put needs no answer.
            let _ =
                lock(&shared).control(form, &sample.payload().to_bytes(), attachment.as_deref());
        })
        .background()
        .await?;

    let (shared, key) = (Arc::clone(server), keys.control());
    session
        .declare_queryable(keys.control())
        .callback(move |query| {
            let form = Format::from_zenoh(
                &query
                    .encoding()
                    .map_or_else(String::new, ToString::to_string),
            );
            let payload = query.payload().map(|payload| payload.to_bytes());
            let attachment = query.attachment().map(|seal| seal.to_bytes());
            let answer = lock(&shared).control(
                form,
                payload.as_deref().unwrap_or_default(),
                attachment.as_deref(),
            );
            let sent = match answer {
                Ok(written) => query
                    .reply(&key, written.payload)
                    .encoding(Encoding::from(form.encoding()))
                    .attachment(written.attachment)
                    .wait(),
                Err(why) => query.reply_err(why.to_string()).wait(),
            };
            if let Err(error) = sent {
                tracing::warn!(%error, "request not answered");
            }
        })
        .background()
        .await?;

    let shared = Arc::clone(server);
    answer(session, keys.joins(), move |key, payload, build| {
        let answer = lock(&shared).join(key, payload, build);
        answer.map_err(|error| error.to_string())
    })
    .await?;
    let shared = Arc::clone(server);
    answer(session, keys.enlist("*"), move |key, payload, _| {
        lock(&shared).enlist(key, payload)
    })
    .await
}

async fn answer(
    session: &Session,
    keys: String,
    answer: impl Fn(&str, &[u8], Option<&[u8]>) -> Result<Vec<u8>, String> + Send + Sync + 'static,
) -> zenoh::Result<()> {
    session
        .declare_queryable(keys)
        .callback(move |query| {
            let payload = query.payload().map(|payload| payload.to_bytes());
            let key = query.key_expr().clone();
            let attachment = query.attachment().map(|bytes| bytes.to_bytes());
            let payload = payload.as_deref().unwrap_or_default();
            let sent = answer(&key, payload, attachment.as_deref()).and_then(|bytes| {
                let reply = query.reply(&key, bytes).wait();
                reply.map_err(|error| error.to_string())
            });
            if let Err(error) = sent {
                tracing::warn!(error, key = %key, "request not answered");
            }
        })
        .background()
        .await
}

/// Waits for the end of the run. Handles signals, pace and deadlines in the meantime.
async fn supervise(
    server: &Mutex<Server>,
    mut metrics: Option<&mut Metrics>,
    mut end: oneshot::Receiver<Ended>,
) -> Result<Outcome, WorldError> {
    let mut terminate = signal(SignalKind::terminate())?;
    let mut interrupt = signal(SignalKind::interrupt())?;
    let mut clock = tokio::time::interval(CLOCK_INTERVAL);
    let mut missing: Option<String> = None;
    lock(server).advance();
    loop {
        let due = lock(server).due();
        tokio::select! {
            ended = &mut end => return Ok(ended.unwrap_or(Ok(Outcome::Interrupted))?),
            _ = terminate.recv() => lock(server).interrupt(),
            _ = interrupt.recv() => lock(server).interrupt(),
            () = sleep_until(due.unwrap_or_else(Instant::now)), if due.is_some() => lock(server).advance(),
            _ = clock.tick() => {
                let mut server = lock(server);
                server.check_deadlines();
                if let Some(metrics) = &mut metrics {
                    let simulation = server.simulation();
                    let step_ms = simulation.setup().scenario.step_ms;
                    metrics.update(&simulation.counts(), step_ms, Instant::now());
                }
                server.publish_view();
                announce_missing(&server, &mut missing);
            }
        }
    }
}

/// Logs the robots that the run waits for after each change.
fn announce_missing(server: &Server, announced: &mut Option<String>) {
    if server.simulation().barrier().started() {
        if announced.take().is_some() {
            tracing::info!("all robots are here; started");
        }
        return;
    }
    let missing = listed(&server.missing(), NAMES);
    if announced.as_ref() != Some(&missing) {
        tracing::info!("waiting for {missing}");
        *announced = Some(missing);
    }
}

/// Waits until all agents have received the end of the run, so that none of them sees the world disappear before.
async fn wait_for_agents(server: &Mutex<Server>) {
    let until = Instant::now() + FAREWELL;
    while Instant::now() < until && lock(server).has_agents() {
        sleep(Duration::from_millis(5)).await;
    }
}

/// Returns the contents of host.json: data that depends on the machine and the wall clock.
fn host(
    server: &Server,
    options: &Options,
    endpoint: &str,
    time: Range<Instant>,
) -> serde_json::Value {
    let wall = |instant: Instant| {
        let ago = Instant::now().duration_since(instant);
        // The wall clock is for host.json only. The simulation never uses it.
        #[allow(clippy::disallowed_methods)]
        let then = SystemTime::now() - ago;
        then.duration_since(UNIX_EPOCH)
            .map_or(0, |since| since.as_millis() as u64)
    };
    let seconds = server
        .first_tick()
        .map(|first| time.end.duration_since(first).as_secs_f64());
    let ticks = server.ticks();
    json!({
        "run": options.run,
        "build": program_build::get(),
        "command": invocation::command(),
        "speed": options.speed.to_string(),
        "endpoint": endpoint,
        "started_unix_ms": wall(time.start),
        "ended_unix_ms": wall(time.end),
        "start_to_first_tick_s": server.first_tick().map(|first| first.duration_since(time.start).as_secs_f64()),
        "running_s": seconds,
        "ticks_per_s": seconds.filter(|seconds| *seconds > 0.0).map(|seconds| ticks as f64 / seconds),
        "pids": {
            "world": std::process::id(),
            "robots": server.pids().collect::<BTreeMap<_, _>>(),
        },
        "refused": server.refused().collect::<BTreeMap<_, _>>(),
    })
}
