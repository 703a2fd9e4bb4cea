//! The world: components, penetrability, aspects, physics and sensing (thesis §3.2 and §4.1, DESIGN §7). Pure: a function
//! of the setup and the commands.
//!
//! A tour, from the floor up:
//! - [`outline`](Outline): the geometry of one solid: nearest point, ray cast, and the sweep of a disc that stops short of
//!   contact.
//! - [`component`](Component): what lies on the floor, with its [`Penetrability`] and its aspects; [`aspect`](Aspect):
//!   properties that evolve each step, such as [`Energy`](Battery).
//! - `space`: the border and the rectangles, before anything moves; [`start_poses`]: where robots begin.
//! - `grid`: what is near a place. `ground`: how the floor slows a robot down or speeds it up. `motion`: turn, then move straight ahead.
//! - `bar`: solids of a mission that move where bodies push them.
//! - `vicinity`: what is known of a robot's surroundings from steps before. `unchanged`: whether what it sensed last still holds.
//! - `radio`: who is in range of whom. `sensing`: what a robot reads, but for the devices of its mission.
//! - `change`: what interruption handlers do to all of it between steps.
//! - [`Floor`]: all of that. [`World`]: a floor and the [mission](crate::mission) on it.
//!
//! # One step
//! Between steps, interruption handlers change the world (`change`: [`Floor::add_obstacle`], [`Floor::move_robot`], …). A
//! step then lets the components act, in rank order, and after them the aspects evolve. What a robot does for its mission it
//! does where it has sensed, that is before it moves; then it turns, and then it moves along its new heading against everything as it
//! stands at that moment. Where a bar stops it, the mission may let the bar [give way](WorldMission::give_way), and the body goes on. So each robot finds those of lower rank already moved and those of higher rank not yet.
//!
//! # Decisions where DESIGN is silent
//! - A body stops [`SKIN_M`] short of a solid. The center beam of the proximity sensor uses the same sweep, so it is free
//!   exactly when the body can move.
//! - Where patches overlap, the slowest decides; a patch slows the robot whose center is on it, from the point of its way
//!   where it enters to the point where it leaves, however long the step.
//! - Driving draws energy by the speed that a body really has, so not when it pushes against a wall; a robot without energy
//!   ignores all commands, and its sensors still read.

mod aspect;
mod bar;
pub(crate) mod change;
mod component;
pub(crate) mod floor;
mod grid;
mod ground;
pub(crate) mod happened;
mod motion;
mod outline;
mod radio;
mod sensing;
mod space;
pub(crate) mod start;
mod unchanged;
mod vicinity;

use std::ops::{Deref, DerefMut};

use alliance_proto::fault::Fault;
use alliance_proto::ids::RobotId;
use alliance_proto::mission::Deed;
use alliance_proto::readings::{Actuation, Readings};
use alliance_proto::scenario::Setup;

use crate::mission::{MissionWorld, Validity, WorldMission};
use crate::recorder::Event;

pub use aspect::{Aspect, Battery};
pub use bar::{Bar, Push};
pub use change::ChangeError;
pub use component::{Component, ComponentId, ObstacleId, Penetrability, Shape};
pub use floor::{Floor, Impairment};
pub use grid::Grid;
use happened::Happened;
pub use motion::{limited, wrapped};
pub use outline::{Outline, SKIN_M};
pub use space::around;
pub use start::{ROUNDING_M, StartError, start_poses};
pub use vicinity::Circle;

/// The state of the simulated world: a floor, to which it dereferences, and the mission on it.
pub struct World {
    floor: Floor,
    mission: Box<dyn WorldMission>,
}

impl Clone for World {
    fn clone(&self) -> Self {
        Self {
            floor: self.floor.clone(),
            mission: self.mission.boxed(),
        }
    }
}

impl Deref for World {
    type Target = Floor;

    fn deref(&self) -> &Floor {
        &self.floor
    }
}

