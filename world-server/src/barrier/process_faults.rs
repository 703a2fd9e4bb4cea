//! Process faults of the scenario, which take effect at a tick. The tick waits for them.

use scenario::ids::RobotId;

use super::Barrier;
use super::place::Presence;

impl Barrier {
    /// Marks the robot's agent to be killed in this tick: its report still counts, but its broadcasts are not delivered.
    pub fn kill_after_tick(&mut self, robot: RobotId) {
        self.places[robot.index()].dies_after_tick = true;
    }

    pub fn cancel_kill(&mut self, robot: RobotId) {
        self.places[robot.index()].dies_after_tick = false;
    }

    /// Returns `true` if the robot's agent has died in the current tick in which it was to be killed.
    #[must_use]
    pub fn is_killed(&self, robot: RobotId) -> bool {
        let place = &self.places[robot.index()];
        place.lost && place.dies_after_tick
    }

    /// Suspends the robot's agent for the scenario before the tick is sent to it. It is out until it is readmitted.
    pub fn suspend(&mut self, robot: RobotId) {
        let place = &mut self.places[robot.index()];
        if place.presence == Presence::Present && !place.tick_sent && !place.lost {
            place.suspended = true;
            place.fall_silent(self.tick, true, &mut self.inputs);
        }
    }

    #[must_use]
    pub fn is_suspended(&self, robot: RobotId) -> bool {
        self.places[robot.index()].suspended
    }

    /// Readmits a suspended agent to the current tick.
    pub fn readmit(&mut self, robot: RobotId) {
        let place = &mut self.places[robot.index()];
        if std::mem::take(&mut place.suspended) && place.presence == Presence::Silent && !place.lost
        {
            place.presence = Presence::Entering { again: true };
            place.enter(true, None, &mut self.inputs);
        }
    }

    /// Ends the suspension of an agent that could not be resumed. It takes part again after its next report.
    pub fn release(&mut self, robot: RobotId) {
        self.places[robot.index()].suspended = false;
    }

    /// Makes the current tick wait for an agent that the scenario starts. An agent that has already arrived is admitted at once.
    pub fn expect(&mut self, robot: RobotId) {
        let place = &mut self.places[robot.index()];
        place.absent = false;
        if place.presence == (Presence::Entering { again: false }) {
            place.enter(true, None, &mut self.inputs);
        } else {
            self.expected.insert(robot);
        }
    }

    /// Stops waiting for an expected agent that will not arrive.
    pub fn cancel_expected(&mut self, robot: RobotId) {
        self.expected.remove(&robot);
    }

    pub fn mark_absent(&mut self, robot: RobotId) {
        self.places[robot.index()].absent = true;
    }

    #[must_use]
    pub fn is_absent(&self, robot: RobotId) -> bool {
        self.places[robot.index()].absent
    }
}
