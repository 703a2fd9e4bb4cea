//! The data that all environments of a batch share, and the form of their steps.

use std::sync::Arc;

use launch::Registry;
use missions::Randomised;
use proto::readings::Readings;
use pyo3::prelude::*;
use robot_agent::allocator::Choice;
use scenario::Setup;
use scenario::ids::{BehaviorId, RobotId, TaskId};
use scenario::time::SimTime;

use super::external_agent::{ExternalAgent, ExternalAgents, NAME};
use super::features::{self, Names, Row};
use super::interrupt::Interrupt;
use super::shaping::Shaping;
use crate::controller::FailureReaction;
use crate::errors::scenario_error;
use crate::request::PreparedRun;

/// The level of the external decisions.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Level {
    Decide,
    /// The body of a robot: speed, turn rate and gripper.
    Drive,
}

/// The length of a step, as the caller states it.
pub struct StepLength {
    pub period_s: Option<f64>,
    pub ticks: Option<u64>,
}

impl StepLength {
    /// The length of a step at level decide by default, s.
    const PERIOD_S: f64 = 1.0;

    /// Returns the largest number of ticks in a step.
    fn ticks(&self, level: Level, step_ms: u64) -> PyResult<u64> {
        let step_s = step_ms as f64 / 1000.0;
        match (self.ticks, self.period_s, level) {
            (Some(_), Some(_), _) => Err(scenario_error(
                "ticks and period_s: both state the length of a step; leave one out",
            )),
            (Some(0), ..) => Err(scenario_error("ticks: a step has at least 1")),
            (Some(ticks), ..) => Ok(ticks),
            (None, None, Level::Drive) => Ok(1),
            (None, period_s, _) => {
                let period_s = period_s.unwrap_or(Self::PERIOD_S);
                let ticks = (period_s / step_s).round();
                if ticks.is_nan() || ticks < 1.0 {
                    return Err(scenario_error(format!(
                        "period_s: {period_s} is shorter than a step; it must be at least {step_s} s"
                    )));
                }
                Ok(ticks as u64)
            }
        }
    }
}

/// The number of values in an action at level drive: speed, turn, gripper, report.
pub const DRIVE_ACTION_LEN: usize = 4;
/// The data that all environments of a batch share.
pub struct Common {
    pub setup: Setup,
    pub registry: Registry,
    pub failure: FailureReaction,
    /// The properties of the scenario that each episode draws from its seed.
    pub randomised: Randomised,
    pub shaping: Shaping,
    pub level: Level,
    pub interrupt: Interrupt,
    /// The largest number of ticks in a step.
    pub period: u64,
    /// The externally controlled robots.
    pub agents: Vec<RobotId>,
    /// True if the last picture of an episode is kept.
    pub renders: bool,
    /// True if each episode has a hash. Others have one only if they are recorded.
    pub hashes: bool,
    /// The number of values in an observation, the same for all agents.
    pub features: usize,
    /// The largest number of sets that an agent has.
    pub sets: usize,
}

impl Common {
    /// Creates the shared data. Robots without their own controller are externally controlled.
    pub fn new(
        ready: PreparedRun,
        level: Level,
        length: &StepLength,
        shaping: Shaping,
        (renders, hashes): (bool, bool),
    ) -> PyResult<Self> {
        let PreparedRun {
            setup,
            registry,
            failure,
            randomised,
        } = ready;
        let mission = setup.catalog.mission.name();
        if level == Level::Drive && !["waste", "push", "observe"].contains(&mission) {
            return Err(scenario_error(format!(
                "level: a robot of the mission '{mission}' cannot be driven; use 'decide', or waste, push or observe"
            )));
        }
        let robots = setup.scenario.robots.iter().zip(0..);
        let agents = robots.filter(|(robot, _)| setup.scenario.decider_of(robot) == NAME);
        let agents: Vec<RobotId> = agents.map(|(_, rank)| RobotId(rank)).collect();
        let sets = |robot: &RobotId| {
            let robot = &setup.scenario.robots[robot.index()];
            setup.catalog.behaviors_of(robot).count()
        };
        let sets = agents.iter().map(sets).max().unwrap_or(0);
        let period = length.ticks(level, setup.scenario.step_ms)?;
        let mut common = Self {
            setup,
            registry,
            failure,
            randomised,
            shaping,
            level,
            interrupt: Interrupt::default(),
            period,
            agents,
            renders,
            hashes,
            features: 0,
            sets,
        };
        common.features = common.names(0).len();
        Ok(common)
    }

    /// Returns the names of the values in an agent's observation.
    pub fn names(&self, agent: usize) -> Vec<String> {
        let Some(agent) = self.agents.get(agent) else {
            return Vec::new();
        };
        let external = ExternalAgent {
            choices: self.sets_of(*agent).into_iter().map(placeholder).collect(),
            ..ExternalAgent::default()
        };
        let mut names = Names::default();
        self.show(&Readings::default(), &external, &mut names);
        names.0
    }

    pub fn show(&self, readings: &Readings, external: &ExternalAgent, row: &mut impl Row) {
        match self.level {
            Level::Decide => features::decide(row, external, &self.setup, self.sets),
            Level::Drive => features::drive(row, readings, external, &self.setup),
        }
    }

    /// Checks the actions of all environments at level decide.
    pub fn check_decisions(&self, actions: &[i64]) -> PyResult<()> {
        let sets = |agent: &RobotId| self.sets_of(*agent).len();
        let most: Vec<usize> = self.agents.iter().map(sets).collect();
        let agents = self.agents.iter().zip(most).cycle();
        for (action, (agent, most)) in actions.iter().zip(agents) {
            if !usize::try_from(*action).is_ok_and(|number| number <= most) {
                let robot = self.setup.roster.name(*agent);
                return Err(scenario_error(format!(
                    "action of '{robot}': {action} is out of range; it must be from 0 to {most}"
                )));
            }
        }
        Ok(())
    }

    /// Returns empty data of all robots for a new environment.
    pub fn external_agents(&self) -> Arc<ExternalAgents> {
        let robots = self.setup.scenario.robots.len();
        Arc::new(ExternalAgents::new(robots))
    }

    /// Returns the sets of an externally controlled robot, in the order of its actions from 1 on.
    pub fn sets_of(&self, agent: RobotId) -> Vec<BehaviorId> {
        let robot = &self.setup.scenario.robots[agent.index()];
        self.setup.catalog.behaviors_of(robot).collect()
    }
}

/// Returns a placeholder for a set before the first step.
fn placeholder(behavior: BehaviorId) -> Choice {
    Choice {
        behavior,
        task: TaskId(0),
        round: SimTime::ZERO,
        applicable: false,
        cost_s: None,
        opens_in_s: 0.0,
        reward: 0.0,
        priority: 0,
        max_robots: 0,
    }
}
