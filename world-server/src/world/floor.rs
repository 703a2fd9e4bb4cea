//! The world without a mission: space, bodies, what is near, time.

use alliance_proto::ids::RobotId;
use alliance_proto::readings::Pose;
use alliance_proto::scenario::{Body, Robot as RobotSpec, Scenario, Sensors};
use alliance_proto::time::SimTime;
use glam::Vec2;

use super::grid::Grid;
use super::happened::Happened;
use super::radio::RadioRange;
use super::space::{Space, nearest_place};
use super::unchanged::Unchanged;
use super::vicinity::{Drift, Vicinity};
use super::{
    Aspect, Bar, Battery, Component, ComponentId, Outline, Penetrability, Shape, start_poses,
};
use crate::recorder::{Event, EventKind};

/// Space, bodies and time: what every mission has.
#[derive(Clone, Debug)]
pub struct Floor {
    pub(super) now: SimTime,
    pub(super) step: SimTime,
    pub(super) body: Body,
    pub(super) sensors: Sensors,
    pub(super) space: Space,
    /// By rank.
    pub(super) robots: Vec<Robot>,
    /// Whether any of them has aspects.
    pub(super) has_aspects: bool,
    /// Ranks of those that are there, by their centers.
    pub(super) bodies: Grid,
    pub(super) drift: Drift,
    /// `None` where all hear all.
    pub(super) range: Option<RadioRange>,
    /// In this step.
    impairments: Vec<Impairment>,
}

/// A skill of a robot of which only a share is left.
#[derive(Clone, Debug, PartialEq)]
pub struct Impairment {
    /// Whose.
    pub robot: RobotId,
    /// Which one.
    pub skill: String,
    /// What is left of it, 0 to 1.
    pub share: f64,
    /// Whether the robot has used it in this step.
    pub has_acted: bool,
}

/// A robot's body.
#[derive(Clone, Debug)]
pub(super) struct Robot {
    pub component: Component,
    /// Where it enters the mission.
    pub start: Pose,
    /// Whether it has a body in the world.
    pub present: bool,
    /// Whether its power is switched on.
    pub powered: bool,
    /// Unit vector of its heading.
    pub ahead: Vec2,
    /// Over the last step.
    pub speed_m_s: f32,
    pub body: Body,
    pub side_sensor: bool,
    /// How often it has been put somewhere.
    pub jumps: u32,
    pub vicinity: Vicinity,
    pub unchanged: Unchanged,
}

impl Robot {
    pub fn position(&self) -> Vec2 {
        self.component.pose.position
    }

    pub fn face(&mut self, heading_rad: f32) {
        self.unchanged.end();
        self.component.pose.heading_rad = heading_rad;
        self.ahead = Vec2::new(libm::cosf(heading_rad), libm::sinf(heading_rad));
    }

    pub fn can_act(&self) -> bool {
        let aspects = &self.component.aspects;
        self.present && self.powered && aspects.iter().all(Aspect::is_powered)
    }
}

