//! The time that a robot needs for points with windows, and the selection among them.

use glam::Vec2;
use robot_agent::allocator::Choice;
use robot_agent::mission::ControllerInput;
use scenario::ids::TaskId;
use scenario::time::SimTime;

use super::ServiceController;
use super::memory::is_open;
use crate::service::bus::{LEAST_LEFT_S, PointFact};
use crate::service::data::TaskGranularity;

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
    fn end_s(&self, from: Vec2, time_s: f64, fact: &PointFact) -> Option<f64> {
        let skill = self.memory.skill(fact);
        let arrival_s = time_s + self.drive_s(from, fact)?;
        let start_s = arrival_s.max(self.opens_in_s(fact));
        let delivery = self.briefing.terms(fact.point).deliver_to;
        let delivery_s = match delivery {
            None => 0.0,
            Some(to) if self.briefing.has_paths() => {
                let way_m = self.briefing.way_m(fact.at, to)?;
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
            let fact = self.point_of(*task, from)?;
            load += self.briefing.terms(fact.point).kept_demand();
            time_s = self.end_s(from, time_s, fact)?;
            from = self
                .briefing
                .terms(fact.point)
                .deliver_to
                .unwrap_or(fact.at);
        }
        let fact = self.point_of(task, from)?;
        let end_s = self.end_s(from, time_s, fact)?;
        let (_, closes) = self.briefing.window(fact);
        let closes_s = closes.map_or(f64::INFINITY, |closes| {
            closes.as_secs_f64() - self.now.as_secs_f64() + ROUNDING_S
        });
        let is_at_work = after.is_empty() && self.working == Some(fact.point);
        let has_capacity = self.has_capacity(load, fact.point);
        (has_capacity && end_s <= closes_s || is_at_work).then_some(end_s - time_s)
    }

    /// Returns the best point of a kind for a robot at a place: highest priority, then earliest start. Points without a
    /// way to them or to their delivery are left out.
    fn best_of_kind(&self, kind: usize, from: Vec2) -> Option<&PointFact> {
        let open = self.memory.open_of_kind(kind, self.now);
        let open = open.filter(|fact| self.has_capacity(0.0, fact.point));
        let possible = open
            .filter(|fact| self.can_deliver(fact))
            .filter_map(|fact| {
                let start_s = self.drive_s(from, fact)?.max(self.opens_in_s(fact));
                Some((fact, self.briefing.priority(fact.point), start_s))
            });
        let best = possible.min_by(|(_, priority, start_s), (_, other, other_s)| {
            other.cmp(priority).then(start_s.total_cmp(other_s))
        });
        best.map(|(fact, ..)| fact)
    }

    /// Returns whether a way leads from a point to its delivery, if it has one.
    pub(super) fn can_deliver(&self, fact: &PointFact) -> bool {
        let delivery = self.briefing.terms(fact.point).deliver_to;
        delivery.is_none_or(|to| self.briefing.has_way(fact.at, to))
    }

    /// Returns whether a teammate carries the load of the point of a task.
    pub(super) fn is_taken(&self, task: TaskId, from: Option<Vec2>) -> bool {
        let fact = from.and_then(|from| self.point_of(task, from));
        fact.is_some_and(|fact| self.is_load(fact) && self.laden != Some(fact.point))
    }

    /// Returns whether the load of a point is on its way. The least work left stands for this.
    pub(super) fn is_load(&self, fact: &PointFact) -> bool {
        let is_delivery = self.briefing.terms(fact.point).deliver_to.is_some();
        is_delivery && is_open(fact) && fact.left_s <= LEAST_LEFT_S
    }

    /// Returns whether a robot should drive to the point of a task by now: the window is open, or opens about when the
    /// robot arrives. A robot on its way continues. A robot without a way or the capacity does not drive.
    pub(super) fn is_due(&self, task: TaskId, from: Option<Vec2>) -> bool {
        let fact = from.and_then(|from| self.point_of(task, from));
        fact.zip(from).is_some_and(|(fact, from)| {
            let opens_s = self.opens_in_s(fact);
            let is_in_time = |drive_s: f64| drive_s + EARLY_S >= opens_s;
            self.has_capacity(0.0, fact.point)
                && (self.heading_for == Some(fact.point)
                    || self.drive_s(from, fact).is_some_and(is_in_time))
        })
    }

    /// Adds one choice per behavior. It is applicable also for points whose windows open later: a planner of sequences can plan them.
    pub(super) fn choices_in_windows(
        &self,
        input: &ControllerInput<'_>,
        choices: &mut Vec<Choice>,
    ) {
        let from = input.position();
        let has_energy = input.readings.energy_j.is_none_or(|left_j| left_j > 0.0);
        let can_go = from.is_some() && has_energy && self.recharge.charger.is_none();
        let is_open = self.memory.applicable(&self.briefing, input.now);
        for (behavior, is_open) in input.behaviors.iter().zip(is_open) {
            let task = behavior.task;
            let fact = from.and_then(|from| self.point_of(task, from));
            choices.push(Choice {
                behavior: behavior.id,
                task,
                round: self.round_of(fact, input.now),
                applicable: is_open
                    && can_go
                    && !self.is_taken(task, from)
                    && self.may_fill(task)
                    && fact.is_some_and(|fact| self.has_capacity(0.0, fact.point))
                    && (!self.briefing.has_paths() || self.is_reachable(task, from)),
                cost_s: from.and_then(|from| self.seconds_in_window(from, &[], task)),
                opens_in_s: fact.map_or(0.0, |fact| self.opens_in_s(fact)),
                reward: fact.map_or(1.0, |fact| self.briefing.terms(fact.point).value),
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
    pub(super) fn point_of(&self, task: TaskId, from: Vec2) -> Option<&PointFact> {
        match self.briefing.tasks {
            TaskGranularity::Points => self.memory.fact(self.briefing.point(task)),
            TaskGranularity::Kinds if self.briefing.has_terms() || self.briefing.has_paths() => {
                self.best_of_kind(task.index(), from)
            }
            TaskGranularity::Kinds => self.memory.nearest(task.index(), from, self.now),
        }
    }
}
