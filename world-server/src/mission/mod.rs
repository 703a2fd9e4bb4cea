//! The world side of a mission: the interface between the [`Floor`] and the robots' goals.
//!
//! A [`MissionWorld`] describes a mission before a run and creates the [`WorldMission`] of a run, which acts on the floor,
//! adds to the readings and returns the progress. A mission with its own types needs less code as a [`TypedMission`].
//!
//! # One step
//! A step calls [`WorldMission::begin`]. For each robot in rank order it calls [`WorldMission::act`], moves the body, and
//! calls [`WorldMission::handle_push`] if the body meets a bar. Then follow [`WorldMission::settle`], the aspects and the clock.
//!
//! # Repeatable runs
//! A mission depends only on its setup, the actions, the faults and its own state: not on a clock, an address or the order
//! of a hash map. Its [`state`](WorldMission::state_hash) covers everything that its steps depend on.

pub mod prelude;
#[cfg(test)]
mod tests;
mod typed;

use std::any::Any;

use glam::Vec2;
use proto::mission::{Action, SensorReading};
use proto::readings::Pose;
use proto::tick::Outcome;
use proto::view::View;
use scenario::fault::Fault;
use scenario::ids::{ItemId, RobotId, TaskId};
use scenario::mission::registry::Mission;
use scenario::time::SimTime;
use scenario::{Scenario, Setup};

use crate::world::change::ChangeError;
use crate::world::floor::Floor;
use crate::world::start::{StartError, start_poses};
use crate::world::{Bar, Push};

pub use crate::world::step_events::StepEvents;
pub use scenario::mission::{FigureValue, MissionFigures, Target, TeamFigures};
pub use typed::{TypedAdapter, TypedMission};

/// The world side of a mission, as known before a run.
#[derive(Clone, Copy, Debug)]
pub struct MissionWorld {
    /// The mission that this world side belongs to.
    pub data: Mission,
    /// The area for robots without a start in the scenario: lower left and upper right corner, m.
    pub start_area: fn(&Scenario) -> [Vec2; 2],
    /// The preferred places for these robots, used if enough of them are free, m.
    pub starts: fn(&Scenario) -> Vec<Vec2>,
    /// The bars on the floor at the start. The mission identifies a bar by its index.
    pub bars: fn(&Scenario) -> Vec<Bar>,
    /// The constructor for a run. The scenario is valid.
    pub new: fn(&Setup, &Floor) -> Box<dyn WorldMission>,
}

impl MissionWorld {
    /// Creates the world side of a [`TypedMission`].
    #[must_use]
    pub const fn typed<M: TypedMission>(data: Mission) -> Self {
        Self {
            data,
            start_area: M::start_area,
            starts: M::starts,
            bars: M::bars,
            new: |setup, floor| Box::new(TypedAdapter(M::new(setup, floor))),
        }
    }

    /// Returns the start poses of a scenario's robots, by rank.
    ///
    /// # Errors
    /// If there is no room for a robot.
    pub fn start_poses(&self, scenario: &Scenario) -> Result<Vec<Pose>, StartError> {
        start_poses(
            scenario,
            (self.start_area)(scenario),
            &(self.starts)(scenario),
            &(self.bars)(scenario),
        )
    }
}

/// The world sides that a program contains.
#[derive(Clone, Debug, Default)]
pub struct MissionRegistry(Vec<MissionWorld>);

/// An error: the program has no world side for the scenario's mission.
#[derive(Clone, Debug, thiserror::Error)]
#[error("mission {mission}: this program does not contain the mission; available missions: {}", known.join(", "))]
pub struct UnknownMission {
    mission: &'static str,
    known: Vec<&'static str>,
}

impl MissionRegistry {
    /// Adds a world side and replaces an earlier one of the same mission.
    pub fn add(&mut self, world: MissionWorld) {
        self.0.retain(|known| known.data != world.data);
        self.0.push(world);
    }

    /// Returns the world side of the scenario's mission.
    ///
    /// # Errors
    /// If the program contains none.
    pub fn find(&self, scenario: &Scenario) -> Result<MissionWorld, UnknownMission> {
        let mission = scenario.mission();
        let known = self.0.iter().find(|known| known.data == mission);
        known.copied().ok_or_else(|| UnknownMission {
            mission: mission.name(),
            known: self.0.iter().map(|known| known.data.name()).collect(),
        })
    }
}

