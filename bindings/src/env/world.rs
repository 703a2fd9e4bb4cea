//! One environment: a run, and the robots in it that do what somebody else decides.

use std::path::PathBuf;
use std::sync::Arc;

use alliance_proto::control::{AgentState, Phase};
use alliance_proto::event::EventLine;
use alliance_proto::ids::{BehaviorId, RobotId, TaskId};
use alliance_proto::log::{Document, LogLevel, Memory, Table};
use alliance_proto::mission::columns::ColumnKind;
use alliance_proto::mission::items::{Gripper, ItemsDeed};
use alliance_proto::mission::{Deed, Value};
use alliance_proto::readings::Readings;
use alliance_proto::scenario::Setup;
use alliance_proto::tick::Outcome;
use alliance_proto::time::SimTime;
use in_process::{Command, Spaces, Team, joins_of};
use launch::Registry;
use pyo3::prelude::*;
use robot_agent::allocator::Choice;
use world_server::recorder::{Folder, RecordError, Sink};

use super::features::{self, Row};
use super::puppet::{Hand, Hands, NAME, Puppets};
use crate::asked::Ready;
use crate::errors::{failed, mistake};
use crate::mind::Failure;

/// What is decided of a robot.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Level {
    /// Its behavior set.
    Decide,
    /// Its body.
    Drive,
}

/// Numbers of an action at level drive: speed, turn, gripper, deed.
pub const DRIVE: usize = 4;

/// Where the log of an episode goes.
pub enum Place {
    Nowhere(Memory),
    Folder(Folder),
}

impl Sink for Place {
    fn append(&mut self, table: Table, bytes: &[u8]) -> Result<(), RecordError> {
        match self {
            // What is logged at no level is not kept either: a long episode would fill the memory.
            Self::Nowhere(_) => Ok(()),
            Self::Folder(folder) => folder.append(table, bytes),
        }
    }

    fn replace(&mut self, document: Document, text: &str) -> Result<(), RecordError> {
        match self {
            Self::Nowhere(memory) => memory.replace(document, text),
            Self::Folder(folder) => folder.replace(document, text),
        }
    }
}

/// What all environments of a batch have in common.
pub struct Common {
    pub setup: Setup,
    registry: Registry,
    failure: Failure,
    pub level: Level,
    /// Most ticks of a step.
    period: u64,
    /// The robots that are decided for.
    pub agents: Vec<RobotId>,
    /// Numbers of an observation of each of them, the same for all.
    pub features: usize,
    /// The most sets that one of them has.
    pub sets: usize,
}

impl Common {
    /// The robots without a mind of their own are decided for.
    pub fn new(ready: Ready, level: Level, period_s: f64) -> PyResult<Self> {
        let Ready {
            setup,
            registry,
            failure,
        } = ready;
        let mission = setup.catalog.mission.name();
        if level == Level::Drive && !["waste", "push", "observe"].contains(&mission) {
            return Err(mistake(format!(
                "level: a robot of the mission '{mission}' cannot be driven; use 'decide', or waste, push or observe"
            )));
        }
        let robots = setup.scenario.robots.iter().zip(0..);
        let agents = robots.filter(|(robot, _)| setup.scenario.allocator_of(robot) == NAME);
        let agents: Vec<RobotId> = agents.map(|(_, rank)| RobotId(rank)).collect();
        let sets = |robot: &RobotId| {
            let robot = &setup.scenario.robots[robot.index()];
            setup.catalog.behaviors_of(robot).count()
        };
        let sets = agents.iter().map(sets).max().unwrap_or(0);
        let period = match level {
            Level::Decide => (period_s * 1000.0 / setup.scenario.step_ms as f64).round() as u64,
            Level::Drive => 1,
        };
        if period == 0 {
            let step_s = setup.scenario.step_ms as f64 / 1000.0;
            return Err(mistake(format!(
                "period_s: {period_s} is shorter than a step; it must be at least {step_s} s"
            )));
        }
        let mut common = Self {
            setup,
            registry,
            failure,
            level,
            period,
            agents,
            features: 0,
            sets,
        };
        common.features = common.names(0).len();
        Ok(common)
    }

    /// What the numbers of an agent's observation mean.
    pub fn names(&self, agent: usize) -> Vec<String> {
        let mut names = Vec::new();
        let Some(agent) = self.agents.get(agent) else {
            return names;
        };
        let hand = Hand {
            choices: self.sets_of(*agent).into_iter().map(unknown).collect(),
            ..Hand::default()
        };
        let row = &mut Row::new(&mut [], Some(&mut names));
        self.show(&Readings::default(), &hand, row);
        names
    }

    fn show(&self, readings: &Readings, hand: &Hand, row: &mut Row<'_>) {
        match self.level {
            Level::Decide => features::decide(row, hand, &self.setup, self.sets),
            Level::Drive => features::drive(row, readings, hand, &self.setup),
        }
    }

    /// The sets of a robot that is decided for, in the order of its actions from 1 on.
    pub fn sets_of(&self, agent: RobotId) -> Vec<BehaviorId> {
        let robot = &self.setup.scenario.robots[agent.index()];
        self.setup.catalog.behaviors_of(robot).collect()
    }
}

