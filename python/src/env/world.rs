//! One environment: a run in which external agents control some robots.

use std::path::PathBuf;
use std::sync::Arc;

use analysis::{Pixels, draw_view};
use in_process::{BodyCommand, Team, Workspaces, joins_of};
use prefetch::{Layer, prefetch};
use proto::control::{AgentState, Phase};
use proto::event::EventLine;
use proto::mission::Action;
use proto::mission::items::{Gripper, ItemsAction};
use proto::tick::Outcome;
use proto::view::View;
use pyo3::prelude::*;
use run_log::recorder::{Folder, RecordError, Sink};
use run_log::{Document, LogLevel, Table};
use scenario::Setup;
use scenario::ids::{BehaviorId, RobotId};
use scenario::mission::FigureValue;
use scenario::mission::columns::ColumnKind;

use super::common::{Common, DRIVE_ACTION_LEN, Level};
use super::external_agent::{self, ExternalAgents, NAME};
use super::features::Numbers;
use super::interrupt::Watch;
use crate::errors::{alliance_error, scenario_error};

/// The destination of an episode's log.
pub enum Place {
    Nowhere,
    Folder(Folder),
}

impl Sink for Place {
    fn append(&mut self, table: Table, bytes: &[u8]) -> Result<(), RecordError> {
        match self {
            Self::Nowhere => Ok(()),
            Self::Folder(folder) => folder.append(table, bytes),
        }
    }

    fn replace(&mut self, document: Document, text: &str) -> Result<(), RecordError> {
        match self {
            Self::Nowhere => Ok(()),
            Self::Folder(folder) => folder.replace(document, text),
        }
    }
}
/// An environment with at most one episode in progress.
pub struct Environment {
    team: Option<Team<Place>>,
    external_agents: Arc<ExternalAgents>,
    sets: Vec<Vec<BehaviorId>>,
    pub outcome: Option<Outcome>,
    /// The hash of the last ended episode.
    pub hash: Option<String>,
    /// The folder for the log of the next episode, if it is recorded.
    pub record: Option<PathBuf>,
    /// True if the current episode has a log.
    is_recorded: bool,
    /// The row of mission.csv after the latest tick, and the amount of completed work in it.
    row: Vec<FigureValue>,
    done: u64,
    pub events: Vec<EventLine>,
    /// The state of the team at the end of its episode.
    final_state: FinalState,
}

/// The poses of all robots (x, y, m, and heading, rad) by rank, and the descriptions of the faults in force.
#[derive(Clone, Default)]
struct FinalState {
    poses: Vec<[f32; 3]>,
    faults: Vec<String>,
    /// The setup of the episode and the view for a picture, if pictures are drawn.
    picture: Option<Box<(Setup, View)>>,
}

impl Environment {
    pub fn new(common: &Common) -> Self {
        Self {
            team: None,
            external_agents: common.external_agents(),
            sets: common
                .agents
                .iter()
                .map(|agent| common.sets_of(*agent))
                .collect(),
            outcome: None,
            hash: None,
            record: None,
            is_recorded: false,
            row: Vec::new(),
            done: 0,
            events: Vec::new(),
            final_state: FinalState::default(),
        }
    }

    /// Starts an episode and executes its first tick without external decisions, so that there is an observation.
    pub fn reset(&mut self, common: &Common, seed: u64, spaces: &mut Workspaces) -> PyResult<()> {
        self.close()?;
        let (level, place) = match self.record.take() {
            None => (LogLevel::Off, Place::Nowhere),
            Some(folder) => {
                let folder = Folder::create(folder).map_err(alliance_error)?;
                (LogLevel::Full, Place::Folder(folder))
            }
        };
        let drawn = common
            .randomised
            .draw_setup(&common.setup, seed, &common.registry);
        let mut setup = drawn.map_err(scenario_error)?;
        let allocators = || external_agent::kind(common.level, Arc::clone(&self.external_agents));
        let mut registry = common.registry.clone().with_allocator_kind(allocators());
        if level != LogLevel::Off {
            // The log keeps the answers of external controllers. The decisions come from outside, so a replay needs
            // them.
            registry = registry.with_controller(allocators());
        }
        for agent in &common.agents {
            self.external_agents.lock()[agent.index()].wanted = None;
            if level != LogLevel::Off {
                let robot = &mut setup.scenario.robots[agent.index()];
                (robot.allocator, robot.controller) = (None, Some(NAME.to_owned()));
            }
        }
        let joins = joins_of(&setup);
        let mut team =
            Team::with_registry(&registry, setup, joins, level, place).map_err(scenario_error)?;
        // Earlier events are discarded.
        team.take_events();
        if !common.hashes && level == LogLevel::Off {
            team.omit_hash();
        }
        (self.outcome, self.hash, self.done) = (None, None, 0);
        self.is_recorded = level != LogLevel::Off;
        self.team = Some(team);
        if common.level == Level::Drive {
            for agent in &common.agents {
                self.drive(common, *agent, [0.0; DRIVE_ACTION_LEN]);
            }
        }
        self.tick(common, spaces).map(drop)
    }

