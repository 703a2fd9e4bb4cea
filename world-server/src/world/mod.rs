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
//! - `vicinity`: what is known of a robot's surroundings from steps before.
//! - `radio`: who is in range of whom. `waste`: spills, deposit, items, report site. `gripper`: pick up and put down. `sensing`: what a robot reads.
//! - `change`: what interruption handlers do to all of it between steps.
//!
//! # One step
//! Between steps, interruption handlers change the world (`change`: [`World::add_obstacle`], [`World::move_robot`], …). A
//! step then lets the components act, in rank order, and after them the aspects evolve. A robot works its gripper and reports where it
//! has sensed, that is before it moves; then it turns, and then it moves along its new heading against everything as it
//! stands at that moment. So each robot finds those of lower rank already moved and those of higher rank not yet.
//!
//! # Decisions where DESIGN is silent
//! - A body stops [`SKIN_M`] short of a solid. The center beam of the proximity sensor uses the same sweep, so it is free
//!   exactly when the body can move.
//! - Where patches overlap, the slowest decides; a patch slows the robot whose center is on it, from the point of its way
//!   where it enters to the point where it leaves, however long the step.
//! - Driving draws energy by the speed that a body really has, so not when it pushes against a wall; a robot without energy
//!   ignores all commands, and its sensors still read.
//! - Waste is sensed through obstacles and robots; the range alone limits it.
//! - The deposit keeps what it gets: nothing in it can be picked up again, though it can be sensed.
//! - An item lies, at the start and after each drop, where a robot's gripper can reach it, if there is such a place.

mod aspect;
mod change;
mod component;
mod event;
mod grid;
mod gripper;
mod ground;
mod motion;
mod outline;
mod radio;
mod sensing;
mod space;
mod start;
mod vicinity;
mod waste;

#[cfg(test)]
mod tests;

use alliance_proto::ids::{ItemId, RobotId};
use alliance_proto::items::ItemCounts;
use alliance_proto::readings::{Actuation, Pose};
use alliance_proto::scenario::{Body, Robot as RobotSpec, Sensors, Setup};
use alliance_proto::time::SimTime;
use glam::Vec2;

pub use aspect::{Aspect, Battery};
pub use change::ChangeError;
pub use component::{Component, ComponentId, ObstacleId, Penetrability, Shape};
pub use event::WorldEvent;
pub use motion::limited;
pub(crate) use motion::wrapped;
pub use outline::{Outline, SKIN_M};
pub use start::{StartError, start_poses};
pub use waste::Item;

use grid::Grid;
use radio::RadioRange;
use space::Space;
use vicinity::{Drift, Vicinity};
use waste::WasteFloor;

/// The state of the simulated world.
#[derive(Clone, Debug)]
pub struct World {
    now: SimTime,
    step: SimTime,
    body: Body,
    sensors: Sensors,
    space: Space,
    /// By rank.
    robots: Vec<Robot>,
    /// Whether any of them has aspects.
    has_aspects: bool,
    /// Ranks of those that are there, by their centers.
    bodies: Grid,
    drift: Drift,
    /// `None` where all hear all.
    range: Option<RadioRange>,
    waste: WasteFloor,
}

/// A robot's body.
#[derive(Clone, Debug)]
struct Robot {
    component: Component,
    /// Where it enters the mission.
    start: Pose,
    /// Whether it has a body in the world.
    present: bool,
    /// Whether its power is switched on.
    powered: bool,
    /// Unit vector of its heading.
    ahead: Vec2,
    /// Over the last step.
    speed_m_s: f32,
    carrying: Option<ItemId>,
    body: Body,
    side_sensor: bool,
    vicinity: Vicinity,
}

impl Robot {
    fn position(&self) -> Vec2 {
        self.component.pose.position
    }

    fn face(&mut self, heading_rad: f32) {
        self.vicinity.unchanged.set(false);
        self.component.pose.heading_rad = heading_rad;
        self.ahead = Vec2::new(libm::cosf(heading_rad), libm::sinf(heading_rad));
    }

    fn can_act(&self) -> bool {
        let aspects = &self.component.aspects;
        self.present && self.powered && aspects.iter().all(Aspect::is_powered)
    }
}

