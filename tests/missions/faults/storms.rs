//! Storms: hundreds of orders and a hundred signals by hand at once, while what was ordered of processes is still under way. The log
//! has one order of all of it, and repeats it to the byte.

use std::sync::Arc;
use std::time::Duration;

use alliance_proto::control::ControlCommand;
use alliance_proto::fault::Order;
use alliance_proto::rendezvous::User;
use launch::control::query;
use launch::observer::Observer;
use nix::sys::signal::Signal;
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;
use tokio::task::JoinSet;

use super::assert_items_accounted_for;
use crate::harness::Lab;
use crate::hostile::announced;
use crate::team::Team;

/// Of some robot where it is `{}`. Who is killed for a while, or restarted, has another process afterwards.
const ORDERS: [&str; 16] = [
    r#"{"fault":{"restart":"{}"}}"#,
    r#"{"fault":{"restart":"{}"}}"#,
    r#"{"fault":{"restart":"{}"}}"#,
    r#"{"fault":{"kill":"{}"},"for_s":2}"#,
    r#"{"fault":{"kill":"{}"},"for_s":0.05}"#,
    r#"{"fault":{"terminate":"{}"},"for_s":1}"#,
    r#"{"fault":{"pause":"{}"},"for_s":0.5}"#,
    r#"{"fault":{"pause":"{}"},"for_s":5}"#,
    r#"{"fault":{"continue":"{}"}}"#,
    r#"{"fault":{"restart":"{}"},"when":"{} dies"}"#,
    r#"{"fault":{"mute":"{}"},"every_s":4,"for_s":0.5}"#,
    r#"{"fault":{"kill":"executing:report-progress"},"for_s":1}"#,
    r#"{"fault":{"pause":"executing:report-progress"},"every_s":5,"for_s":0.5}"#,
    r#"{"fault":{"kill":"idle"},"for_s":1}"#,
    r#"{"fault":{"waste":{"x_m":2,"y_m":2}}}"#,
    r#"{"fault":{"drop":{"from":"{}","to":"all","p":0.5}},"for_s":3}"#,
];

const SIGNALS: [Signal; 4] = [
    Signal::SIGKILL,
    Signal::SIGKILL,
    Signal::SIGSTOP,
    Signal::SIGCONT,
];

/// Storms by real processes; `ALLIANCE_REPLAYS` asks for more.
#[test]
fn every_storm_of_orders_and_signals_is_repeated_to_the_byte() {
    let storms = std::env::var("ALLIANCE_REPLAYS").map_or(20, |storms| storms.parse().unwrap());
    let mut all = (0, 0);
    for seed in 0..storms {
        let lab = Lab::new();
        let (orders, signals) = storm(&lab, seed);
        assert_items_accounted_for(&lab.log("run"));
        let again = lab.run(&["replay", "run", "--out", "again"]).expect(0);
        assert!(
            again.stderr.starts_with("identical"),
            "storm {seed}: {}",
            again.stderr
        );
        lab.assert_same_bytes("run", "again");
        all = (all.0 + orders, all.1 + signals);
    }
    eprintln!("{storms} storms: {} orders, {} signals", all.0, all.1);
    let (orders, signals) = (all.0 / storms, all.1 / storms);
    assert!(
        orders >= 100 && signals >= 25,
        "{orders} and {signals} each"
    );
}

/// A mission in a storm; how many orders the world obeyed, and how many signals were sent.
fn storm(lab: &Lab, seed: u64) -> (u64, u64) {
    let mut chance = ChaCha8Rng::seed_from_u64(seed);
    let mut team = Team::start(lab, &["--robots", "6", "--limit", "400", "--speed", "100x"]);
    team.wait_for_row("events.csv", &["joined"]);
    let robots = team.robots();
    let runtime = tokio::runtime::Builder::new_multi_thread()
        .worker_threads(1)
        .enable_all()
        .build()
        .unwrap();
    let operator = runtime
        .block_on(Observer::join(announced(lab), User::Operator))
        .unwrap();
    let operator = Arc::new(operator);
    let mut replies = JoinSet::new();
    let mut signals = 0;
    for _ in 0..100 {
        if !team.is_running() {
            break;
        }
        for _ in 0..3 {
            let robot = &robots[chance.random_range(0..robots.len())];
            let order = ORDERS[chance.random_range(0..ORDERS.len())].replace("{}", robot);
            let order: Order = serde_json::from_str(&order).unwrap();
            let operator = Arc::clone(&operator);
            let ask = async move { query(&operator, ControlCommand::Fault(order)).await.is_ok() };
            replies.spawn_on(ask, runtime.handle());
        }
        // Between the orders, after them, or while the world still waits for what they ask of processes.
        std::thread::sleep(Duration::from_millis(chance.random_range(0..60)));
        let robot = &robots[chance.random_range(0..robots.len())];
        team.try_signal_latest(robot, SIGNALS[chance.random_range(0..SIGNALS.len())]);
        signals += 1;
    }
    // Whoever stands still shall go on, so that the run has an end that does not wait for them.
    for robot in &robots {
        team.try_signal_latest(robot, Signal::SIGCONT);
    }
    let finished = team.wait();
    let orders = runtime.block_on(replies.join_all());
    assert!(
        matches!(finished.status.code(), Some(0 | 1)),
        "storm {seed}: {}",
        finished.stderr
    );
    let obeyed = orders
        .into_iter()
        .filter(|is_answered| *is_answered)
        .count();
    (obeyed as u64, signals)
}
