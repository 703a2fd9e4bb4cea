//! The time that a robot needs for points with windows, and the selection among them.

use glam::Vec2;
use robot_agent::allocator::Choice;
use robot_agent::mission::ControllerInput;
use scenario::ids::TaskId;
use scenario::time::SimTime;

use super::ServiceController;
use super::memory::{KnownPoint, is_open};
use crate::service::bus::{LOAD_LEFT_S, PointFact};
use crate::service::data::{Origin, TaskGranularity};

/// The time before the opening of a window at which a robot arrives at the point, if it drives straight, s. It covers
/// turns and detours.
const EARLY_S: f64 = 10.0;

/// The tolerance of an estimate of the end of the work, s. It covers rounding.
const ROUNDING_S: f64 = 0.01;

impl ServiceController {
    /// Returns the time until a window opens, s; 0 if it is open.
    fn opens_in_s(&self, fact: &PointFact) -> f64 {
        let (opens, _) = self.briefing.window(fact);
        opens.since(self.now).as_secs_f64()
    }

    /// Estimates the time at which a robot has done a point, s from now: the way from a place where it is at `time_s`,
    /// the wait for the window, and all work left. `None` without the skill or a way.
    fn end_s(&self, from: Vec2, time_s: f64, known: &KnownPoint) -> Option<f64> {
        let fact = &known.fact;
        let skill = self.memory.skill(&self.briefing, fact);
        let arrival_s = time_s + self.drive_s(from, known)?;
        let start_s = arrival_s.max(self.opens_in_s(fact));
        let delivery = self.briefing.terms(fact.point).deliver_to;
        let delivery_s = match delivery {
            None => 0.0,
            Some(to) if self.briefing.has_paths() => {
                let way_m = self.briefing.delivery_m(&known.place, to)?;
                self.driver.seconds(Vec2::ZERO, Vec2::new(way_m, 0.0))
            }
            Some(to) => self.driver.seconds(fact.at, to),
        };
        (skill > 0.0).then(|| start_s + f64::from(fact.left_s / skill) + delivery_s)
    }

    /// Estimates the duration of a task after other tasks, s. `None` if the work cannot end in its window. A robot at
    /// work continues, because it measures its progress in quarters only.
    pub(super) fn seconds_in_window(
        &self,
        from: Vec2,
        after: &[TaskId],
        task: TaskId,
    ) -> Option<f64> {
        let (mut from, mut time_s, mut load) = (from, 0.0, 0.0);
        for task in after {
            let known = self.point_of(*task, from)?;
            let terms = self.briefing.terms(known.fact.point);
            load += terms.kept_demand();
            time_s = self.end_s(from, time_s, known)?;
            from = terms.deliver_to.unwrap_or(known.fact.at);
        }
        let known = self.point_of(task, from)?;
        let end_s = self.end_s(from, time_s, known)?;
        let (_, closes) = self.briefing.window(&known.fact);
        let closes_s = closes.map_or(f64::INFINITY, |closes| {
            closes.as_secs_f64() - self.now.as_secs_f64() + ROUNDING_S
        });
        let point = known.fact.point;
        let is_at_work = after.is_empty() && self.working == Some(point);
        let has_capacity = self.has_capacity(load, point);
        (has_capacity && end_s <= closes_s || is_at_work).then_some(end_s - time_s)
    }

    /// Returns the best point of a kind for a robot at a place: highest priority, then earliest start. Points without a
    /// way to them or to their delivery are left out.
    fn best_of_kind(&self, kind: usize, from: Vec2) -> Option<&KnownPoint> {
        let open = self.memory.open_of_kind(&self.briefing, kind, self.now);
        let open = open.filter(|known| self.has_capacity(0.0, known.fact.point));
        let possible = open
            .filter(|known| self.can_deliver(known))
            .filter_map(|known| {
                let start_s = self.drive_s(from, known)?.max(self.opens_in_s(&known.fact));
                Some((known, self.briefing.priority(known.fact.point), start_s))
            });
        let best = possible.min_by(|(_, priority, start_s), (_, other, other_s)| {
            other.cmp(priority).then(start_s.total_cmp(other_s))
        });
        best.map(|(known, ..)| known)
    }

