//! The rate of a team at full speed while one of its agents is stopped.

use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use alliance_tests::harness::{Lab, wait_until};
use alliance_tests::operator::{announced, connect, peak_memory};
use cluster::rendezvous::ConnectionRole;
use nix::sys::signal::Signal;
use proto::keys::KeyExpressions;
use proto::secret::Secret;
use proto::view::View;
use scenario::ids::Tick;
use zenoh::{Session, Wait};

use crate::figures::{Figures, print};
use crate::mission::Mission;
use crate::real::Run;

const TEAM: usize = 10;

/// The time after the start of a run before the measurement begins.
const WARM_UP: Duration = Duration::from_secs(3);

/// The longest measurement before and after the stop.
const ASIDE: Duration = Duration::from_secs(60);

/// The labels of the measured figures.
const LABELS: [&str; 8] = [
    "before, ticks/s",
    "during, ticks/s",
    "after, ticks/s",
    "a team without it, ticks/s",
    "during / before",
    "during / without",
    "memory of the world before, MB",
    "memory of the world at the end of the stop, MB",
];

/// Measures the team with the stop and the team without the robot in turn.
pub fn measure(rounds: usize, stop: Duration) {
    // A low speed, many items per spill and a long limit, so that the mission outlasts the stop at any rate.
    let [ten, nine] = [TEAM, TEAM - 1].map(|size| Mission::busy(size, 0.05, 1000, 1e6));
    let mut results = LABELS.map(|_| Figures::default());
    for _ in 0..rounds {
        let lab = Lab::new();
        let without = Watched::start(&lab, &nine).rate(stop.min(ASIDE));
        let lab = Lab::new();
        let ten = Watched::start(&lab, &ten);
        let memory = || peak_memory(ten.run.team.pid("world")).unwrap();
        let last = format!("r{}", TEAM - 1);
        let (before, memory_before) = (ten.rate(stop.min(ASIDE)), memory());
        ten.run.team.signal(&last, Signal::SIGSTOP);
        let (during, memory_after) = (ten.rate(stop), memory());
        ten.run.team.signal(&last, Signal::SIGCONT);
        let after = ten.rate(stop.min(ASIDE));
        let ratios = [during / before, during / without];
        let values = [before, during, after, without].into_iter().chain(ratios);
        let values = values.chain([memory_before, memory_after]);
        for (figures, value) in results.iter_mut().zip(values) {
            figures.push(value);
        }
    }
    let stop_s = stop.as_secs();
    println!("\n## One of {TEAM} agents stopped for {stop_s} s\n");
    print(LABELS.map(str::to_owned).into_iter().zip(&results));
}

type Seen = Arc<Mutex<Option<(Tick, Instant)>>>;

struct Watched<'l> {
    run: Run<'l>,
    seen: Seen,
    /// The session of the observer, kept open on the bus.
    _session: Session,
}

impl<'l> Watched<'l> {
    /// Starts a run, joins its bus and waits for the warm-up to pass.
    fn start(lab: &'l Lab, mission: &Mission) -> Self {
        let run = Run::start(lab, mission, "--log=off --no-page");
        let world = announced(lab);
        let session = connect(&world, ConnectionRole::Operator);
        let seen = Seen::default();
        let latest = Arc::clone(&seen);
        let key = KeyExpressions::new(&world.run).view();
        let secret = Secret::from_token(&world.token);
        session
            .declare_subscriber(key.clone())
            .callback(move |sample| {
                let view: View = secret.open(&key, &sample.payload().to_bytes()).unwrap();
                *latest.lock().unwrap() = Some((view.tick, Instant::now()));
            })
            .background()
            .wait()
            .unwrap();
        let watched = Self {
            run,
            seen,
            _session: session,
        };
        wait_until("the first tick", || {
            watched.latest().is_some_and(|(tick, _)| tick > 0)
        });
        std::thread::sleep(WARM_UP);
        watched
    }

    /// Returns the ticks per second during the next `length`.
    fn rate(&self, length: Duration) -> f64 {
        let (from, began) = self.latest().unwrap();
        std::thread::sleep(length);
        let (to, ended) = self.latest().unwrap();
        (to - from) as f64 / (ended - began).as_secs_f64()
    }

    fn latest(&self) -> Option<(Tick, Instant)> {
        *self.seen.lock().unwrap()
    }
}