/// A set of which nothing is known yet.
fn unknown(behavior: BehaviorId) -> Choice {
    Choice {
        behavior,
        task: TaskId(0),
        round: SimTime::ZERO,
        applicable: false,
        cost_s: None,
        reward: 0.0,
        priority: 0,
        max_robots: 0,
    }
}

/// An environment.
pub struct World {
    team: Option<Team<Place>>,
    hands: Arc<Hands>,
    /// The sets of each agent.
    sets: Vec<Vec<BehaviorId>>,
    pub outcome: Option<Outcome>,
    /// Of the episode that has ended.
    pub hash: Option<String>,
    /// Where the log of the next episode goes.
    pub record: Option<PathBuf>,
    /// The row of mission.csv after the latest tick, and how much is done by it.
    row: Vec<Value>,
    done: u64,
    /// What has happened in the latest step.
    pub events: Vec<EventLine>,
    /// What was to be seen of the team when its episode ended.
    last: Last,
}

/// Where all robots are: x, y, m, and heading, rad, by rank; and the faults in force, in words.
#[derive(Clone, Default)]
struct Last {
    poses: Vec<[f32; 3]>,
    faults: Vec<String>,
}

impl World {
    pub fn new(common: &Common) -> Self {
        Self {
            team: None,
            hands: Arc::new(Hands::new(common.setup.scenario.robots.len())),
            sets: common.agents.iter().map(|it| common.sets_of(*it)).collect(),
            outcome: None,
            hash: None,
            record: None,
            row: Vec::new(),
            done: 0,
            events: Vec::new(),
            last: Last::default(),
        }
    }

    /// Begins an episode with that seed, and makes its first tick, in which nobody decides: so there is something to see.
    pub fn reset(&mut self, common: &Common, seed: u64, spaces: &mut Spaces) -> PyResult<()> {
        self.close()?;
        let (level, place) = match self.record.take() {
            None => (LogLevel::Off, Place::Nowhere(Memory::default())),
            Some(folder) => {
                let folder = Folder::create(folder).map_err(failed)?;
                (LogLevel::Full, Place::Folder(folder))
            }
        };
        let mut setup = common.setup.clone();
        setup.seed = seed;
        let puppets = || Arc::new(Puppets(Arc::clone(&self.hands)));
        let mut registry = common.registry.clone().kind(puppets());
        if level != LogLevel::Off {
            // No scenario tells again what is decided from outside: of a mind of its own the log keeps the answers.
            registry = registry.mind(puppets());
        }
        for agent in &common.agents {
            self.hands.of(*agent).wanted = None;
            if level != LogLevel::Off {
                let robot = &mut setup.scenario.robots[agent.index()];
                (robot.allocator, robot.mind) = (None, Some(NAME.to_owned()));
            }
        }
        let joins = joins_of(&setup);
        let mut team =
            Team::with_registry(&registry, setup, joins, level, place).map_err(mistake)?;
        // From now on they are told.
        team.take_events();
        (self.outcome, self.hash, self.done) = (None, None, 0);
        self.team = Some(team);
        if common.level == Level::Drive {
            for agent in &common.agents {
                self.drive(common, *agent, [0.0; DRIVE]);
            }
        }
        self.tick(common, spaces).map(drop)
    }

    /// Ends an episode that is under way, and its log.
    pub fn close(&mut self) -> PyResult<()> {
        match self.team.take() {
            Some(team) => {
                let outcome = self.outcome.unwrap_or(Outcome::Interrupted);
                team.end(outcome).map(drop).map_err(failed)
            }
            None => Ok(()),
        }
    }

    /// What each agent does from now on at level decide: 0 is to be idle, else the number of one of its sets, from 1.
    pub fn decide(&mut self, common: &Common, agent: usize, action: i64) -> PyResult<()> {
        let sets = &self.sets[agent];
        let wanted = match usize::try_from(action) {
            Ok(0) => None,
            Ok(number) if number <= sets.len() => Some(sets[number - 1]),
            _ => {
                let robot = common.setup.roster.name(common.agents[agent]);
                let most = sets.len();
                return Err(mistake(format!(
                    "action of '{robot}': {action} is out of range; it must be from 0 to {most}"
                )));
            }
        };
        let mut hand = self.hands.of(common.agents[agent]);
        hand.wanted = wanted;
        hand.has_ended = false;
        Ok(())
    }

    /// The same at level drive: speed, turn, gripper and deed, each from -1 to 1.
    pub fn drive(&mut self, common: &Common, agent: RobotId, action: [f32; DRIVE]) {
        let robot = &common.setup.scenario.robots[agent.index()];
        let body = common.setup.scenario.body_of(robot);
        let [speed, turn, gripper, deed] = action;
        let has_gripper = common.setup.catalog.mission.name() == "waste";
        let deed = has_gripper.then(|| {
            Deed::from(ItemsDeed {
                gripper: match gripper {
                    _ if gripper > 0.5 => Gripper::Pick,
                    _ if gripper < -0.5 => Gripper::Drop,
                    _ => Gripper::Keep,
                },
                report: deed > 0.5,
            })
        });
        if let Some(team) = &mut self.team {
            let command = Command {
                speed_m_s: speed.clamp(0.0, 1.0) * body.speed_m_s,
                turn_rad_s: turn.clamp(-1.0, 1.0) * body.turn_deg_s.to_radians(),
                deed,
            };
            team.drive(agent, Some(command));
        }
    }

