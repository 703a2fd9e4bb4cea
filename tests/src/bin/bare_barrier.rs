//! The rate limit of the bus: the barrier of a run without all other work.
//!
//! Processes, sessions, callbacks, keys and message sizes equal those of a run, over zenoh with the same
//! configuration. There are no sensors, controllers, motion or logs. The benchmark starts one process per part.

#![allow(clippy::disallowed_methods)] // The program measures wall-clock time.

use std::collections::BTreeSet;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use clap::{Args, Parser, Subcommand};
use cluster::rendezvous::{ConnectionRole, JoinEndpoint, Rendezvous};
use cluster::session::{self, Members, Router};
use nix::sys::prctl::set_pdeathsig;
use nix::sys::signal::Signal;
use proto::keys::KeyExpressions;
use tokio::sync::Notify;
use zenoh::pubsub::Publisher;
use zenoh::qos::Priority;
use zenoh::sample::SampleKind;
use zenoh::{Session, Wait};

/// Exchange the messages of a run without other work
#[derive(Parser)]
struct BarrierCli {
    #[command(subcommand)]
    part: Part,
    /// Locator of the world
    #[arg(long, global = true, default_value = "")]
    endpoint: String,
}

#[derive(Subcommand)]
enum Part {
    /// Send ticks, collect reports and print ticks per second
    World(World),
    /// Answer each tick with a report, and send a broadcast before some of them
    Agent(Agent),
}

#[derive(Args)]
struct World {
    /// Number of agents in the team
    #[arg(long)]
    agents: usize,
    /// Number of ticks of the run
    #[arg(long)]
    ticks: u64,
    /// Size of a tick message, at least 8
    #[arg(long)]
    tick_bytes: usize,
}

#[derive(Args)]
struct Agent {
    /// Place in the team, from 0
    #[arg(long)]
    rank: u64,
    /// Size of a report
    #[arg(long)]
    report_bytes: usize,
    /// Size of a broadcast
    #[arg(long)]
    broadcast_bytes: usize,
    /// Ticks from one broadcast to the next
    #[arg(long)]
    broadcast_every: u64,
}

fn main() -> zenoh::Result<()> {
    session::prepare_process();
    set_pdeathsig(Signal::SIGKILL)?;
    let runtime = tokio::runtime::Builder::new_multi_thread()
        // The world and the agents use one worker thread, too.
        .worker_threads(1)
        .enable_all()
        .build()?;
    let BarrierCli { part, endpoint } = BarrierCli::parse();
    // The rendezvous that a run would announce.
    let run = Rendezvous {
        run: "bare".to_owned(),
        endpoint: String::new(),
        pid: std::process::id(),
        token: "token".to_owned(),
        team: JoinEndpoint {
            endpoint,
            password: "team".to_owned(),
        },
        started: 0,
        remote: None,
    };
    runtime.block_on(async {
        match part {
            Part::World(world) => world.run(&run).await,
            Part::Agent(agent) => agent.run(&run).await,
        }
    })
}

fn name(rank: impl std::fmt::Display) -> String {
    format!("r{rank}")
}

fn token(name: &str) -> String {
    format!("alliance/bare/alive/{name}")
}

#[derive(Default)]
struct Barrier {
    ticks: Vec<Publisher<'static>>,
    tick_bytes: usize,
    /// The tokens of the agents that have joined. A set, because a token can be received twice.
    joined: BTreeSet<String>,
    tick: u64,
    last: u64,
    reports: usize,
    began: Option<Instant>,
    took: Option<Duration>,
}

impl Barrier {
    fn arrive(&mut self, token: &str, over: &Notify) {
        if self.joined.insert(token.to_owned()) && self.joined.len() == self.ticks.len() {
            self.began = Some(Instant::now());
            self.send_ticks(over);
        }
    }

    fn report(&mut self, over: &Notify) {
        self.reports += 1;
        if self.reports == self.ticks.len() {
            self.reports = 0;
            self.tick += 1;
            self.send_ticks(over);
        }
    }

