//! Attacks by local programs on a run: their cost in speed and memory, and whether they change the run.
//!
//! The run has one core and the attackers another, so the attackers' own load does not slow the run.

use std::io::Write;
use std::os::unix::net::UnixStream;
use std::process::Command;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::time::Duration;

use cluster::rendezvous::{ConnectionRole, Rendezvous};
use cluster::session::client;
use proto::keys::KeyExpressions;
use zenoh::Wait;
use zenoh::qos::{CongestionControl, Priority};

use crate::figures::Figures;
use crate::real::Run;
use crate::stop::wait_for;
use crate::team::Team;

const CORE_OF_RUN: usize = 0;
const CORE_OF_ATTACKERS: usize = 1;

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

const ATTACKS: [(&str, &str, Attack); 15] = [
    ("no attack", "", |_, _, _| ()),
    ("no token: burns its core", "rounds", burn_core),
    (
        "no token: junk on new connections",
        "connections",
        send_junk,
    ),
    (
        "no token: half a greeting, then idle",
        "connections",
        send_half_greeting,
    ),
    (
        "no token: requests sessions with a wrong password",
        "tries",
        try_passwords,
    ),
    (
        "token: 60 kB on all robots' keys, at the highest priority of the run",
        "MB",
        flood,
    ),
    ("token: empty messages there", "messages", send_empty),
    (
        "token: requests without a seal on the control topic",
        "requests",
        request,
    ),
    (
        "token: as many liveliness tokens as possible",
        "tokens",
        declare_tokens,
    ),
    (
        "token: subscribes to as many keys as possible",
        "subscribers",
        subscribe,
    ),
    (
        "token: subscribes to everything with a blocked callback",
        "subscribers",
        block_callback,
    ),
    ("token: new sessions without end", "sessions", open_sessions),
    (
        "the team's endpoint: junk on new connections",
        "connections",
        |run, over, count| send_junk(&with_team_endpoint(run), over, count),
    ),
    (
        "the team's endpoint: half a greeting, then idle",
        "connections",
        |run, over, count| send_half_greeting(&with_team_endpoint(run), over, count),
    ),
    (
        "the team's endpoint: requests with a wrong password",
        "tries",
        |run, over, count| try_passwords(&with_team_endpoint(run), over, count),
    ),
];

/// Runs all attacks in turn, so that all have the same background load. Ratios refer to the run without an attack in
/// the same round.
pub fn measure(rounds: usize, limit_s: f64) {
    let me = std::process::id().to_string();
    let pinned = Command::new("taskset")
        .args(["-a", "-p", "-c", &CORE_OF_ATTACKERS.to_string(), &me])
        .output();
    if !pinned.is_ok_and(|output| output.status.success()) {
        return println!("\n## Hostile programs\n\nnot measured: needs `taskset` and two cores");
    }
    let team = Team::busy(TEAM, 0.5, ITEMS, limit_s);
    let mut results = [(); ATTACKS.len()].map(|()| [(); 4].map(|()| Figures::default()));
    let (mut changed, mut undisturbed) = ([0; ATTACKS.len()], None);
    for _ in 0..rounds {
        let mut alone = f64::NAN;
        for (index, (_, _, attack)) in ATTACKS.into_iter().enumerate() {
            let run = Run::start_on(CORE_OF_RUN, &team, &["--log=off", "--no-page"]);
            let rendezvous = wait_for(|| run.rendezvous());
            let (over, count) = (AtomicBool::new(false), AtomicU64::new(0));
            let finished = std::thread::scope(|scope| {
                for _ in 0..CROWD {
                    scope.spawn(|| attack(&rendezvous, &over, &count));
                }
                let finished = run.finish();
                over.store(true, Ordering::Relaxed);
                finished
            });
            if index == 0 {
                alone = finished.ticks_per_s;
            }
            let hash = finished.run.hash;
            let first = undisturbed.get_or_insert_with(|| hash.clone());
            changed[index] += u32::from(*first != hash);
            let [rate, world, gateway, counts] = &mut results[index];
            rate.push(finished.ticks_per_s / alone);
            world.push(finished.world.resident);
            gateway.push(finished.gateway.resident);
            counts.push(count.into_inner() as f64);
        }
    }
    println!(
        "\n## Hostile programs, {CROWD} at a time, {TEAM} agents, {limit_s} s of simulated time\n"
    );
    println!(
        "| attack | how much | ticks/s / without attack | memory of the world, MB | of its gateway, MB | another hash |"
    );
    println!("|---|---|---|---|---|---|");
    for (index, (attack, unit, _)) in ATTACKS.into_iter().enumerate() {
        let [rate, world, gateway, counts] = &results[index];
        let changed = changed[index];
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
        count.fetch_add(
            u64::from(std::hint::black_box(digest) != 1),
            Ordering::Relaxed,
        );
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
        [
            keys.tick(robot),
            keys.report(robot),
            keys.team(robot, "heartbeat"),
        ]
    });
    for key in keys.as_flattened().iter().cycle() {
        let message = session.put(key, vec![7; bytes]);
        let message = message.congestion_control(CongestionControl::Block);
        if message.priority(Priority::InteractiveHigh).wait().is_err()
            || over.load(Ordering::Relaxed)
        {
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
    let subscriber = subscriber
        .callback(|_| std::thread::sleep(Duration::from_secs(1)))
        .wait();
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
