//! The world side of a mission: the interface between the [`Floor`] and the robots' goals.
//!
//! A [`MissionWorld`] acts on the floor, adds to the readings and returns the progress. A [`WorldKind`] registers its
//! type for a mission.
//!
//! # One step
//! A step calls [`MissionWorld::begin`]. For each robot in rank order it calls [`MissionWorld::act`], moves the body, and
//! calls [`MissionWorld::handle_push`] if the body meets a bar. Then follow [`MissionWorld::settle`], the batteries and the clock.
//!
//! # Repeatable runs
//! A mission depends only on its setup, the actions, the faults and its own state: not on a clock, an address or the order
//! of a hash map. Its [`state`](MissionWorld::state_hash) covers everything that its steps depend on.

#![warn(missing_docs)]

pub mod prelude;
#[cfg(test)]
mod tests;

use std::any::Any;

use glam::Vec2;
use prefetch::Layer;
use proto::codec;
use proto::mission::{Action, SensorReading};
use proto::readings::Pose;
use proto::tick::Outcome;
use proto::view::View;
use scenario::fault::MissionFault;
use scenario::ids::{ItemId, RobotId, TaskId};
use scenario::mission::registry::Mission;
use scenario::time::SimTime;
use scenario::{Problem, Scenario, Setup};
use serde::Serialize;
use xxhash_rust::xxh3::xxh3_64;

use crate::world::change::ChangeError;
use crate::world::floor::Floor;
use crate::world::start::{StartError, start_poses};
use crate::world::{Bar, Places, Push};

pub use crate::world::step_events::StepEvents;
pub use scenario::mission::{FigureValue, MissionFigures, Target, TeamFigures};

/// A registered world type of a mission.
#[derive(Clone, Copy, Debug)]
pub struct WorldKind {
    /// The mission that this world side belongs to.
    pub data: Mission,
    /// See [`MissionWorld::start_area`].
    pub start_area: fn(&Scenario) -> [Vec2; 2],
    /// The preferred start places of the robots: [`MissionWorld::starts`].
    pub starts: fn(&Scenario) -> Vec<Vec2>,
    /// The solid bars at the start: [`MissionWorld::bars`].
    pub bars: fn(&Scenario) -> Vec<Bar>,
    /// The constructor of a run's mission: [`MissionWorld::new`].
    pub new: fn(&Setup, &Floor) -> Box<dyn MissionWorld>,
}

