//! find-locations: find the extremes of the border, with two behaviors (thesis §4.1.2.1, Fig. 4.4).

use glam::Vec2;
use proto::readings::Readings;
use scenario::time::SimTime;

use super::compass::Compass;
use super::extremes::Extremes;
use robot_agent::body::{Goal, Status, wrap};

/// The distance at which the robot turns at a wall and at which it follows a wall, m.
const WALL_M: f32 = 0.15;
/// The steering correction per meter of deviation from that distance, and its limit.
const STEER_RAD_PER_M: f32 = 0.5;
const STEER_MAX_RAD: f32 = 0.08;
/// The maximum angle to a wall's normal at which the robot faces the wall, rad.
const FACING_RAD: f32 = 0.1;
/// The duration of a leg in the first round of wandering.
const FIRST_LEG: SimTime = SimTime(30_000);
/// The number of blocked steps after which a wandering robot starts the next leg.
const BLOCKED: u32 = 2;
/// The movement of an extreme that counts as progress, m.
const PROGRESS_M: f32 = 0.1;

/// Checks whether the robot stands before the wall in a direction and faces it.
fn is_before(wall: Compass, readings: &Readings) -> bool {
    let distance = readings.front_border.flatten();
    faces(wall, readings) && distance.is_some_and(|distance| distance <= WALL_M)
}

fn faces(wall: Compass, readings: &Readings) -> bool {
    let angle_to = |heading_rad: f32| wrap(wall.heading() - heading_rad).abs();
    readings
        .pose
        .is_some_and(|pose| angle_to(pose.heading_rad) < FACING_RAD)
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum SearchStep {
    /// The next goal. `progress` is true if this step had an effect.
    Go {
        goal: Goal,
        progress: bool,
    },
    Finished {
        progress: bool,
    },
}

/// find-locations-methodical: drive to the left wall, then clockwise along each wall to the next.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Methodical {
    visited: usize,
}

impl Methodical {
    pub fn step(&mut self, readings: &Readings) -> SearchStep {
        let mut progress = false;
        if let Some(&wall) = Compass::CLOCKWISE.get(self.visited)
            && is_before(wall, readings)
        {
            // The way to the first wall follows no wall, so it is no progress.
            progress = self.visited > 0;
            self.visited += 1;
        }
        match Compass::CLOCKWISE.get(self.visited) {
            Some(&wall) => SearchStep::Go {
                goal: Goal::Direction(self.along(wall, readings)),
                progress,
            },
            None => SearchStep::Finished { progress },
        }
    }

    /// Returns the direction to the wall. Keeps a constant distance from a wall that the side sensor measures.
    fn along(&self, wall: Compass, readings: &Readings) -> Vec2 {
        let aligned = faces(wall, readings);
        let beside = readings.side_border.flatten();
        let correction = match beside.filter(|_| aligned && self.visited > 0) {
            Some(distance) => (distance - WALL_M) * STEER_RAD_PER_M,
            None => 0.0,
        };
        let correction = correction.clamp(-STEER_MAX_RAD, STEER_MAX_RAD);
        if correction == 0.0 {
            return wall.vector();
        }
        Vec2::from_angle(wall.heading() + correction)
    }
}

/// find-locations-wander: drive west, north, east and south for a while, longer each round, until all walls are sensed.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Wander {
    leg: usize,
    leg_time: SimTime,
    spent: SimTime,
    blocked: u32,
    /// The reach of the extremes in the leg's direction at the last counted progress, m.
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
    /// Advances by one step of duration `step`. `status` is the result of driving in the previous step.
    pub fn step(
        &mut self,
        readings: &Readings,
        extremes: &Extremes,
        step: SimTime,
        status: Status,
    ) -> SearchStep {
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
                return SearchStep::Finished { progress };
            }
        }
        SearchStep::Go {
            goal: Goal::Direction(Compass::CLOCKWISE[self.leg].vector()),
            progress,
        }
    }

    /// Starts the next leg. Skips sensed walls after the first round.
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

#[cfg(test)]
mod tests {
    use proto::readings::Pose;

