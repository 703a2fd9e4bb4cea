//! Missions with their own types, which cross the bus as bytes.

use glam::Vec2;
use proto::codec;
use proto::mission::{Action, Bytes, SensorReading};
use proto::tick::Outcome;
use proto::view::View;
use scenario::fault::{Fault, MissionFault};
use scenario::ids::{ItemId, RobotId, TaskId};
use scenario::time::SimTime;
use scenario::{Scenario, Setup};
use serde::Serialize;
use serde::de::DeserializeOwned;
use xxhash_rust::xxh3::xxh3_64;

use super::{FigureValue, StepEvents, Target, TeamFigures, Validity, WorldMission};
use crate::world::{Bar, ChangeError, Floor, Push};

/// The size of a mission's encoded state up to which a step allocates no memory, bytes.
const STATE_ROOM: usize = 1024;

/// A `WorldMission` with its own types; the docs of its methods are there. `Typed` converts it. The serialized form is
/// hashed, so skip exactly the fields that never change.
///
/// ```
/// use proto::mission::{Action, Bytes};
/// use proto::readings::Actuation;
/// use scenario::testkit::{DRILL, default_setup};
/// use serde::{Deserialize, Serialize};
/// use world_server::mission::prelude::*;
/// use world_server::world::World;
///
/// /// A bell that must be rung twice, by any robot.
/// #[derive(Clone, Serialize)]
/// struct Bell {
///     rung: u64,
/// }
///
/// #[derive(Serialize, Deserialize)]
/// struct Ring;
///
/// impl TypedMission for Bell {
///     /// True if the bell has been rung. Every robot receives it.
///     type Reading = bool;
///     type Action = Ring;
///
///     fn new(_: &Setup, _: &Floor) -> Self {
///         Self { rung: 0 }
///     }
///
///     fn act(&mut self, robot: RobotId, _: Ring, _: &mut Floor, happened: &mut StepEvents) {
///         self.rung += 1;
///         happened.push_mission_event("done", Some(robot));
///     }
///
///     fn sense(&self, _: RobotId, _: &Floor) -> (bool, Validity) {
///         (self.rung > 0, Validity::ThisTick)
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
/// }
///
/// // The drill, a mission for tests, provides the names.
/// let mut world = World::new(&default_setup(1), MissionWorld::typed::<Bell>(DRILL));
/// let action = Action::Open(Bytes::encode(&Ring)?);
/// let command = Some(Actuation { action, ..Actuation::default() });
/// world.step(&[command, command]);
/// assert_eq!(world.mission().end(world.now()), Some(Outcome::Complete));
/// # Ok::<(), proto::codec::CodecError>(())
/// ```
pub trait TypedMission: Serialize + Clone + Send + 'static {
    /// The readings of the mission's devices: at most [`MAX_READING_BYTES`](proto::mission::MAX_READING_BYTES) bytes on the bus.
    type Reading: Serialize + DeserializeOwned + Default;

    /// A robot's action other than driving: at most [`MAX_ACTION_BYTES`](proto::mission::MAX_ACTION_BYTES) bytes on the bus.
    type Action: DeserializeOwned;

    /// Creates the mission of a run; see [`MissionWorld::new`](super::MissionWorld::new).
    fn new(setup: &Setup, floor: &Floor) -> Self;

    /// Returns the start area; see [`MissionWorld::start_area`](super::MissionWorld::start_area). It defaults to the left wall.
    fn start_area(scenario: &Scenario) -> [Vec2; 2] {
        [Vec2::ZERO, Vec2::new(1.0, scenario.room.height_m)]
    }

    /// Returns preferred start places; see [`MissionWorld::starts`](super::MissionWorld::starts). The default is none.
    fn starts(_scenario: &Scenario) -> Vec<Vec2> {
        Vec::new()
    }

    /// Returns the bars at the start; see [`MissionWorld::bars`](super::MissionWorld::bars). The default is none.
    fn bars(_scenario: &Scenario) -> Vec<Bar> {
        Vec::new()
    }

    /// Applies early changes; see [`WorldMission::begin`].
    fn begin(&mut self, _floor: &mut Floor, _happened: &mut StepEvents) {}

    /// Applies a robot's action; see [`WorldMission::act`]. Bytes that do not decode to an action are ignored.
    fn act(
        &mut self,
        robot: RobotId,
        action: Self::Action,
        floor: &mut Floor,
        happened: &mut StepEvents,
    );

    /// Handles a push; see [`WorldMission::handle_push`].
    fn handle_push(&mut self, _push: &Push, _floor: &mut Floor, _happened: &mut StepEvents) -> f32 {
        0.0
    }

    /// Applies late changes; see [`WorldMission::settle`].
    fn settle(&mut self, _floor: &mut Floor, _happened: &mut StepEvents) {}

    /// Returns a robot's current readings of the mission's devices.
    fn sense(&self, robot: RobotId, floor: &Floor) -> (Self::Reading, Validity);

    /// Releases a robot's load; see [`WorldMission::release_load`].
    fn release_load(&mut self, _robot: RobotId, _floor: &mut Floor, _happened: &mut StepEvents) {}

    /// Applies a fault that the mission declares; see [`WorldMission::change`].
    fn change(
        &mut self,
        _fault: &MissionFault,
        _floor: &mut Floor,
    ) -> Option<Result<String, ChangeError>> {
        None
    }

    /// Copies the values of a device from other readings.
    fn copy_device(&self, _device: &str, _from: &Self::Reading, _to: &mut Self::Reading) {}

    /// Adds errors to a device; see [`WorldMission::add_error`].
    fn add_error(
        &self,
        _device: &str,
        _sensed: &mut Self::Reading,
        _error_m: &mut dyn FnMut() -> f32,
    ) {
    }

    /// Returns the outcome; see [`WorldMission::end`].
    fn end(&self, now: SimTime) -> Option<Outcome>;

    /// Checks a task; see [`WorldMission::has_work`].
    fn has_work(&self, _task: TaskId, _robot: RobotId, _floor: &Floor) -> bool {
        true
    }

    /// Returns the load; see [`WorldMission::load`].
    fn load(&self, _robot: RobotId) -> Option<ItemId> {
        None
    }

    /// Adds the mission.csv values; see [`WorldMission::row`].
    fn row(&self, row: &mut Vec<FigureValue>);

    /// Adds targets; see [`WorldMission::targets`].
    fn targets(&self, _targets: &mut Vec<Target>) {}

    /// Adds figures; see [`WorldMission::figures`].
    fn figures(&self, _figures: &mut TeamFigures) {}

    /// Adds visible parts; see [`WorldMission::add_to_view`].
    fn add_to_view(&self, _floor: &Floor, _view: &mut View) {}

    /// Checks the invariants; see [`WorldMission::check_invariants`].
    ///
    /// # Errors
    /// If an invariant is violated; the text describes it in one line.
    fn check_invariants(&self, _floor: &Floor) -> Result<(), String> {
        Ok(())
    }
}