    /// A step: ticks until the period is over, a set has ended, or the run; returns the team's reward.
    pub fn step(&mut self, common: &Common, spaces: &mut Spaces) -> PyResult<f64> {
        self.events.clear();
        if self.outcome.is_some() || self.team.is_none() {
            return Ok(0.0);
        }
        let mut reward = 0.0;
        for _ in 0..common.period {
            reward += self.tick(common, spaces)?;
            let mut agents = common.agents.iter();
            if self.outcome.is_some() || agents.any(|it| self.hands.of(*it).has_ended) {
                break;
            }
        }
        Ok(reward)
    }

    /// One tick; returns what the team gains in it: what is done, or where a mission counts nothing as done what its first column
    /// holds, times the seconds of the tick.
    fn tick(&mut self, common: &Common, spaces: &mut Spaces) -> PyResult<f64> {
        let Some(team) = &mut self.team else {
            return Ok(0.0);
        };
        team.exchange(spaces);
        let ticked = team.tick();
        team.exchange(spaces);
        self.outcome = ticked.map_err(failed)?;
        if let Some(error) = common.failure.take() {
            return Err(error);
        }
        self.events.append(&mut team.take_events());
        self.row.clear();
        team.simulation().world().mission().row(&mut self.row);
        let columns = common.setup.catalog.mission.terms().columns.iter();
        let all = columns.zip(&self.row);
        let counted = all.filter(|(column, _)| column.kind == ColumnKind::Done);
        let done = counted.map(|(_, value)| value.count()).reduce(|a, b| a + b);
        let Some(done) = done else {
            let first = self.row.first().and_then(|it| it.number());
            return Ok(first.unwrap_or(0.0) * common.setup.scenario.step_ms as f64 / 1000.0);
        };
        let gain = done as f64 - self.done as f64;
        self.done = done;
        Ok(gain)
    }

    /// After the last step of an episode, once all has been seen of it: ends its log.
    pub fn finish(&mut self) -> PyResult<()> {
        if let Some(outcome) = self.outcome
            && let Some(team) = self.team.take()
        {
            self.last = Last {
                poses: poses(&team),
                faults: faults(&team),
            };
            let (run, _) = team.end(outcome).map_err(failed)?;
            self.hash = run.hash;
        }
        Ok(())
    }

    /// The values of mission.csv, in the order of its columns.
    pub fn row(&self) -> impl Iterator<Item = Option<f64>> {
        self.row.iter().map(|value| value.number())
    }

    /// The faults that are in force, in words.
    pub fn faults(&self) -> Vec<String> {
        let last = || self.last.faults.clone();
        self.team.as_ref().map_or_else(last, faults)
    }

    /// Writes what an agent sees: zeros while it is dead.
    pub fn observe(&self, common: &Common, agent: usize, numbers: &mut [f32]) {
        let robot = common.agents[agent];
        let team = self.team.as_ref().filter(|_| self.is_alive(robot));
        let Some(team) = team else {
            return numbers.fill(0.0);
        };
        let readings = &team.simulation().message(robot).readings;
        common.show(
            readings,
            &self.hands.of(robot),
            &mut Row::new(numbers, None),
        );
    }

    /// Where all robots are: x, y, m, and heading, rad, by rank.
    pub fn poses(&self) -> Vec<[f32; 3]> {
        let last = || self.last.poses.clone();
        self.team.as_ref().map_or_else(last, poses)
    }

    /// Writes which actions an agent at level decide has: to be idle, and its applicable sets.
    pub fn mask(&self, common: &Common, agent: usize, mask: &mut [i8]) {
        let robot = common.agents[agent];
        mask.fill(0);
        mask[0] = 1;
        if self.is_alive(robot) {
            let hand = self.hands.of(robot);
            for (place, choice) in mask[1..].iter_mut().zip(&hand.choices) {
                *place = i8::from(choice.applicable);
            }
        }
    }

    /// Whether the robot has an agent that takes part.
    pub fn is_alive(&self, robot: RobotId) -> bool {
        let state = |team: &Team<Place>| team.simulation().agent_state(robot);
        self.team.as_ref().map(state) == Some(AgentState::Present)
    }
}

fn faults(team: &Team<Place>) -> Vec<String> {
    let statuses = team.simulation().faults().into_iter();
    let in_force = statuses.filter(|status| status.phase == Phase::InForce);
    in_force
        .map(|status| status.order.fault.to_string())
        .collect()
}

fn poses(team: &Team<Place>) -> Vec<[f32; 3]> {
    let simulation = team.simulation();
    let poses = simulation.barrier().robots().map(|robot| {
        let pose = simulation.world().pose(robot);
        [pose.position.x, pose.position.y, pose.heading_rad]
    });
    poses.collect()
}
