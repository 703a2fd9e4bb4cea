//! Attacks by local programs on a run: their cost in speed and memory, and whether they change the run.
//!
//! The run has one core and the attackers another, so the attackers' own load does not slow the run.

use std::io::Write;
use std::os::unix::net::UnixStream;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::time::Duration;

use alliance_tests::harness::Lab;
use alliance_tests::operator::{announced, stay_on};
use cluster::rendezvous::{ConnectionRole, Rendezvous};
use cluster::session::client;
use proto::keys::KeyExpressions;
use zenoh::Wait;
use zenoh::qos::{CongestionControl, Priority};

use crate::figures::Figures;
use crate::mission::Mission;
use crate::real::Run;

/// The number of simultaneous attackers.
const CROWD: usize = 8;

/// The length of a large message, in bytes.
const LARGE: usize = 60_000;

/// The maximum number of connections that one attacker holds.
const HELD: usize = 100;

/// The size of the team, and the items in each of its spills: more than the team can carry away.
const TEAM: usize = 3;
const ITEMS: usize = 1000;

/// The work of an attacker until the flag is set. It adds to the counter.
type Attack = fn(&Rendezvous, &AtomicBool, &AtomicU64);

/// The name of each attack and the unit of its amount.
const LABELS: &str = "no attack|
no token: burns its core|rounds
no token: junk on new connections|connections
no token: half a greeting, then idle|connections
no token: requests sessions with a wrong password|tries
token: 60 kB on all robots' keys, at the highest priority of the run|MB
token: empty messages there|messages
token: requests without a seal on the control topic|requests
token: as many liveliness tokens as possible|tokens
token: subscribes to as many keys as possible|subscribers
token: subscribes to everything with a blocked callback|subscribers
token: new sessions without end|sessions
the team's endpoint: junk on new connections|connections
the team's endpoint: half a greeting, then idle|connections
the team's endpoint: requests with a wrong password|tries";

const ATTACKS: [Attack; 15] = [
    |_, _, _| (),
    burn_core,
    send_junk,
    send_half_greeting,
    try_passwords,
    flood,
    send_empty,
    request,
    declare_tokens,
    subscribe,
    block_callback,
    open_sessions,
    |run, over, count| send_junk(&with_team_endpoint(run), over, count),
    |run, over, count| send_half_greeting(&with_team_endpoint(run), over, count),
    |run, over, count| try_passwords(&with_team_endpoint(run), over, count),
];

/// Runs all attacks in turn, so that all have the same background load. Ratios refer to the run without an attack in
/// the same round. The run has the first core, and the attackers have the second.
pub fn measure(rounds: usize, limit_s: f64) {
    let mission = Mission::busy(TEAM, 0.5, ITEMS, limit_s);
    let mut results = ATTACKS.map(|_| [(); 4].map(|()| Figures::default()));
    let (mut changed, mut undisturbed) = ([0; ATTACKS.len()], None);
    for _ in 0..rounds {
        let mut alone = None;
        for (index, attack) in ATTACKS.into_iter().enumerate() {
            let lab = Lab::new();
            stay_on(0);
            let run = Run::start(&lab, &mission, "--log=off --no-page");
            stay_on(1);
            let rendezvous = announced(&lab);
            let (over, count) = (AtomicBool::new(false), AtomicU64::new(0));
            let finished = std::thread::scope(|scope| {
                for _ in 0..CROWD {
                    scope.spawn(|| attack(&rendezvous, &over, &count));
                }
                let finished = run.finish();
                over.store(true, Ordering::Relaxed);
                finished
            });
            let of_alone = finished.ticks_per_s / *alone.get_or_insert(finished.ticks_per_s);
            let first = undisturbed.get_or_insert_with(|| finished.hash.clone());
            changed[index] += u32::from(*first != finished.hash);
            let amount = count.into_inner() as f64;
            let values = [of_alone, finished.world, finished.gateway, amount];
            for (figures, value) in results[index].iter_mut().zip(values) {
                figures.push(value);
            }
        }
    }
    println!(
        "\n## Hostile programs, {CROWD} at a time, {TEAM} agents, {limit_s} s of simulated time\n\n\
         | attack | how much | ticks/s / without attack | memory of the world, MB | of its gateway, MB | another hash |\n\
         |---|---|---|---|---|---|"
    );
    for (label, (figures, changed)) in LABELS.lines().zip(results.iter().zip(changed)) {
        let (attack, unit) = label.split_once('|').unwrap();
        let [rate, world, gateway, counts] = figures;
        println!(
            "| {attack} | {counts} {unit} | {rate} | {world} | {gateway} | {changed} of {rounds} |"
        );
    }
}

/// Returns a copy of `run` whose operator endpoint is the team's endpoint, so that an attack goes to the team's
/// endpoint.
fn with_team_endpoint(run: &Rendezvous) -> Rendezvous {
    Rendezvous {
        endpoint: run.team.endpoint.clone(),
        ..run.clone()
    }
}

fn burn_core(_: &Rendezvous, over: &AtomicBool, count: &AtomicU64) {
    while !over.load(Ordering::Relaxed) {
        let digest = (0..10_000_000_u64).fold(1, |sum: u64, number| sum.rotate_left(1) ^ number);
        let is_done = std::hint::black_box(digest) != 1;
        count.fetch_add(is_done.into(), Ordering::Relaxed);
    }
}

