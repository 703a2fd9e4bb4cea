//! The gateway: a process between the team's bus and the operators and observers.
//!
//! Operators connect to the gateway's own router. Their messages, declarations and slow readers therefore use queues, tables and
//! time of this process, not of the world. Requests on the control topic with the run's seal are forwarded to the world, and its
//! answers are sent back. Messages of the team are forwarded while an operator subscribes to them. The world uses the gateway's
//! standard input and output; the gateway ends when its input is closed ([`supervisor`]).

pub mod supervisor;

use std::fs;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use anyhow::Context;
use cluster::ignored::IgnoredMessages;
use cluster::process_log::set_run;
use cluster::rendezvous::{ConnectionRole, Rendezvous};
use cluster::session;
use nix::libc;
use nix::unistd::{SysconfVar, sysconf};
use proto::control::wire::{ControlTopic, Format, WireError};
use proto::keys::KeyExpressions;
use proto::secret::Secret;
use terminal;
use tokio::io::{AsyncBufReadExt, BufReader, Lines, Stdin, stdin};
use tokio::time::{Instant, interval, sleep, timeout};
use zenoh::bytes::{Encoding, ZBytes};
use zenoh::query::{ConsolidationMode, Query, QueryTarget, Reply};
use zenoh::sample::{Locality, Sample, SampleKind};
use zenoh::{Session, Wait};

use cluster::router;

/// The increase of the nice value of processes beside a run.
const NICE: i32 = 10;
/// The memory limit in bytes, far above normal use. Beyond it the gateway disconnects all operators and the world restarts it.
const MOST_MEMORY: u64 = 256 << 20;
const LOOK_INTERVAL: Duration = Duration::from_millis(200);
/// The maximum number of requests that wait for the world's answer.
const MOST_REQUESTS: usize = 1024;
const PATIENCE: Duration = Duration::from_secs(60);
/// The time for the world's last messages to reach observers.
const FAREWELL: Duration = Duration::from_millis(50);
const CLOSE_DEADLINE: Duration = Duration::from_secs(1);

/// Lowers the priority of this process, so that requests of operators and other work beside a run do not slow down the team.
pub fn lower_priority() {
    // SAFETY: Changes the priority of this process only. A failure has no consequence.
    #[allow(unsafe_code)]
    unsafe {
        libc::nice(NICE);
    }
}

/// Runs the gateway until its standard input is closed. The first line of input is the rendezvous of the run.
pub fn run() -> anyhow::Result<()> {
    lower_priority();
    let runtime = tokio::runtime::Builder::new_multi_thread()
        .worker_threads(1)
        .enable_all()
        .build()
        .context("starting the runtime")?;
    let served = runtime.block_on(serve());
    // The thread that reads standard input does not end by itself.
    runtime.shutdown_background();
    served
}

async fn serve() -> anyhow::Result<()> {
    let mut input = BufReader::new(stdin()).lines();
    // The input is empty if the world could not start. The world reports that error itself.
    let Some(run) = input.next_line().await? else {
        return Ok(());
    };
    let mut run: Rendezvous = serde_json::from_str(&run).context("the run")?;
    set_run(&run.run);
    let keys = KeyExpressions::new(&run.run);
    let team = session::client(&run.login(ConnectionRole::Team)?, false);
    let team = cluster::open(&team)
        .await
        .map_err(anyhow::Error::from_boxed)?;
    let operators = router::open_for_operators(&mut run).await?;
    let refused = Arc::new(Refused::default());
    let wire = ControlTopic::new(&keys, Secret::from_token(&run.token));
    bridge(&team, &operators, &keys, wire, &refused)
        .await
        .map_err(anyhow::Error::from_boxed)?;
    terminal::print(format_args!("{}\n", run.endpoint))?;
    wait(&mut input).await?;
    terminal::print(format_args!("{}\n", refused.count.load(Ordering::Relaxed)))?;
    sleep(FAREWELL).await;
    // Closing may hang, so the process does not wait for it without limit.
    let _ = timeout(CLOSE_DEADLINE, operators.close()).await;
    Ok(())
}

/// Waits until the world ends. Ends the process if it uses too much memory.
async fn wait(input: &mut Lines<BufReader<Stdin>>) -> anyhow::Result<()> {
    let page = sysconf(SysconfVar::PAGE_SIZE)?.unwrap_or(4096) as u64;
    let mut clock = interval(LOOK_INTERVAL);
    loop {
        tokio::select! {
            line = input.next_line() => if line?.is_none() { return Ok(()) },
            _ = clock.tick() => if pages() * page > MOST_MEMORY {
                tracing::warn!("operators use more than {} MiB of memory; disconnecting all of them", MOST_MEMORY >> 20);
                std::process::exit(1);
            }
        }
    }
}

