//! What of a mission happens in the world: the seam between the [`Floor`] and what robots are there for.
//!
//! A [`MissionWorld`] is what there is to know of a mission before a run; it makes the [`WorldMission`] of a run, which acts on
//! the floor, adds to what robots sense and says how far it has come. A mission with types of its own is shorter as a
//! [`TypedMission`], behind [`Typed`].
//!
//! # One step
//! [`WorldMission::begin`]; for each robot in rank order: [`WorldMission::act`] where it has sensed, then its body turns and
//! moves, and where it drives against a bar, [`WorldMission::give_way`]; [`WorldMission::settle`]; aspects; time.
//!
//! # What a run that repeats asks for
//! A mission depends on nothing but its setup, the deeds, the faults and its own state: no clock, no address, no order of a
//! hash map. Its [`state`](WorldMission::state) covers all that its steps depend on.

pub mod prelude;
#[cfg(test)]
mod tests;
mod typed;

use std::any::Any;

use alliance_proto::fault::Fault;
use alliance_proto::ids::{ItemId, RobotId, TaskId};
use alliance_proto::mission::known::Mission;
use alliance_proto::mission::{Deed, Sensed};
use alliance_proto::readings::Pose;
use alliance_proto::scenario::{Scenario, Setup};
use alliance_proto::tick::Outcome;
use alliance_proto::time::SimTime;
use alliance_proto::view::View;
use glam::Vec2;

use crate::world::change::ChangeError;
use crate::world::floor::Floor;
use crate::world::start::{StartError, start_poses};
use crate::world::{Bar, Push};

pub use crate::world::happened::Happened;
pub use alliance_proto::mission::{MissionFigures, Target, TeamFigures, Value};
pub use typed::{Typed, TypedMission};

/// The world's side of a mission, as it is known before a run.
#[derive(Clone, Copy, Debug)]
pub struct MissionWorld {
    /// The mission.
    pub data: Mission,
    /// Where robots begin to which the scenario gives no start: lower left and upper right corner, m.
    pub start_area: fn(&Scenario) -> [Vec2; 2],
    /// Places where they begin rather than in that area, if there are enough that are free, m.
    pub starts: fn(&Scenario) -> Vec<Vec2>,
    /// The bars that lie on the floor at the start; the mission knows each by its place in the list.
    pub bars: fn(&Scenario) -> Vec<Bar>,
    /// The mission of a run. The scenario is valid.
    pub new: fn(&Setup, &Floor) -> Box<dyn WorldMission>,
}

impl MissionWorld {
    /// That of a [`TypedMission`].
    #[must_use]
    pub const fn of<M: TypedMission>(data: Mission) -> Self {
        Self {
            data,
            start_area: M::start_area,
            starts: M::starts,
            bars: M::bars,
            new: |setup, floor| Box::new(Typed(M::new(setup, floor))),
        }
    }

    /// Where the robots of a scenario begin, by rank.
    ///
    /// # Errors
    /// When there is no room for one.
    pub fn start_poses(&self, scenario: &Scenario) -> Result<Vec<Pose>, StartError> {
        start_poses(
            scenario,
            (self.start_area)(scenario),
            &(self.starts)(scenario),
            &(self.bars)(scenario),
        )
    }
}

/// The worlds' sides that a program knows.
#[derive(Clone, Debug, Default)]
pub struct Worlds(Vec<MissionWorld>);

/// A scenario whose mission has no world in this program.
#[derive(Clone, Debug, thiserror::Error)]
#[error("mission {mission}: there is no such mission; there are {}", known.join(", "))]
pub struct UnknownMission {
    mission: &'static str,
    known: Vec<&'static str>,
}

impl Worlds {
    /// Adds one, or another one of that mission.
    pub fn add(&mut self, world: MissionWorld) {
        self.0.retain(|known| known.data != world.data);
        self.0.push(world);
    }

    /// The world's side of the scenario's mission.
    ///
    /// # Errors
    /// When there is none.
    pub fn of(&self, scenario: &Scenario) -> Result<MissionWorld, UnknownMission> {
        let mission = scenario.mission();
        let known = self.0.iter().find(|known| known.data == mission);
        known.copied().ok_or_else(|| UnknownMission {
            mission: mission.name(),
            known: self.0.iter().map(|known| known.data.name()).collect(),
        })
    }
}