    /// Requests the memory of a layer for the next step, see [`prefetch`](mod@prefetch).
    pub fn prefetch(&self, layer: Layer) {
        match layer {
            Layer::Fields => {
                prefetch(&self.external_agents);
                prefetch(&self.outcome);
                prefetch(&self.row);
                prefetch(&self.events);
            }
            Layer::Lists => prefetch(&*self.row),
            Layer::Elements | Layer::Contents => {}
        }
        self.external_agents.prefetch(layer);
        if let Some(team) = &self.team {
            team.prefetch(layer);
        }
    }

    /// Returns a copy with the same state, whose next episode is not recorded.
    ///
    /// # Errors
    /// If the episode is recorded, because its log exists once, or if a controller in Python cannot be copied.
    pub fn copied(&self, common: &Common) -> PyResult<Self> {
        let external_agents = common.external_agents();
        external_agents.copy_from(&self.external_agents);
        let kind = external_agent::kind(common.level, Arc::clone(&external_agents));
        let registry = common.registry.clone().with_allocator_kind(kind);
        let copy = |team: &Team<Place>| {
            let copied = team.copied(&registry, &common.agents, Place::Nowhere);
            copied.ok_or_else(|| {
                alliance_error("a recorded episode cannot be copied; copy one without a log")
            })
        };
        let team = self.team.as_ref().map(copy).transpose()?;
        if let Some(error) = common.failure.take() {
            return Err(error);
        }
        Ok(Self {
            team,
            external_agents,
            sets: self.sets.clone(),
            outcome: self.outcome,
            hash: self.hash.clone(),
            record: None,
            is_recorded: false,
            row: self.row.clone(),
            done: self.done,
            events: self.events.clone(),
            final_state: self.final_state.clone(),
        })
    }

    pub fn close(&mut self) -> PyResult<()> {
        match self.team.take() {
            Some(team) if self.is_recorded => {
                let outcome = self.outcome.unwrap_or(Outcome::Interrupted);
                team.end(outcome).map(drop).map_err(alliance_error)
            }
            _ => Ok(()),
        }
    }

    /// Sets the action of an agent at level decide: 0 for idle, or the number of one of its sets, from 1. The batch has
    /// checked the range.
    pub fn decide(&mut self, common: &Common, agent: usize, action: i64) {
        let number = usize::try_from(action).unwrap_or(0);
        let set = number.checked_sub(1);
        let external = &mut self.external_agents.lock()[common.agents[agent].index()];
        external.wanted = set.and_then(|set| self.sets[agent].get(set)).copied();
        external.has_ended = false;
    }

    /// Sets the action of an agent at level drive: speed, turn, gripper and report, each from -1 to 1.
    pub fn drive(&mut self, common: &Common, agent: RobotId, action: [f32; DRIVE_ACTION_LEN]) {
        let robot = &common.setup.scenario.robots[agent.index()];
        let body = common.setup.scenario.body_of(robot);
        let [speed, turn, gripper, report] = action;
        let has_gripper = common.setup.catalog.mission.name() == "waste";
        let action = has_gripper.then(|| {
            Action::from(ItemsAction {
                gripper: match gripper {
                    _ if gripper > 0.5 => Gripper::Pick,
                    _ if gripper < -0.5 => Gripper::Drop,
                    _ => Gripper::Keep,
                },
                report: report > 0.5,
            })
        });
        if let Some(team) = &mut self.team {
            let command = BodyCommand {
                speed_m_s: speed.clamp(0.0, 1.0) * body.speed_m_s,
                turn_rad_s: turn.clamp(-1.0, 1.0) * body.turn_deg_s.to_radians(),
                action,
            };
            team.drive(agent, Some(command));
        }
    }

    /// Executes ticks until the period is over, a set has ended, or the run has ended. Returns the reward of the team.
    pub fn step(
        &mut self,
        common: &Common,
        spaces: &mut Workspaces,
        watch: &mut Watch,
    ) -> PyResult<f64> {
        self.events.clear();
        if self.outcome.is_some() || self.team.is_none() {
            return Ok(0.0);
        }
        let start = self.team.as_ref().map(|team| {
            let shaping = &common.shaping;
            (
                team.simulation().tick(),
                shaping.begin(team.simulation(), &common.agents),
            )
        });
        let mut reward = 0.0;
        for _ in 0..common.period {
            watch.count(1, &common.interrupt)?;
            reward += self.tick(common, spaces)?;
            if self.outcome.is_some() || self.has_ended(common) {
                break;
            }
        }
        let (Some(team), Some((tick, start))) = (&self.team, start) else {
            return Ok(reward);
        };
        let ticks = team.simulation().tick() - tick;
        let step_s = ticks as f64 * common.setup.scenario.step_ms as f64 / 1000.0;
        let (shaping, agents) = (&common.shaping, &common.agents);
        Ok(shaping.reward(&start, team.simulation(), agents, step_s, reward))
    }

