//! The monitor: the time of each robot for each task, measured from heartbeats.
//!
//! A trial begins with the first report of execution, and with each reported progress, which ends the previous trial
//! successfully. A trial fails if the robot releases the task, executes another one, is silent for τ or restarts. Send
//! times count, not receive times.

use std::sync::Arc;

use proto::team::{Broadcast, BroadcastContent, TaskState};
use scenario::LearnedTimes;
use scenario::ids::{Incarnation, RobotId, TaskId};
use scenario::time::SimTime;
use smallvec::SmallVec;

use crate::allocator::SelfState;
use crate::by_rank::ByRank;

/// The task times of all robots, as one robot measures them.
#[derive(Clone, Debug)]
pub(super) struct Monitor {
    me: RobotId,
    team: usize,
    tau: SimTime,
    step_s: f64,
    /// μ, the number of stored trials.
    window: usize,
    /// True if a robot may wish for another task while it executes one.
    wishes_at_work: bool,
    /// The assumed time for robots without trials, s, by task; `None` for tasks without a behavior of this robot.
    priors: Vec<Option<f64>>,
    teammates: ByRank<Teammate>,
    own: Option<Attempt>,
    trials: Vec<((TaskId, RobotId), Trials)>,
}

#[derive(Clone, Copy, Debug, Default)]
struct Teammate {
    latest: (Incarnation, u64),
    /// The receive time and the send time of the last message.
    received: SimTime,
    sent: SimTime,
    at: Option<Attempt>,
}

/// A trial in progress.
#[derive(Clone, Copy, Debug)]
struct Attempt {
    task: TaskId,
    began: SimTime,
    progress: u32,
}

#[derive(Clone, Debug, Default)]
struct Trials {
    /// The times of at most μ trials, the oldest first, s.
    times: SmallVec<[f64; 8]>,
    count: u32,
    estimate: f64,
}

impl Monitor {
    /// Creates a monitor without trials, with an assumed time of `prior_units` units of each task's work.
    pub fn new(me: &SelfState, window: usize, prior_units: f64, wishes_at_work: bool) -> Self {
        let is_own = |task: usize| {
            me.behaviors
                .iter()
                .any(|behavior| behavior.task.index() == task)
        };
        let priors = me.briefs.iter().enumerate().map(|(task, brief)| {
            let prior_s = (prior_units * brief.unit_s).max(me.step_s);
            is_own(task).then_some(prior_s)
        });
        Self {
            me: me.robot,
            team: me.team,
            tau: me.ceased_after,
            step_s: me.step_s,
            window,
            wishes_at_work,
            priors: priors.collect(),
            teammates: ByRank::default(),
            own: None,
            trials: Vec::new(),
        }
    }

    pub fn recall(&mut self, task: TaskId, robot: RobotId, times: &LearnedTimes) {
        for &time_s in &times.latest_s {
            self.store(robot, task, time_s);
        }
        if let Ok(place) = self.place(task, robot) {
            self.trials[place].1.count = times.trials;
        }
    }

    /// Returns all times, by task and robot, without trials in progress.
    pub fn learned(&self) -> Vec<(TaskId, RobotId, LearnedTimes)> {
        let known = self.trials.iter().map(|((task, robot), trials)| {
            let times = LearnedTimes {
                trials: trials.count,
                latest_s: trials.times.to_vec(),
            };
            (*task, *robot, times)
        });
        known.collect()
    }

