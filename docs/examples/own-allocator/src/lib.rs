//! The `greedy` allocator: a free robot takes the cheapest task that no teammate has reported lately, and keeps it
//! until it is done.

use std::collections::BTreeMap;

use proto::team::BroadcastContent;
use robot_agent::allocator::{Allocator, Decision, Input, NoParameters, SelfState};
use scenario::ids::{RobotId, TaskId};
use scenario::time::SimTime;

#[derive(Clone, Debug)]
pub struct Greedy {
    me: SelfState,
    /// The latest heartbeat of each teammate: the time of receipt and the reported task.
    reported: BTreeMap<RobotId, (SimTime, Option<TaskId>)>,
}

impl Allocator for Greedy {
    type Config = NoParameters;

    fn new(me: &SelfState, _: &NoParameters) -> Self {
        Self {
            me: me.clone(),
            reported: BTreeMap::new(),
        }
    }

    fn step(&mut self, input: &Input<'_>, decision: &mut Decision) {
        for broadcast in input
            .received
            .iter()
            .filter(|broadcast| broadcast.sender.index() < self.me.team)
        {
            if let BroadcastContent::Heartbeat(heartbeat) = &broadcast.body {
                self.reported
                    .insert(broadcast.sender, (input.now, heartbeat.task));
            }
        }
        let taken = |task| {
            let mut reported = self.reported.values();
            reported.any(|(at, reported_task)| {
                *reported_task == Some(task) && input.now.since(*at) < self.me.ceased_after
            })
        };
        let can = || input.choices.iter().filter(|choice| choice.applicable);
        if can().any(|choice| Some(choice.behavior) == decision.active) {
            return;
        }
        let cost = |cost_s: Option<f64>| cost_s.unwrap_or(f64::INFINITY);
        let free = can().filter(|choice| !taken(choice.task));
        let cheapest = free.min_by(|a, b| cost(a.cost_s).total_cmp(&cost(b.cost_s)));
        decision.active = cheapest.map(|choice| choice.behavior);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn greedy_passes_the_allocator_testkit() {
        robot_agent::testkit::check_allocator::<Greedy>(&NoParameters {});
    }
}
