//! The world without its mission: space, bodies, neighbor search and time.

use glam::Vec2;
use prefetch::prefetch;
use proto::readings::{Pose, Proximity};
use scenario::ids::RobotId;
use scenario::time::SimTime;
use scenario::{Body, Radio, Robot as RobotSpec, Room, Scenario, Sensors};

use super::battery::Battery;
use super::grid::Grid;
use super::neighbor_cache::{Drift, NeighborCache};
use super::radio::RadioRange;
use super::readings_cache::ReadingsCache;
use super::space::{Space, nearest_place};
use super::step_events::StepEvents;
use super::{Bar, Component, ComponentId, Outline, Penetrability, Shape, start_poses};
use run_log::recorder::{Event, EventKind};

/// The space, bodies and time that every mission has.
#[derive(Clone, Debug)]
pub struct Floor {
    pub(super) now: SimTime,
    pub(super) step: SimTime,
    pub(super) body: Body,
    pub(super) sensors: Sensors,
    pub(super) space: Space,
    /// The bodies, indexed by rank.
    pub(super) robots: Vec<Robot>,
    /// True if energy is simulated.
    pub(super) has_energy: bool,
    /// The ranks of the present robots, by their centers.
    pub(super) bodies: Grid,
    pub(super) drift: Drift,
    pub(super) radio: Radio,
    /// The radio range; `None` if every robot receives every broadcast.
    pub(super) range: Option<RadioRange>,
    /// The impaired skills of the current step.
    impairments: Vec<Impairment>,
}

/// A skill of a robot that works only in part.
#[derive(Clone, Debug, PartialEq)]
pub struct Impairment {
    /// The robot with the impaired skill.
    pub robot: RobotId,
    /// The name of the skill.
    pub skill: String,
    /// The remaining share, 0 to 1.
    pub share: f64,
    /// True if the robot has used the skill in this step.
    pub was_used: bool,
}

#[derive(Clone, Debug)]
pub(super) struct Robot {
    pub component: Component,
    /// The pose at which the robot enters the mission.
    pub start: Pose,
    /// True if the robot has a body in the world.
    pub present: bool,
    /// True if the robot's power is switched on.
    pub powered: bool,
    /// The energy; `None` if energy is not simulated.
    pub battery: Option<Battery>,
    /// The unit vector of the heading.
    pub ahead: Vec2,
    /// The mean speed over the last step.
    pub speed_m_s: f32,
    pub body: Body,
    pub side_sensor: bool,
    /// The number of times that the body was placed somewhere.
    pub jumps: u32,
    /// The time at which another world last set the pose; `None` for a body that always moved in this world.
    pub placed_at: Option<SimTime>,
    /// The beams that the other world measured at that time. In a box, because few bodies have them.
    pub scan: Option<Box<Proximity>>,
    pub vicinity: NeighborCache,
    pub unchanged: ReadingsCache,
}

impl Robot {
    pub fn position(&self) -> Vec2 {
        self.component.pose.position
    }

    pub fn set_heading(&mut self, heading_rad: f32) {
        self.unchanged.invalidate();
        self.component.pose.heading_rad = heading_rad;
        self.ahead = Vec2::from_angle(heading_rad);
    }

    pub fn can_act(&self) -> bool {
        self.present && self.powered && self.battery.is_none_or(|battery| !battery.is_empty())
    }
}

impl Floor {
    /// Requests the memory of the lists, see [`prefetch`](mod@prefetch).
    pub(super) fn prefetch(&self) {
        prefetch(&*self.robots);
        self.bodies.prefetch();
        if let Some(range) = &self.range {
            range.prefetch();
        }
    }

