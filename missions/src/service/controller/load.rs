//! The robot's load, and the points that still fit into its capacity.

use scenario::Robot;
use scenario::time::SimTime;

use super::ServiceController;
use super::progress::Progress;
use crate::service::bus::PointFact;
use crate::service::data::fits;

/// The time at a point without an effect of the work after which the robot leaves the point out. The estimated load is
/// too small after a restart.
const REFUSED_TIME: SimTime = SimTime(5000);

/// The robot's own record of the demands that it has taken for the rest of the run.
#[derive(Clone, Debug)]
pub(super) struct Load {
    capacity: Option<f64>,
    taken: f64,
    /// The last point whose demand was taken, with its round. A stuck sensor reports it again.
    last: Option<(u32, u32)>,
    /// The point at which the work has no effect, and since when.
    refused: Option<(u32, SimTime)>,
}

impl Load {
    /// Creates the empty load of a robot.
    pub fn new(robot: &Robot) -> Self {
        Self {
            capacity: robot.capacity,
            taken: 0.0,
            last: None,
            refused: None,
        }
    }

    /// Records that the robot is at no point.
    pub fn forget_refusal(&mut self) {
        self.refused = None;
    }

    /// Returns whether a demand fits beside the taken ones and `more`.
    pub fn fits(&self, more: f64, demand: f64) -> bool {
        fits(self.taken + more, demand, self.capacity)
    }
}

impl ServiceController {
    /// Takes the demand of a point that is over after the robot's work, and that is delivered nowhere. From the
    /// deadline on, the point may have expired. The robot then takes the demand only if it has done all the work.
    pub(super) fn note_load(&mut self, fact: &PointFact, progress: &Progress, now: SimTime) {
        let (_, closes) = self.briefing.window(fact);
        let is_done = closes.is_none_or(|closes| closes > now) || progress.is_complete();
        let done = Some((fact.point, fact.round));
        if is_done && self.load.last != done {
            self.load.taken += self.briefing.terms(fact.point).kept_demand();
            self.load.last = done;
        }
    }

    /// Returns whether the robot can take the demand of a point after those of other tasks.
    pub(super) fn has_capacity(&self, more: f64, point: u32) -> bool {
        self.load.fits(more, self.briefing.terms(point).demand)
    }

    /// Lets a robot give up a point at which its work has no effect, because its load is larger than it estimates.
    pub(super) fn note_refusal(
        &mut self,
        fact: &PointFact,
        works: bool,
        is_near: bool,
        now: SimTime,
    ) {
        let (opens, _) = self.briefing.window(fact);
        let has_demand = self.briefing.terms(fact.point).demand > 0.0;
        if !has_demand || works || !is_near || now < opens {
            self.load.refused = None;
            return;
        }
        let known = self.load.refused.filter(|(point, _)| *point == fact.point);
        let (point, since) = *self.load.refused.insert(known.unwrap_or((fact.point, now)));
        if now.since(since) >= REFUSED_TIME {
            self.load.refused = None;
            self.memory.failed.fail(point, now);
        }
    }
}
