//! The same scenario and seed give the same bytes on a busy machine, and other settings change them.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::JoinHandle;

use alliance_tests::harness::Lab;

/// The simulated time in s after which the whole team works.
const LIMIT: &str = "80";

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
fn runs_on_a_busy_machine_are_the_same_byte_for_byte() {
    let lab = Lab::new();
    let _busy = BusyMachine::new();
    let first = hash(&lab, "run-0", &["--limit", LIMIT]);
    let run_file = |out: &str| std::fs::read(lab.path(out).join("run.json")).unwrap();
    for out in ["run-1", "run-2"] {
        assert_eq!(hash(&lab, out, &["--limit", LIMIT]), first, "{out}");
        lab.assert_same_bytes("run-0", out);
        assert!(run_file("run-0") == run_file(out), "run.json of {out}");
    }
}

#[test]
fn neither_speed_nor_log_level_changes_the_hash_but_seed_and_order_do() {
    let lab = Lab::new();
    let run = |name: &str, value: &str| {
        let out = format!("{}-{value}", &name[2..]);
        hash(&lab, &out, &["--limit", LIMIT, name, value])
    };
    let expected = run("--log", "full");
    for (name, value) in [("--speed", "40x"), ("--log", "summary"), ("--log", "off")] {
        assert_eq!(run(name, value), expected, "{name} {value}");
    }
    lab.assert_same_bytes("log-full", "speed-40x");
    // The robots must sense items, whose positions depend on the seed.
    assert_ne!(run("--seed", "2"), expected);
    let in_order = run("--step-order", "in-order");
    assert_ne!(in_order, expected);
    let again = ["--limit", LIMIT, "--step-order", "in-order", "--in-process"];
    assert_eq!(hash(&lab, "again", &again), in_order);
}
