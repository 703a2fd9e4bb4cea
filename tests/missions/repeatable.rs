//! The same scenario and seed give the same bytes on a busy machine.

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
        let threads = (0..cores).map(|_| {
            let idle = Arc::clone(&idle);
            std::thread::spawn(move || {
                while !idle.load(Ordering::Relaxed) {
                    std::hint::spin_loop();
                }
            })
        });
        let threads = threads.collect();
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

/// All runs are on a busy machine. Speed and log level do not change the hash, but seed and order do.
#[test]
fn runs_are_the_same_byte_for_byte_and_only_seed_and_order_change_them() {
    let lab = Lab::new();
    let _busy = BusyMachine::new();
    let hash = |out: &str, options: &str| {
        let result = lab.mission(out, format!("--json --limit {LIMIT} {options}"));
        let result = result.expect(1).json();
        assert_eq!(result["outcome"], "time-limit");
        assert_eq!(result["unscripted"], false);
        result["hash"].as_str().unwrap().to_owned()
    };
    let first = hash("first", "");
    for (out, options) in [("again", "--log compact"), ("paced", "--speed 40x")] {
        assert_eq!(hash(out, options), first, "{options}");
        lab.assert_same_bytes("first", out);
        let run_file = |out: &str| lab.bytes(&format!("{out}/run.json"));
        assert!(run_file("first") == run_file(out), "run.json of {out}");
    }
    assert_eq!(hash("full", "--log full"), first);
    assert_eq!(hash("summary", "--log summary"), first);
    assert_eq!(hash("off", "--log off"), first);
    // The robots must sense items, whose positions depend on the seed.
    assert_ne!(hash("other-seed", "--seed 2"), first);
    let in_order = hash("in-order", "--step-order in-order");
    assert_ne!(in_order, first);
    let one_process = "--step-order in-order --in-process";
    assert_eq!(hash("one-process", one_process), in_order);
}
