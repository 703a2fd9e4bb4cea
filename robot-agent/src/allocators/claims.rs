//! The claims of teammates: which task each reports to execute. For [`super::first_come`] and [`super::learned`].

use std::collections::BTreeMap;

use proto::team::{BroadcastContent, TaskState};
use scenario::ids::{Incarnation, RobotId, TaskId};
use scenario::time::SimTime;

use crate::allocator::{Input, SelfState};

/// The latest claim of each teammate.
#[derive(Clone, Debug, Default)]
pub struct Claims(BTreeMap<RobotId, Claim>);

/// The content of a teammate's latest heartbeat.
#[derive(Clone, Copy, Debug)]
pub struct Claim {
    stamp: (Incarnation, u64),
    pub received: SimTime,
    /// The time at which the teammate claimed the task.
    pub since: SimTime,
    task: Option<TaskId>,
}

impl Claims {
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// Stores the claims of this step's heartbeats. An older heartbeat does not replace a newer one.
    pub fn receive(&mut self, me: &SelfState, input: &Input<'_>) {
        for broadcast in input.received {
            let (sender, stamp) = (broadcast.sender, (broadcast.incarnation, broadcast.seq));
            if !me.is_teammate(sender) {
                continue;
            }
            let BroadcastContent::Heartbeat(heartbeat) = &broadcast.body else {
                continue;
            };
            if self
                .0
                .get(&sender)
                .is_some_and(|known| known.stamp >= stamp)
            {
                continue;
            }
            let executes = heartbeat.state == TaskState::Executing;
            let claim = Claim {
                stamp,
                received: input.now,
                since: heartbeat.since,
                task: heartbeat.task.filter(|_| executes),
            };
            self.0.insert(sender, claim);
        }
    }

    /// Returns the claims to the task that were received within τ, by rank.
    pub fn of_task(
        &self,
        me: &SelfState,
        task: TaskId,
        now: SimTime,
    ) -> impl Iterator<Item = (RobotId, Claim)> {
        let ceased_after = me.ceased_after;
        let within = self.0.iter().filter(move |(_, claim)| {
            claim.task == Some(task) && now.since(claim.received) < ceased_after
        });
        within.map(|(&robot, &claim)| (robot, claim))
    }
}
