//! The reported activities of teammates, and the order of their claims (docs/ALLIANCE.md §3).

use proto::team::{Broadcast, BroadcastContent, Heartbeat, TaskState};
use scenario::ids::{Incarnation, RobotId, TaskId};
use scenario::time::SimTime;

use crate::by_rank::{ByRank, place_from};

/// A claim to a task or a wish for it. The earlier one comes first; a tie goes to the lower rank.
pub(super) type Claim = (SimTime, RobotId);

/// The last reported activities of teammates on the robot's tasks.
#[derive(Clone, Debug, Default)]
pub(super) struct Teammates {
    latest: ByRank<(Incarnation, u64)>,
    /// The claims and wishes, sorted by teammate; every step reads them.
    activities: Vec<Activity>,
    /// The place of the activities of the latest sender, or after them.
    near: usize,
}

/// The activity of one teammate on one task.
#[derive(Clone, Copy, Debug)]
struct Activity {
    teammate: RobotId,
    task: TaskId,
    /// True for executing, false for waiting.
    executing: bool,
    since: SimTime,
    received: SimTime,
}

impl Teammates {
    /// Stores a broadcast received at `now`. Returns whether it states or ends a claim or wish. A claim to another
    /// robot's task only ends the sender's earlier claims.
    pub fn receive(
        &mut self,
        now: SimTime,
        broadcast: &Broadcast,
        is_own: impl Fn(TaskId) -> bool,
    ) -> bool {
        let stamp = (broadcast.incarnation, broadcast.seq);
        let latest = self
            .latest
            .get_or_insert_with(broadcast.sender, Default::default);
        if stamp <= *latest {
            return false;
        }
        let is_new_incarnation = stamp.0 > latest.0;
        *latest = stamp;
        let before = self.activities.len();
        if is_new_incarnation {
            // Claims of the old incarnation are void.
            self.replace(broadcast.sender, |_| true, None);
        }
        let claims = match &broadcast.body {
            BroadcastContent::Heartbeat(heartbeat) => {
                self.take(now, broadcast.sender, heartbeat, is_own)
            }
            _ => false,
        };
        claims || self.activities.len() < before
    }

    /// Updates the activities of the sender. Returns whether the heartbeat states a claim or wish for a task of the
    /// robot.
    fn take(
        &mut self,
        now: SimTime,
        sender: RobotId,
        heartbeat: &Heartbeat,
        is_own: impl Fn(TaskId) -> bool,
    ) -> bool {
        let (task, executing) = match (heartbeat.state, heartbeat.task) {
            (TaskState::Executing, Some(task)) => (task, true),
            (TaskState::Waiting, Some(task)) => (task, false),
            (TaskState::Released, Some(task)) => {
                self.replace(sender, |activity| activity.task == task, None);
                return false;
            }
            (TaskState::Idle, _) => {
                self.replace(sender, |_| true, None);
                return false;
            }
            (_, None) => return false,
        };
        let activity = Activity {
            teammate: sender,
            task,
            executing,
            since: heartbeat.since,
            received: now,
        };
        let is_own = is_own(task);
        let ends = |activity: &Activity| executing || activity.executing || activity.task == task;
        self.replace(sender, ends, is_own.then_some(activity));
        is_own
    }

    /// Removes the activities of a teammate that end, and adds a new one after its others.
    fn replace(
        &mut self,
        teammate: RobotId,
        ends: impl Fn(&Activity) -> bool,
        new: Option<Activity>,
    ) {
        let activities = &mut self.activities;
        let begin = place_from(activities, self.near, teammate, |other| other.teammate);
        let mut end = begin;
        let mut kept = begin;
        while activities
            .get(end)
            .is_some_and(|other| other.teammate == teammate)
        {
            if !ends(&activities[end]) {
                activities[kept] = activities[end];
                kept += 1;
            }
            end += 1;
        }
        // Most messages repeat an activity. Its place is used again, because a shift of a large team's list takes long.
        match new {
            Some(activity) if kept < end => {
                activities[kept] = activity;
                kept += 1;
            }
            Some(activity) => activities.insert(kept, activity),
            None => {}
        }
        activities.drain(kept..end);
        self.near = kept;
    }

    /// Returns whether `max_robots` teammates execute the task; teammates silent for τ do not count.
    pub fn is_occupied(&self, task: TaskId, max_robots: usize, tau: SimTime, now: SimTime) -> bool {
        self.executing(task, tau, now).count() >= max_robots
    }

    /// Returns whether the task has a place left for the robot with `wish`. Executing teammates and earlier wishes take
    /// places first.
    pub fn has_place_for(
        &self,
        wish: Claim,
        task: TaskId,
        max_robots: usize,
        tau: SimTime,
        now: SimTime,
    ) -> bool {
        let waiting = self.claims(task, false, tau, now);
        let earlier = waiting.filter(|&other| other < wish);
        self.executing(task, tau, now).count() + earlier.count() < max_robots
    }

    /// Returns the claims of executing teammates received within τ.
    pub fn executing(
        &self,
        task: TaskId,
        tau: SimTime,
        now: SimTime,
    ) -> impl Iterator<Item = Claim> {
        self.claims(task, true, tau, now)
    }

    /// Returns the times after `now` at which claims and wishes for the task expire without a new message.
    pub fn expiries(
        &self,
        task: TaskId,
        tau: SimTime,
        now: SimTime,
    ) -> impl Iterator<Item = SimTime> {
        let about = self
            .activities
            .iter()
            .filter(move |activity| activity.task == task);
        about
            .map(move |activity| activity.received + tau)
            .filter(move |&end| end > now)
    }

    fn claims(
        &self,
        task: TaskId,
        executing: bool,
        tau: SimTime,
        now: SimTime,
    ) -> impl Iterator<Item = Claim> {
        self.activities.iter().filter_map(move |activity| {
            let matches = activity.task == task && activity.executing == executing;
            (matches && now.since(activity.received) < tau)
                .then_some((activity.since, activity.teammate))
        })
    }
}
