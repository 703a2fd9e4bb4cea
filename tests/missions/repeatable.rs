//! The same scenario and seed give the same bytes on a busy machine, and other settings change them.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::JoinHandle;

use crate::harness::Lab;

/// The simulated time in s after which the whole team works.
const LIMIT: &str = "100";

/// Load on every core until the value is dropped.
struct BusyMachine {
    idle: Arc<AtomicBool>,
    threads: Vec<JoinHandle<()>>,
}

impl BusyMachine {
    fn new() -> Self {
        let idle = Arc::new(AtomicBool::new(false));
        let cores = std::thread::available_parallelism().unwrap().get();
        let threads = (0..cores)
            .map(|_| {
                let idle = Arc::clone(&idle);
                std::thread::spawn(move || {
                    while !idle.load(Ordering::Relaxed) {
                        std::hint::spin_loop();
                    }
                })
            })
            .collect();
        Self { idle, threads }
    }
}

impl Drop for BusyMachine {
    fn drop(&mut self) {
        self.idle.store(true, Ordering::Relaxed);
        for thread in self.threads.drain(..) {
            thread.join().unwrap();
        }
    }
}

/// Returns the hash of a run that ends at its time limit.
#[track_caller]
fn hash(lab: &Lab, out: &str, arguments: &[&str]) -> String {
    let mut all = vec!["--json"];
    all.extend(arguments);
    let result = lab.mission(out, &all).expect(1).json();
    assert_eq!(result["outcome"], "time-limit");
    assert_eq!(result["unscripted"], false);
    result["hash"].as_str().unwrap().to_owned()
}

#[test]
fn ten_runs_on_a_busy_machine_are_the_same_byte_for_byte() {
    let lab = Lab::new();
    let _busy = BusyMachine::new();
    let first = hash(&lab, "run-0", &["--limit", LIMIT]);
    for number in 1..10 {
        let out = format!("run-{number}");
        assert_eq!(hash(&lab, &out, &["--limit", LIMIT]), first, "{out}");
        lab.assert_same_bytes("run-0", &out);
        let run_file = |out: &str| std::fs::read(lab.path(out).join("run.json")).unwrap();
        assert!(run_file("run-0") == run_file(&out), "run.json of {out}");
    }
}

#[test]
fn neither_speed_nor_log_level_changes_the_hash() {
    let lab = Lab::new();
    let limit = ["--limit", "60"];
    let expected = hash(&lab, "plain", &limit);
    for (name, value) in [
        ("--speed", "max"),
        ("--speed", "20x"),
        ("--speed", "100x"),
        ("--log", "full"),
        ("--log", "summary"),
        ("--log", "off"),
    ] {
        let out = format!("{}-{value}", &name[2..]);
        let [limit, seconds] = limit;
        assert_eq!(
            hash(&lab, &out, &[limit, seconds, name, value]),
            expected,
            "{out}"
        );
    }
    lab.assert_same_bytes("plain", "speed-20x");
}

#[test]
fn in_order_steps_are_repeatable_and_give_another_run() {
    let lab = Lab::new();
    let limit = ["--limit", LIMIT, "--step-order"];
    let [name, seconds, order] = limit;
    let first = hash(&lab, "first", &[name, seconds, order, "in-order"]);
    assert_eq!(
        hash(&lab, "second", &[name, seconds, order, "in-order"]),
        first
    );
    lab.assert_same_bytes("first", "second");
    assert_ne!(
        hash(
            &lab,
            "simultaneous",
            &[name, seconds, order, "simultaneous"]
        ),
        first
    );
}

#[test]
fn another_seed_gives_another_run() {
    let lab = Lab::new();
    // The robots must sense items, whose positions depend on the seed.
    let first = hash(&lab, "seed-1", &["--limit", LIMIT, "--seed", "1"]);
    let second = hash(&lab, "seed-2", &["--limit", LIMIT, "--seed", "2"]);
    assert_ne!(first, second);
}
