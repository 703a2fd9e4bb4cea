//! What teammates say they do: who executes a task, who waits for it, and whose turn it is (ALLIANCE.md §3).

use std::collections::BTreeMap;

use alliance_proto::ids::{Incarnation, RobotId, TaskId};
use alliance_proto::team::{Body, Broadcast, Heartbeat, TaskState};
use alliance_proto::time::SimTime;

/// A claim to a task or a wish for it, by age: the earlier comes first, a tie goes to the lower rank.
pub(super) type Claim = (SimTime, RobotId);

/// The teammates that spoke.
#[derive(Clone, Debug, Default)]
pub(super) struct Teammates(BTreeMap<RobotId, Teammate>);

/// What one teammate last said it does.
#[derive(Clone, Debug, Default)]
struct Teammate {
    /// Incarnation and sequence number of its latest message.
    latest: (Incarnation, u64),
    executes: Option<(TaskId, Said)>,
    waits_for: BTreeMap<TaskId, Said>,
}

#[derive(Clone, Copy, Debug)]
struct Said {
    since: SimTime,
    heard: SimTime,
}

impl Teammates {
    /// Takes in a broadcast that is heard at `now`.
    pub fn hear(&mut self, now: SimTime, broadcast: &Broadcast) {
        let teammate = self.0.entry(broadcast.sender).or_default();
        let stamp = (broadcast.incarnation, broadcast.seq);
        if stamp <= teammate.latest {
            return;
        }
        if stamp.0 > teammate.latest.0 {
            // A new life does nothing of what the old one did.
            teammate.executes = None;
            teammate.waits_for.clear();
        }
        teammate.latest = stamp;
        if let Body::Heartbeat(heartbeat) = &broadcast.body {
            teammate.take(now, heartbeat);
        }
    }

    /// Whether as many teammates execute the task as may; who was not heard within τ does not count.
    pub fn occupy(&self, task: TaskId, max_robots: usize, tau: SimTime, now: SimTime) -> bool {
        self.executing(task, tau, now).count() >= max_robots
    }

    /// Whether there is a place for the robot that wishes for the task: after those who execute it and those who wished
    /// for it earlier.
    pub fn leave_to(
        &self,
        wish: Claim,
        task: TaskId,
        max_robots: usize,
        tau: SimTime,
        now: SimTime,
    ) -> bool {
        let earlier = self.waiting(task, tau, now).filter(|&other| other < wish);
        self.executing(task, tau, now).count() + earlier.count() < max_robots
    }

    /// The claims to the task of those who execute it and were heard within τ.
    pub fn executing(
        &self,
        task: TaskId,
        tau: SimTime,
        now: SimTime,
    ) -> impl Iterator<Item = Claim> {
        self.0.iter().filter_map(move |(&rank, teammate)| {
            let (_, said) = teammate.executes.filter(|&(doing, _)| doing == task)?;
            said.claim(rank, tau, now)
        })
    }

    fn waiting(&self, task: TaskId, tau: SimTime, now: SimTime) -> impl Iterator<Item = Claim> {
        self.0.iter().filter_map(move |(&rank, teammate)| {
            let said = teammate.waits_for.get(&task)?;
            said.claim(rank, tau, now)
        })
    }
}

impl Teammate {
    fn take(&mut self, now: SimTime, heartbeat: &Heartbeat) {
        let said = Said {
            since: heartbeat.since,
            heard: now,
        };
        match (heartbeat.state, heartbeat.task) {
            (TaskState::Executing, Some(task)) => {
                self.executes = Some((task, said));
                self.waits_for.clear();
            }
            (TaskState::Waiting, Some(task)) => {
                self.executes = None;
                self.waits_for.insert(task, said);
            }
            (TaskState::Released, Some(task)) => {
                self.executes = self.executes.filter(|&(doing, _)| doing != task);
                self.waits_for.remove(&task);
            }
            (TaskState::Idle, _) => {
                self.executes = None;
                self.waits_for.clear();
            }
            (_, None) => {}
        }
    }
}

impl Said {
    fn claim(self, rank: RobotId, tau: SimTime, now: SimTime) -> Option<Claim> {
        (now.since(self.heard) < tau).then_some((self.since, rank))
    }
}