    /// Creates the floor at the start of a run. Robots without a start use `starts`, or `start_area` with its lower left and upper
    /// right corner, m.
    ///
    /// # Panics
    /// If [`start_poses`] rejects the scenario; validation calls that function first.
    pub(super) fn new(
        scenario: &Scenario,
        start_area: [Vec2; 2],
        starts: &[Vec2],
        bars: Vec<Bar>,
    ) -> Self {
        let poses = match start_poses(scenario, start_area, starts, &bars) {
            Ok(poses) => poses,
            Err(error) => panic!("scenario not validated: {error}"),
        };
        let body = scenario.body;
        let robots = scenario.robots.iter().zip(poses).enumerate();
        let robots = robots.map(|(rank, (robot, pose))| {
            let component = Component {
                id: ComponentId::Robot(RobotId(rank as u32)),
                pose,
                shape: Shape::Disc {
                    radius_m: body.radius_m,
                },
                penetrability: Penetrability(body.robot_penetrability),
            };
            let mut robot = Robot {
                component,
                start: pose,
                present: !robot.absent,
                powered: true,
                battery: scenario.energy.as_ref().map(Battery::full),
                ahead: Vec2::X,
                speed_m_s: 0.0,
                body: scenario.body_of(robot),
                side_sensor: robot.has_device(RobotSpec::SIDE_BORDER),
                jumps: 0,
                placed_at: None,
                scan: None,
                vicinity: NeighborCache::default(),
                unchanged: ReadingsCache::default(),
            };
            robot.set_heading(pose.heading_rad);
            robot
        });
        let robots: Vec<Robot> = robots.collect();
        let space = Space::new(scenario, bars);
        let sensed_m = 3.0 * body.radius_m + scenario.sensors.avoidance_range_m;
        let mut bodies = Grid::new(&space.room, sensed_m, robots.len());
        for (rank, robot) in robots.iter().enumerate() {
            if robot.present {
                bodies.insert(rank, robot.position());
            }
        }
        let range = scenario.radio.range_m.map(|range_m| {
            let places = robots.iter().map(Robot::position);
            RadioRange::new(&space.room, range_m, places)
        });
        Self {
            radio: scenario.radio,
            range,
            impairments: Vec::new(),
            now: SimTime::ZERO,
            step: SimTime(scenario.step_ms),
            body,
            sensors: scenario.sensors,
            has_energy: scenario.energy.is_some(),
            robots,
            bodies,
            drift: Drift::new(&space.room),
            space,
        }
    }

    pub(super) fn draw_energy(&mut self, happened: &mut StepEvents) {
        for (rank, robot) in self.robots.iter_mut().enumerate() {
            let Some(battery) = &mut robot.battery else {
                continue;
            };
            if !robot.present || !robot.powered {
                continue;
            }
            let drive = if robot.body.speed_m_s > 0.0 {
                robot.speed_m_s / robot.body.speed_m_s
            } else {
                0.0
            };
            let was_empty = battery.is_empty();
            battery.draw(drive, self.step);
            if !was_empty && battery.is_empty() {
                let robot = Some(RobotId(rank as u32));
                happened.add(Event::new(EventKind::EnergyOut, robot));
            }
        }
    }

    /// Returns the simulated time of the readings and of the next step's commands.
    #[must_use]
    pub fn now(&self) -> SimTime {
        self.now
    }

    /// Checks whether a robot has a body in the world.
    #[must_use]
    pub fn is_present(&self, robot: RobotId) -> bool {
        self.robots[robot.index()].present
    }

    /// Returns the pose of a robot; for an absent robot, the last or future one.
    #[must_use]
    pub fn pose(&self, robot: RobotId) -> Pose {
        self.robots[robot.index()].component.pose
    }

    /// Returns the mean speed of a robot in the last step, m/s.
    #[must_use]
    pub fn speed_m_s(&self, robot: RobotId) -> f32 {
        self.robots[robot.index()].speed_m_s
    }

    /// Returns the remaining energy of a robot, J; `None` if energy is not simulated.
    #[must_use]
    pub fn energy_j(&self, robot: RobotId) -> Option<f32> {
        let battery = self.robots[robot.index()].battery;
        battery.map(|battery| battery.charge_j())
    }

    /// Returns whether the body of a robot executes commands: it is in the room, has power and a charge.
    #[must_use]
    pub fn can_act(&self, robot: RobotId) -> bool {
        self.robots[robot.index()].can_act()
    }

    /// Charges the battery of a robot, at most up to its capacity. Returns the energy that the battery took, J; 0 if energy is
    /// not simulated.
    pub fn charge(&mut self, robot: RobotId, energy_j: f64) -> f64 {
        let battery = &mut self.robots[robot.index()].battery;
        let taken = battery.as_mut().map(|battery| battery.charge(energy_j));
        taken.unwrap_or_default()
    }

    /// Returns whether a robot's battery is full. True if energy is not simulated.
    #[must_use]
    pub fn is_fully_charged(&self, robot: RobotId) -> bool {
        let battery = self.robots[robot.index()].battery;
        battery.is_none_or(|battery| battery.is_full())
    }

    /// Returns the energy that a robot's battery has received since the start, J.
    #[must_use]
    pub fn received_j(&self, robot: RobotId) -> f64 {
        let battery = self.robots[robot.index()].battery;
        battery.map_or(0.0, |battery| battery.received_j())
    }

