//! The way to a place behind an end of a bar: away from the bar, along it at a distance, and up to it.

use std::f32::consts::PI;

use glam::Vec2;
use proto::readings::{Actuation, Pose, Readings};
use robot_agent::body::{Chassis, Driver, wrap};
use scenario::Setup;
use scenario::ids::RobotId;
use scenario::time::SimTime;

use crate::push::bar::{BarEnd, from_bar_frame, to_bar_frame};
use crate::push::data::{PUSH_PLACES, PushSection};

/// The distance behind a bar at which a robot drives along it, m.
const BEHIND_M: f32 = 0.45;
/// The distance behind a bar from which a robot need not move away first, m.
const AWAY_M: f32 = 0.2;
/// The largest deviation from the line to the place, m. Beyond it the robot starts the approach again.
const ASIDE_M: f32 = 0.15;
/// The tolerance for a place on the way, m.
const NEAR_M: f32 = 0.06;
/// The distance at which a hull touches a bar, for a dead touch sensor, m.
const TOUCH_M: f32 = 0.01;
/// The largest heading error of a robot that pushes, rad from the goal's direction.
const SQUARE_RAD: f32 = 0.1;
/// The distance from the edges of the outer third that a robot keeps, m.
const INSIDE_M: f32 = 0.02;
/// The time beyond twice the expected duration after which the way counts as blocked, s.
const PATIENCE_S: f32 = 6.0;

/// Returns whether a place in the bar's frame is beside the outer third at that end.
fn is_within_third(seen: &Vec2, end: BarEnd, section: &PushSection) -> bool {
    let third = section.length_m / 6.0 + INSIDE_M..=section.length_m / 2.0 - INSIDE_M;
    third.contains(&(end.sign() * seen.y))
}

#[derive(Clone, Debug)]
pub(super) struct Approach {
    driver: Driver,
    chassis: Chassis,
    /// The place of the robot at the left end and at the right one. It changes if the way to it is blocked.
    spots: [usize; 2],
    /// The time from which the way counts as blocked.
    until: Option<SimTime>,
    /// True if the robot was behind its place and now approaches the bar.
    is_lined_up: bool,
    /// True if the robot must leave its present place first.
    goes_round: bool,
    /// True while the robot moves away from the bar.
    gets_away: bool,
}

impl Approach {
    pub fn new(robot: RobotId, setup: &Setup) -> Self {
        let scenario = &setup.scenario;
        Self {
            driver: Driver::new(robot, setup),
            chassis: Chassis::new(scenario, &scenario.robots[robot.index()]),
            spots: [0; 2],
            until: None,
            is_lined_up: false,
            goes_round: false,
            gets_away: false,
        }
    }

    /// Resets the state of the way, because the robot changes its task.
    pub fn end(&mut self) {
        self.until = None;
        self.is_lined_up = false;
        self.goes_round = false;
        self.gets_away = false;
    }

    fn hull_m(&self, section: &PushSection) -> f32 {
        self.chassis.radius_m + section.half_width_m
    }

    pub fn place_in_room(&self, bar: &Pose, end: BarEnd, section: &PushSection) -> Vec2 {
        let spot = PUSH_PLACES[self.spots[usize::from(end == BarEnd::Right)]];
        let along_m = end.sign() * (0.5 - spot) * section.length_m;
        from_bar_frame(bar, Vec2::new(-self.hull_m(section), along_m))
    }

    pub fn is_in_place(
        &self,
        bar: &Pose,
        end: BarEnd,
        section: &PushSection,
        position: Vec2,
        touch: Option<bool>,
    ) -> bool {
        let seen = to_bar_frame(bar, position);
        let touches = touch.unwrap_or(seen.x >= -self.hull_m(section) - TOUCH_M);
        touches && seen.x < 0.0 && is_within_third(&seen, end, section)
    }