fn connect(run: &Rendezvous) -> std::io::Result<UnixStream> {
    UnixStream::connect(run.endpoint.strip_prefix("unixsock-stream/").unwrap())
}

fn send_junk(run: &Rendezvous, over: &AtomicBool, count: &AtomicU64) {
    let junk: Vec<u8> = (0..1_000_000_u32)
        .map(|number| (number.wrapping_mul(number) >> 7) as u8)
        .collect();
    while !over.load(Ordering::Relaxed) {
        if let Ok(mut socket) = connect(run) {
            // The router closes the connection after the first bytes.
            let _ = socket.write_all(&junk);
            count.fetch_add(1, Ordering::Relaxed);
        }
    }
}

fn send_half_greeting(run: &Rendezvous, over: &AtomicBool, count: &AtomicU64) {
    let mut held = Vec::new();
    while !over.load(Ordering::Relaxed) {
        match connect(run) {
            Ok(mut socket) if held.len() < HELD => {
                let _ = socket.write_all(&[9, 0, 1, 2, 3]);
                held.push(socket);
                count.fetch_add(1, Ordering::Relaxed);
            }
            _ => std::thread::sleep(Duration::from_millis(100)),
        }
    }
}

fn try_passwords(run: &Rendezvous, over: &AtomicBool, count: &AtomicU64) {
    let token = "0f5c31c27ad2bd0a".to_owned();
    let wrong = Rendezvous {
        token,
        ..run.clone()
    };
    while !over.load(Ordering::Relaxed) {
        assert!(session(&wrong).is_err());
        count.fetch_add(1, Ordering::Relaxed);
    }
}

/// Opens an operator's session without retries.
fn session(run: &Rendezvous) -> zenoh::Result<zenoh::Session> {
    let config = client(&run.login(ConnectionRole::Operator)?, true);
    zenoh::open(zenoh::Config::from_json5(&config)?).wait()
}

/// Sends messages of `bytes` bytes to the keys of the run until it ends.
fn put(run: &Rendezvous, over: &AtomicBool, bytes: usize, mut put: impl FnMut()) {
    let Ok(session) = session(run) else { return };
    let keys = KeyExpressions::new(&run.run);
    let keys = ["r0", "r1", "r2"].map(|robot| {
        let heartbeat = keys.team(robot, "heartbeat");
        [keys.tick(robot), keys.report(robot), heartbeat]
    });
    for key in keys.as_flattened().iter().cycle() {
        let message = session.put(key, vec![7; bytes]);
        let message = message.congestion_control(CongestionControl::Block);
        let sent = message.priority(Priority::InteractiveHigh).wait();
        if sent.is_err() || over.load(Ordering::Relaxed) {
            break;
        }
        put();
    }
}

fn flood(run: &Rendezvous, over: &AtomicBool, count: &AtomicU64) {
    let mut bytes = 0;
    put(run, over, LARGE, || bytes += LARGE as u64);
    count.fetch_add(bytes / 1_000_000, Ordering::Relaxed);
}

fn send_empty(run: &Rendezvous, over: &AtomicBool, count: &AtomicU64) {
    put(run, over, 0, || _ = count.fetch_add(1, Ordering::Relaxed));
}

fn request(run: &Rendezvous, over: &AtomicBool, count: &AtomicU64) {
    let Ok(session) = session(run) else { return };
    let key = KeyExpressions::new(&run.run).control();
    while !over.load(Ordering::Relaxed) {
        if let Ok(answers) = session.get(&key).payload(vec![7; LARGE]).wait() {
            count.fetch_add(answers.iter().count() as u64, Ordering::Relaxed);
        }
    }
}

fn declare_tokens(run: &Rendezvous, over: &AtomicBool, count: &AtomicU64) {
    let Ok(session) = session(run) else { return };
    let mut tokens = Vec::new();
    while !over.load(Ordering::Relaxed) {
        let number = count.fetch_add(1, Ordering::Relaxed);
        let key = format!("alliance/{}/alive/r0/{number}/0", run.run);
        tokens.extend(session.liveliness().declare_token(key).wait());
    }
}

fn subscribe(run: &Rendezvous, over: &AtomicBool, count: &AtomicU64) {
    let Ok(session) = session(run) else { return };
    let mut subscribers = Vec::new();
    while !over.load(Ordering::Relaxed) {
        let number = count.fetch_add(1, Ordering::Relaxed);
        let key = format!("alliance/{}/view/{number}", run.run);
        subscribers.extend(session.declare_subscriber(key).callback(|_| ()).wait());
    }
}

fn block_callback(run: &Rendezvous, over: &AtomicBool, count: &AtomicU64) {
    let Ok(session) = session(run) else { return };
    let everything = format!("alliance/{}/**", run.run);
    let subscriber = session.declare_subscriber(everything);
    let subscriber = subscriber.callback(|_| std::thread::sleep(Duration::from_secs(1)));
    let subscriber = subscriber.wait();
    while !over.load(Ordering::Relaxed) {
        std::thread::sleep(Duration::from_millis(50));
    }
    count.fetch_add(u64::from(subscriber.is_ok()), Ordering::Relaxed);
}

fn open_sessions(run: &Rendezvous, over: &AtomicBool, count: &AtomicU64) {
    while !over.load(Ordering::Relaxed) {
        if session(run).is_ok() {
            count.fetch_add(1, Ordering::Relaxed);
        }
    }
}
