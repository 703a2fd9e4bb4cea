//! Work at points where robots must work together.

use robot_agent::mission::Perception;
use scenario::time::SimTime;

use super::ServiceController;
use crate::service::bus::PointFact;

impl ServiceController {
    /// Updates the progress of a crew from the facts, because the pace of a crew depends on all of its robots. Returns
    /// whether the robot works in a crew.
    pub(super) fn note_crew(&mut self, effect: Option<u16>, perception: &mut Perception) -> bool {
        let point = effect.filter(|point| self.briefing.has_slots(*point));
        let fact = point.and_then(|point| self.memory.fact(point));
        let has_progressed = self.crew.note_left(fact);
        perception
            .progressed
            .extend(self.crew.task.filter(|_| has_progressed));
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
            && distance_m <= self.briefing.reach_m_of(fact.point);
        let point = is_waiting.then_some(fact.point);
        if self.crew.note_wait(point, now) {
            let span = self.briefing.coalition_wait;
            self.memory.failed.suspend(fact.point, span, now);
        }
    }
}
