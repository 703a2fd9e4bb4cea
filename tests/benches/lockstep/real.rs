//! An `alliance run` in its own folder, observed from outside.

use missions::Registry;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, SystemTime, UNIX_EPOCH};

use cluster::rendezvous::Rendezvous;
use run_log::RunFile;
use tempfile::TempDir;

use crate::team::Team;

const EXECUTABLE: &str = env!("CARGO_BIN_EXE_alliance-under-test");

/// The interval between observations. It is long, so that observation costs little.
const INTERVAL: Duration = Duration::from_millis(200);

/// A running `alliance run`. It ends when the value is dropped.
pub struct Run {
    folder: TempDir,
    launcher: Child,
    started: SystemTime,
}

pub struct Finished {
    pub ticks_per_s: f64,
    /// The time from the start of `alliance run` to the first tick.
    pub start_s: f64,
    /// The time from the start of the world to the first tick.
    pub world_start_s: f64,
    pub running_s: f64,
    pub run: RunFile,
    /// The peak memory of any agent and of the world.
    pub agent: Memory,
    pub world: Memory,
    pub gateway: Memory,
}

/// The memory of a process in MB: the resident set, and the proportional share, which divides shared pages among
/// their processes.
#[derive(Clone, Copy, Debug, Default)]
pub struct Memory {
    pub resident: f64,
    pub share: f64,
}

impl Run {
    pub fn start(team: &Team, options: &[&str]) -> Self {
        Self::spawn(Command::new(EXECUTABLE), team, options)
    }

    /// Starts a run with all processes on one core.
    pub fn start_on(core: usize, team: &Team, options: &[&str]) -> Self {
        let mut command = Command::new("taskset");
        command.args(["-c", &core.to_string(), EXECUTABLE]);
        Self::spawn(command, team, options)
    }

    fn spawn(mut command: Command, team: &Team, options: &[&str]) -> Self {
        let folder = TempDir::new().unwrap();
        std::fs::write(folder.path().join("team.toml"), &team.text).unwrap();
        std::fs::create_dir(folder.path().join("runtime")).unwrap();
        let started = SystemTime::now();
        let launcher = command
            .args(["run", "team.toml", "--out=run"])
            .args(options)
            .current_dir(folder.path())
            .env("XDG_RUNTIME_DIR", folder.path().join("runtime"))
            .env_remove("RUST_LOG")
            .stdin(Stdio::null())
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .spawn()
            .unwrap();
        Self {
            folder,
            launcher,
            started,
        }
    }

    /// Returns the process id of "world" or of a robot's agent, once the process exists.
    pub fn pid(&self, part: &str) -> Option<u32> {
        self.parts()
            .find(|(name, _)| name == part)
            .map(|(_, pid)| pid)
    }

    /// Returns the rendezvous of the run's bus, once it is announced.
    pub fn rendezvous(&self) -> Option<Rendezvous> {
        let runs = std::fs::read_dir(self.folder.path().join("runtime/alliance")).ok()?;
        let announced = runs.flatten().find(|file| {
            file.path()
                .extension()
                .is_some_and(|extension| extension == "json")
        })?;
        serde_json::from_str(&std::fs::read_to_string(announced.path()).ok()?).ok()
    }

    /// Waits for the end of the run and returns its measurements.
    pub fn finish(mut self) -> Finished {
        let [mut agent, mut world, mut gateway] = [Memory::default(); 3];
        while self.launcher.try_wait().unwrap().is_none() {
            for (name, pid) in self.parts() {
                let seen = if name == "world" {
                    &mut world
                } else {
                    &mut agent
                };
                *seen = seen.max(Memory::of(pid));
                if name == "world" {
                    let child = children(pid).next();
                    gateway = gateway.max(child.map_or(Memory::default(), Memory::of));
                }
            }
            std::thread::sleep(INTERVAL);
        }
        let out = self.folder.path().join("run");
        let document = |name: &str| std::fs::read_to_string(out.join(name)).unwrap();
        let host: serde_json::Value = serde_json::from_str(&document("host.json")).unwrap();
        let number = |key: &str| host[key].as_f64().unwrap_or(f64::NAN);
        let began = self
            .started
            .duration_since(UNIX_EPOCH)
            .unwrap()
            .as_secs_f64();
        Finished {
            ticks_per_s: number("ticks_per_s"),
            start_s: number("started_unix_ms") / 1000.0 + number("start_to_first_tick_s") - began,
            world_start_s: number("start_to_first_tick_s"),
            running_s: number("running_s"),
            run: RunFile::parse(
                document("run.json").as_bytes(),
                &Registry::built_in().vocabulary(),
            )
            .unwrap(),
            agent,
            world,
            gateway,
        }
    }

    fn parts(&self) -> impl Iterator<Item = (String, u32)> {
        children(self.launcher.id()).filter_map(|pid| {
            let command = read(format!("/proc/{pid}/cmdline"));
            // The agents and the world are subcommands of `cluster`; the page is a command.
            let mut arguments = command
                .split('\0')
                .skip(1)
                .filter(|word| *word != "cluster");
            match arguments.next()? {
                "agent" => arguments.nth(1).map(|robot| (robot.to_owned(), pid)),
                part => Some((part.to_owned(), pid)),
            }
        })
    }
}

impl Drop for Run {
    fn drop(&mut self) {
        // The other processes end with the launcher.
        let _ = self.launcher.kill();
        let _ = self.launcher.wait();
    }
}

impl Memory {
    pub fn of(pid: u32) -> Self {
        let now = read(format!("/proc/{pid}/smaps_rollup"));
        let megabytes = |key: &str| {
            let line = now.lines().find_map(|line| line.strip_prefix(key));
            let number = line.and_then(|line| line.split_whitespace().next()?.parse::<f64>().ok());
            number.map_or(0.0, |kilobytes| kilobytes / 1024.0)
        };
        Self {
            resident: megabytes("Rss:"),
            share: megabytes("Pss:"),
        }
    }

    fn max(self, other: Self) -> Self {
        Self {
            resident: self.resident.max(other.resident),
            share: self.share.max(other.share),
        }
    }
}

/// Returns the child processes of all threads of a process.
fn children(pid: u32) -> impl Iterator<Item = u32> {
    let threads = std::fs::read_dir(format!("/proc/{pid}/task")).into_iter();
    let children = threads.flatten().flatten().map(|thread| {
        let children = read(thread.path().join("children"));
        let children = children.split_whitespace().map(str::parse);
        children.flatten().collect::<Vec<u32>>()
    });
    children.flatten()
}

/// Reads a file. Returns an empty text if the file is missing, because processes can end at any time.
fn read(path: impl AsRef<Path>) -> String {
    std::fs::read_to_string(path).unwrap_or_default()
}
