//! Runs over several machines, each a host of the test's own network: real processes, real TLS, and a network that fails as networks do.

mod by_hand;
mod forged;
mod hostile;
mod outages;
mod returns;
mod started;
mod whole;

use std::fs;
use std::time::Duration;

use alliance_proto::log::{Input, RunLog};
use alliance_tests::hosts::Hosts;

use crate::harness::{Finished, Lab, Process, wait_until};

/// Where the world is reached.
const WORLD: &str = "tls/10.0.0.1:7447";

/// Silence for which an agent is left out, s: long for a busy machine, short for a test.
const STALL_AFTER: &str = "2";

/// Hosts of a team, with its cluster file, and with the keys of each.
struct Machines {
    hosts: Hosts,
    lab: Lab,
}

/// A run over them.
struct Run<'m> {
    machines: &'m Machines,
    launcher: Process,
}

impl Machines {
    /// So many hosts, of which these have these robots; the world is on `h1`. `None` as in [`Hosts::enter`].
    #[track_caller]
    fn enter(count: u8, places: &[(&str, &[&str])]) -> Option<Self> {
        let hosts = Hosts::enter(count)?;
        let lab = Lab::new();
        let places: String = places
            .iter()
            .map(|(host, robots)| {
                let at = hosts.address(host);
                format!("[[hosts]]\nname = {host:?}\nrobots = {robots:?}\nat = [\"{at}\"]\n")
            })
            .collect();
        let cluster = format!(
            "scenario = \"waste-cleanup\"\nlisten = {WORLD:?}\nkeys = \"keys\"\nworld = \"h1\"\n{places}"
        );
        fs::write(lab.path("cluster.toml"), cluster).unwrap();
        lab.run(&["keys", "cluster.toml"]).expect(0);
        Some(Self { hosts, lab })
    }

    /// From now on another scenario of the same team.
    fn of_scenario(&self, text: &str) {
        fs::write(self.lab.path("scenario.toml"), text).unwrap();
        let file = self.lab.path("cluster.toml");
        let cluster = fs::read_to_string(&file).unwrap();
        fs::write(file, cluster.replace("waste-cleanup", "scenario.toml")).unwrap();
    }

    /// A copy of the keys of these members alone, as somebody carries it to another machine.
    fn keys_of(&self, members: &[&str]) -> String {
        let name = format!("keys-{}", members.join("-"));
        let folder = self.lab.path(&name);
        if !folder.exists() {
            fs::create_dir(&folder).unwrap();
            let mut files = vec!["ca.pem".to_owned()];
            for member in members {
                files.extend(["pem", "key", "secret"].map(|end| format!("{member}.{end}")));
            }
            for file in files {
                fs::copy(self.lab.path("keys").join(&file), folder.join(&file)).unwrap();
            }
        }
        name
    }

    /// The daemon of the host of that name with these robots, on any host; it ends with the run.
    fn daemon(&self, on: &str, name: &str, robots: &[&str]) -> Process {
        let mut members = vec![format!("host-{name}")];
        members.extend(robots.iter().map(|robot| format!("robot-{robot}")));
        let members: Vec<&str> = members.iter().map(String::as_str).collect();
        let keys = self.keys_of(&members);
        self.start(
            on,
            &[
                "host",
                "--name",
                name,
                "--connect",
                WORLD,
                "--keys",
                &keys,
                "--once",
            ],
        )
    }

    /// The command with these arguments, on a host.
    fn start(&self, host: &str, arguments: &[&str]) -> Process {
        self.lab.start_on(&self.hosts, host, arguments)
    }

