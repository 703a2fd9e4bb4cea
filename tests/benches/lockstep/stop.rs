//! The rate of a team at full speed while one of its agents is stopped.

use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use cluster::rendezvous::ConnectionRole;
use cluster::session;
use nix::sys::signal::{Signal, kill};
use nix::unistd::Pid;
use proto::keys::KeyExpressions;
use proto::secret::Secret;
use proto::view::View;
use scenario::ids::Tick;
use zenoh::{Session, Wait};

use crate::figures::Figures;
use crate::real::{Memory, Run};
use crate::team::Team;

const TEAM: usize = 10;

/// The time after the start of a run before the measurement begins.
const WARM_UP: Duration = Duration::from_secs(3);

/// The longest measurement before and after the stop.
const ASIDE: Duration = Duration::from_secs(60);

/// A low speed and many items per spill, so that the mission outlasts the stop at any rate.
const SLOW_M_S: f64 = 0.05;
const ITEMS: usize = 1000;

/// A simulated time limit in s that is longer than any measurement.
const NO_LIMIT: f64 = 1e6;

/// The rates of the team before, during and after the stop, and of a team without that robot.
#[derive(Default)]
struct Results {
    before: Figures,
    during: Figures,
    after: Figures,
    without: Figures,
    kept: Figures,
    against_without: Figures,
    /// The memory of the world in MB, before the stop and at its end.
    memory: [Figures; 2],
}

/// Measures the team with the stop and the team without the robot in turn.
pub fn measure(rounds: usize, stop: Duration) {
    let [ten, nine] = [TEAM, TEAM - 1].map(|size| Team::busy(size, SLOW_M_S, ITEMS, NO_LIMIT));
    let mut results = Results::default();
    for _ in 0..rounds {
        let without = Watched::start(&nine).rate(stop.min(ASIDE));
        let ten = Watched::start(&ten);
        let world = ten.run.pid("world").unwrap();
        let before = ten.rate(stop.min(ASIDE));
        results.memory[0].push(Memory::of(world).resident);
        let last = Pid::from_raw(ten.run.pid(&format!("r{}", TEAM - 1)).unwrap() as i32);
        kill(last, Signal::SIGSTOP).unwrap();
        let during = ten.rate(stop);
        results.memory[1].push(Memory::of(world).resident);
        kill(last, Signal::SIGCONT).unwrap();
        let after = ten.rate(stop.min(ASIDE));

        results.before.push(before);
        results.during.push(during);
        results.after.push(after);
        results.without.push(without);
        results.kept.push(during / before);
        results.against_without.push(during / without);
    }
    println!(
        "\n## One of {TEAM} agents stopped for {} s\n",
        stop.as_secs()
    );
    println!("| | median [least .. most] |\n|---|---|");
    for (label, figures) in [
        ("before, ticks/s", &results.before),
        ("during, ticks/s", &results.during),
        ("after, ticks/s", &results.after),
        ("a team without it, ticks/s", &results.without),
        ("during / before", &results.kept),
        ("during / without", &results.against_without),
        ("memory of the world before, MB", &results.memory[0]),
        (
            "memory of the world at the end of the stop, MB",
            &results.memory[1],
        ),
    ] {
        println!("| {label} | {figures} |");
    }
}

struct Watched {
    run: Run,
    seen: Arc<Mutex<Option<(Tick, Instant)>>>,
    /// The session of the observer, kept open on the bus.
    _session: Session,
}

impl Watched {
    /// Starts a run, joins its bus and waits for the warm-up to pass.
    fn start(team: &Team) -> Self {
        let run = Run::start(team, &["--log=off", "--no-page"]);
        let world = wait_for(|| run.rendezvous());
        let config = zenoh::Config::from_json5(&session::client(
            &world.login(ConnectionRole::Operator).unwrap(),
            false,
        ))
        .unwrap();
        let session = zenoh::open(config).wait().unwrap();
        let seen = Arc::new(Mutex::new(None));
        let latest = Arc::clone(&seen);
        let (key, secret) = (
            KeyExpressions::new(&world.run).view(),
            Secret::from_token(&world.token),
        );
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
        wait_for(|| watched.latest().filter(|(tick, _)| *tick > 0));
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

pub fn wait_for<T>(mut look: impl FnMut() -> Option<T>) -> T {
    let until = Instant::now() + Duration::from_secs(30);
    loop {
        if let Some(found) = look() {
            return found;
        }
        assert!(Instant::now() < until, "the run does not begin");
        std::thread::sleep(Duration::from_millis(20));
    }
}