/// A wrapper that makes a [`TypedMission`] a [`WorldMission`].
#[derive(Clone, Debug)]
pub struct TypedAdapter<M>(pub M);

impl<M: TypedMission> TypedAdapter<M> {
    fn decoded(sensed: &SensorReading) -> M::Reading {
        match sensed {
            SensorReading::Open(bytes) => bytes.decode().unwrap_or_default(),
            _ => M::Reading::default(),
        }
    }

    /// Encodes readings and reuses the memory of the previous encoding.
    ///
    /// # Panics
    /// If the encoding exceeds the size limit.
    fn encode(readings: &M::Reading, sensed: &mut SensorReading) {
        match (Bytes::encode(readings), sensed) {
            (Ok(bytes), SensorReading::Open(old)) => **old = bytes,
            (Ok(bytes), sensed) => *sensed = SensorReading::Open(Box::new(bytes)),
            (Err(error), _) => panic!("cannot encode the readings of the mission: {error}"),
        }
    }
}

impl<M: TypedMission> WorldMission for TypedAdapter<M> {
    fn begin(&mut self, floor: &mut Floor, happened: &mut StepEvents) {
        self.0.begin(floor, happened);
    }

    fn act(
        &mut self,
        robot: RobotId,
        action: &Action,
        floor: &mut Floor,
        happened: &mut StepEvents,
    ) {
        if let Action::Open(bytes) = action
            && let Ok(action) = bytes.decode()
        {
            self.0.act(robot, action, floor, happened);
        }
    }

    fn handle_push(&mut self, push: &Push, floor: &mut Floor, happened: &mut StepEvents) -> f32 {
        self.0.handle_push(push, floor, happened)
    }

    fn settle(&mut self, floor: &mut Floor, happened: &mut StepEvents) {
        self.0.settle(floor, happened);
    }

    fn sense(&self, robot: RobotId, floor: &Floor, sensed: &mut SensorReading) -> Validity {
        let (readings, validity) = self.0.sense(robot, floor);
        Self::encode(&readings, sensed);
        validity
    }

    fn release_load(&mut self, robot: RobotId, floor: &mut Floor, happened: &mut StepEvents) {
        self.0.release_load(robot, floor, happened);
    }

    fn change(&mut self, fault: &Fault, floor: &mut Floor) -> Option<Result<String, ChangeError>> {
        match fault {
            Fault::Mission(fault) => self.0.change(fault, floor),
            _ => None,
        }
    }

    fn copy_device(&self, device: &str, from: &SensorReading, to: &mut SensorReading) {
        let mut readings = Self::decoded(to);
        self.0
            .copy_device(device, &Self::decoded(from), &mut readings);
        Self::encode(&readings, to);
    }

    fn add_error(
        &self,
        device: &str,
        sensed: &mut SensorReading,
        error_m: &mut dyn FnMut() -> f32,
    ) {
        let mut readings = Self::decoded(sensed);
        self.0.add_error(device, &mut readings, error_m);
        Self::encode(&readings, sensed);
    }

    fn end(&self, now: SimTime) -> Option<Outcome> {
        self.0.end(now)
    }

    fn has_work(&self, task: TaskId, robot: RobotId, floor: &Floor) -> bool {
        self.0.has_work(task, robot, floor)
    }

    fn load(&self, robot: RobotId) -> Option<ItemId> {
        self.0.load(robot)
    }

    fn row(&self, row: &mut Vec<FigureValue>) {
        self.0.row(row);
    }

    fn targets(&self, targets: &mut Vec<Target>) {
        self.0.targets(targets);
    }

    fn state_hash(&self) -> u64 {
        let encoded = "a mission's state can be encoded";
        let mut place = [0; STATE_ROOM];
        // The state is plain data of known length, and the destination is memory.
        let length = codec::encode_to_slice(&self.0, &mut place).expect(encoded);
        if let Some(state) = place.get(..length) {
            return xxh3_64(state);
        }
        let mut room = vec![0; length];
        codec::encode_to_slice(&self.0, &mut room).expect(encoded);
        xxh3_64(&room)
    }

    fn figures(&self, figures: &mut TeamFigures) {
        self.0.figures(figures);
    }

    fn add_to_view(&self, floor: &Floor, view: &mut View) {
        self.0.add_to_view(floor, view);
    }

    fn check_invariants(&self, floor: &Floor) -> Result<(), String> {
        self.0.check_invariants(floor)
    }

    fn clone_boxed(&self) -> Box<dyn WorldMission> {
        Box::new(self.clone())
    }
}
