//! A fault fuzzer by real processes: hundreds of orders and a hundred manual signals at once, while earlier process
//! orders are still pending. The log has one order of all inputs and repeats the run byte for byte.

use std::sync::Arc;
use std::time::Duration;

use alliance_tests::fault_fuzzer::process_order;
use alliance_tests::harness::Lab;
use alliance_tests::operator::announced;
use alliance_tests::team::Team;
use cluster::rendezvous::ConnectionRole;
use launch::control::query;
use launch::observer::Observer;
use nix::sys::signal::Signal;
use proto::control::ControlCommand;
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;
use tokio::task::JoinSet;

use super::assert_items_accounted_for;

const SIGNALS: [Signal; 4] = [
    Signal::SIGKILL,
    Signal::SIGKILL,
    Signal::SIGSTOP,
    Signal::SIGCONT,
];

/// Runs `ALLIANCE_REPLAYS` missions, by default one, by real processes.
#[test]
fn every_fuzzed_run_is_repeated_byte_for_byte() {
    let runs = std::env::var("ALLIANCE_REPLAYS").map_or(1, |runs| runs.parse().unwrap());
    let (mut orders, mut signals) = (0, 0);
    for seed in 0..runs {
        let lab = Lab::new();
        let accepted = fuzz(&lab, seed);
        assert_items_accounted_for(&lab.log("run"));
        let again = lab.run("replay run --out again").expect(0);
        let is_identical = again.answer().starts_with("identical");
        assert!(is_identical, "seed {seed}: {}", again.stderr);
        lab.assert_same_bytes("run", "again");
        (orders, signals) = (orders + accepted.0, signals + accepted.1);
    }
    eprintln!("{runs} runs: {orders} orders, {signals} signals");
    assert!(orders >= 100 * runs && signals >= 25 * runs);
}

/// Runs a mission with random orders and signals. Returns the number of accepted orders and of sent signals.
fn fuzz(lab: &Lab, seed: u64) -> (u64, u64) {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut team = Team::start(lab, "--robots 6 --limit 400 --speed 100x");
    team.wait_for_row("events.csv", &["joined"]);
    let robots = team.robots();
    let runtime = tokio::runtime::Builder::new_multi_thread()
        .worker_threads(1)
        .enable_all()
        .build()
        .unwrap();
    let operator = runtime
        .block_on(Observer::join(announced(lab), ConnectionRole::Operator))
        .unwrap();
    let operator = Arc::new(operator);
    let mut replies = JoinSet::new();
    let mut signals = 0;
    for _ in 0..100 {
        if !team.is_running() {
            break;
        }
        for _ in 0..3 {
            let robot = &robots[rng.random_range(0..robots.len())];
            let order = process_order(robot, 0.0, &mut rng);
            let operator = Arc::clone(&operator);
            let request =
                async move { query(&operator, ControlCommand::Fault(order)).await.is_ok() };
            replies.spawn_on(request, runtime.handle());
        }
        // The signal comes between the orders, after them, or while the world waits for processes.
        std::thread::sleep(Duration::from_millis(rng.random_range(0..60)));
        let robot = &robots[rng.random_range(0..robots.len())];
        team.try_signal_latest(robot, SIGNALS[rng.random_range(0..SIGNALS.len())]);
        signals += 1;
    }
    // Stopped robots continue, so that the run can end.
    for robot in &robots {
        team.try_signal_latest(robot, Signal::SIGCONT);
    }
    let finished = team.wait();
    let orders = runtime.block_on(replies.join_all());
    let status = finished.status.code();
    let is_over = matches!(status, Some(0 | 1));
    assert!(is_over, "seed {seed}: {}", finished.stderr);
    let accepted = orders.into_iter().filter(|is_accepted| *is_accepted);
    (accepted.count() as u64, signals)
}