    /// Returns all rectangles by id: obstacles and patches.
    #[must_use]
    pub fn obstacles(&self) -> &[Component] {
        self.space.rectangles()
    }

    /// Returns the number of robots, with or without a body.
    #[must_use]
    pub fn robot_count(&self) -> usize {
        self.robots.len()
    }

    /// Returns the common properties of the bodies: size, gripper and penetrability.
    #[must_use]
    pub fn body(&self) -> &Body {
        &self.body
    }

    /// Returns the body of a robot, with its own speeds and turn rate.
    #[must_use]
    pub fn body_of(&self, robot: RobotId) -> &Body {
        &self.robots[robot.index()].body
    }

    /// Returns the skills that are impaired in this step.
    #[must_use]
    pub fn impairments(&self) -> &[Impairment] {
        &self.impairments
    }

    /// Sets the impaired skills of the next step.
    pub fn impair(&mut self, impairments: impl Iterator<Item = Impairment>) {
        self.impairments.clear();
        self.impairments.extend(impairments);
    }

    /// Applies a skill of a robot in this step and returns its remaining share, 0 to 1.
    pub fn apply_skill(&mut self, robot: RobotId, skill: &str) -> f64 {
        let impairments = self.impairments.iter_mut();
        let matching =
            impairments.filter(|impairment| impairment.robot == robot && impairment.skill == skill);
        matching.fold(1.0, |left, impairment| {
            impairment.was_used = impairment.share < 1.0;
            left * impairment.share
        })
    }

    /// Returns the sensor ranges.
    #[must_use]
    pub fn sensors(&self) -> &Sensors {
        &self.sensors
    }

    /// Returns the border of the run.
    #[must_use]
    pub fn room(&self) -> &Room {
        &self.space.room
    }

    /// Returns everything solid except the bodies: the walls, the solid rectangles and the bars.
    pub fn solids(&self) -> impl Iterator<Item = Outline> + '_ {
        self.space.solids()
    }

    /// Clears the cached surroundings of all robots. No result changes; tests use this to check the caches.
    pub fn clear_caches(&mut self) {
        for robot in &mut self.robots {
            robot.vicinity = NeighborCache::default();
            robot.unchanged.invalidate();
            // The mission searches again, too.
            robot.jumps += 1;
        }
    }

    /// Returns the unit vector of a robot's heading.
    #[must_use]
    pub fn ahead(&self, robot: RobotId) -> Vec2 {
        self.robots[robot.index()].ahead
    }

    /// Returns how often a robot's body was placed somewhere. A new number invalidates cached surroundings.
    #[must_use]
    pub fn placement_count(&self, robot: RobotId) -> u32 {
        self.robots[robot.index()].jumps
    }

    /// Returns the bodies within reach of a point, with their centers, and some out of reach.
    #[inline]
    pub fn bodies_near(
        &self,
        point: Vec2,
        reach_m: f32,
    ) -> impl Iterator<Item = (RobotId, Vec2)> + '_ {
        let near = self.bodies.near(point, reach_m);
        near.map(|(rank, at)| (RobotId(rank as u32), at))
    }

    /// Checks whether a disc overlaps no solid except bodies.
    #[must_use]
    pub fn fits(&self, center: Vec2, radius_m: f32) -> bool {
        self.space.fits(center, radius_m, 0.0)
    }

    /// Checks whether a robot can work at a place from within `reach_m`, without regard to other robots and to the path. Either
    /// a robot can stand there, or the place lies in no solid and a robot has room to drive nearby.
    #[must_use]
    pub fn can_be_worked_on(&self, place: Vec2, reach_m: f32) -> bool {
        self.space.can_be_worked_on(place, reach_m, &self.body)
    }

    /// Checks whether a robot can grip a thing at a place, from a place that `is_free`. Half of the gripper's reach remains as a
    /// margin. The path to that place is not checked.
    pub fn can_be_gripped(
        &self,
        thing: Vec2,
        radius_m: f32,
        is_free: impl Fn(Vec2) -> bool,
    ) -> bool {
        self.space
            .can_be_gripped(thing, radius_m, &self.body, is_free)
    }

    /// Returns the first place for which `will_do` holds, in rings of growing radius round the center.
    pub fn nearest_place(&self, center: Vec2, will_do: impl Fn(Vec2) -> bool) -> Option<Vec2> {
        nearest_place(center, &self.space.room, will_do)
    }
}
