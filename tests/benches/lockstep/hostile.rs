//! Programs that mean harm to a run of the same machine: what they cost it, in speed and in memory, and whether they change it.
//!
//! The run has one core and the attackers have another: what they take for themselves is not what they cost the run.

use std::io::Write;
use std::os::unix::net::UnixStream;
use std::process::Command;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::time::Duration;

use alliance_proto::keys::Keys;
use alliance_proto::rendezvous::{Rendezvous, User};
use alliance_proto::session::client;
use zenoh::Wait;
use zenoh::qos::{CongestionControl, Priority};

use crate::figures::Figures;
use crate::real::Run;
use crate::stop::wait_for;
use crate::team::Team;

const CORE_OF_RUN: usize = 0;
const CORE_OF_ATTACKERS: usize = 1;

/// Attackers at the same time.
const CROWD: usize = 8;

/// Bytes of a large message.
const LARGE: usize = 60_000;

/// Connections that one attacker holds at most.
const HELD: usize = 100;

/// Size of the team, and items in each of its spills: more than it brings away.
const TEAM: usize = 3;
const ITEMS: usize = 1000;

/// What an attacker does until it is told to stop, and what it counts.
type Attack = fn(&Rendezvous, &AtomicBool, &AtomicU64);

const ATTACKS: [(&str, &str, Attack); 15] = [
    ("nobody", "", |_, _, _| ()),
    ("no token: burns its core", "rounds", burn),
    ("no token: junk on new connections", "connections", junk),
    ("no token: half a greeting, and waits", "connections", greet),
    (
        "no token: asks for sessions with a wrong password",
        "tries",
        knock,
    ),
    (
        "token: 60 kB on all robots' keys, at the highest priority of the run",
        "MB",
        flood,
    ),
    ("token: empty messages there", "messages", patter),
    (
        "token: requests without a seal on the control topic",
        "requests",
        ask,
    ),
    ("token: as many liveliness tokens as it can", "tokens", live),
    (
        "token: listens to as many keys as it can",
        "subscribers",
        listen,
    ),
    (
        "token: hears everything, and does not listen",
        "subscribers",
        deaf,
    ),
    ("token: new sessions, without end", "sessions", come),
    (
        "the team's own entrance: junk on new connections",
        "connections",
        |run, over, count| junk(&of_the_team(run), over, count),
    ),
    (
        "the team's own entrance: half a greeting, and waits",
        "connections",
        |run, over, count| greet(&of_the_team(run), over, count),
    ),
    (
        "the team's own entrance: asks with a wrong password",
        "tries",
        |run, over, count| knock(&of_the_team(run), over, count),
    ),
];

/// All of them in turns, so that all see the same noise of the machine; ratios are to the run that nobody attacks, of the same round.
pub fn measure(rounds: usize, limit_s: f64) {
    let me = std::process::id().to_string();
    let pinned = Command::new("taskset")
        .args(["-a", "-p", "-c", &CORE_OF_ATTACKERS.to_string(), &me])
        .output();
    if !pinned.is_ok_and(|output| output.status.success()) {
        return println!("\n## Hostile programs\n\nnot measured: it takes `taskset` and two cores");
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
        "| attack | how much | ticks/s / with nobody | memory of the world, MB | of its gateway, MB | another hash |"
    );
    println!("|---|---|---|---|---|---|");
    for (index, (what, unit, _)) in ATTACKS.into_iter().enumerate() {
        let [rate, world, gateway, counts] = &results[index];
        let changed = changed[index];
        println!(
            "| {what} | {counts} {unit} | {rate} | {world} | {gateway} | {changed} of {rounds} |"
        );
    }
}

/// What a run would announce whose team came in where its operators do: so an attack on operators' entrance becomes one on the team's.
fn of_the_team(run: &Rendezvous) -> Rendezvous {
    Rendezvous {
        endpoint: run.team.endpoint.clone(),
        ..run.clone()
    }
}