impl DerefMut for World {
    fn deref_mut(&mut self) -> &mut Floor {
        &mut self.floor
    }
}

impl World {
    /// The world at the start of a run of such a mission.
    ///
    /// # Panics
    /// If [`start_poses`] refuses the scenario; validation asks it first.
    #[must_use]
    pub fn new(setup: &Setup, kind: MissionWorld) -> Self {
        let area = (kind.start_area)(&setup.scenario);
        let starts = (kind.starts)(&setup.scenario);
        let bars = (kind.bars)(&setup.scenario);
        let floor = Floor::new(&setup.scenario, area, &starts, bars);
        let mission = (kind.new)(setup, &floor);
        Self { floor, mission }
    }

    /// Advances the world by one step. Commands by rank; without one, or without power, a body stays as it is.
    pub fn step(&mut self, commands: &[Option<Actuation>]) -> Vec<Event> {
        let Self { floor, mission } = self;
        let mut happened = Happened::default();
        floor.drift.begin_step();
        mission.begin(floor, &mut happened);
        for rank in 0..floor.robots.len() {
            let can_act = floor.robots[rank].can_act();
            let command = commands.get(rank).copied().flatten().filter(|_| can_act);
            let command = limited(&floor.robots[rank].body, command.unwrap_or_default());
            let robot = RobotId(rank as u16);
            if !matches!(command.deed, Deed::Nothing) {
                mission.act(robot, &command.deed, floor, &mut happened);
            }
            let push = floor.turn_and_move(robot, command.turn_rad_s, command.speed_m_s);
            if let Some(push) = push {
                let way_m = mission.give_way(&push, floor, &mut happened);
                floor.go_on(robot, way_m.min(push.way_m));
            }
        }
        mission.settle(floor, &mut happened);
        if floor.has_aspects {
            floor.evolve_aspects(&mut happened);
        }
        floor.now = floor.now + floor.step;
        happened.into_events()
    }

    /// What a robot senses now. All devices that it has are intact here: faults act on the readings.
    #[must_use]
    pub fn readings(&self, robot: RobotId) -> Readings {
        let mut readings = Readings::default();
        self.look(robot, &mut readings);
        readings
    }

    /// Writes to `readings` what a robot senses now, see [`World::readings`]: in place, for small writes followed by a
    /// copy of the whole would cause a store-forwarding stall.
    pub fn sense(&self, robot: RobotId, readings: &mut Readings) {
        let validity = self.look(robot, readings);
        // Energy changes by itself.
        let lasts = validity == Validity::UntilChange && !self.floor.has_aspects;
        self.floor.sensed(robot, lasts);
    }

    fn look(&self, robot: RobotId, readings: &mut Readings) -> Validity {
        self.floor.look(robot, readings);
        self.mission
            .sense(robot, &self.floor, &mut readings.mission)
    }

    /// The mission.
    #[must_use]
    pub fn mission(&self) -> &dyn WorldMission {
        &*self.mission
    }

    /// The mission, and the floor that it is on.
    pub fn mission_mut(&mut self) -> (&mut dyn WorldMission, &mut Floor) {
        (&mut *self.mission, &mut self.floor)
    }

    /// Makes the change that a fault of the mission asks for, see [`WorldMission::change`].
    pub fn change(&mut self, fault: &Fault) -> Option<Result<String, ChangeError>> {
        self.mission.change(fault, &mut self.floor)
    }

    /// A robot lets go of what it has, as when its agent has died.
    pub fn lose(&mut self, robot: RobotId) -> Vec<Event> {
        let mut happened = Happened::default();
        self.mission.lose(robot, &mut self.floor, &mut happened);
        happened.into_events()
    }

    /// Takes a robot's body away: nothing touches or senses it, and it obeys nothing. What it has it lets go of first, as with
    /// [`World::lose`]. Its battery keeps its charge.
    pub fn remove_robot(&mut self, robot: RobotId) -> Vec<Event> {
        let events = self.lose(robot);
        self.floor.take_away(robot);
        events
    }
}
