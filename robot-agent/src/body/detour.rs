//! Following the outline of an obstacle (thesis §4.2.1, Fig. 4.5 and 4.6), with a memory.
//!
//! The robot aligns with the surface that it met and drives along it until the side beams are free, then turns around
//! the corner. Unlike in the thesis, it leaves the outline only nearer to its goal than where the detour began. This
//! prevents endless circling around several obstacles.

use std::f32::consts::{FRAC_PI_2, PI};

use glam::Vec2;
use proto::readings::{Actuation, Hit};

use super::chassis::FACING_RAD;
use super::goal::{Goal, length};
use super::surroundings::{Side, Surroundings};
use super::{Chassis, wrap};

/// The distance to keep from the outline, m.
pub const CLEARANCE_M: f32 = 0.08;
/// The tolerance of the clearance, m. Without it rounding could keep the robot from reaching it.
const CLOSE_M: f32 = 0.01;
/// The least gain toward the goal before a detour may end, m.
const GAIN_M: f32 = 0.05;
/// The distance to drive after a change of course, m. A turn exactly at a corner would graze it.
const A_LITTLE_M: f32 = 0.05;
const STEER_RAD_PER_M: f32 = 1.5;
/// The largest steering correction, rad. It is below [`FACING_RAD`], so that it never stops the robot.
const STEER_MAX_RAD: f32 = 0.15;

/// The largest angle of a goal on the obstacle's side that counts as straight ahead, rad.
const PARALLEL_RAD: f32 = 0.05;

/// The largest heading error at which the side beams are reliable, rad.
const ALIGNED_RAD: f32 = 0.03;

#[derive(Clone, Copy, Debug, PartialEq)]
enum Contact {
    /// The surface was ahead. The robot aligns with it here, and drives on a little before it uses the side beams.
    /// Near a corner they meet another face, and the robot would turn to and fro.
    Aligned(Vec2),
    /// A side beam meets the outline.
    Touching,
    /// A place since which all beams are free: the robot passes the corner.
    Passing(Vec2),
    /// The robot turned around the corner at this place and drives on to the next face.
    Turned(Vec2),
}

/// The next action of a detour.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Course {
    Follow(Actuation),
    Leave,
    /// The obstacle disappeared: a robot that moved on, or an object that was removed.
    Lost,
    /// The reachable outline was followed without a way to the goal.
    Closed,
}

/// A detour around one obstacle, or several that touch.
#[derive(Clone, Debug, PartialEq)]
pub struct Detour {
    side: Side,
    /// The heading along the outline, rad in the world's frame.
    along: f32,
    contact: Contact,
    /// The remaining distance to the goal where the detour began, m.
    initial_remaining: f32,
    /// The place where the present direction of travel began.
    start: Vec2,
    /// True once the robot has been away from `start`.
    away: bool,
    /// True once the border has turned the robot back.
    turned_back: bool,
    /// The angle turned since the last move, rad. Beyond one and a half turns the robot is boxed in.
    turned: f32,
    last_heading: f32,
    last_position: Vec2,
}

impl Detour {
    /// Creates a detour along the surface ahead with that outward normal, rad in the world's frame.
    #[must_use]
    pub fn new(side: Side, normal: f32, met: f32, around: &Surroundings) -> Self {
        Self {
            side,
            along: side.along(normal),
            contact: Contact::Aligned(around.pose.position),
            initial_remaining: met,
            start: around.pose.position,
            away: false,
            turned_back: false,
            turned: 0.0,
            last_heading: around.pose.heading_rad,
            last_position: around.pose.position,
        }
    }

    #[must_use]
    pub fn side(&self) -> Side {
        self.side
    }

    #[must_use]
    pub fn met(&self) -> f32 {
        self.initial_remaining
    }

    /// Returns whether the robot faces along the outline, so that an object ahead blocks the detour.
    #[must_use]
    pub fn faces_along(&self, around: &Surroundings) -> bool {
        wrap(self.along - around.pose.heading_rad).abs() <= FACING_RAD
    }

    #[must_use]
    pub fn step(&mut self, chassis: &Chassis, goal: &Goal, around: &Surroundings) -> Course {
        let position = around.pose.position;
        if self.is_boxed_in(around) || self.has_closed(chassis, position) {
            return Course::Closed;
        }
        if self.faces_along(around) {
            if self.may_leave(goal, around) {
                return Course::Leave;
            }
            if let Some(end) = self.sense(chassis, around) {
                return end;
            }
        }
        let way = around.free_ahead() - CLEARANCE_M;
        let way = match self.contact {
            // In a long step the robot must not pass far beyond the corner.
            Contact::Aligned(_) | Contact::Passing(_) => way.min(A_LITTLE_M),
            _ => way,
        };
        let bearing = wrap(self.along - around.pose.heading_rad);
        Course::Follow(chassis.drive(bearing, way.max(0.0)))
    }

