//! Following the outline of an obstacle (thesis §4.2.1, Fig. 4.5 and 4.6), with a memory.
//!
//! The robot aligns with the side that it hit and goes along it until the side beams are free, then turns round the
//! corner. Unlike the thesis' rule it leaves the outline only where it is nearer to its goal than where it met it: this is
//! what keeps it from going round several obstacles for ever.

use std::f32::consts::{FRAC_PI_2, PI};

use alliance_proto::readings::{Actuation, Hit};
use glam::Vec2;

use super::chassis::FACING_RAD;
use super::goal::{Goal, length};
use super::surroundings::{Side, Surroundings};
use super::{Chassis, wrap};

/// Distance kept from the outline, m.
pub const CLEARANCE_M: f32 = 0.08;
/// What is at most this much farther than the clearance is reached: rounding must not keep the robot waiting for it.
const CLOSE_M: f32 = 0.01;
/// How much nearer to the goal a detour must have come before it may end, m.
const GAIN_M: f32 = 0.05;
/// How far the robot goes on after a change of course, m. Turning exactly at a corner would graze it.
const A_LITTLE_M: f32 = 0.05;
/// Steering back to the clearance, rad per m.
const STEER_RAD_PER_M: f32 = 1.5;
/// Largest such correction, rad; below [`FACING_RAD`], so that it never stops the robot.
const STEER_MAX_RAD: f32 = 0.15;

/// A goal at most this far on the obstacle's side of the heading counts as straight ahead, rad.
const PARALLEL_RAD: f32 = 0.05;

/// With a heading this exact the side beams see what they should, rad.
const ALIGNED_RAD: f32 = 0.03;

/// Contact with the outline.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Contact {
    /// It was ahead: the robot aligns with it here, and goes on a little before it looks to the side. Near a corner the side
    /// beams see another face than the one that matters, and the robot must not turn to and fro between the two.
    Aligned(Vec2),
    /// A side beam touches it.
    Touching,
    /// All beams are free since this place: the robot passes the corner.
    Passing(Vec2),
    /// It has turned round the corner at this place and goes on until it touches the next side.
    Turned(Vec2),
}

/// What becomes of a detour.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Course {
    /// It goes on.
    Follow(Actuation),
    /// The way to the goal is free.
    Leave,
    /// There is nothing to follow any more: it was a robot that moved on, or an obstacle that was removed.
    Lost,
    /// The whole outline has been followed, or what could be reached of it: no way.
    Closed,
}

/// A detour round one obstacle, or several that touch.
#[derive(Clone, Debug, PartialEq)]
pub struct Detour {
    side: Side,
    /// Heading along the outline, rad in the world's frame.
    along: f32,
    contact: Contact,
    /// What was left of the way where the obstacle was met, m.
    met: f32,
    /// Where the present sense of travel began.
    start: Vec2,
    /// Whether the robot has been far from there.
    away: bool,
    /// Whether the border has already turned it back once.
    turned_back: bool,
    /// How far it turned since it last moved, rad: beyond a full turn it is boxed in.
    turned: f32,
    last_heading: f32,
    last_position: Vec2,
}

impl Detour {
    /// Begins where a surface with that outward normal (rad in the world's frame) is ahead.
    #[must_use]
    pub fn new(side: Side, normal: f32, met: f32, around: &Surroundings) -> Self {
        Self {
            side,
            along: side.along(normal),
            contact: Contact::Aligned(around.pose.position),
            met,
            start: around.pose.position,
            away: false,
            turned_back: false,
            turned: 0.0,
            last_heading: around.pose.heading_rad,
            last_position: around.pose.position,
        }
    }

    /// The side on which the obstacle is.
    #[must_use]
    pub fn side(&self) -> Side {
        self.side
    }

    /// What was left of the way where the obstacle was met, m.
    #[must_use]
    pub fn met(&self) -> f32 {
        self.met
    }

    /// Whether the robot faces along the outline, so that what is ahead is in the detour's way.
    #[must_use]
    pub fn faces_along(&self, around: &Surroundings) -> bool {
        wrap(self.along - around.pose.heading_rad).abs() <= FACING_RAD
    }

    /// One step along the outline.
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
            // Not far beyond the corner in one long step.
            Contact::Aligned(_) | Contact::Passing(_) => way.min(A_LITTLE_M),
            _ => way,
        };
        let bearing = wrap(self.along - around.pose.heading_rad);
        Course::Follow(chassis.drive(bearing, way.max(0.0)))
    }

    /// Nearer to the goal than where the obstacle was met, and nothing of it lies between.
    fn may_leave(&self, goal: &Goal, around: &Surroundings) -> bool {
        let position = around.pose.position;
        let outward = -self.side.sign() * wrap(goal.direction(position) - around.pose.heading_rad);
        let clear = match self.contact {
            Contact::Passing(since) if has_moved(since, position) => outward >= -FRAC_PI_2,
            _ => outward >= -PARALLEL_RAD,
        };
        clear && goal.remaining(position) < self.met - GAIN_M
    }

    /// Sets the heading by what the beams say.
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

    /// The course along a surface that was hit, back to the clearance (rad in the world's frame).
    fn beside(&self, heading: f32, hit: &Hit) -> f32 {
        let off = (hit.distance_m - CLEARANCE_M) * STEER_RAD_PER_M;
        let correction = off.clamp(-STEER_MAX_RAD, STEER_MAX_RAD);
        wrap(self.side.along(heading + hit.normal_rad) + self.side.sign() * correction)
    }

    /// The border blocks this side: try the other one.
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

    /// Whether the robot is back where it began.
    fn has_closed(&mut self, chassis: &Chassis, position: Vec2) -> bool {
        let distance = length(position - self.start);
        self.away |= distance > 2.0 * chassis.radius_m;
        self.away && distance < chassis.radius_m
    }
}

/// Whether a robot that changed its course at `since` has gone on for a little.
fn has_moved(since: Vec2, position: Vec2) -> bool {
    length(position - since) >= A_LITTLE_M - CLOSE_M
}

impl Surroundings {
    /// What is straight ahead within the clearance.
    #[inline]
    #[must_use]
    pub fn blocked_by(&self) -> Option<Hit> {
        self.proximity.ahead[1].filter(|hit| hit.distance_m <= CLEARANCE_M + CLOSE_M)
    }
}
