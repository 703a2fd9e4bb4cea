//! Runs over several machines, which are hosts of a test network: real processes, real TLS, and network failures.

mod by_hand;
mod hostile;
mod outages;
mod returns;
mod started;
mod vanishes;
mod whole;

use std::fs;
use std::time::Duration;

use alliance_tests::harness::{Arguments, Finished, Lab, Process, join, wait_until};
use alliance_tests::hosts::Hosts;
use run_log::{Input, RunLog};

const WORLD: &str = "tls/10.0.0.1:7447";

/// The silence in s after which an agent counts as stalled: long for a busy machine, short for a test.
const STALL_AFTER: &str = "2";

/// The two robots that are on another host than the world in most tests.
const AWAY: [&str; 2] = ["gold", "green"];

/// Blue is with the world, and the other two robots on another host.
const TWO_HOSTS: [(&str, &[&str]); 2] = [("h1", &["blue"]), ("h2", &AWAY)];

/// The hosts of a team with its cluster file and keys.
struct Machines {
    hosts: Hosts,
    lab: Lab,
}

struct Run<'m> {
    machines: &'m Machines,
    launcher: Process,
}

impl Machines {
    /// Creates `count` hosts, of which `places` lists the robots. The world is on `h1`. Returns `None` as
    /// [`Hosts::enter`] does.
    #[track_caller]
    fn enter(count: u8, places: &[(&str, &[&str])]) -> Option<Self> {
        let hosts = Hosts::enter(count)?;
        let lab = Lab::new();
        let places = places.iter().map(|(host, robots)| {
            let at = hosts.address(host);
            format!("[[hosts]]\nname = {host:?}\nrobots = {robots:?}\nat = [\"{at}\"]\n")
        });
        let cluster = format!(
            "scenario = \"waste-cleanup\"\nlisten = {WORLD:?}\nkeys = \"keys\"\nworld = \"h1\"\n{}",
            places.collect::<String>()
        );
        lab.write("cluster.toml", cluster);
        lab.run("cluster keys cluster.toml").expect(0);
        Some(Self { hosts, lab })
    }

    fn use_scenario(&self, text: &str) {
        self.lab.write("scenario.toml", text);
        let cluster = self.lab.text("cluster.toml");
        let cluster = cluster.replace("waste-cleanup", "scenario.toml");
        self.lab.write("cluster.toml", cluster);
    }

    /// Copies the keys of these members to a new folder, as for another machine, and returns its name.
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

    /// Starts the daemon of the host `name` on host `on`. It ends with the run.
    fn daemon(&self, on: &str, name: &str, robots: &[&str]) -> Process {
        let mut members = vec![format!("host-{name}")];
        members.extend(robots.iter().map(|robot| format!("robot-{robot}")));
        let members: Vec<&str> = members.iter().map(String::as_str).collect();
        let keys = self.keys_of(&members);
        let host = format!("cluster host --name {name} --connect {WORLD} --keys {keys} --once");
        self.start(on, host)
    }

    fn start(&self, host: &str, arguments: impl Arguments) -> Process {
        self.lab.start_on(&self.hosts, host, arguments)
    }

    fn up(&self, arguments: impl Arguments) -> Run<'_> {
        let up = "cluster up cluster.toml --no-page --out run";
        Run {
            machines: self,
            launcher: self.start("h1", join(up, arguments)),
        }
    }

    /// Starts a run with gold and green on `h2`, and waits until they work.
    fn at_work(&self, arguments: &str) -> (Run<'_>, Process) {
        let daemon = self.daemon("h2", "h2", &AWAY);
        let mut run = self.up(format!("--limit 200 {arguments}"));
        run.wait_for("activated", &AWAY);
        (run, daemon)
    }

    /// Checks that the run in the folder `run` has the bytes of an undisturbed run on one machine.
    #[track_caller]
    fn assert_same_as_one_machine(&self, limit: &str) {
        let alone = format!("--in-process --limit {limit}");
        self.lab.mission("alone", alone).expect(1);
        let (run, alone) = (self.lab.log("run").run, self.lab.log("alone").run);
        assert!(!run.unscripted, "there must be no unscripted input");
        assert!(run.hash.is_some());
        assert_eq!(run.hash, alone.hash);
        self.lab.assert_same_bytes("run", "alone");
    }

    /// Checks the external inputs of gold and green, that blue only joined, and that a replay is identical.
    #[track_caller]
    fn assert_inputs(&self, expected: &[&str]) {
        let log = self.replayed_log();
        for robot in AWAY {
            assert_eq!(inputs_of(&log, robot), expected, "{robot}");
        }
        assert_eq!(inputs_of(&log, "blue"), ["joined 1"]);
    }

    /// Checks that a replay of the run is identical, and returns the log of the run.
    #[track_caller]
    fn replayed_log(&self) -> RunLog {
        self.lab.assert_repeated("run");
        self.lab.log("run")
    }
}