    use super::*;

    const STEP: SimTime = SimTime(500);

    fn facing(direction: Compass, wall_m: Option<f32>) -> Readings {
        Readings {
            pose: Some(Pose {
                position: Vec2::ONE,
                heading_rad: direction.heading(),
            }),
            front_border: Some(wall_m),
            ..Readings::default()
        }
    }

    fn heads(search: SearchStep, direction: Compass) -> bool {
        matches!(search, SearchStep::Go { goal: Goal::Direction(way), .. } if way.dot(direction.vector()) > 0.99)
    }

    #[test]
    fn methodical_goes_clockwise_and_each_wall_it_followed_is_progress() {
        let mut methodical = Methodical::default();
        // A wall beside the path is not the wall ahead.
        let search = methodical.step(&facing(Compass::North, Some(0.1)));
        assert!(heads(search, Compass::West));
        for (index, wall) in Compass::CLOCKWISE.into_iter().enumerate() {
            assert!(heads(methodical.step(&facing(wall, None)), wall));
            assert!(heads(methodical.step(&facing(wall, Some(0.4))), wall));
            let at_wall = methodical.step(&facing(wall, Some(0.1)));
            let (SearchStep::Go { progress, .. } | SearchStep::Finished { progress }) = at_wall;
            assert_eq!(progress, index > 0);
            assert_eq!(matches!(at_wall, SearchStep::Finished { .. }), index == 3);
        }
    }

    #[test]
    fn methodical_keeps_its_distance_from_the_wall_it_follows() {
        let mut methodical = Methodical::default();
        methodical.step(&facing(Compass::West, Some(0.1)));
        let mut heading = |side_m| {
            let mut readings = facing(Compass::North, None);
            readings.side_border = Some(side_m);
            match methodical.step(&readings) {
                SearchStep::Go {
                    goal: Goal::Direction(way),
                    ..
                } => way,
                other => panic!("{other:?}"),
            }
        };
        assert!(heading(Some(0.4)).x < 0.0);
        assert!(heading(Some(0.05)).x > 0.0);
        assert_eq!(heading(None), Vec2::Y);
    }

    /// The legs of the next round are twice as long.
    #[test]
    fn a_wander_leg_ends_at_the_border_after_its_time_or_when_blocked() {
        let extremes = Extremes::default();
        let (open, at_wall) = (
            facing(Compass::West, None),
            facing(Compass::West, Some(0.1)),
        );
        let leg = FIRST_LEG.0 / STEP.0;
        for (readings, status, steps) in [
            (&at_wall, Status::Going, 1),
            (&open, Status::Going, leg),
            (&open, Status::Blocked, 2),
        ] {
            let mut wander = Wander::default();
            for _ in 1..steps {
                let search = wander.step(readings, &extremes, STEP, status);
                assert!(heads(search, Compass::West));
            }
            let search = wander.step(readings, &extremes, STEP, status);
            assert!(heads(search, Compass::North));
        }
        let mut wander = Wander::default();
        for (round, legs) in [(1, 4), (2, 8)] {
            for _ in 0..legs * leg {
                wander.step(&open, &extremes, STEP, Status::Going);
            }
            let longer = SimTime(FIRST_LEG.0 << round);
            assert_eq!((wander.leg, wander.leg_time), (0, longer));
        }
    }

    #[test]
    fn a_moved_extreme_is_progress_of_wandering() {
        let mut extremes = Extremes::default();
        let mut wander = Wander::default();
        let steps = (0..40).filter(|step| {
            let mut readings = facing(Compass::West, None);
            let x = 20.0 - 0.0625 * *step as f32;
            readings.pose.as_mut().unwrap().position = Vec2::new(x, 1.0);
            extremes.join(&readings, 0.2);
            let search = wander.step(&readings, &extremes, STEP, Status::Going);
            matches!(search, SearchStep::Go { progress: true, .. })
        });
        // The extreme moves 0.0625 m per step, so every second step counts.
        assert_eq!(steps.count(), 19);
    }
}