    /// Returns whether the chosen set of an agent has ended by itself in this step. A driven robot has no set.
    fn has_ended(&self, common: &Common) -> bool {
        common.level == Level::Decide && {
            let external = self.external_agents.lock();
            let mut agents = common.agents.iter();
            agents.any(|agent| external[agent.index()].has_ended)
        }
    }

    /// Executes one tick and returns the reward of the team. The reward is the increase of the completed work. If the
    /// mission counts no completed work, it is the first column times the duration of the tick, s.
    fn tick(&mut self, common: &Common, spaces: &mut Workspaces) -> PyResult<f64> {
        let Some(team) = &mut self.team else {
            return Ok(0.0);
        };
        team.swap_workspaces(spaces);
        let ticked = team.tick();
        team.swap_workspaces(spaces);
        self.outcome = ticked.map_err(alliance_error)?;
        if let Some(error) = common.failure.take() {
            return Err(error);
        }
        self.events.append(&mut team.take_events());
        self.row.clear();
        team.simulation().world().mission().row(&mut self.row);
        let columns = common.setup.catalog.mission.vocabulary().columns.iter();
        let all = columns.zip(&self.row);
        let counted = all.filter(|(column, _)| column.kind == ColumnKind::Done);
        let done = counted.map(|(_, value)| value.count()).reduce(|a, b| a + b);
        let Some(done) = done else {
            let first = self.row.first().and_then(|value| value.number());
            return Ok(first.unwrap_or(0.0) * common.setup.scenario.step_ms as f64 / 1000.0);
        };
        let gain = done as f64 - self.done as f64;
        self.done = done;
        Ok(gain)
    }

    /// Ends the log of an ended episode. Call it after all observations have been read.
    pub fn finish(&mut self, common: &Common) -> PyResult<()> {
        if let Some(outcome) = self.outcome
            && let Some(team) = self.team.take()
        {
            self.final_state = FinalState {
                poses: poses(&team),
                faults: faults(&team),
                picture: common.renders.then(|| {
                    let setup = team.simulation().setup().clone();
                    Box::new((setup, team.view()))
                }),
            };
            if common.hashes || self.is_recorded {
                let (run, _) = team.end(outcome).map_err(alliance_error)?;
                self.hash = run.hash;
            }
        }
        Ok(())
    }

    /// Returns the values of mission.csv, in column order.
    pub fn row(&self) -> impl Iterator<Item = Option<f64>> {
        self.row.iter().map(|value| value.number())
    }

    pub fn faults(&self) -> Vec<String> {
        let ended = || self.final_state.faults.clone();
        self.team.as_ref().map_or_else(ended, faults)
    }

    /// Writes for each agent whether its robot takes part, its observation, and at level decide the available actions:
    /// idle, and the applicable sets. The observation of a robot that does not take part is zero, and it can only idle.
    pub fn observe(
        &self,
        common: &Common,
        alive: &mut [i8],
        observation: &mut [f32],
        mask: &mut [i8],
    ) {
        let external = self.external_agents.lock();
        let observations = observation.chunks_exact_mut(common.features.max(1));
        let masks = mask.chunks_exact_mut(common.sets + 1);
        let rows = alive.iter_mut().zip(observations).zip(masks);
        for (robot, ((alive, numbers), mask)) in common.agents.iter().zip(rows) {
            let external = &external[robot.index()];
            let takes_part =
                |team: &&Team<Place>| team.simulation().agent_state(*robot) == AgentState::Present;
            let team = self.team.as_ref().filter(takes_part);
            *alive = i8::from(team.is_some());
            match team {
                Some(team) => {
                    let readings = &team.simulation().message(*robot).readings;
                    common.show(readings, external, &mut Numbers(numbers));
                }
                None => numbers.fill(0.0),
            }
            if common.level == Level::Decide {
                mask.fill(0);
                mask[0] = 1;
                let choices = external.choices.iter().filter(|_| team.is_some());
                for (place, choice) in mask[1..].iter_mut().zip(choices) {
                    *place = i8::from(choice.applicable);
                }
            }
        }
    }

    /// Returns the poses of all robots by rank: x, y, m, and heading, rad.
    pub fn poses(&self) -> Vec<[f32; 3]> {
        let ended = || self.final_state.poses.clone();
        self.team.as_ref().map_or_else(ended, poses)
    }

    /// Draws the room at this width, px. Returns `None` before the first episode.
    pub fn picture(&self, width_px: u32) -> PyResult<Option<Pixels>> {
        let pixels = match (&self.team, &self.final_state.picture) {
            (Some(team), _) => draw_view(team.simulation().setup(), team.view(), width_px),
            (None, Some(last)) => draw_view(&last.0, last.1.clone(), width_px),
            (None, None) => return Ok(None),
        };
        pixels.map(Some).map_err(alliance_error)
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