/// A mission in the world. Most are shorter as a [`TypedMission`]; there is an example.
pub trait WorldMission: Any + Send {
    /// What happens by itself, before robots act.
    fn begin(&mut self, _floor: &mut Floor, _happened: &mut Happened) {}

    /// A robot does something beside driving, where it has sensed. It can act: it has a body and power.
    fn act(&mut self, robot: RobotId, deed: &Deed, floor: &mut Floor, happened: &mut Happened);

    /// A body drives against a bar: how far the mission lets the body go on, m. What moves the bar is [`Floor::move_bar`].
    fn give_way(&mut self, _push: &Push, _floor: &mut Floor, _happened: &mut Happened) -> f32 {
        0.0
    }

    /// What happens once all robots have acted and moved.
    fn settle(&mut self, _floor: &mut Floor, _happened: &mut Happened) {}

    /// Writes what the mission's devices tell a robot now, all of them intact, to `sensed`, where there is what they told
    /// some robot at some time.
    fn sense(&self, robot: RobotId, floor: &Floor, sensed: &mut Sensed) -> Validity;

    /// A robot lets go of what it has: its agent has died, or its body is about to be taken away.
    fn lose(&mut self, _robot: RobotId, _floor: &mut Floor, _happened: &mut Happened) {}

    /// Makes the change that a fault of this mission asks for, and tells what is where now; `None`: it is no fault of this
    /// mission.
    fn change(
        &mut self,
        _fault: &Fault,
        _floor: &mut Floor,
    ) -> Option<Result<String, ChangeError>> {
        None
    }

    /// Makes one of the mission's own devices tell what it tells in `from`; nothing if that is the default.
    fn copy_device(&self, _device: &str, _from: &Sensed, _to: &mut Sensed) {}

    /// Makes each length, in meters, that one of the mission's own devices tells wrong by an error of its own.
    fn mislead(&self, _device: &str, _sensed: &mut Sensed, _error_m: &mut dyn FnMut() -> f32) {}

    /// Takes out of a deed what a broken actuator of the mission's own cannot do.
    fn disable(&self, _actuator: &str, _deed: &mut Deed) {}

    /// Whether there is anything to do on a task for a robot, whatever it believes.
    fn is_due(&self, _task: TaskId, _robot: RobotId, _floor: &Floor) -> bool {
        true
    }

    /// How the mission has ended, if it has.
    fn end(&self, now: SimTime) -> Option<Outcome>;

    /// What a robot carries.
    fn load(&self, _robot: RobotId) -> Option<ItemId> {
        None
    }

    /// Adds the values of mission.csv to an empty row, in the order of the columns that its data declare.
    fn row(&self, row: &mut Vec<Value>);

    /// Adds its targets to an empty list: the log calls them t0, t1 and so on, in the order of the list.
    fn targets(&self, _targets: &mut Vec<Target>) {}

    /// Hash of everything that the steps to come depend on.
    fn state(&self) -> u64;

    /// What run.json tells of it, in the order in which it is to be told. What is done and left by the columns of mission.csv is
    /// told where nothing here tells it, and so is how much each robot has done where nothing is told of any.
    fn figures(&self, _figures: &mut TeamFigures) {}

    /// Adds to a view what there is to see of it.
    fn show(&self, _floor: &Floor, _view: &mut View) {}

    /// Whether all is as it must be after a step, whatever went wrong in it.
    ///
    /// # Errors
    /// What is not, in one line.
    fn holds(&self, _floor: &Floor) -> Result<(), String> {
        Ok(())
    }

    /// A copy with the same state.
    fn boxed(&self) -> Box<dyn WorldMission>;
}

/// How long that holds what a robot has sensed of a mission.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Validity {
    /// Until its body moves, or somebody tells of a change by [`Floor::changed`] or [`Floor::changed_near`].
    UntilChange,
    /// For this tick.
    ThisTick,
}