impl WorldKind {
    /// Registers a world type for a mission.
    #[must_use]
    pub const fn new<M: MissionWorld>(data: Mission) -> Self {
        Self {
            data,
            start_area: M::start_area,
            starts: M::starts,
            bars: M::bars,
            new: |setup, floor| Box::new(M::new(setup, floor)),
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
pub struct MissionRegistry(Vec<WorldKind>);

/// An error: the program has no world side for the scenario's mission.
#[derive(Clone, Debug, thiserror::Error)]
#[error("mission {mission}: this program does not contain the mission; available missions: {}", known.join(", "))]
pub struct UnknownMission {
    mission: &'static str,
    known: Vec<&'static str>,
}

impl MissionRegistry {
    /// Adds a world side and replaces an earlier one of the same mission.
    pub fn add(&mut self, world: WorldKind) {
        self.0.retain(|known| known.data != world.data);
        self.0.push(world);
    }

    /// Returns the world side of the scenario's mission.
    ///
    /// # Errors
    /// If the program contains none.
    pub fn find(&self, scenario: &Scenario) -> Result<WorldKind, UnknownMission> {
        let mission = scenario.mission();
        let known = self.0.iter().find(|known| known.data == mission);
        known.copied().ok_or_else(|| UnknownMission {
            mission: mission.name(),
            known: self.0.iter().map(|known| known.data.name()).collect(),
        })
    }
}

/// A mission in the world. Positions are in the room's frame, m.
///
/// The readings of the mission's devices are a value of its own type, which the robots in the same process receive as
/// such: [`SensorReading::value_mut`] writes it. On the bus it has at most
/// [`MAX_READING_BYTES`](proto::mission::MAX_READING_BYTES), and an action at most
/// [`MAX_ACTION_BYTES`](proto::mission::MAX_ACTION_BYTES).
///
/// ```
/// use proto::readings::Actuation;
/// use scenario::testkit::{DRILL, default_setup};
/// use serde::{Deserialize, Serialize};
/// use world_server::mission::prelude::*;
/// use world_server::world::World;
///
/// /// A bell that must be rung twice, by any robot. Every robot reads whether it has been rung.
/// #[derive(Clone, Serialize)]
/// struct Bell {
///     rung: u64,
/// }
///
/// #[derive(Serialize, Deserialize)]
/// struct Ring;
///
/// impl MissionWorld for Bell {
///     fn new(_: &Setup, _: &Floor) -> Self {
///         Self { rung: 0 }
///     }
///
///     fn act(&mut self, robot: RobotId, action: &Action, _: &mut Floor, happened: &mut StepEvents) {
///         if let Some(Ring) = action.value() {
///             self.rung += 1;
///             happened.push_mission_event("done", Some(robot));
///         }
///     }
///
///     fn sense(&self, _: RobotId, _: &Floor, sensed: &mut SensorReading) -> Validity {
///         *sensed.value_mut() = self.rung > 0;
///         Validity::ThisTick
///     }
///
///     fn end(&self, _: SimTime) -> Option<Outcome> {
///         (self.rung >= 2).then_some(Outcome::Complete)
///     }
///
///     fn row(&self, row: &mut Vec<FigureValue>) {
///         row.extend([2_u64.saturating_sub(self.rung), 0, 0, self.rung].map(FigureValue::from));
///         row.push(FigureValue::None);
///     }
///
///     fn state_hash(&self) -> u64 {
///         hash_state(self)
///     }
/// }
///
/// // The drill, a mission for tests, provides the names.
/// let mut world = World::new(&default_setup(1), WorldKind::new::<Bell>(DRILL));
/// let command = Some(Actuation { action: Action::new(&Ring), ..Actuation::default() });
/// world.step(&[command, command]);
/// assert_eq!(world.mission().end(world.now()), Some(Outcome::Complete));
/// ```
pub trait MissionWorld: CloneWorld + Any + Send + Sync {
    /// Creates the mission of a run on its floor, with all bodies at their start. The scenario is valid.
    fn new(setup: &Setup, floor: &Floor) -> Self
    where
        Self: Sized;

    /// Returns the area for robots without a start in the scenario: lower left and upper right corner, m. The default is a
    /// strip of 1 m at the left wall.
    fn start_area(scenario: &Scenario) -> [Vec2; 2]
    where
        Self: Sized,
    {
        let low = scenario.room.low();
        [low, low + Vec2::new(1.0, scenario.room.height_m)]
    }

    /// Returns the preferred places for these robots, used if enough of them are free, m. The default is none.
    fn starts(_scenario: &Scenario) -> Vec<Vec2>
    where
        Self: Sized,
    {
        Vec::new()
    }

    /// Returns the bars on the floor at the start. The mission identifies a bar by its index. The default is none.
    fn bars(_scenario: &Scenario) -> Vec<Bar>
    where
        Self: Sized,
    {
        Vec::new()
    }

    /// Applies changes that precede the robots' actions. The default is none.
    fn begin(&mut self, _floor: &mut Floor, _happened: &mut StepEvents) {}

    /// Applies a robot's action other than driving, at the position where it read its sensors. The robot has a body and
    /// power. The action can have any content; one that [`value`](Action::value) cannot convert has no effect.
    fn act(
        &mut self,
        robot: RobotId,
        action: &Action,
        floor: &mut Floor,
        happened: &mut StepEvents,
    );

    /// Handles a push and returns the distance that the body may continue, m; larger values than
    /// [`Push::remaining_m`] count as that. [`Floor::move_bar`] moves the bar. By default the body stops.
    fn handle_push(&mut self, _push: &Push, _floor: &mut Floor, _happened: &mut StepEvents) -> f32 {
        0.0
    }

    /// Applies changes that follow the actions and moves of all robots. The default is none.
    fn settle(&mut self, _floor: &mut Floor, _happened: &mut StepEvents) {}

    /// Writes a robot's current readings of the mission's intact devices to `sensed`, which contains older readings.
    /// Several threads may call this function at the same time, for different robots.
    fn sense(&self, robot: RobotId, floor: &Floor, sensed: &mut SensorReading) -> Validity;

    /// Releases everything that a robot holds, because its agent has died or its body is about to be removed. By default
    /// robots hold nothing.
    fn release_load(&mut self, _robot: RobotId, _floor: &mut Floor, _happened: &mut StepEvents) {}

    /// Applies a fault that the mission declares and returns the new places for the log, or `None` for an unknown fault.
    /// The order has been checked: only arguments with a default can be missing.
    ///
    /// # Errors
    /// The inner result is an error if the fault cannot be applied now.
    fn change(
        &mut self,
        _fault: &MissionFault,
        _floor: &mut Floor,
    ) -> Option<Result<String, ChangeError>> {
        None
    }

    /// Returns the reason why an order of a fault must fail at any time, with a remedy. The fault takes effect `times`
    /// times. `ordered` are the faults of the mission that have not taken effect, each with its number of times. `places`
    /// are free of the border and the scenario's obstacles, which never change. By default no reason is known.
    fn refuse_order(
        &self,
        _fault: &MissionFault,
        _times: u64,
        _ordered: &[(&MissionFault, u64)],
        _places: &Places,
    ) -> Option<Problem> {
        None
    }

    /// Copies the values of one of the mission's devices from other readings, for faults of sensors. A dead device has
    /// the values of the default reading.
    fn copy_device(&self, _device: &str, _from: &SensorReading, _to: &mut SensorReading) {}

    /// Adds an error to each length, in m, that one of the mission's devices measures. Call `_error_m` once per length.
    fn add_error(
        &self,
        _device: &str,
        _sensed: &mut SensorReading,
        _error_m: &mut dyn FnMut() -> f32,
    ) {
    }

    /// Removes the parts of an action that a broken actuator of the mission cannot perform. The default is none.
    fn remove_disabled(&self, _actuator: &str, _action: &mut Action) {}

    /// Checks whether a robot can do anything for a task, by the ground truth. The default is true.
    fn has_work(&self, _task: TaskId, _robot: RobotId, _floor: &Floor) -> bool {
        true
    }

    /// Returns the outcome if the mission has ended at the time `now`.
    fn end(&self, now: SimTime) -> Option<Outcome>;

    /// Returns the item that a robot carries. The default is none.
    fn load(&self, _robot: RobotId) -> Option<ItemId> {
        None
    }

    /// Adds the values of mission.csv to an empty row, one per column that the mission declares and in that order. Numbers
    /// are finite.
    fn row(&self, row: &mut Vec<FigureValue>);

    /// Adds the mission's targets to an empty list. The log names them t0, t1 and so on, in the order of the list.
    fn targets(&self, _targets: &mut Vec<Target>) {}

    /// Returns a hash of everything that later steps, readings and rows depend on, except constants of the run.
    /// [`hash_state`] computes it from a serialized value.
    fn state_hash(&self) -> u64;

    /// Adds the mission's figures for run.json, in the order of the file. By default run.json contains the done and left columns
    /// of mission.csv, and the work of each robot.
    fn figures(&self, _figures: &mut TeamFigures) {}

    /// Adds the mission's visible parts to a view. The default is none.
    fn add_to_view(&self, _floor: &Floor, _view: &mut View) {}

    /// Requests the lists of the next step from memory, at [`Layer::Elements`], and their contents, at [`Layer::Contents`].
    /// A batch of environments calls this while other environments step. The default requests nothing.
    fn prefetch(&self, _layer: Layer) {}

    /// Checks the invariants of the mission after a step with any faults. The default checks nothing.
    ///
    /// # Errors
    /// If an invariant is violated; the text describes it in one line.
    fn check_invariants(&self, _floor: &Floor) -> Result<(), String> {
        Ok(())
    }
}

/// Copies the mission behind a [`MissionWorld`] object. Each mission with `Clone` has it.
pub trait CloneWorld {
    /// Returns a copy with the same state.
    fn clone_box(&self) -> Box<dyn MissionWorld>;
}

impl<M: MissionWorld + Clone> CloneWorld for M {
    fn clone_box(&self) -> Box<dyn MissionWorld> {
        Box::new(self.clone())
    }
}

impl Clone for Box<dyn MissionWorld> {
    fn clone(&self) -> Self {
        (**self).clone_box()
    }
}

/// The size of a mission's encoded state up to which a step allocates no memory, bytes.
const STATE_ROOM: usize = 1024;

/// Returns the hash of a state, for [`MissionWorld::state_hash`]. It covers the serialized form, so skip exactly the
/// fields that never change.
///
/// # Panics
/// If the state cannot be serialized, such as a list of unknown length.
pub fn hash_state(state: &impl Serialize) -> u64 {
    let encoded = "a mission's state can be encoded";
    let mut place = [0; STATE_ROOM];
    // The state is plain data of known length, and the destination is memory.
    let length = codec::encode_to_slice(state, &mut place).expect(encoded);
    if let Some(state) = place.get(..length) {
        return xxh3_64(state);
    }
    let mut room = vec![0; length];
    codec::encode_to_slice(state, &mut room).expect(encoded);
    xxh3_64(&room)
}

/// The time for which a robot's readings of a mission hold.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Validity {
    /// The readings hold until the body moves or [`Floor::invalidate_readings`] or [`Floor::invalidate_readings_near`] is called.
    UntilChange,
    /// The readings hold for this tick only.
    ThisTick,
}