fn burn(_: &Rendezvous, over: &AtomicBool, count: &AtomicU64) {
    while !over.load(Ordering::Relaxed) {
        let digest = (0..10_000_000_u64).fold(1, |sum: u64, it| sum.rotate_left(1) ^ it);
        count.fetch_add(
            u64::from(std::hint::black_box(digest) != 1),
            Ordering::Relaxed,
        );
    }
}

fn connect(run: &Rendezvous) -> std::io::Result<UnixStream> {
    UnixStream::connect(run.endpoint.strip_prefix("unixsock-stream/").unwrap())
}

fn junk(run: &Rendezvous, over: &AtomicBool, count: &AtomicU64) {
    let junk: Vec<u8> = (0..1_000_000_u32)
        .map(|it| (it.wrapping_mul(it) >> 7) as u8)
        .collect();
    while !over.load(Ordering::Relaxed) {
        if let Ok(mut socket) = connect(run) {
            // The router hangs up after the first bytes.
            let _ = socket.write_all(&junk);
            count.fetch_add(1, Ordering::Relaxed);
        }
    }
}

fn greet(run: &Rendezvous, over: &AtomicBool, count: &AtomicU64) {
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

fn knock(run: &Rendezvous, over: &AtomicBool, count: &AtomicU64) {
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

/// As an operator, without patience.
fn session(run: &Rendezvous) -> zenoh::Result<zenoh::Session> {
    let config = client(&run.login(User::Operator)?, true);
    zenoh::open(zenoh::Config::from_json5(&config)?).wait()
}

/// Puts messages of so many bytes on the keys of the run until it ends.
fn put(run: &Rendezvous, over: &AtomicBool, bytes: usize, mut put: impl FnMut()) {
    let Ok(session) = session(run) else { return };
    let keys = Keys::new(&run.run);
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

fn patter(run: &Rendezvous, over: &AtomicBool, count: &AtomicU64) {
    put(run, over, 0, || _ = count.fetch_add(1, Ordering::Relaxed));
}

fn ask(run: &Rendezvous, over: &AtomicBool, count: &AtomicU64) {
    let Ok(session) = session(run) else { return };
    let key = Keys::new(&run.run).control();
    while !over.load(Ordering::Relaxed) {
        if let Ok(answers) = session.get(&key).payload(vec![7; LARGE]).wait() {
            count.fetch_add(answers.iter().count() as u64, Ordering::Relaxed);
        }
    }
}

fn live(run: &Rendezvous, over: &AtomicBool, count: &AtomicU64) {
    let Ok(session) = session(run) else { return };
    let mut tokens = Vec::new();
    while !over.load(Ordering::Relaxed) {
        let number = count.fetch_add(1, Ordering::Relaxed);
        let key = format!("alliance/{}/alive/r0/{number}/0", run.run);
        tokens.extend(session.liveliness().declare_token(key).wait());
    }
}

fn listen(run: &Rendezvous, over: &AtomicBool, count: &AtomicU64) {
    let Ok(session) = session(run) else { return };
    let mut subscribers = Vec::new();
    while !over.load(Ordering::Relaxed) {
        let number = count.fetch_add(1, Ordering::Relaxed);
        let key = format!("alliance/{}/view/{number}", run.run);
        subscribers.extend(session.declare_subscriber(key).callback(|_| ()).wait());
    }
}

fn deaf(run: &Rendezvous, over: &AtomicBool, count: &AtomicU64) {
    let Ok(session) = session(run) else { return };
    let everything = format!("alliance/{}/**", run.run);
    let heard = session.declare_subscriber(everything);
    let heard = heard
        .callback(|_| std::thread::sleep(Duration::from_secs(1)))
        .wait();
    while !over.load(Ordering::Relaxed) {
        std::thread::sleep(Duration::from_millis(50));
    }
    count.fetch_add(u64::from(heard.is_ok()), Ordering::Relaxed);
}

fn come(run: &Rendezvous, over: &AtomicBool, count: &AtomicU64) {
    while !over.load(Ordering::Relaxed) {
        if session(run).is_ok() {
            count.fetch_add(1, Ordering::Relaxed);
        }
    }
}