impl World {
    /// The world at the start of a mission.
    ///
    /// # Panics
    /// If [`start_poses`] refuses the scenario; validation asks it first.
    #[must_use]
    pub fn new(setup: &Setup) -> Self {
        let scenario = &setup.scenario;
        let poses = match start_poses(scenario) {
            Ok(poses) => poses,
            Err(error) => panic!("scenario not validated: {error}"),
        };
        let body = scenario.body;
        let robots = scenario.robots.iter().zip(poses).enumerate();
        let robots = robots.map(|(rank, (robot, pose))| {
            let component = Component {
                id: ComponentId::Robot(RobotId(rank as u16)),
                pose,
                shape: Shape::Disc {
                    radius_m: body.radius_m,
                },
                penetrability: Penetrability(body.robot_penetrability),
                aspects: scenario
                    .energy
                    .iter()
                    .map(|energy| Aspect::Energy(Battery::full(energy)))
                    .collect(),
            };
            let mut robot = Robot {
                component,
                start: pose,
                present: !robot.absent,
                powered: true,
                ahead: Vec2::X,
                speed_m_s: 0.0,
                carrying: None,
                body: scenario.body_of(robot),
                side_sensor: robot.has_device(RobotSpec::SIDE_BORDER),
                vicinity: Vicinity::default(),
            };
            robot.face(pose.heading_rad);
            robot
        });
        let robots: Vec<Robot> = robots.collect();
        let space = Space::new(scenario);
        let sensed_m = 3.0 * body.radius_m + scenario.sensors.avoidance_range_m;
        let mut bodies = Grid::new(space.size, sensed_m, robots.len());
        for (rank, robot) in robots.iter().enumerate() {
            if robot.present {
                bodies.insert(rank, robot.position());
            }
        }
        let range = scenario.radio.range_m.map(|range_m| {
            let places = robots.iter().map(Robot::position);
            RadioRange::new(space.size, range_m, places)
        });
        Self {
            range,
            now: SimTime::ZERO,
            step: SimTime(scenario.step_ms),
            body,
            sensors: scenario.sensors,
            has_aspects: robots
                .iter()
                .any(|robot| !robot.component.aspects.is_empty()),
            robots,
            bodies,
            drift: Drift::new(space.size),
            waste: WasteFloor::new(scenario, setup.seed, &space),
            space,
        }
    }

    /// Advances the world by one step. Commands by rank; without one, or without power, a body stays as it is.
    pub fn step(&mut self, commands: &[Option<Actuation>]) -> Vec<WorldEvent> {
        let mut events = Vec::new();
        self.drift.begin_step();
        for rank in 0..self.robots.len() {
            let can_act = self.robots[rank].can_act();
            let command = commands.get(rank).copied().flatten().filter(|_| can_act);
            let command = limited(&self.robots[rank].body, command.unwrap_or_default());
            let robot = RobotId(rank as u16);
            events.extend(self.grip(robot, command.gripper));
            if command.report_progress && self.waste.is_report_site(self.robots[rank].position()) {
                self.waste.last_report = Some(self.now);
                events.push(WorldEvent::ReportMade { robot });
            }
            self.turn_and_move(robot, command.turn_rad_s, command.speed_m_s);
        }
        if self.has_aspects {
            self.evolve_aspects(&mut events);
        }
        self.now = self.now + self.step;
        events
    }

    fn evolve_aspects(&mut self, events: &mut Vec<WorldEvent>) {
        for (rank, robot) in self.robots.iter_mut().enumerate() {
            if !robot.present || !robot.powered {
                continue;
            }
            let drive = if robot.body.speed_m_s > 0.0 {
                robot.speed_m_s / robot.body.speed_m_s
            } else {
                0.0
            };
            for aspect in &mut robot.component.aspects {
                let was_powered = aspect.is_powered();
                aspect.evolve(drive, self.step);
                if was_powered && !aspect.is_powered() {
                    events.push(WorldEvent::EnergyOut {
                        robot: RobotId(rank as u16),
                    });
                }
            }
        }
    }

    /// Simulated time: that of the readings, and of the commands of the next step.
    #[must_use]
    pub fn now(&self) -> SimTime {
        self.now
    }

    /// Whether a robot has a body in the world.
    #[must_use]
    pub fn is_present(&self, robot: RobotId) -> bool {
        self.robots[robot.index()].present
    }

    /// Where a robot is; of an absent one, where it was or will begin.
    #[must_use]
    pub fn pose(&self, robot: RobotId) -> Pose {
        self.robots[robot.index()].component.pose
    }

    /// Length of the way that a robot made in the last step, by the step's length, m/s.
    #[must_use]
    pub fn speed_m_s(&self, robot: RobotId) -> f32 {
        self.robots[robot.index()].speed_m_s
    }

    /// The item in a robot's gripper.
    #[must_use]
    pub fn carrying(&self, robot: RobotId) -> Option<ItemId> {
        self.robots[robot.index()].carrying
    }

    /// Energy that a robot has left, J; `None` where energy is not simulated.
    #[must_use]
    pub fn energy_j(&self, robot: RobotId) -> Option<f32> {
        let aspects = &self.robots[robot.index()].component.aspects;
        aspects
            .iter()
            .map(|Aspect::Energy(battery)| battery.charge_j())
            .next()
    }

    /// Where the items are.
    #[must_use]
    pub fn item_counts(&self) -> ItemCounts {
        self.waste.counts()
    }

    /// Whether every item is in the deposit.
    #[must_use]
    pub fn is_complete(&self) -> bool {
        self.waste.is_complete()
    }

    /// All items, by id.
    #[must_use]
    pub fn items(&self) -> &[Item] {
        self.waste.items()
    }

    /// All rectangles on the floor, by id: solid obstacles and patches.
    #[must_use]
    pub fn obstacles(&self) -> &[Component] {
        self.space.rectangles()
    }

    /// When the last progress report was made.
    #[must_use]
    pub fn last_report(&self) -> Option<SimTime> {
        self.waste.last_report
    }

    /// Whether the report site shows its changed color.
    #[must_use]
    pub fn site_colored(&self) -> bool {
        self.waste.site_colored(self.now)
    }
}