    /// Sends the next tick. After the last one it sends an empty message, which ends the agents.
    fn send_ticks(&mut self, over: &Notify) {
        let is_over = self.tick == self.last;
        let mut message = self.tick.to_le_bytes().to_vec();
        message.resize(if is_over { 0 } else { self.tick_bytes }, 0);
        for publisher in &self.ticks {
            publish(publisher, message.clone());
        }
        if is_over {
            self.took = self.began.map(|began| began.elapsed());
            over.notify_one();
        }
    }
}

impl World {
    async fn run(&self, run: &Rendezvous) -> zenoh::Result<()> {
        let members = Members::new([(ConnectionRole::Team.name(), run.team.password.as_str())])?;
        let session = open(&session::router(&Router {
            listen: std::slice::from_ref(&run.team.endpoint),
            uplink: None,
            members: &members,
            keyring: None,
            access: String::new(),
        }))
        .await?;
        let keys = KeyExpressions::new(&run.run);
        let mut ticks = Vec::new();
        for rank in 0..self.agents {
            ticks.push(declare(&session, keys.tick(&name(rank))).await?);
        }
        let barrier = Arc::new(Mutex::new(Barrier {
            ticks,
            tick_bytes: self.tick_bytes.max(8),
            last: self.ticks,
            ..Barrier::default()
        }));
        let over = Arc::new(Notify::new());

        let (shared, end) = (Arc::clone(&barrier), Arc::clone(&over));
        session
            .declare_subscriber(keys.reports())
            .callback(move |_| lock(&shared).report(&end))
            .background()
            .await?;
        session
            .declare_subscriber(keys.team_all())
            .callback(drop)
            .background()
            .await?;
        let (shared, end) = (Arc::clone(&barrier), Arc::clone(&over));
        session
            .liveliness()
            .declare_subscriber(token("*"))
            .history(true)
            .callback(move |sample| {
                if sample.kind() == SampleKind::Put {
                    lock(&shared).arrive(sample.key_expr().as_str(), &end);
                }
            })
            .background()
            .await?;

        over.notified().await;
        if let Some(took) = lock(&barrier).took {
            println!("{}", self.ticks as f64 / took.as_secs_f64());
        }
        // The last message to the agents may not have been delivered yet.
        tokio::time::sleep(Duration::from_millis(200)).await;
        Ok(())
    }
}

impl Agent {
    async fn run(&self, run: &Rendezvous) -> zenoh::Result<()> {
        let session = open(&session::client(&run.login(ConnectionRole::Team)?, false)).await?;
        let (keys, name) = (KeyExpressions::new(&run.run), name(self.rank));
        let report = declare(&session, keys.report(&name)).await?;
        let team = declare(&session, keys.team(&name, "heartbeat")).await?;
        let (rank, every) = (self.rank, self.broadcast_every.max(1));
        let (report_bytes, broadcast_bytes) = (self.report_bytes, self.broadcast_bytes);
        let over = Arc::new(Notify::new());
        let end = Arc::clone(&over);
        session
            .declare_subscriber(keys.tick(&name))
            .callback(move |sample| {
                let message = sample.payload().to_bytes();
                let Some(tick) = message.first_chunk() else {
                    return end.notify_one();
                };
                // The agents broadcast in different ticks.
                if (u64::from_le_bytes(*tick) + rank).is_multiple_of(every) {
                    publish(&team, vec![0; broadcast_bytes]);
                }
                publish(&report, vec![0; report_bytes]);
            })
            .background()
            .await?;
        let _token = session.liveliness().declare_token(token(&name)).await?;
        over.notified().await;
        Ok(())
    }
}

async fn open(config: &str) -> zenoh::Result<Session> {
    zenoh::open(zenoh::Config::from_json5(config)?).await
}

/// Declares a publisher with the priority of a run's lockstep.
async fn declare(session: &Session, key: String) -> zenoh::Result<Publisher<'static>> {
    let declared = session.declare_publisher(key);
    declared.priority(Priority::InteractiveHigh).await
}

/// Sends a message. A lost message blocks the barrier, so an error is printed.
fn publish(publisher: &Publisher<'_>, message: Vec<u8>) {
    if let Err(error) = publisher.put(message).wait() {
        eprintln!("{error}");
    }
}

fn lock(barrier: &Mutex<Barrier>) -> MutexGuard<'_, Barrier> {
    barrier.lock().unwrap_or_else(PoisonError::into_inner)
}
