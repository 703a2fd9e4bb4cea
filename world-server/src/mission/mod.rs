//! What of a mission happens in the world: the seam between the [`Floor`] and what robots are there for.
//!
//! A [`MissionKind`] is what there is to know of a mission before a run; it makes the [`WorldMission`] of a run, which acts on
//! the floor, adds to what robots sense and says how far it has come. A mission with types of its own is shorter as a
//! [`TypedMission`], behind [`Typed`].
//!
//! # One step
//! [`WorldMission::begin`]; for each robot in rank order: [`WorldMission::act`] where it has sensed, then its body turns and
//! moves; [`WorldMission::settle`]; aspects; time.
//!
//! # What a run that repeats asks for
//! A mission depends on nothing but its setup, the deeds, the faults and its own state: no clock, no address, no order of a
//! hash map. Its [`state`](WorldMission::state) covers all that its steps depend on.

#[cfg(test)]
mod tests;
mod typed;

use std::any::Any;

use alliance_proto::fault::Fault;
use alliance_proto::ids::{ItemId, RobotId};
use alliance_proto::mission::{Deed, Sensed};
use alliance_proto::scenario::{Scenario, Setup};
use alliance_proto::tick::Outcome;
use alliance_proto::time::SimTime;
use alliance_proto::view::View;
use glam::Vec2;

use crate::recorder::{Event, EventKind};
use crate::world::{ChangeError, Floor};

pub use alliance_proto::mission::{MissionFigures, TeamFigures, Value};
pub use typed::{Typed, TypedMission};

/// A mission as it is known before a run.
#[derive(Debug)]
pub struct MissionKind {
    /// Its name.
    pub name: &'static str,
    /// Columns of mission.csv after the time.
    pub columns: &'static [&'static str],
    /// Verbs that faults can wait for, each with the kind of the event that it stands for.
    pub verbs: &'static [(&'static str, &'static str)],
    /// Where robots begin to which the scenario gives no start: lower left and upper right corner, m.
    pub start_area: fn(&Scenario) -> [Vec2; 2],
    /// The mission of a run. The scenario is valid.
    pub new: fn(&Setup, &Floor) -> Box<dyn WorldMission>,
}

/// A mission in the world.
pub trait WorldMission: Any + Send {
    /// What happens by itself, before robots act.
    fn begin(&mut self, _floor: &mut Floor, _happened: &mut Happened) {}

    /// A robot does something beside driving, where it has sensed. It can act: it has a body and power.
    fn act(&mut self, robot: RobotId, deed: &Deed, floor: &mut Floor, happened: &mut Happened);

    /// What happens once all robots have acted and moved.
    fn settle(&mut self, _floor: &mut Floor, _happened: &mut Happened) {}

    /// Writes what the mission's devices tell a robot now, all of them intact, to `sensed`, where there is what they told
    /// some robot at some time.
    fn sense(&self, robot: RobotId, floor: &Floor, sensed: &mut Sensed) -> Validity;

    /// A robot lets go of what it has: its agent has died, or its body is about to be taken away.
    fn lose(&mut self, robot: RobotId, floor: &mut Floor, happened: &mut Happened);

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

    /// How the mission has ended, if it has.
    fn end(&self, now: SimTime) -> Option<Outcome>;

    /// What a robot carries.
    fn load(&self, _robot: RobotId) -> Option<ItemId> {
        None
    }

    /// Adds the values of mission.csv to an empty row, in the order of the [columns](MissionKind::columns).
    fn row(&self, row: &mut Vec<Value>);

    /// Hash of everything that the steps to come depend on.
    fn state(&self) -> u64;

    /// What run.json tells of it, in the order in which it is to be told.
    fn figures(&self, figures: &mut TeamFigures);

    /// Adds to a view what there is to see of it.
    fn show(&self, floor: &Floor, view: &mut View);

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

/// Events of the world, in order.
#[derive(Debug, Default)]
pub struct Happened(Vec<Event>);

impl Happened {
    /// An event of the mission, with its `kind` in events.csv. Subject, reason and detail are empty.
    pub fn tell(&mut self, kind: &'static str, robot: Option<RobotId>) -> &mut Event {
        self.add(Event::new(EventKind::Mission(kind), robot))
    }

    pub(crate) fn add(&mut self, event: Event) -> &mut Event {
        let last = self.0.len();
        self.0.push(event);
        &mut self.0[last]
    }

    /// All of them.
    #[must_use]
    pub fn into_events(self) -> Vec<Event> {
        self.0
    }
}