/// Returns the resident memory of this process in pages, from `/proc/self/statm` (proc(5)).
fn pages() -> u64 {
    let sizes = fs::read_to_string("/proc/self/statm").unwrap_or_default();
    let resident = sizes.split(' ').nth(1).and_then(|pages| pages.parse().ok());
    resident.unwrap_or(0)
}

#[derive(Default)]
struct Refused {
    count: AtomicU64,
    warnings: Mutex<IgnoredMessages>,
}

impl Refused {
    fn count(&self, why: &WireError) {
        self.count.fetch_add(1, Ordering::Relaxed);
        let mut warnings = self.warnings.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(count) = warnings.count("control", Instant::now().into_std()) {
            tracing::warn!(count, %why, "request ignored");
        }
    }
}

async fn bridge(
    team: &Session,
    operators: &Session,
    keys: &KeyExpressions,
    wire: ControlTopic,
    refused: &Arc<Refused>,
) -> zenoh::Result<()> {
    for topic in keys.published() {
        forward_topic(team, operators, topic).await?;
    }
    let (to, counted, reader) = (team.clone(), Arc::clone(refused), wire.clone());
    operators
        .declare_subscriber(keys.control())
        .callback(move |sample| {
            let form = Format::from_zenoh(&sample.encoding().to_string());
            let (payload, seal) = (sample.payload().to_bytes(), seal_of(sample.attachment()));
            match reader.read_request(form, &payload, seal.as_deref()) {
                Err(why) => counted.count(&why),
                // A put needs no answer.
                Ok(_) => _ = forward(&to, &sample).wait(),
            }
        })
        .background()
        .await?;

    let (to, counted, waiting) = (team.clone(), Arc::clone(refused), Arc::new(()));
    operators
        .declare_queryable(keys.control())
        .callback(move |query| {
            let form = Format::from_zenoh(
                &query
                    .encoding()
                    .map_or_else(String::new, ToString::to_string),
            );
            let payload = query.payload().map(ZBytes::to_bytes).unwrap_or_default();
            let seal = seal_of(query.attachment());
            let read = wire.read_request(form, &payload, seal.as_deref());
            let sent = match read {
                Err(why) => {
                    counted.count(&why);
                    query.reply_err(why.to_string()).wait()
                }
                Ok(_) if Arc::strong_count(&waiting) > MOST_REQUESTS => query
                    .reply_err("too many requests wait for an answer")
                    .wait(),
                Ok(_) => query_world(&to, query, Arc::clone(&waiting)),
            };
            if let Err(error) = sent {
                tracing::warn!(%error, "request not forwarded");
            }
        })
        .background()
        .await?;

    // The end of this token shows operators that the run is over.
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

/// Forwards the team's messages on a topic while an operator subscribes to it. Without subscribers, forwarding would only cost
/// the world and the sender time.
async fn forward_topic(team: &Session, operators: &Session, topic: String) -> zenoh::Result<()> {
    let listeners = operators
        .declare_publisher(topic.clone())
        .allowed_destination(Locality::Remote)
        .await?;
    let (team, operators) = (team.clone(), operators.clone());
    tokio::spawn(async move {
        let Ok(changes) = listeners.matching_listener().await else {
            return;
        };
        let mut has_subscriber = listeners
            .matching_status()
            .await
            .is_ok_and(|now| now.matching());
        loop {
            let to = operators.clone();
            let passing = team
                .declare_subscriber(&topic)
                .callback(move |sample| _ = forward(&to, &sample).wait());
            // Dropping it ends the subscription.
            let _passing = if has_subscriber {
                passing.await.ok()
            } else {
                None
            };
            match changes.recv_async().await {
                Ok(now) => has_subscriber = now.matching(),
                Err(_) => return,
            }
        }
    });
    Ok(())
}

fn forward<'a>(to: &'a Session, sample: &'a Sample) -> impl Wait<To = zenoh::Result<()>> + 'a {
    to.put(sample.key_expr(), sample.payload().clone())
        .encoding(sample.encoding().clone())
        .attachment(sample.attachment().cloned())
        .priority(sample.priority())
}

fn seal_of(attachment: Option<&ZBytes>) -> Option<Vec<u8>> {
    attachment.map(|seal| seal.to_bytes().into_owned())
}

/// Sends an operator's request to the world and returns its answers to the operator.
fn query_world(team: &Session, query: Query, waiting: Arc<()>) -> zenoh::Result<()> {
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