    /// Returns whether the robot is nearer to the goal than at the start, with a free way to it.
    fn may_leave(&self, goal: &Goal, around: &Surroundings) -> bool {
        let position = around.pose.position;
        let outward = -self.side.sign() * wrap(goal.direction(position) - around.pose.heading_rad);
        let clear = match self.contact {
            Contact::Passing(since) if has_moved(since, position) => outward >= -FRAC_PI_2,
            _ => outward >= -PARALLEL_RAD,
        };
        clear && goal.remaining(position) < self.initial_remaining - GAIN_M
    }

    /// Sets the heading from the beams. Returns the end of the detour, if any.
    fn sense(&mut self, chassis: &Chassis, around: &Surroundings) -> Option<Course> {
        let heading = around.pose.heading_rad;
        let position = around.pose.position;
        if let Some(hit) = around.blocked_by() {
            if around.is_border_ahead() {
                if self.turned_back {
                    return Some(Course::Closed);
                }
                self.turn_back(position);
            } else {
                self.along = self.beside(heading, &hit);
                self.contact = Contact::Aligned(position);
            }
            return None;
        }
        let holds = match self.contact {
            Contact::Aligned(since) | Contact::Turned(since) => !has_moved(since, position),
            Contact::Touching | Contact::Passing(_) => false,
        };
        if holds || wrap(self.along - heading).abs() > ALIGNED_RAD {
            return None;
        }
        let beside = around.beside(self.side);
        let nearest = beside
            .iter()
            .flatten()
            .min_by(|a, b| a.distance_m.total_cmp(&b.distance_m));
        if let Some(hit) = nearest {
            self.along = self.beside(heading, hit);
            self.contact = Contact::Touching;
            return None;
        }
        match self.contact {
            Contact::Aligned(_) | Contact::Touching => self.contact = Contact::Passing(position),
            Contact::Passing(since) if has_moved(since, position) => {
                self.along = wrap(self.along + self.side.sign() * FRAC_PI_2);
                self.contact = Contact::Turned(position);
            }
            Contact::Passing(_) => {}
            Contact::Turned(since) => {
                let enough = 2.0 * chassis.radius_m + 4.0 * CLEARANCE_M;
                if length(position - since) > enough {
                    return Some(Course::Lost);
                }
            }
        }
        None
    }

    /// Returns the course along a surface, back toward the clearance, rad in the world's frame.
    fn beside(&self, heading: f32, hit: &Hit) -> f32 {
        let off = (hit.distance_m - CLEARANCE_M) * STEER_RAD_PER_M;
        let correction = off.clamp(-STEER_MAX_RAD, STEER_MAX_RAD);
        wrap(self.side.along(heading + hit.normal_rad) + self.side.sign() * correction)
    }

    /// Tries the other side, because the border blocks this one.
    fn turn_back(&mut self, position: Vec2) {
        self.side = self.side.other();
        self.along = wrap(self.along + PI);
        self.contact = Contact::Touching;
        self.turned_back = true;
        self.start = position;
        self.away = false;
        self.turned = 0.0;
    }

    fn is_boxed_in(&mut self, around: &Surroundings) -> bool {
        if length(around.pose.position - self.last_position) > CLOSE_M {
            self.last_position = around.pose.position;
            self.turned = 0.0;
        }
        self.turned += wrap(around.pose.heading_rad - self.last_heading).abs();
        self.last_heading = around.pose.heading_rad;
        self.turned > 3.0 * PI
    }

    /// Returns whether the robot is back at the start of the detour.
    fn has_closed(&mut self, chassis: &Chassis, position: Vec2) -> bool {
        let distance = length(position - self.start);
        self.away |= distance > 2.0 * chassis.radius_m;
        self.away && distance < chassis.radius_m
    }
}

/// Returns whether the robot has driven on after a change of course at `since`.
fn has_moved(since: Vec2, position: Vec2) -> bool {
    length(position - since) >= A_LITTLE_M - CLOSE_M
}

impl Surroundings {
    /// Returns the object straight ahead within the clearance.
    #[inline]
    #[must_use]
    pub fn blocked_by(&self) -> Option<Hit> {
        self.proximity.ahead[1].filter(|hit| hit.distance_m <= CLEARANCE_M + CLOSE_M)
    }
}