/// A mission in the world. A [`TypedMission`] needs less code and has an example.
pub trait WorldMission: Any + Send {
    /// Applies changes that precede the robots' actions.
    fn begin(&mut self, _floor: &mut Floor, _happened: &mut StepEvents) {}

    /// Applies a robot's action other than driving, at the position where it read its sensors. The robot has a body and power.
    fn act(
        &mut self,
        robot: RobotId,
        action: &Action,
        floor: &mut Floor,
        happened: &mut StepEvents,
    );

    /// Handles a push and returns the distance that the body may continue, m. [`Floor::move_bar`] moves the bar.
    fn handle_push(&mut self, _push: &Push, _floor: &mut Floor, _happened: &mut StepEvents) -> f32 {
        0.0
    }

    /// Applies changes that follow the actions and moves of all robots.
    fn settle(&mut self, _floor: &mut Floor, _happened: &mut StepEvents) {}

    /// Writes a robot's current readings of the mission's intact devices to `sensed`, which contains older readings.
    fn sense(&self, robot: RobotId, floor: &Floor, sensed: &mut SensorReading) -> Validity;

    /// Releases everything that a robot holds, because its agent has died or its body is about to be removed.
    fn release_load(&mut self, _robot: RobotId, _floor: &mut Floor, _happened: &mut StepEvents) {}

    /// Applies a fault of this mission and returns the new places for the log; `None` for other faults.
    fn change(
        &mut self,
        _fault: &Fault,
        _floor: &mut Floor,
    ) -> Option<Result<String, ChangeError>> {
        None
    }

    /// Copies the values of one of the mission's devices from other readings.
    fn copy_device(&self, _device: &str, _from: &SensorReading, _to: &mut SensorReading) {}

    /// Adds an error to each length, in m, that one of the mission's devices measures. Call `_error_m` once per length.
    fn add_error(
        &self,
        _device: &str,
        _sensed: &mut SensorReading,
        _error_m: &mut dyn FnMut() -> f32,
    ) {
    }

    /// Removes the parts of an action that a broken actuator of the mission cannot perform.
    fn remove_disabled(&self, _actuator: &str, _deed: &mut Action) {}

    /// Checks whether a robot can do anything for a task, by the ground truth.
    fn has_work(&self, _task: TaskId, _robot: RobotId, _floor: &Floor) -> bool {
        true
    }

    /// Returns the outcome if the mission has ended.
    fn end(&self, now: SimTime) -> Option<Outcome>;

    /// Returns the item that a robot carries.
    fn load(&self, _robot: RobotId) -> Option<ItemId> {
        None
    }

    /// Adds the values of mission.csv to an empty row, in the order of the columns that the mission declares.
    fn row(&self, row: &mut Vec<FigureValue>);

    /// Adds the mission's targets to an empty list. The log names them t0, t1 and so on, in the order of the list.
    fn targets(&self, _targets: &mut Vec<Target>) {}

    /// Returns a hash of everything that later steps depend on.
    fn state_hash(&self) -> u64;

    /// Adds the mission's figures for run.json, in the order of the file. By default run.json contains the done and left columns
    /// of mission.csv, and the work of each robot.
    fn figures(&self, _figures: &mut TeamFigures) {}

    /// Adds the mission's visible parts to a view.
    fn add_to_view(&self, _floor: &Floor, _view: &mut View) {}

    /// Checks the invariants of the mission after a step with any faults.
    ///
    /// # Errors
    /// If an invariant is violated; the text describes it in one line.
    fn check_invariants(&self, _floor: &Floor) -> Result<(), String> {
        Ok(())
    }

    /// Returns a copy with the same state.
    fn clone_boxed(&self) -> Box<dyn WorldMission>;
}

/// The time for which a robot's readings of a mission hold.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Validity {
    /// The readings hold until the body moves or [`Floor::invalidate_readings`] or [`Floor::invalidate_readings_near`] is called.
    UntilChange,
    /// The readings hold for this tick only.
    ThisTick,
}
