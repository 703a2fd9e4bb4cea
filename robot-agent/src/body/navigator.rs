//! Straight to the goal, giving way to teammates, and round whatever blocks the way.

use alliance_proto::readings::Actuation;
use alliance_proto::time::SimTime;
use glam::Vec2;

use super::chassis::FACING_RAD;
use super::detour::{CLEARANCE_M, Course, Detour};
use super::goal::{Goal, length};
use super::surroundings::{Side, Surroundings};
use super::{Chassis, wrap};

/// How long a robot waits for a teammate of lower rank to clear its way.
const YIELD: SimTime = SimTime(4_000);
/// How long it stands still after a way proved to be closed: others may move meanwhile.
const REST: SimTime = SimTime(2_000);
/// Without having come nearer to the goal for so long, it takes the way to be closed.
const PATIENCE: SimTime = SimTime(60_000);
/// How much nearer counts as nearer, m.
const NEARER_M: f32 = 0.1;
/// An obstacle met so soon after the last one was left is taken to be the same, m.
const SAME_OBSTACLE_M: f32 = 1.0;
/// Before the border the robot turns to its goal as exactly as this, rad.
const SQUARE_RAD: f32 = 0.05;
/// A surface that leads toward the goal by less than this on either side prefers none: the rule of the road decides (cosine).
const UNDECIDED: f32 = 0.2;

/// A teammate that has the right of way, as last heard of.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Teammate {
    /// Where it was, m.
    pub position: Vec2,
    /// When it said so.
    pub heard: SimTime,
}

/// How the robot gets on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Status {
    /// On its way.
    Going,
    /// At the goal; it stands still.
    Arrived,
    /// No way was found. It says so once, stands still for a while and then tries again.
    Blocked,
}

/// One step of body control.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Drive {
    /// What the body shall do.
    pub actuation: Actuation,
    /// How it gets on.
    pub status: Status,
    /// Whether a detour began in this step, and on which side the obstacle is.
    pub detour: Option<Side>,
}

/// What the robot remembers of the obstacle it left last.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Left {
    at: Vec2,
    side: Side,
    met: f32,
}

/// The way to one goal after another.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Navigator {
    goal: Option<Goal>,
    detour: Option<Detour>,
    left: Option<Left>,
    /// Least that was left of the way, m, and when.
    best: Option<(f32, SimTime)>,
    /// Gives way since then.
    yielding: Option<SimTime>,
    resting_until: Option<SimTime>,
    /// Side tried when the surface does not prefer one; changes each time a way proves to be closed.
    contrary: bool,
}

impl Navigator {
    /// One step toward the goal. `right_of_way` are the teammates to give way to; who they are is asked only when something
    /// is in the way.
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
        if self.gives_way(chassis, &goal, around, right_of_way, now) {
            return stand(Status::Going);
        }
        if let Some(detour) = &mut self.detour {
            match detour.step(chassis, &goal, around) {
                Course::Follow(actuation) => return going(actuation),
                Course::Closed => return self.rest(now),
                Course::Leave => {
                    self.left = Some(Left {
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
        let blocked = around
            .blocked_by()
            .filter(|hit| bearing.abs() <= FACING_RAD && hit.distance_m < goal.way(position));
        let Some(hit) = blocked else {
            let (way, free) = (goal.way(position), around.free_ahead());
            // A goal before the obstacle may lie within the clearance from it.
            let way = if way <= free {
                way
            } else {
                (free - CLEARANCE_M).max(0.0)
            };
            return going(chassis.drive(bearing, way));
        };
        if around.is_border_ahead() {
            // Whoever searches for this border has found it when the robot faces it.
            if bearing.abs() > SQUARE_RAD {
                return going(chassis.drive(bearing, 0.0));
            }
            return self.rest(now);
        }
        let normal = around.pose.heading_rad + hit.normal_rad;
        let remaining = goal.remaining(position);
        let again = self
            .left
            .filter(|left| length(position - left.at) < SAME_OBSTACLE_M);
        let (side, met) = match again {
            Some(left) => (left.side, left.met.min(remaining)),
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

    /// The side on which the way round looks shorter; where none does, keep right as on a road: two robots that meet
    /// then pass each other.
    fn choose_side(&self, goal: &Goal, around: &Surroundings, normal: f32) -> Side {
        let direction = goal.direction(around.pose.position);
        // How far going along the surface with it to the left leads toward the goal.
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

    /// Whether a teammate that has the right of way is in the way, for a limited time.
    fn gives_way(
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
            let ahead = Vec2::new(libm::cosf(heading), libm::sinf(heading)) * reach;
            around.may_be_robot(&hit)
                && right_of_way.into_iter().any(|teammate| {
                    let moved = chassis.speed_m_s * now.since(teammate.heard).as_secs_f64() as f32;
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

    /// Stands still for a while; the next attempt goes round on the other side.
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
