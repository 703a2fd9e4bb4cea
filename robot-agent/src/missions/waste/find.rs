//! find-locations: find the border's extremes, in two ways (thesis §4.1.2.1, Fig. 4.4).

use std::f32::consts::{FRAC_PI_2, PI};

use alliance_proto::readings::Readings;
use alliance_proto::time::SimTime;
use glam::Vec2;

use super::extremes::Extremes;
use crate::body::{Goal, Status, wrap};

/// How near to a wall the robot turns, and at which distance it follows one, m.
const WALL_M: f32 = 0.15;
/// Steering back to that distance, rad per m, and its limit.
const STEER_RAD_PER_M: f32 = 0.5;
const STEER_MAX_RAD: f32 = 0.08;
/// Faces a wall squarely, rad.
const FACING_RAD: f32 = 0.1;
/// A leg of the first round of wandering.
const FIRST_LEG: SimTime = SimTime(30_000);
/// Wandering, the robot takes the next leg when it has found the way blocked so often.
const BLOCKED: u32 = 2;
/// An extreme that moved by this much is progress (ALLIANCE.md §3), m.
const PROGRESS_M: f32 = 0.1;

/// The directions in which the walls lie, in the order in which both behaviors take them.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Compass {
    West,
    North,
    East,
    South,
}

impl Compass {
    pub const CLOCKWISE: [Self; 4] = [Self::West, Self::North, Self::East, Self::South];

    /// Unit vector.
    pub fn vector(self) -> Vec2 {
        match self {
            Self::West => Vec2::NEG_X,
            Self::North => Vec2::Y,
            Self::East => Vec2::X,
            Self::South => Vec2::NEG_Y,
        }
    }

    /// Heading in that direction, rad.
    pub fn heading(self) -> f32 {
        match self {
            Self::West => PI,
            Self::North => FRAC_PI_2,
            Self::East => 0.0,
            Self::South => -FRAC_PI_2,
        }
    }
}

/// Whether the robot stands before the wall in that direction.
fn is_before(wall: Compass, readings: &Readings) -> bool {
    let faces = readings
        .pose
        .is_some_and(|pose| wrap(wall.heading() - pose.heading_rad).abs() < FACING_RAD);
    let distance = readings.front_border.flatten();
    faces && distance.is_some_and(|distance| distance <= WALL_M)
}

/// What one step of searching comes to.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Search {
    /// Go there; `progress` if this step had an effect on the world.
    Go { goal: Goal, progress: bool },
    /// All walls have been visited.
    Finished { progress: bool },
}

/// find-locations-methodical: to the left wall, then clockwise along each wall to the next.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Methodical {
    /// Walls visited.
    visited: usize,
}

impl Methodical {
    pub fn step(&mut self, readings: &Readings) -> Search {
        let mut progress = false;
        if let Some(&wall) = Compass::CLOCKWISE.get(self.visited)
            && is_before(wall, readings)
        {
            // The way to the first wall follows none.
            progress = self.visited > 0;
            self.visited += 1;
        }
        match Compass::CLOCKWISE.get(self.visited) {
            Some(&wall) => Search::Go {
                goal: Goal::Direction(self.along(wall, readings)),
                progress,
            },
            None => Search::Finished { progress },
        }
    }

    /// Straight toward the wall, at a constant distance from the one to the left where the side sensor feels it.
    fn along(&self, wall: Compass, readings: &Readings) -> Vec2 {
        let aligned = readings
            .pose
            .is_some_and(|pose| wrap(wall.heading() - pose.heading_rad).abs() < FACING_RAD);
        let beside = readings.side_border.flatten();
        let correction = match beside.filter(|_| aligned && self.visited > 0) {
            Some(distance) => (distance - WALL_M) * STEER_RAD_PER_M,
            None => 0.0,
        };
        let correction = correction.clamp(-STEER_MAX_RAD, STEER_MAX_RAD);
        if correction == 0.0 {
            return wall.vector();
        }
        let heading = wall.heading() + correction;
        Vec2::new(libm::cosf(heading), libm::sinf(heading))
    }
}

/// find-locations-wander: a while to the west, north, east and south; longer each round, until each wall was sensed.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Wander {
    leg: usize,
    leg_time: SimTime,
    spent: SimTime,
    blocked: u32,
    /// Reach of the extremes in the leg's direction when progress was last counted, m.
    counted: Option<f32>,
}

impl Default for Wander {
    fn default() -> Self {
        Self {
            leg: 0,
            leg_time: FIRST_LEG,
            spent: SimTime::ZERO,
            blocked: 0,
            counted: None,
        }
    }
}

impl Wander {
    /// One step of that length; `status` is how the body got on in the step before.
    pub fn step(
        &mut self,
        readings: &Readings,
        extremes: &Extremes,
        step: SimTime,
        status: Status,
    ) -> Search {
        let direction = Compass::CLOCKWISE[self.leg];
        self.spent = self.spent + step;
        if status == Status::Blocked {
            self.blocked += 1;
        }
        let reach = extremes.reach(direction);
        let counted = *self.counted.get_or_insert(reach);
        let progress = reach - counted >= PROGRESS_M;
        if progress {
            self.counted = Some(reach);
        }
        if is_before(direction, readings) || self.spent >= self.leg_time || self.blocked >= BLOCKED
        {
            self.next_leg(extremes);
            if extremes.border().is_some() {
                return Search::Finished { progress };
            }
        }
        Search::Go {
            goal: Goal::Direction(Compass::CLOCKWISE[self.leg].vector()),
            progress,
        }
    }

    /// On to the next direction in which the wall is still unknown; in the first round to each.
    fn next_leg(&mut self, extremes: &Extremes) {
        loop {
            self.leg += 1;
            if self.leg == Compass::CLOCKWISE.len() {
                self.leg = 0;
                self.leg_time = self.leg_time + self.leg_time;
            }
            let first_round = self.leg_time == FIRST_LEG;
            if first_round
                || extremes.border().is_some()
                || !extremes.has_sensed(Compass::CLOCKWISE[self.leg])
            {
                break;
            }
        }
        self.spent = SimTime::ZERO;
        self.blocked = 0;
        self.counted = None;
    }
}
