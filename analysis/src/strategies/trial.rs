//! One trial of the study: an instance with one strategy, in one process.

use missions::Registry;
use proto::tick::Outcome;
use run_log::{LogLevel, MemoryLog};
use scenario::{Scenario, Setup};

use super::condition::{Condition, Rule};
use super::instance::Instance;
use super::optimum;
use in_process::Team;

#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Trial {
    /// The end of the last task, s; `None` if the limit was reached first.
    pub time_s: Option<f64>,
    /// The least time, for a team without faults and with full information, s.
    pub least_time_s: f64,
    /// The energy of all robots, J: power times working time, including duplicate work.
    pub energy_j: f64,
    /// The least energy, J.
    pub least_energy_j: f64,
    /// The time at tasks that another robot already works on, robot-s.
    pub doubled_s: f64,
}

pub fn run_trial(condition: &Condition, rule: &Rule, seed: u64) -> anyhow::Result<Trial> {
    let instance = Instance::draw(condition, seed);
    let vocabulary = Registry::current().vocabulary();
    let text = instance.scenario(rule, condition.fault);
    let scenario = Scenario::parse("instance.toml", &text, &vocabulary)?;
    let setup = Setup {
        profile: instance.profile(),
        ..Setup::resolve(scenario, seed, None)?.setup
    };
    let mut team = Team::new(setup, LogLevel::Off, MemoryLog::default())?;
    let outcome = team.continue_for(u64::MAX, Outcome::TimeLimit, |_| {})?;
    let result = team.end(outcome)?.0.result;
    let worked_s = |robot: usize, figure: &str| {
        let figures = result.robots.get(&format!("r{robot}"));
        let worked_s = figures.and_then(|figures| figures.mission.get(figure).number());
        worked_s.unwrap_or(0.0)
    };
    let (mut energy_j, mut doubled_s) = (0.0, 0.0);
    for (robot, power_w) in instance.powers_w.iter().enumerate() {
        let surplus_s = worked_s(robot, "surplus_s");
        energy_j += power_w * (worked_s(robot, "work_s") + surplus_s);
        doubled_s += surplus_s;
    }
    let last_ms = result.mission.get("makespan_ms").number();
    Ok(Trial {
        time_s: last_ms
            .filter(|_| outcome == Outcome::Complete)
            .map(|ms| ms / 1000.0),
        least_time_s: f64::from(optimum::makespan_s(&instance)),
        energy_j,
        least_energy_j: optimum::energy_j(&instance),
        doubled_s,
    })
}
