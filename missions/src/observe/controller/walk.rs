//! The motion of a robot: along a force or at random, around obstacles, and within the region.

use std::f32::consts::{FRAC_PI_2, FRAC_PI_3, TAU};

use glam::Vec2;
use proto::readings::{Actuation, Readings};
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use robot_agent::body::{Chassis, Goal, Navigator, Status, Surroundings};
use scenario::Setup;
use scenario::ids::RobotId;
use scenario::rng::{Purpose, robot_stream};
use scenario::time::SimTime;

use crate::observe::data::Area;

/// The distance between the hull and the region's edge at which a robot turns back, m.
const MARGIN_M: f32 = 0.3;
/// The mean time between two turns of a wandering robot, s.
const STRAIGHT_S: f64 = 20.0;
/// The least force that moves a robot.
const LEAST: f32 = 0.05;

#[derive(Clone, Debug)]
pub(super) struct Walk {
    chassis: Chassis,
    navigator: Navigator,
    area: Area,
    rng: ChaCha8Rng,
    course: Vec2,
    turns_at: SimTime,
}

impl Walk {
    pub fn new(robot: RobotId, setup: &Setup) -> Self {
        let scenario = &setup.scenario;
        let mut rng = robot_stream(setup.seed, Purpose::Behavior, robot);
        Self {
            chassis: Chassis::new(scenario, &scenario.robots[robot.index()]),
            navigator: Navigator::default(),
            area: Area::from_scenario(scenario).inset(scenario.body.radius_m + MARGIN_M),
            course: Vec2::from_angle(TAU * rng.random::<f32>()),
            turns_at: SimTime::ZERO,
            rng,
        }
    }

    /// Returns the actuation along a force. The speed grows with the force.
    pub fn follow(&mut self, mut force: Vec2, readings: &Readings, now: SimTime) -> Actuation {
        let Some(around) = Surroundings::from_readings(readings) else {
            return Actuation::default();
        };
        if let Some(inward) = self.area.inward(around.pose.position) {
            force -= force.dot(inward).min(0.0) * inward;
        }
        let strength = force.length();
        if strength < LEAST {
            return Actuation::default();
        }
        let (actuation, _) = self.go(force / strength, &around, now);
        Actuation {
            speed_m_s: actuation.speed_m_s * strength.min(1.0),
            ..actuation
        }
    }

    /// Returns the actuation of a random walk: straight on, with a turn at random times.
    pub fn wander(&mut self, readings: &Readings, now: SimTime) -> Actuation {
        let Some(around) = Surroundings::from_readings(readings) else {
            return Actuation::default();
        };
        let inward = self.area.inward(around.pose.position);
        if let Some(inward) = inward.filter(|inward| self.course.dot(*inward) <= 0.0) {
            self.course = self.turned(inward, FRAC_PI_3);
        } else if now >= self.turns_at {
            self.course = self.turned(self.course, FRAC_PI_2);
            let wait_s = -STRAIGHT_S * libm::log(1.0 - self.rng.random::<f64>());
            self.turns_at = now + SimTime::from_secs_f64(wait_s);
        }
        let (actuation, status) = self.go(self.course, &around, now);
        if status == Status::Blocked {
            self.turns_at = now;
        }
        actuation
    }

    /// Returns a direction turned by a random angle of at most `most_rad`, rad.
    fn turned(&mut self, from: Vec2, most_rad: f32) -> Vec2 {
        let angle = most_rad * (2.0 * self.rng.random::<f32>() - 1.0);
        Vec2::from_angle(angle).rotate(from).normalize_or(Vec2::X)
    }

    fn go(&mut self, way: Vec2, around: &Surroundings, now: SimTime) -> (Actuation, Status) {
        let goal = Goal::Direction(way);
        let drive = self.navigator.drive(&self.chassis, goal, around, [], now);
        (drive.actuation, drive.status)
    }
}
