//! Work at points where robots must work together.

use glam::Vec2;
use robot_agent::mission::Perception;
use scenario::ids::TaskId;
use scenario::time::SimTime;

use super::ServiceController;
use super::appointments::Appointment;
use super::memory::is_open;
use crate::service::bus::PointFact;

impl ServiceController {
    /// Updates the progress of a crew from the facts, because the pace of a crew depends on all of its robots. Returns
    /// whether the robot works in a crew.
    pub(super) fn note_crew(&mut self, effect: Option<u32>, perception: &mut Perception) -> bool {
        let point = effect.filter(|point| self.briefing.has_slots(*point));
        let fact = point.and_then(|point| self.memory.fact(point));
        let has_progressed = self.crew.note_left(fact);
        perception
            .progressed
            .extend(self.crew.task.filter(|_| has_progressed));
        if let Some(point) = point {
            self.crew.has_waited_in_vain = false;
            self.memory.waits.succeed(point);
        }
        point.is_some()
    }

    /// Returns whether the robot stands at its place in a crew that is not complete.
    pub(super) fn stands_in_crew(&self, fact: &PointFact, distance_m: f32) -> bool {
        let near_m = self.briefing.reach_m_of(fact.point);
        let is_near = distance_m <= near_m / 2.0;
        self.briefing.has_slots(fact.point)
            && (is_near || distance_m <= near_m && self.driver.is_blocked())
    }

    /// Lets a robot give up a point at which it has waited too long for the robots of the other slots.
    pub(super) fn note_wait(
        &mut self,
        fact: &PointFact,
        works: bool,
        distance_m: f32,
        now: SimTime,
    ) {
        let (opens, _) = self.briefing.window(fact);
        let is_waiting = self.briefing.has_slots(fact.point)
            && !works
            && now >= opens
            && !self.is_appointed(fact.point)
            && distance_m <= self.briefing.reach_m_of(fact.point);
        let point = is_waiting.then_some(fact.point);
        if self.crew.note_wait(point, now) {
            let span = self.briefing.coalition_wait;
            self.memory.waits.suspend(fact.point, span, now);
            self.crew.has_waited_in_vain |= self.briefing.slots.of_point(fact.point).len() > 1;
        }
    }

    fn is_appointed(&self, point: u32) -> bool {
        let appointment = self.crew.appointment;
        appointment.is_some_and(|(_, appointment)| appointment.is_at(point))
    }

    /// Returns whether the robot may fill the slot of a task now; true for tasks that are no slots.
    pub(super) fn may_fill(&self, task: TaskId) -> bool {
        let slots = &self.briefing.slots;
        let Some((point, _)) = slots.of_task(task) else {
            return true;
        };
        let appointment = self
            .crew
            .appointment
            .filter(|_| slots.of_point(point).len() > 1);
        let is_permitted =
            appointment.is_none_or(|(_, appointment)| appointment.permits(point, task));
        is_permitted
            && (self.is_appointed(point) || !self.memory.waits.is_suspended(point, self.now))
    }

    /// Gives a robot that has waited in vain its place in this round.
    pub(super) fn update_appointment(&mut self, position: Option<Vec2>, now: SimTime) {
        let before = self.crew.appointment.take();
        if !self.crew.has_waited_in_vain {
            return;
        }
        let Some(round) = self.briefing.appointments.round(now) else {
            return;
        };
        if let Some((ended, appointment)) = before
            && ended != round
            && let Some(point) = self.working.filter(|point| appointment.is_at(*point))
            && self.has_task_alone(position, now)
        {
            // The robots of the other slots may never come.
            let half_ms = self.briefing.appointments.length(ended.cycle).0 / 2;
            self.memory.failed.suspend(point, SimTime(half_ms), now);
        }
        let appointments = &self.briefing.appointments;
        let can_gather = |point| self.can_gather_at(point, now);
        let Some(point) = appointments.point(round, &self.crew.points, can_gather) else {
            return;
        };
        let is_same = |(of_round, appointment): &(_, Appointment)| {
            *of_round == round && appointment.concerns(point)
        };
        let slots = &self.briefing.slots;
        let new = || (round, appointments.place(round, point, slots, self.robot));
        self.crew.appointment = before.filter(is_same).or_else(|| Some(new()));
    }

    /// Returns whether the robot could begin a task now for which it needs no other robot.
    fn has_task_alone(&self, position: Option<Vec2>, now: SimTime) -> bool {
        let from = position.map(|at| self.briefing.origin(at));
        let slots = &self.briefing.slots;
        let is_alone = |task: &TaskId| {
            let slot = slots.of_task(*task);
            slot.is_none_or(|(point, _)| slots.of_point(point).len() == 1)
        };
        let tasks = self.memory.applicable_tasks(&self.briefing, now);
        tasks
            .filter(is_alone)
            .any(|task| self.may_begin(task, from.as_ref()))
    }

    /// Returns whether robots can work at one of the robot's points now.
    fn can_gather_at(&self, point: u32, now: SimTime) -> bool {
        let fact = self.memory.fact(point).filter(|fact| is_open(fact));
        fact.is_some_and(|fact| now >= self.briefing.window(fact).0)
            && !self.memory.failed.is_suspended(point, now)
    }
}
