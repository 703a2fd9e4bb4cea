//! The end of the run.

use proto::tick::Outcome;
use scenario::ids::RobotId;
use scenario::time::SimTime;

use super::Simulation;
use crate::barrier::Presence;

impl Simulation {
    /// Ends the run before the current tick, which does not count.
    pub fn interrupt(&mut self) {
        self.outcome.get_or_insert(Outcome::Interrupted);
    }

    /// Ends the run if no robot takes part.
    pub fn end_if_idle(&mut self) {
        if self.outcome.is_none() && self.barrier.is_idle() {
            // The faults that were due in this tick count.
            self.schedule.end_idle_tick();
            self.outcome = Some(Outcome::NoRobotLeft);
        }
    }

    /// Returns the outcome if the run is over: the mission has ended, time is up, or no robot can act again.
    pub(super) fn decide_outcome(&self) -> Option<Outcome> {
        let limit = SimTime::from_secs_f64(self.setup.scenario.limit_s);
        let end = self.world.mission().end(self.world.now());
        end.or_else(|| (self.world.now() >= limit).then_some(Outcome::TimeLimit))
            .or_else(|| self.is_out_of_energy().then_some(Outcome::NoRobotLeft))
    }

    /// Checks whether all robots with a running agent have used up their energy or have no power, and the schedule brings
    /// no other robot and no power back. A robot without energy cannot drive to a charger.
    fn is_out_of_energy(&self) -> bool {
        let runs = |robot: &RobotId| {
            !matches!(
                self.barrier.presence(*robot),
                Presence::Empty | Presence::Invited
            )
        };
        let mut left = self.barrier.robots().filter(runs).peekable();
        left.peek().is_some()
            && left.all(|robot| !self.world.can_act(robot))
            && !self.schedule.will_return_robots()
    }
}
