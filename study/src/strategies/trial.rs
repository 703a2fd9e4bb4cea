//! An instance of the abstract study by one strategy, in one process.

use alliance_proto::log::{LogLevel, Memory};
use alliance_proto::scenario::{Scenario, Setup};
use alliance_proto::tick::Outcome;
use missions::Registry;

use super::design::{Condition, Rule};
use super::instance::Instance;
use super::optimum;
use crate::in_process::Team;

/// What came of it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Trial {
    /// When the last task was done, s; `None`: some were not within the limit.
    pub time_s: Option<f64>,
    /// The least time, of a team without mishaps that knows it all, s.
    pub least_time_s: f64,
    /// By each robot its power times the time that it worked, in vain or not, J.
    pub energy_j: f64,
    /// The least energy, J.
    pub least_energy_j: f64,
    /// How long robots were at work where others were already, robot-s.
    pub wasted_s: f64,
}

/// Runs the instance of a seed.
///
/// # Errors
/// When it cannot be run.
pub fn attempt(condition: &Condition, rule: &Rule, seed: u64) -> anyhow::Result<Trial> {
    let instance = Instance::draw(condition, seed);
    let vocabulary = Registry::of_this_program().vocabulary();
    let text = instance.scenario(rule, condition.mishap);
    let scenario = Scenario::parse("instance.toml", &text, &vocabulary)?;
    let setup = Setup {
        profile: instance.profile(),
        ..Setup::resolve(scenario, seed, None)?.setup
    };
    let mut team = Team::new(setup, LogLevel::Off, Memory::default())?;
    let outcome = team.go_on_for(u64::MAX, Outcome::TimeLimit, |_| {})?;
    let result = team.end(outcome)?.0.result;
    let energy_j = (0..)
        .zip(&instance.powers_w)
        .map(|(robot, power_w): (usize, _)| {
            let figures = result.robots.get(&format!("r{robot}"));
            let worked_s = figures.map_or(0.0, |figures| {
                let second = |name| figures.mission.get(name).number().unwrap_or(0.0);
                second("work_s") + second("wasted_s")
            });
            power_w * worked_s
        });
    let last_ms = result.mission.get("makespan_ms").number();
    Ok(Trial {
        time_s: last_ms
            .filter(|_| outcome == Outcome::Complete)
            .map(|ms| ms / 1000.0),
        least_time_s: f64::from(optimum::makespan_s(&instance)),
        energy_j: energy_j.sum(),
        least_energy_j: optimum::energy_j(&instance),
        wasted_s: result.mission.get("wasted_robot_s").number().unwrap_or(0.0),
    })
}
