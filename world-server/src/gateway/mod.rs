//! The gateway: a process between the team's bus and those who order and watch.
//!
//! Operators have a router of their own here, so that whatever they send, declare or leave unread fills the queues and tables of this
//! process and takes its time, not the world's. What bears the run's seal on the control topic goes on to the world, and its answer
//! comes back; what the team puts is passed on while somebody listens. It speaks with the world by its standard input, at whose end it
//! ends, and its standard output ([`keeper`]).

pub mod keeper;

use std::fs;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use alliance_proto::control::wire::{Form, Wire, WireError};
use alliance_proto::ignored::Ignored;
use alliance_proto::keys::Keys;
use alliance_proto::rendezvous::{Rendezvous, User};
use alliance_proto::secret::Secret;
use alliance_proto::session;
use alliance_proto::terminal;
use anyhow::Context;
use nix::libc;
use nix::unistd::{SysconfVar, sysconf};
use tokio::io::{AsyncBufReadExt, BufReader, Lines, Stdin, stdin};
use tokio::time::{Instant, interval, sleep, timeout};
use zenoh::bytes::{Encoding, ZBytes};
use zenoh::query::{ConsolidationMode, Query, QueryTarget, Reply};
use zenoh::sample::{Locality, Sample, SampleKind};
use zenoh::{Session, Wait};

use crate::router;

/// Added to its nice value: what operators ask for in great number shall not keep the team waiting.
const NICE: i32 = 10;
/// Memory that no honest operators need, bytes. With more, all of them are cut off, and the world starts another gateway.
const MOST_MEMORY: u64 = 256 << 20;
/// How often it looks at its memory.
const LOOK_INTERVAL: Duration = Duration::from_millis(200);
/// How many requests may wait for the world's answer.
const MOST_REQUESTS: usize = 1024;
/// How long the world may take to answer.
const PATIENCE: Duration = Duration::from_secs(60);
/// Until what the world said last has reached those who listen.
const FAREWELL: Duration = Duration::from_millis(50);
/// How long a session may take to close.
const CLOSE_DEADLINE: Duration = Duration::from_secs(1);

/// Is the gateway of the run that the world tells, until it ends.
///
/// # Errors
/// When there is no such run, or the bus fails.
pub fn run() -> anyhow::Result<()> {
    // SAFETY: changes the priority of this process alone; it may fail, and then nothing is lost.
    #[allow(unsafe_code)]
    unsafe {
        libc::nice(NICE);
    }
    let runtime = tokio::runtime::Builder::new_multi_thread()
        .worker_threads(1)
        .enable_all()
        .build()
        .context("starting the runtime")?;
    let served = runtime.block_on(serve());
    // Standard input is read by a thread that nothing else ends.
    runtime.shutdown_background();
    served
}

async fn serve() -> anyhow::Result<()> {
    let mut told = BufReader::new(stdin()).lines();
    // None where its world could not begin, which says so.
    let Some(run) = told.next_line().await? else {
        return Ok(());
    };
    let mut run: Rendezvous = serde_json::from_str(&run).context("the run")?;
    let keys = Keys::new(&run.run);
    let team = session::client(&run.login(User::Team)?, false);
    let team = bus::open(&team).await.map_err(anyhow::Error::from_boxed)?;
    let operators = router::open_for_operators(&mut run).await?;
    let refused = Arc::new(Refused::default());
    let wire = Wire::new(&keys, Secret::of(&run.token));
    bridge(&team, &operators, &keys, wire, &refused)
        .await
        .map_err(anyhow::Error::from_boxed)?;
    terminal::print(format_args!("{}\n", run.endpoint))?;
    wait(&mut told).await?;
    terminal::print(format_args!("{}\n", refused.count.load(Ordering::Relaxed)))?;
    sleep(FAREWELL).await;
    // Teardown may hang; the process ends whether or not it does.
    let _ = timeout(CLOSE_DEADLINE, operators.close()).await;
    Ok(())
}

/// Until the world ends or this process takes too much memory.
async fn wait(told: &mut Lines<BufReader<Stdin>>) -> anyhow::Result<()> {
    let page = sysconf(SysconfVar::PAGE_SIZE)?.unwrap_or(4096) as u64;
    let mut clock = interval(LOOK_INTERVAL);
    loop {
        tokio::select! {
            line = told.next_line() => if line?.is_none() { return Ok(()) },
            _ = clock.tick() => if pages() * page > MOST_MEMORY {
                tracing::warn!("operators take more than {} MiB; they are cut off", MOST_MEMORY >> 20);
                std::process::exit(1);
            }
        }
    }
}

/// Memory of this process, pages: resident, of `/proc/self/statm` (proc(5)).
fn pages() -> u64 {
    let sizes = fs::read_to_string("/proc/self/statm").unwrap_or_default();
    let resident = sizes.split(' ').nth(1).and_then(|pages| pages.parse().ok());
    resident.unwrap_or(0)
}

/// Requests that are none.
#[derive(Default)]
struct Refused {
    count: AtomicU64,
    told: Mutex<Ignored>,
}

impl Refused {
    fn count(&self, why: &WireError) {
        self.count.fetch_add(1, Ordering::Relaxed);
        let mut told = self.told.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(count) = told.count("control", Instant::now().into_std()) {
            tracing::warn!(count, %why, "request ignored");
        }
    }
}