    /// Processes the messages of a step, and ends the trials of teammates silent for τ.
    pub fn receive<'a>(
        &mut self,
        now: SimTime,
        received: impl IntoIterator<Item = &'a Arc<Broadcast>>,
    ) {
        for broadcast in received {
            self.receive_broadcast(now, broadcast);
        }
        for place in self.teammates.places() {
            let (robot, teammate) = self.teammates.entry_mut(place);
            if now.since(teammate.received) >= self.tau
                && let Some(attempt) = teammate.at.take()
            {
                let sent = teammate.sent;
                self.fail(robot, attempt, sent);
            }
        }
    }

    fn receive_broadcast(&mut self, now: SimTime, broadcast: &Broadcast) {
        let sender = broadcast.sender;
        let task = match &broadcast.body {
            BroadcastContent::Heartbeat(heartbeat) => heartbeat.task,
            BroadcastContent::Bulletin(bulletin) => bulletin.about.map(|about| about.task),
            BroadcastContent::Allocation(_) => None,
        };
        let is_known = |task: TaskId| task.index() < self.priors.len();
        if sender == self.me || sender.index() >= self.team || !task.is_none_or(is_known) {
            return;
        }
        let teammate = self.teammates.get_or_insert_with(sender, Teammate::default);
        let stamp = (broadcast.incarnation, broadcast.seq);
        if stamp <= teammate.latest {
            return;
        }
        let before = *teammate;
        // A send time in the future is invalid.
        let sent = broadcast.sent.min(now);
        (teammate.latest, teammate.received, teammate.sent) = (stamp, now, sent);
        let mut at = before.at;
        if stamp.0 > before.latest.0
            && let Some(attempt) = at.take()
        {
            self.fail(sender, attempt, before.sent);
        }
        let (progress, continues) = match &broadcast.body {
            BroadcastContent::Heartbeat(heartbeat) => {
                let is_same = at.is_some_and(|at| Some(at.task) == heartbeat.task);
                let continues = match heartbeat.state {
                    TaskState::Executing => is_same,
                    TaskState::Released => !is_same,
                    TaskState::Waiting => self.wishes_at_work && !is_same,
                    TaskState::Idle => false,
                };
                (is_same.then_some(heartbeat.progress), continues)
            }
            BroadcastContent::Bulletin(bulletin) => {
                let about = bulletin.about.as_ref();
                let same = about.filter(|about| at.is_some_and(|at| at.task == about.task));
                (same.map(|about| about.progress), true)
            }
            BroadcastContent::Allocation(_) => (None, true),
        };
        if let (Some(attempt), Some(progress)) = (&mut at, progress) {
            let units = progress.saturating_sub(attempt.progress);
            attempt.progress = attempt.progress.max(progress);
            self.succeed(sender, attempt, units, sent);
        }
        if !continues && let Some(attempt) = at.take() {
            self.fail(sender, attempt, sent);
        }
        if let BroadcastContent::Heartbeat(heartbeat) = &broadcast.body
            && let (TaskState::Executing, Some(task), None) = (heartbeat.state, heartbeat.task, at)
        {
            at = Some(Attempt {
                task,
                began: sent,
                progress: heartbeat.progress,
            });
        }
        self.teammates
            .get_or_insert_with(sender, Teammate::default)
            .at = at;
    }

    pub fn note_progress(&mut self, now: SimTime, progressed: &[TaskId]) {
        if let Some(mut attempt) = self.own {
            let units = progressed.iter().filter(|&&task| task == attempt.task);
            let units = units.count() as u32;
            self.succeed(self.me, &mut attempt, units, now);
            self.own = Some(attempt);
        }
    }

    pub fn note_active(&mut self, now: SimTime, active: Option<TaskId>) {
        if self.own.map(|attempt| attempt.task) == active {
            return;
        }
        if let Some(attempt) = self.own.take() {
            self.fail(self.me, attempt, now);
        }
        self.own = active.map(|task| Attempt {
            task,
            began: now,
            progress: 0,
        });
    }

    /// Returns the robot's own current task and the start of its trial.
    pub fn current_trial(&self) -> Option<(TaskId, SimTime)> {
        self.own.map(|attempt| (attempt.task, attempt.began))
    }

    /// Returns task_time(k, j) of a task of this robot, s; the assumed time if there is no trial.
    pub fn time_s(&self, task: TaskId, robot: RobotId) -> f64 {
        let prior_s = || self.priors[task.index()].unwrap_or(self.step_s);
        let known = self.place(task, robot);
        known.map_or_else(|_| prior_s(), |place| self.trials[place].1.estimate)
    }

    /// Returns the assumed time of a robot without trials of the task, s.
    pub fn prior_s(&self, task: TaskId) -> f64 {
        self.priors[task.index()].unwrap_or(self.step_s)
    }

    /// Returns the robots with trials of a task and their times, s, by rank. This robot is included.
    pub fn trials_of(&self, task: TaskId) -> impl Iterator<Item = (RobotId, f64)> {
        let from = self.trials.partition_point(|((other, _), _)| *other < task);
        let rest = self.trials[from..].iter();
        rest.take_while(move |((other, _), _)| *other == task)
            .map(|((_, robot), trials)| (*robot, trials.estimate))
    }

    pub fn trial_count(&self, task: TaskId) -> u32 {
        let known = self.place(task, self.me);
        known.map_or(0, |place| self.trials[place].1.count)
    }

    /// Returns the number of teammates that report executing a task.
    pub fn executing_count(&self, task: TaskId) -> usize {
        let teammates = self.teammates.iter();
        teammates
            .filter(|(_, teammate)| teammate.at.is_some_and(|at| at.task == task))
            .count()
    }

    /// Returns the teammates received within τ, by rank.
    pub fn present(&self, now: SimTime) -> impl Iterator<Item = RobotId> {
        let teammates = self.teammates.iter();
        teammates
            .filter(move |(_, teammate)| now.since(teammate.received) < self.tau)
            .map(|(robot, _)| robot)
    }

    fn place(&self, task: TaskId, robot: RobotId) -> Result<usize, usize> {
        self.trials
            .binary_search_by_key(&(task, robot), |&(key, _)| key)
    }

    /// Stores progress of several units as one trial each, with equal shares of the time.
    fn succeed(&mut self, robot: RobotId, attempt: &mut Attempt, units: u32, now: SimTime) {
        if units == 0 {
            return;
        }
        let time_s = now.since(attempt.began).as_secs_f64() / f64::from(units);
        attempt.began = now;
        // More than μ equal trials would only replace each other.
        for _ in 0..units.min(self.window as u32) {
            self.store(robot, attempt.task, time_s);
        }
    }

    /// Stores a failed trial with its duration, at least the current estimate. A trial of zero duration does not count.
    fn fail(&mut self, robot: RobotId, attempt: Attempt, now: SimTime) {
        let spent_s = now.since(attempt.began).as_secs_f64();
        if spent_s > 0.0 {
            let known_s = self.time_s(attempt.task, robot);
            self.store(robot, attempt.task, spent_s.max(known_s));
        }
    }

    pub(super) fn store(&mut self, robot: RobotId, task: TaskId, time_s: f64) {
        if self.priors[task.index()].is_none() {
            return;
        }
        let place = self.place(task, robot).unwrap_or_else(|place| {
            self.trials
                .insert(place, ((task, robot), Trials::default()));
            place
        });
        // The resolution is one step.
        let time_s = time_s.max(self.step_s);
        self.trials[place].1.push(time_s, self.window);
    }
}

impl Trials {
    fn push(&mut self, time_s: f64, window: usize) {
        if self.times.len() >= window {
            self.times.remove(0);
        }
        self.times.push(time_s);
        self.count = self.count.saturating_add(1);
        self.estimate = mean_and_deviation(&self.times);
    }
}

/// Returns the mean plus one sample standard deviation (n - 1; 0 for one value).
fn mean_and_deviation(values: &[f64]) -> f64 {
    let count = values.len() as f64;
    let mean = values.iter().sum::<f64>() / count;
    if values.len() < 2 {
        return mean;
    }
    let squares: f64 = values
        .iter()
        .map(|value| (value - mean) * (value - mean))
        .sum();
    mean + (squares / (count - 1.0)).sqrt()
}