    /// World and launcher, with these further arguments.
    fn up(&self, arguments: &[&str]) -> Run<'_> {
        let common = ["cluster", "up", "cluster.toml", "--no-page", "--out", "run"];
        Run {
            machines: self,
            launcher: self.start("h1", &[&common, arguments].concat()),
        }
    }

    /// Asserts that the run in the folder `run` has the bytes of one on one machine, of that limit, in which nothing happened.
    #[track_caller]
    fn assert_as_alone(&self, limit: &str) {
        let arguments = ["--in-process", "--limit", limit];
        let alone = self.lab.mission("alone", &arguments).expect(1);
        drop(alone);
        let (run, alone) = (self.lab.log("run").run, self.lab.log("alone").run);
        assert!(!run.unscripted, "nobody did anything to it");
        assert!(run.hash.is_some());
        assert_eq!(run.hash, alone.hash);
        self.lab.assert_same_bytes("run", "alone");
    }

    /// Asserts that from outside this happened to gold and green, in order, to blue nothing, and that the run is repeated from that.
    #[track_caller]
    fn assert_fates(&self, expected: &[&str]) {
        let log = self.repeated();
        for robot in ["gold", "green"] {
            assert_eq!(fate(&log, robot), expected, "{robot}");
        }
        assert_eq!(fate(&log, "blue"), ["life 1"]);
    }

    /// The log of the run in the folder `run`, which is repeated from its inputs.
    #[track_caller]
    fn repeated(&self) -> RunLog {
        let replay = self.lab.run(&["replay", "run"]).expect(0);
        let said = &replay.stderr;
        assert!(said.starts_with("identical"), "{said}");
        self.lab.log("run")
    }
}

impl Run<'_> {
    /// Waits until this has happened to all these robots, so many times.
    #[track_caller]
    fn wait_for(&mut self, kind: &str, robots: &[&str], times: usize) {
        let path = self.machines.lab.path("run/events.csv");
        let launcher = &mut self.launcher;
        wait_until(&format!("{kind} of {robots:?}, {times} times"), || {
            let events = fs::read_to_string(&path).unwrap_or_default();
            let happened = robots
                .iter()
                .all(|robot| events.matches(&format!(",{kind},{robot},")).count() >= times);
            assert!(
                happened || launcher.is_running(),
                "ended without {kind} of {robots:?}:\n{}",
                launcher.stderr()
            );
            happened
        });
    }

    /// Waits until all these robots live for the second time.
    #[track_caller]
    fn wait_for_second_lives(&mut self, robots: &[&str]) {
        let lab = &self.machines.lab;
        for robot in robots {
            let joined = format!(",joined,{robot},");
            lab.wait_for_row(
                &mut self.launcher,
                "events.csv",
                &[&joined, "incarnation 2"],
            );
        }
    }

    /// Waits until so many further seconds of simulated time have passed, for those who are there.
    #[track_caller]
    fn go_on(&mut self, seconds: u64) {
        let until = self.now_ms() + 1000 * seconds;
        wait_until(&format!("simulated time {until} ms"), || {
            let is_running = self.launcher.is_running();
            assert!(is_running, "ended:\n{}", self.launcher.stderr());
            self.now_ms() >= until
        });
    }

    /// The latest simulated time in its log.
    fn now_ms(&self) -> u64 {
        let path = self.machines.lab.path("run/poses.csv");
        let text = fs::read_to_string(path).unwrap_or_default();
        let whole = text.rfind('\n').map_or("", |end| &text[..end]);
        let last = whole.lines().last().unwrap_or_default();
        last.split(',').next().unwrap().parse().unwrap_or(0)
    }

    /// From now on so fast: `max`, or such as `2x`.
    #[track_caller]
    fn pace(&self, speed: &str) {
        let clock = self.machines.start("h1", &["clock", "speed", speed]);
        clock.wait().expect(0);
    }

    /// Its end, at its limit.
    #[track_caller]
    fn end(self) -> Finished {
        self.launcher.wait().expect(1)
    }

    /// Goes on for a while, and is soon over.
    #[track_caller]
    fn end_soon(mut self) {
        self.go_on(5);
        self.pace("max");
        self.end();
    }
}

/// What came from outside to that robot, in order.
fn fate(log: &RunLog, robot: &str) -> Vec<String> {
    let lines = log.inputs().unwrap().into_iter();
    let words = lines.filter_map(|line| match line.input {
        Input::Join {
            robot, incarnation, ..
        } => Some((robot, format!("life {incarnation}"))),
        Input::Gone {
            robot, incarnation, ..
        } => Some((robot, format!("end of {incarnation}"))),
        Input::StallBegin { robot, .. } => Some((robot, "silent".to_owned())),
        Input::StallEnd { robot, .. } => Some((robot, "back".to_owned())),
        _ => None,
    });
    words
        .filter(|(whose, _)| whose == robot)
        .map(|(_, word)| word)
        .collect()
}

/// Waits by the clock on the wall: what a network does takes time.
fn sleep(seconds: u64) {
    std::thread::sleep(Duration::from_secs(seconds));
}