async fn bridge(
    team: &Session,
    operators: &Session,
    keys: &Keys,
    wire: Wire,
    refused: &Arc<Refused>,
) -> zenoh::Result<()> {
    for topic in keys.news() {
        pass_on(team, operators, topic).await?;
    }
    let (to, counted, reader) = (team.clone(), Arc::clone(refused), wire.clone());
    operators
        .declare_subscriber(keys.control())
        .callback(move |sample| {
            let form = Form::of(&sample.encoding().to_string());
            let (payload, seal) = (sample.payload().to_bytes(), seal_of(sample.attachment()));
            match reader.read_request(form, &payload, seal.as_deref()) {
                Err(why) => counted.count(&why),
                // Whoever puts wants no answer.
                Ok(_) => _ = forward(&to, &sample).wait(),
            }
        })
        .background()
        .await?;

    let (to, counted, waiting) = (team.clone(), Arc::clone(refused), Arc::new(()));
    operators
        .declare_queryable(keys.control())
        .callback(move |query| {
            let form = Form::of(
                &query
                    .encoding()
                    .map_or_else(String::new, ToString::to_string),
            );
            let payload = query.payload().map(ZBytes::to_bytes).unwrap_or_default();
            let seal = seal_of(query.attachment());
            let read = wire.read_request(form, &payload, seal.as_deref());
            let asked = match read {
                Err(why) => {
                    counted.count(&why);
                    query.reply_err(why.to_string()).wait()
                }
                Ok(_) if Arc::strong_count(&waiting) > MOST_REQUESTS => query
                    .reply_err("too many requests wait for an answer")
                    .wait(),
                Ok(_) => ask(&to, query, Arc::clone(&waiting)),
            };
            if let Err(error) = asked {
                tracing::warn!(%error, "request not passed on");
            }
        })
        .background()
        .await?;

    // Operators see by it that the run is over.
    let (over, alive) = (operators.clone(), keys.alive_world());
    let token = Mutex::new(None);
    team.liveliness()
        .declare_subscriber(&alive)
        .history(true)
        .callback({
            let alive = alive.clone();
            move |sample| {
                let mut token = token.lock().unwrap_or_else(PoisonError::into_inner);
                *token = match sample.kind() {
                    SampleKind::Put => over.liveliness().declare_token(&alive).wait().ok(),
                    SampleKind::Delete => None,
                };
            }
        })
        .background()
        .await
}

/// Passes on what the team puts on a topic while an operator listens to it: otherwise it would cost the world and the sender the
/// time of one more listener.
async fn pass_on(team: &Session, operators: &Session, topic: String) -> zenoh::Result<()> {
    let listeners = operators
        .declare_publisher(topic.clone())
        .allowed_destination(Locality::Remote)
        .await?;
    let (team, operators) = (team.clone(), operators.clone());
    tokio::spawn(async move {
        let Ok(changes) = listeners.matching_listener().await else {
            return;
        };
        let mut listens = listeners
            .matching_status()
            .await
            .is_ok_and(|now| now.matching());
        loop {
            let to = operators.clone();
            let passing = team
                .declare_subscriber(&topic)
                .callback(move |sample| _ = forward(&to, &sample).wait());
            // Undeclared where it is dropped.
            let _passing = if listens { passing.await.ok() } else { None };
            match changes.recv_async().await {
                Ok(now) => listens = now.matching(),
                Err(_) => return,
            }
        }
    });
    Ok(())
}

/// The same message on the other bus.
fn forward<'a>(to: &'a Session, sample: &'a Sample) -> impl Wait<To = zenoh::Result<()>> + 'a {
    to.put(sample.key_expr(), sample.payload().clone())
        .encoding(sample.encoding().clone())
        .attachment(sample.attachment().cloned())
        .priority(sample.priority())
}

fn seal_of(attachment: Option<&ZBytes>) -> Option<Vec<u8>> {
    attachment.map(|seal| seal.to_bytes().into_owned())
}

/// Asks the world what an operator asks, who has its answers as they come.
fn ask(team: &Session, query: Query, waiting: Arc<()>) -> zenoh::Result<()> {
    let encoding = query.encoding().cloned().unwrap_or_default();
    team.get(query.key_expr().clone().into_owned())
        .payload(query.payload().cloned().unwrap_or_default())
        .encoding(encoding)
        .attachment(query.attachment().cloned())
        .target(QueryTarget::All)
        .consolidation(ConsolidationMode::None)
        .timeout(PATIENCE)
        .callback(move |reply| {
            let _waits = &waiting;
            if let Err(error) = answer(&query, &reply) {
                tracing::warn!(%error, "request not answered");
            }
        })
        .wait()
}

fn answer(query: &Query, reply: &Reply) -> zenoh::Result<()> {
    match reply.result() {
        Ok(sample) => query
            .reply(sample.key_expr(), sample.payload().clone())
            .encoding(sample.encoding().clone())
            .attachment(sample.attachment().cloned())
            .wait(),
        Err(error) => query
            .reply_err(error.payload().clone())
            .encoding(Encoding::clone(error.encoding()))
            .wait(),
    }
}