impl Run<'_> {
    /// Waits until an event of this kind has occurred for each of the robots.
    #[track_caller]
    fn wait_for(&mut self, kind: &str, robots: &[&str]) {
        self.wait_for_events(&format!("{kind} of {robots:?}"), |events| {
            let has = |robot: &&str| events.contains(&format!(",{kind},{robot},"));
            robots.iter().all(has)
        });
    }

    /// Waits until the text of the events fulfills the condition.
    #[track_caller]
    fn wait_for_events(&mut self, what: &str, condition: impl Fn(&str) -> bool) {
        let path = self.machines.lab.path("run/events.csv");
        let launcher = &mut self.launcher;
        wait_until(what, || {
            let events = fs::read_to_string(&path).unwrap_or_default();
            let found = condition(&events);
            let is_alive = found || launcher.is_running();
            assert!(is_alive, "ended:\n{}", launcher.stderr());
            found
        });
    }

    /// Waits until gold and green have their second incarnations.
    #[track_caller]
    fn wait_for_second_incarnations(&mut self) {
        for robot in AWAY {
            let joined = format!(",joined,{robot},");
            let row = [&*joined, "incarnation 2"];
            let lab = &self.machines.lab;
            lab.wait_for_row(&mut self.launcher, "events.csv", &row);
        }
    }

    /// Waits until `seconds` more of simulated time have passed.
    #[track_caller]
    fn run_for(&mut self, seconds: u64) {
        let until = self.now_ms() + 1000 * seconds;
        wait_until(&format!("simulated time {until} ms"), || {
            let is_running = self.launcher.is_running();
            assert!(is_running, "ended:\n{}", self.launcher.stderr());
            self.now_ms() >= until
        });
    }

    fn now_ms(&self) -> u64 {
        let path = self.machines.lab.path("run/poses.csv");
        let text = fs::read_to_string(path).unwrap_or_default();
        let whole = text.rfind('\n').map_or("", |end| &text[..end]);
        let last = whole.lines().last().unwrap_or_default();
        last.split(',').next().unwrap().parse().unwrap_or(0)
    }

    /// Sets the speed: `max`, or a factor such as `2x`.
    #[track_caller]
    fn pace(&self, speed: &str) {
        let clock = self.machines.start("h1", format!("clock speed {speed}"));
        clock.wait().expect(0);
    }

    /// Waits for the end of the run at its limit.
    #[track_caller]
    fn end(self) -> Finished {
        self.launcher.wait().expect(1)
    }

    /// Runs for a while, then at full speed to the end.
    #[track_caller]
    fn end_soon(mut self) {
        self.run_for(5);
        self.pace("max");
        self.end();
    }
}

/// Returns the external inputs about a robot, in order.
fn inputs_of(log: &RunLog, name: &str) -> Vec<String> {
    let mut lines = log.inputs().unwrap();
    lines.retain(|line| line.input.robot() == Some(name));
    let inputs = lines.into_iter().filter_map(|line| match line.input {
        Input::Join { incarnation, .. } => Some(format!("joined {incarnation}")),
        Input::Gone { incarnation, .. } => Some(format!("gone {incarnation}")),
        Input::StallBegin { .. } => Some("stalled".to_owned()),
        Input::StallEnd { .. } => Some("back".to_owned()),
        _ => None,
    });
    inputs.collect()
}

/// Waits by the wall clock, because a network needs real time.
fn sleep(seconds: u64) {
    std::thread::sleep(Duration::from_secs(seconds));
}