    pub fn push(&mut self, pose: &Pose) -> Actuation {
        self.until = None;
        let bearing = wrap(-pose.heading_rad);
        let way_m = if bearing.abs() < SQUARE_RAD {
            f32::INFINITY
        } else {
            0.0
        };
        self.chassis.drive(bearing, way_m)
    }

    pub fn go(
        &mut self,
        bar: &Pose,
        end: BarEnd,
        section: &PushSection,
        pose: &Pose,
        readings: &Readings,
        now: SimTime,
    ) -> Actuation {
        let place = self.place_in_room(bar, end, section);
        let seen = to_bar_frame(bar, pose.position);
        let hull_m = self.hull_m(section);
        let aside_m = (place.y - pose.position.y).abs();
        let staging = place - Vec2::new(BEHIND_M, 0.0);
        let is_there = aside_m <= NEAR_M && seen.x < TOUCH_M - hull_m;
        self.is_lined_up = (self.is_lined_up || is_there) && aside_m <= ASIDE_M;
        let ahead = readings.proximity.and_then(|proximity| proximity.ahead[1]);
        let meets_something = ahead.is_some_and(|hit| hit.distance_m < TOUCH_M);
        let is_blocked = meets_something && seen.x < -hull_m - TOUCH_M;
        // The robot was in place before, and the bar has moved on a little.
        let is_just_behind =
            is_within_third(&seen, end, section) && (-hull_m - AWAY_M..=0.0).contains(&seen.x);
        self.goes_round |= is_blocked || !is_just_behind;
        if !self.goes_round {
            return self.chassis.drive(wrap(-pose.heading_rad), BEHIND_M);
        }
        self.check_time(bar, end, section, pose, now);
        if self.is_lined_up && seen.x < TOUCH_M - hull_m {
            if is_blocked {
                self.take_another_place(end);
            }
            let toward = place + Vec2::new(AWAY_M, 0.0) - pose.position;
            let bearing = wrap(libm::atan2f(toward.y, toward.x) - pose.heading_rad);
            return self.chassis.drive(bearing, BEHIND_M);
        }
        let is_behind =
            seen.x < 0.0 && seen.y.abs() < section.length_m / 2.0 + self.chassis.radius_m;
        let gap_m = -hull_m - seen.x;
        // The robot moves away for good: on its way along an inclined bar it comes nearer again.
        let leaves_at_m = if self.gets_away {
            BEHIND_M - NEAR_M
        } else {
            AWAY_M
        };
        self.gets_away = is_behind && gap_m < leaves_at_m;
        let to = if self.gets_away {
            pose.position - Vec2::new(BEHIND_M - gap_m, 0.0)
        } else {
            staging
        };
        self.driver.drive_to(to, NEAR_M / 2.0, readings, now)
    }

    /// Takes another place at that end if the way to the present one proves to be blocked.
    fn check_time(
        &mut self,
        bar: &Pose,
        end: BarEnd,
        section: &PushSection,
        pose: &Pose,
        now: SimTime,
    ) {
        if self.until.is_some_and(|until| now < until) {
            return;
        }
        if self.until.is_some() {
            self.take_another_place(end);
        }
        let way_m = self
            .place_in_room(bar, end, section)
            .distance(pose.position)
            + 2.0 * BEHIND_M;
        let way_s = way_m / self.chassis.speed_m_s + PI / self.chassis.turn_rad_s;
        self.until = Some(now + SimTime::from_secs_f64(f64::from(2.0 * way_s + PATIENCE_S)));
    }

    fn take_another_place(&mut self, end: BarEnd) {
        let spot = &mut self.spots[usize::from(end == BarEnd::Right)];
        *spot = (*spot + 1) % PUSH_PLACES.len();
        self.until = None;
        self.is_lined_up = false;
    }

    /// Returns the travel time in a straight line at top speed, s.
    pub fn seconds(&self, from: Vec2, to: Vec2) -> f64 {
        self.driver.seconds(from, to)
    }
}
