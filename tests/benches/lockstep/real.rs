//! An `alliance run` in its own folder, observed from outside.

use std::time::{Duration, SystemTime, UNIX_EPOCH};

use alliance_tests::harness::{Lab, join};
use alliance_tests::operator::{child_of, peak_memory};
use alliance_tests::team::Team;

use crate::mission::Mission;

/// The interval between observations. It is long, so that observation costs little.
const INTERVAL: Duration = Duration::from_millis(200);

/// A running `alliance run`. It ends when the value is dropped.
pub struct Run<'l> {
    lab: &'l Lab,
    pub team: Team<'l>,
    started: SystemTime,
}

pub struct Finished {
    pub ticks_per_s: f64,
    /// The time from the start of `alliance run` to the first tick.
    pub start_s: f64,
    pub running_s: f64,
    pub simulated_s: f64,
    pub hash: Option<String>,
    /// The peak resident memory of any agent, of the world and of its gateway, MB.
    pub agent: f64,
    pub world: f64,
    pub gateway: f64,
}

impl<'l> Run<'l> {
    pub fn start(lab: &'l Lab, mission: &Mission, options: &str) -> Self {
        lab.write("team.toml", &mission.text);
        let started = SystemTime::now();
        Self {
            lab,
            team: Team::start_with_page(lab, join("team.toml", options)),
            started,
        }
    }

    /// Waits for the end of the run and returns its measurements.
    pub fn finish(mut self) -> Finished {
        let (mut agent, mut world, mut gateway) = (0.0_f64, 0.0_f64, 0.0_f64);
        let peak = |pid: Option<u32>| pid.and_then(peak_memory).unwrap_or_default();
        let robots = self.team.robots();
        let pid = self.team.pid("world");
        while self.team.is_running() {
            for robot in &robots {
                agent = agent.max(peak(Some(self.team.pid(robot))));
            }
            world = world.max(peak(Some(pid)));
            gateway = gateway.max(peak(child_of(pid)));
            std::thread::sleep(INTERVAL);
        }
        let host = self.lab.json("run/host.json");
        let number = |key: &str| host[key].as_f64().unwrap_or(f64::NAN);
        let began = self.started.duration_since(UNIX_EPOCH).unwrap();
        let first_tick_s = number("started_unix_ms") / 1000.0 + number("start_to_first_tick_s");
        let run = self.lab.log("run").run;
        Finished {
            ticks_per_s: number("ticks_per_s"),
            start_s: first_tick_s - began.as_secs_f64(),
            running_s: number("running_s"),
            simulated_s: run.result.sim_time_ms.as_secs_f64(),
            hash: run.hash,
            agent,
            world,
            gateway,
        }
    }
}

/// Returns the processor time of all ended child processes that were waited for, in s. Processor time depends little
/// on the load of the machine.
pub fn cpu_of_ended_children_s() -> f64 {
    /// The clock ticks per second in which Linux counts processor time.
    const HZ: f64 = 100.0;
    let stat = std::fs::read_to_string("/proc/self/stat").unwrap();
    // The process name, in brackets, may contain spaces. The 14th and 15th field after it are the children's user and
    // system time.
    let (_, fields) = stat.rsplit_once(')').unwrap();
    let times = fields.split_whitespace().skip(13).take(2);
    times.map(|ticks| ticks.parse::<f64>().unwrap() / HZ).sum()
}
