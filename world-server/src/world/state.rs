//! The world of a run: a floor and the mission on it.

use std::ops::{Deref, DerefMut};

use prefetch::{Layer, prefetch};
use proto::mission::Action;
use proto::readings::{Actuation, Readings};
use scenario::Setup;
use scenario::fault::Fault;
use scenario::ids::RobotId;

use crate::mission::{MissionWorld, Validity, WorldKind};
use run_log::recorder::Event;

use super::step_events::StepEvents;
use super::{ChangeError, Floor, limit_command};

/// The state of the simulated world: the mission and its floor. It dereferences to the floor.
#[derive(Clone)]
pub struct World {
    floor: Floor,
    mission: Box<dyn MissionWorld>,
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
    /// Creates the world at the start of a run of the given mission.
    ///
    /// # Panics
    /// If [`start_poses`](super::start_poses) rejects the scenario; validation calls that function first.
    #[must_use]
    pub fn new(setup: &Setup, kind: WorldKind) -> Self {
        let area = (kind.start_area)(&setup.scenario);
        let starts = (kind.starts)(&setup.scenario);
        let bars = (kind.bars)(&setup.scenario);
        let floor = Floor::new(&setup.scenario, area, &starts, bars);
        let mission = (kind.new)(setup, &floor);
        Self { floor, mission }
    }

    /// Requests the memory of a layer below the world's own fields, see [`prefetch`](mod@prefetch).
    pub fn prefetch(&self, layer: Layer) {
        if layer == Layer::Lists {
            self.floor.prefetch();
            prefetch(&*self.mission);
        } else {
            self.mission.prefetch(layer);
        }
    }

    /// Advances the world by one step. `commands` is indexed by rank; a body without a command or without power stays still.
    pub fn step(&mut self, commands: &[Option<Actuation>]) -> Vec<Event> {
        let Self { floor, mission } = self;
        let mut happened = StepEvents::default();
        floor.drift.begin_step();
        mission.begin(floor, &mut happened);
        for rank in 0..floor.robots.len() {
            let can_act = floor.robots[rank].can_act();
            let command = commands.get(rank).copied().flatten().filter(|_| can_act);
            let command = limit_command(&floor.robots[rank].body, command.unwrap_or_default());
            let robot = RobotId(rank as u32);
            if !matches!(command.action, Action::Nothing) {
                mission.act(robot, &command.action, floor, &mut happened);
            }
            if floor.is_placed(robot) {
                continue;
            }
            let push = floor.turn_and_move(robot, command.turn_rad_s, command.speed_m_s);
            if let Some(push) = push {
                let way_m = mission.handle_push(&push, floor, &mut happened);
                floor.move_on(robot, way_m.min(push.remaining_m));
            }
        }
        mission.settle(floor, &mut happened);
        if floor.has_energy {
            floor.draw_energy(&mut happened);
        }
        floor.now = floor.now + floor.step;
        happened.into_events()
    }

    /// Returns the current readings of a robot with all its devices intact. Faults change the readings later.
    #[must_use]
    pub fn readings(&self, robot: RobotId) -> Readings {
        let mut readings = Readings::default();
        self.read_sensors(robot, &mut readings);
        readings
    }

    /// Writes the current readings of a robot to `readings`; see [`World::readings`]. The function writes in place, because a
    /// copy after many small writes causes a store-forwarding stall.
    pub fn write_readings(&self, robot: RobotId, readings: &mut Readings) {
        let validity = self.read_sensors(robot, readings);
        // Energy changes without any event. A scan of another world is of one step.
        let lasts = validity == Validity::UntilChange
            && !self.floor.has_energy
            && self.floor.scan_of(robot).is_none();
        self.floor.set_readings_valid(robot, lasts);
    }

    fn read_sensors(&self, robot: RobotId, readings: &mut Readings) -> Validity {
        self.floor.look(robot, readings);
        self.mission
            .sense(robot, &self.floor, &mut readings.mission)
    }

    #[must_use]
    pub fn mission(&self) -> &dyn MissionWorld {
        &*self.mission
    }

    pub fn mission_mut(&mut self) -> (&mut dyn MissionWorld, &mut Floor) {
        (&mut *self.mission, &mut self.floor)
    }

    /// Applies a fault of the mission, see [`MissionWorld::change`].
    pub fn change(&mut self, fault: &Fault) -> Option<Result<String, ChangeError>> {
        match fault {
            Fault::Mission(fault) => self.mission.change(fault, &mut self.floor),
            _ => None,
        }
    }

    /// Releases everything that a robot holds.
    pub fn release_load(&mut self, robot: RobotId) -> Vec<Event> {
        let mut happened = StepEvents::default();
        self.mission
            .release_load(robot, &mut self.floor, &mut happened);
        happened.into_events()
    }

    /// Removes a robot's body after [`World::release_load`]. Its battery keeps the charge.
    pub fn remove_robot(&mut self, robot: RobotId) -> Vec<Event> {
        let events = self.release_load(robot);
        self.floor.remove_body(robot);
        events
    }
}