impl Floor {
    /// The floor at the start of a run, with the mission's bars. Robots without a start begin at those places or in that area: lower left and upper right
    /// corner, m.
    ///
    /// # Panics
    /// If [`start_poses`] refuses the scenario; validation asks it first.
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
                body: scenario.body_of(robot),
                side_sensor: robot.has_device(RobotSpec::SIDE_BORDER),
                jumps: 0,
                vicinity: Vicinity::default(),
                unchanged: Unchanged::default(),
            };
            robot.face(pose.heading_rad);
            robot
        });
        let robots: Vec<Robot> = robots.collect();
        let space = Space::new(scenario, bars);
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
            impairments: Vec::new(),
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
            space,
        }
    }

    pub(super) fn evolve_aspects(&mut self, happened: &mut Happened) {
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
                    let robot = Some(RobotId(rank as u16));
                    happened.add(Event::new(EventKind::EnergyOut, robot));
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

    /// Energy that a robot has left, J; `None` where energy is not simulated.
    #[must_use]
    pub fn energy_j(&self, robot: RobotId) -> Option<f32> {
        let aspects = &self.robots[robot.index()].component.aspects;
        aspects
            .iter()
            .map(|Aspect::Energy(battery)| battery.charge_j())
            .next()
    }

    /// All rectangles on the floor, by id: solid obstacles and patches.
    #[must_use]
    pub fn obstacles(&self) -> &[Component] {
        self.space.rectangles()
    }

    /// Number of robots, those without a body included.
    #[must_use]
    pub fn robot_count(&self) -> usize {
        self.robots.len()
    }

    /// What the bodies have in common: size, gripper and penetrability. Speeds may differ.
    #[must_use]
    pub fn body(&self) -> &Body {
        &self.body
    }

    /// The body of a robot, with its own speeds and turn rate.
    #[must_use]
    pub fn body_of(&self, robot: RobotId) -> &Body {
        &self.robots[robot.index()].body
    }

    /// The skills that are impaired in this step.
    #[must_use]
    pub fn impairments(&self) -> &[Impairment] {
        &self.impairments
    }

    /// Impairs these skills, and no others, in the step to come.
    pub fn impair(&mut self, impairments: impl Iterator<Item = Impairment>) {
        self.impairments.clear();
        self.impairments.extend(impairments);
    }

    /// A robot uses a skill in this step: what share faults have left of it, 0 to 1.
    pub fn use_skill(&mut self, robot: RobotId, skill: &str) -> f64 {
        let own = self.impairments.iter_mut();
        let own = own.filter(|it| it.robot == robot && it.skill == skill);
        own.fold(1.0, |left, impairment| {
            impairment.has_acted = impairment.share < 1.0;
            left * impairment.share
        })
    }

    /// How far sensors reach.
    #[must_use]
    pub fn sensors(&self) -> &Sensors {
        &self.sensors
    }

    /// From (0, 0) to here is inside the border, m.
    #[must_use]
    pub fn size(&self) -> Vec2 {
        self.space.size
    }

    /// Everything solid but the bodies: the walls, the solid rectangles and the bars.
    pub fn solids(&self) -> impl Iterator<Item = Outline> + '_ {
        self.space.solids()
    }

    /// Drops what is remembered of each robot's surroundings, so that it is looked at anew. It changes no step: it is for tests
    /// of what is remembered.
    pub fn forget_surroundings(&mut self) {
        for robot in &mut self.robots {
            robot.vicinity = Vicinity::default();
            robot.unchanged.end();
            // The mission, too, looks anew.
            robot.jumps += 1;
        }
    }

    /// Unit vector of a robot's heading.
    #[must_use]
    pub fn ahead(&self, robot: RobotId) -> Vec2 {
        self.robots[robot.index()].ahead
    }

    /// How often a robot's body has been put somewhere: what was known of its surroundings before holds no more.
    #[must_use]
    pub fn jumps(&self, robot: RobotId) -> u32 {
        self.robots[robot.index()].jumps
    }

    /// The bodies whose centers are within reach of a point, with these, and some that are not within reach.
    #[inline]
    pub fn bodies_near(
        &self,
        point: Vec2,
        reach_m: f32,
    ) -> impl Iterator<Item = (RobotId, Vec2)> + '_ {
        let near = self.bodies.near(point, reach_m);
        near.map(|(rank, at)| (RobotId(rank as u16), at))
    }

    /// Whether a disc overlaps nothing solid but bodies.
    #[must_use]
    pub fn fits(&self, center: Vec2, radius_m: f32) -> bool {
        self.space.fits(center, radius_m, 0.0)
    }

    /// Whether a thing fits there and a robot can grip it from a place that `is_free`. Half of the gripper's reach is left as
    /// a margin for the robot's own inaccuracy. That the robot finds a way to that place is not checked.
    pub fn can_be_gripped(
        &self,
        thing: Vec2,
        radius_m: f32,
        is_free: impl Fn(Vec2) -> bool,
    ) -> bool {
        self.space
            .can_be_gripped(thing, radius_m, &self.body, is_free)
    }

    /// The first place that will do, in rings of growing radius round the center.
    pub fn nearest_place(&self, center: Vec2, will_do: impl Fn(Vec2) -> bool) -> Option<Vec2> {
        nearest_place(center, self.space.size, will_do)
    }
}
