//! Navigation straight to the goal, yielding to teammates, and around obstacles.

use glam::Vec2;
use proto::readings::Actuation;
use scenario::time::SimTime;

use super::chassis::FACING_RAD;
use super::detour::{CLEARANCE_M, Course, Detour};
use super::goal::{Goal, length};
use super::surroundings::{Side, Surroundings};
use super::{Chassis, wrap};

/// The longest time to wait for a teammate of lower rank that blocks the way.
const YIELD: SimTime = SimTime(4_000);
/// The time to stand still after a way proved to be blocked. Other robots may move meanwhile.
const REST: SimTime = SimTime(2_000);
/// The time without approach to the goal after which the way counts as blocked.
const PATIENCE: SimTime = SimTime(60_000);
const NEARER_M: f32 = 0.1;
/// The distance from the last obstacle within which a new one counts as the same, m.
const SAME_OBSTACLE_M: f32 = 1.0;
/// The largest bearing of a robot that has reached the border, rad.
const SQUARE_RAD: f32 = 0.05;
/// The least preference for a side (cosine). Below it, the rule of the road decides.
const UNDECIDED: f32 = 0.2;

/// The last known position of a teammate that has the right of way.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Teammate {
    pub position: Vec2,
    pub received_at: SimTime,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Status {
    Going,
    Arrived,
    /// No way was found. Reported once; the robot stands still for a while and then tries again.
    Blocked,
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Drive {
    pub actuation: Actuation,
    pub status: Status,
    /// The side of the obstacle, in the step in which a detour begins.
    pub detour: Option<Side>,
}

/// The last obstacle, after the robot left it.
#[derive(Clone, Copy, Debug, PartialEq)]
struct LastObstacle {
    at: Vec2,
    side: Side,
    met: f32,
}

#[derive(Clone, Debug, Default, PartialEq)]
pub struct Navigator {
    goal: Option<Goal>,
    detour: Option<Detour>,
    last_obstacle: Option<LastObstacle>,
    /// The least remaining distance so far, m, and its time.
    best: Option<(f32, SimTime)>,
    /// The time since when the robot yields.
    yielding: Option<SimTime>,
    resting_until: Option<SimTime>,
    /// The preferred side when the surface has none. It changes each time a way proves to be blocked.
    contrary: bool,
}

impl Navigator {
    /// Computes one step toward the goal. `right_of_way` contains the teammates to yield to; it is read only if the
    /// way is blocked.
    #[must_use]
    pub fn drive(
        &mut self,
        chassis: &Chassis,
        goal: Goal,
        around: &Surroundings,
        right_of_way: impl IntoIterator<Item = Teammate>,
        now: SimTime,
    ) -> Drive {
        if !self.goal.is_some_and(|before| goal.continues(&before)) {
            *self = Self::default();
        }
        self.goal = Some(goal);
        let position = around.pose.position;
        if goal.is_reached(position) {
            *self = Self::default();
            return stand(Status::Arrived);
        }
        if self.resting_until.is_some_and(|until| now < until) {
            return stand(Status::Going);
        }
        self.resting_until = None;
        if self.is_out_of_patience(goal.remaining(position), now) {
            return self.rest(now);
        }
        if self.yields(chassis, &goal, around, right_of_way, now) {
            return stand(Status::Going);
        }
        if let Some(detour) = &mut self.detour {
            match detour.step(chassis, &goal, around) {
                Course::Follow(actuation) => return going(actuation),
                Course::Closed => return self.rest(now),
                Course::Leave => {
                    self.last_obstacle = Some(LastObstacle {
                        at: position,
                        side: detour.side(),
                        met: detour.met(),
                    });
                    self.detour = None;
                }
                Course::Lost => self.detour = None,
            }
        }
        self.straight(chassis, &goal, around, now)
    }

    fn straight(
        &mut self,
        chassis: &Chassis,
        goal: &Goal,
        around: &Surroundings,
        now: SimTime,
    ) -> Drive {
        let position = around.pose.position;
        let bearing = wrap(goal.direction(position) - around.pose.heading_rad);
        let blocked = around.blocked_by().filter(|hit| {
            bearing.abs() <= FACING_RAD && hit.distance_m < goal.distance_to_drive(position)
        });
        let Some(hit) = blocked else {
            let (way, free) = (goal.distance_to_drive(position), around.free_ahead());
            // The goal may lie within the clearance of the obstacle.
            let way = if way <= free {
                way
            } else {
                (free - CLEARANCE_M).max(0.0)
            };
            return going(chassis.drive(bearing, way));
        };
        if around.is_border_ahead() {
            // A search for the border ends when the robot faces it.
            if bearing.abs() > SQUARE_RAD {
                return going(chassis.drive(bearing, 0.0));
            }
            return self.rest(now);
        }
        let normal = around.pose.heading_rad + hit.normal_rad;
        let remaining = goal.remaining(position);
        let same_obstacle = self
            .last_obstacle
            .filter(|last| length(position - last.at) < SAME_OBSTACLE_M);
        let (side, met) = match same_obstacle {
            Some(last) => (last.side, last.met.min(remaining)),
            None => (self.choose_side(goal, around, normal), remaining),
        };
        let mut detour = Detour::new(side, normal, met, around);
        let course = detour.step(chassis, goal, around);
        self.detour = Some(detour);
        Drive {
            actuation: match course {
                Course::Follow(actuation) => actuation,
                _ => Actuation::default(),
            },
            status: Status::Going,
            detour: Some(side),
        }
    }

    /// Returns the side on which to keep the obstacle, for the shorter way around. Without a preference the robot keeps
    /// right, as on a road.
    fn choose_side(&self, goal: &Goal, around: &Surroundings, normal: f32) -> Side {
        let direction = goal.direction(around.pose.position);
        // The cosine between the goal and the course with the surface to the left.
        let toward = libm::cosf(wrap(Side::Left.along(normal) - direction));
        let [left, _, right] = around.proximity.ahead;
        let side = if toward.abs() > UNDECIDED {
            if toward > 0.0 {
                Side::Left
            } else {
                Side::Right
            }
        } else if left.is_none() && right.is_some() {
            Side::Right
        } else {
            Side::Left
        };
        if self.contrary { side.other() } else { side }
    }

    /// Returns whether a teammate with the right of way blocks the way, for a limited time.
    fn yields(
        &mut self,
        chassis: &Chassis,
        goal: &Goal,
        around: &Surroundings,
        right_of_way: impl IntoIterator<Item = Teammate>,
        now: SimTime,
    ) -> bool {
        let met = around.blocked_by().is_some_and(|hit| {
            let reach = chassis.radius_m + hit.distance_m;
            let heading = around.pose.heading_rad;
            let ahead = Vec2::from_angle(heading) * reach;
            around.may_be_robot(&hit)
                && right_of_way.into_iter().any(|teammate| {
                    let moved =
                        chassis.speed_m_s * now.since(teammate.received_at).as_secs_f64() as f32;
                    length(around.pose.position + ahead - teammate.position)
                        < 2.0 * chassis.radius_m + moved
                })
        });
        if !met {
            self.yielding = None;
            return false;
        }
        let faces = match &self.detour {
            Some(detour) => detour.faces_along(around),
            None => {
                let direction = goal.direction(around.pose.position);
                wrap(direction - around.pose.heading_rad).abs() <= FACING_RAD
            }
        };
        if !faces {
            return false;
        }
        let since = *self.yielding.get_or_insert(now);
        now.since(since) < YIELD
    }

    fn is_out_of_patience(&mut self, remaining: f32, now: SimTime) -> bool {
        match self.best {
            Some((best, since)) if remaining > best - NEARER_M => now.since(since) > PATIENCE,
            _ => {
                self.best = Some((remaining, now));
                false
            }
        }
    }

    /// Stands still for a while. The next attempt uses the other side.
    fn rest(&mut self, now: SimTime) -> Drive {
        *self = Self {
            goal: self.goal,
            resting_until: Some(now + REST),
            contrary: !self.contrary,
            ..Self::default()
        };
        stand(Status::Blocked)
    }
}

fn going(actuation: Actuation) -> Drive {
    Drive {
        actuation,
        status: Status::Going,
        detour: None,
    }
}

fn stand(status: Status) -> Drive {
    Drive {
        actuation: Actuation::default(),
        status,
        detour: None,
    }
}
