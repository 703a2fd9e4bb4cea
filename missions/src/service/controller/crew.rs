//! The state of a robot that works together with others.

use scenario::ids::{RobotId, TaskId};
use scenario::time::SimTime;

use super::appointments::{Appointment, Round};
use crate::service::bus::PointFact;

#[derive(Clone, Debug)]
pub(super) struct CrewMember {
    /// The longest wait for the robots of the other slots. It differs between robots, so that two incomplete crews
    /// seldom exchange all their robots.
    patience: SimTime,
    /// The points with appointments at which the robot can fill a slot, in ascending order.
    pub points: Vec<u32>,
    /// The task of the slot that the robot fills.
    pub task: Option<TaskId>,
    /// The point at which the robot waits for others, and since when.
    waiting: Option<(u32, SimTime)>,
    /// The point and the work left, s, at the last step with an effect.
    left_s: Option<(u32, f32)>,
    /// True after a wait in vain, until the robot works in a crew.
    pub has_waited_in_vain: bool,
    /// The place of a robot that has waited in vain, in this round.
    pub appointment: Option<(Round, Appointment)>,
}

impl CrewMember {
    /// Creates the state of a robot with these [points](Self::points). Its patience is between half of the longest wait
    /// and all of it: less for a robot of higher rank.
    pub fn new(robot: RobotId, team: usize, longest: SimTime, points: Vec<u32>) -> Self {
        let half_ms = longest.0 / 2;
        Self {
            patience: SimTime(longest.0 - half_ms * u64::from(robot.0) / team.max(1) as u64),
            points,
            task: None,
            waiting: None,
            left_s: None,
            has_waited_in_vain: false,
            appointment: None,
        }
    }

    /// Records the work left at the point where the robot works in a crew; `None` if it does not. Returns whether work
    /// was done since the last record.
    pub fn note_left(&mut self, fact: Option<&PointFact>) -> bool {
        let left = fact.map(|fact| (fact.point, fact.left_s));
        let before = std::mem::replace(&mut self.left_s, left);
        let both = before.zip(left);
        both.is_some_and(|(before, now)| before.0 == now.0 && before.1 > now.1)
    }

    /// Records that the robot waits at a point, or that it does not. Returns whether it has waited too long.
    pub fn note_wait(&mut self, point: Option<u32>, now: SimTime) -> bool {
        let known = self.waiting.filter(|(known, _)| Some(*known) == point);
        self.waiting = known.or(point.map(|point| (point, now)));
        let is_too_long = self
            .waiting
            .is_some_and(|(_, since)| now.since(since) >= self.patience);
        if is_too_long {
            self.waiting = None;
        }
        is_too_long
    }
}
