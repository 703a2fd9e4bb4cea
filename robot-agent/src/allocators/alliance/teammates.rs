//! What teammates say they do: who executes a task, who waits for it, and whose turn it is (ALLIANCE.md §3).

use alliance_proto::ids::{Incarnation, RobotId, TaskId};
use alliance_proto::team::{Broadcast, Content, Heartbeat, TaskState};
use alliance_proto::time::SimTime;

use crate::by_rank::ByRank;

/// A claim to a task or a wish for it, by age: the earlier comes first, a tie goes to the lower rank.
pub(super) type Claim = (SimTime, RobotId);

/// What teammates last said they do about the robot's own tasks.
#[derive(Clone, Debug, Default)]
pub(super) struct Teammates {
    /// Incarnation and sequence number of the latest message of each that spoke.
    latest: ByRank<(Incarnation, u64)>,
    /// Claims and wishes, by teammate: few, and walked in every step.
    said: Vec<Said>,
}

/// What one teammate does about one task.
#[derive(Clone, Copy, Debug)]
struct Said {
    teammate: RobotId,
    task: TaskId,
    /// Executing, else waiting.
    executing: bool,
    since: SimTime,
    heard: SimTime,
}

impl Teammates {
    /// Takes in a broadcast that is heard at `now`, and says whether it is, or ends, a claim or a wish. Of tasks that are not its own
    /// the robot remembers nothing but that the sender executes no other.
    pub fn hear(
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
        let before = self.said.len();
        if is_new_incarnation {
            // It does nothing of what the old one did.
            self.said.retain(|said| said.teammate != broadcast.sender);
        }
        let claims = match &broadcast.body {
            Content::Heartbeat(heartbeat) => self.take(now, broadcast.sender, heartbeat, is_own),
            _ => false,
        };
        claims || self.said.len() < before
    }

    /// Says whether it is a claim or a wish.
    fn take(
        &mut self,
        now: SimTime,
        sender: RobotId,
        heartbeat: &Heartbeat,
        is_own: impl Fn(TaskId) -> bool,
    ) -> bool {
        let (task, executing) = match (heartbeat.state, heartbeat.task) {
            (TaskState::Executing, Some(task)) => {
                self.said.retain(|said| said.teammate != sender);
                (task, true)
            }
            (TaskState::Waiting, Some(task)) => {
                let ends = |said: &Said| said.executing || said.task == task;
                self.said
                    .retain(|said| said.teammate != sender || !ends(said));
                (task, false)
            }
            (TaskState::Released, Some(task)) => {
                let ends = |said: &Said| said.teammate == sender && said.task == task;
                self.said.retain(|said| !ends(said));
                return false;
            }
            (TaskState::Idle, _) => {
                self.said.retain(|said| said.teammate != sender);
                return false;
            }
            (_, None) => return false,
        };
        let is_own = is_own(task);
        if is_own {
            let said = Said {
                teammate: sender,
                task,
                executing,
                since: heartbeat.since,
                heard: now,
            };
            let place = self.said.partition_point(|other| other.teammate <= sender);
            self.said.insert(place, said);
        }
        is_own
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
        let waiting = self.claims(task, false, tau, now);
        let earlier = waiting.filter(|&other| other < wish);
        self.executing(task, tau, now).count() + earlier.count() < max_robots
    }

    /// The claims to the task of those who execute it and were heard within τ.
    pub fn executing(
        &self,
        task: TaskId,
        tau: SimTime,
        now: SimTime,
    ) -> impl Iterator<Item = Claim> {
        self.claims(task, true, tau, now)
    }

    /// When, after `now`, claims to the task and wishes for it expire, if nothing more is heard.
    pub fn expiries(
        &self,
        task: TaskId,
        tau: SimTime,
        now: SimTime,
    ) -> impl Iterator<Item = SimTime> {
        let about = self.said.iter().filter(move |said| said.task == task);
        about
            .map(move |said| said.heard + tau)
            .filter(move |&end| end > now)
    }

    fn claims(
        &self,
        task: TaskId,
        executing: bool,
        tau: SimTime,
        now: SimTime,
    ) -> impl Iterator<Item = Claim> {
        self.said.iter().filter_map(move |said| {
            let is_meant = said.task == task && said.executing == executing;
            (is_meant && now.since(said.heard) < tau).then_some((said.since, said.teammate))
        })
    }
}