    /// Returns whether a way leads from a point to its delivery, if it has one.
    pub(super) fn can_deliver(&self, known: &KnownPoint) -> bool {
        let delivery = self.briefing.terms(known.fact.point).deliver_to;
        let way_m = |to| self.briefing.delivery_m(&known.place, to);
        delivery.is_none_or(|to| way_m(to).is_some())
    }

    /// Returns whether the load of a point is on its way. [`LOAD_LEFT_S`] stands for this.
    pub(super) fn is_load(&self, fact: &PointFact) -> bool {
        let is_delivery = self.briefing.terms(fact.point).deliver_to.is_some();
        is_delivery && is_open(fact) && fact.left_s <= LOAD_LEFT_S
    }

    /// Returns whether a robot could do a task, now or when its window opens: the robot has the capacity and ways, may
    /// fill the slot, and no teammate carries the load.
    fn may_do(&self, task: TaskId, known: &KnownPoint, from: &Origin) -> bool {
        let point = known.fact.point;
        self.has_capacity(0.0, point)
            && (!self.is_load(&known.fact) || self.laden == Some(point))
            && self.may_fill(task)
            && self.is_reachable(from, known)
    }

    /// Returns whether a robot should drive to the point of an open task by now: the window is open, or opens about when
    /// the robot arrives. A robot on its way continues.
    pub(super) fn may_begin(&self, task: TaskId, from: Option<&Origin>) -> bool {
        let known = from.and_then(|from| self.point_of(task, from.at));
        known.zip(from).is_some_and(|(known, from)| {
            let opens_s = self.opens_in_s(&known.fact);
            let is_in_time = |drive_s: f64| drive_s + EARLY_S >= opens_s;
            let is_due = opens_s <= EARLY_S
                || self.heading_for == Some(known.fact.point)
                || self.drive_s(from.at, known).is_some_and(is_in_time);
            is_due && self.may_do(task, known, from)
        })
    }

    /// Adds one choice per behavior. It is applicable also for points whose windows open later: a planner of sequences can plan them.
    pub(super) fn choices_in_windows(
        &self,
        input: &ControllerInput<'_>,
        choices: &mut Vec<Choice>,
    ) {
        let from = input.position();
        let origin = from.map(|from| self.briefing.origin(from));
        let has_energy = input.readings.energy_j.is_none_or(|left_j| left_j > 0.0);
        let can_go = from.is_some() && has_energy && self.recharge.charger.is_none();
        let is_open = self.memory.applicable(&self.briefing, input.now);
        for (behavior, is_open) in input.behaviors.iter().zip(is_open) {
            let task = behavior.task;
            let known = from.and_then(|from| self.point_of(task, from));
            let may_do = || {
                let both = known.zip(origin.as_ref());
                both.is_some_and(|(known, origin)| self.may_do(task, known, origin))
            };
            choices.push(Choice {
                behavior: behavior.id,
                task,
                round: self.round_of(known, input.now),
                applicable: is_open && can_go && may_do(),
                cost_s: from.and_then(|from| self.seconds_in_window(from, &[], task)),
                opens_in_s: known.map_or(0.0, |known| self.opens_in_s(&known.fact)),
                reward: known.map_or(1.0, |known| self.briefing.terms(known.fact.point).value),
                priority: behavior.priority,
                max_robots: behavior.max_robots,
            });
        }
    }

    /// Marks the points as over whose stated deadline has passed.
    pub(super) fn close_expired(&mut self, now: SimTime) {
        while let Some(&fact) = self.memory.next_closed(now) {
            let (_, closes) = self.briefing.window(&fact);
            if is_open(&fact) && closes.is_some_and(|closes| closes <= now) {
                self.learn(fact, now);
            }
        }
    }

    /// Returns the point that represents a task, for a robot at the given place.
    pub(super) fn point_of(&self, task: TaskId, from: Vec2) -> Option<&KnownPoint> {
        match self.briefing.tasks {
            TaskGranularity::Points => self.memory.known(self.briefing.point(task)),
            TaskGranularity::Kinds if self.briefing.has_terms() || self.briefing.has_paths() => {
                self.best_of_kind(task.index(), from)
            }
            TaskGranularity::Kinds => {
                let kind = task.index();
                self.memory.nearest(&self.briefing, kind, from, self.now)
            }
        }
    }
}
