//! The monitor: how long each robot needs for each task, from what it says it does.
//!
//! A trial begins when a robot is first heard executing a task, and at each progress that it reports on it. Progress ends it. A trial
//! that ends otherwise has failed: the task was released, the robot turned to something else, fell silent for τ, or began a new
//! incarnation. Times are those of the sender's words, never of their arrival.

use std::sync::Arc;

use alliance_proto::ids::{Incarnation, RobotId, TaskId};
use alliance_proto::scenario::KnownTimes;
use alliance_proto::team::{Broadcast, Content, TaskState};
use alliance_proto::time::SimTime;
use smallvec::SmallVec;

use crate::allocator::Me;
use crate::by_rank::ByRank;

/// What one robot knows of the times of all, itself included.
#[derive(Clone, Debug)]
pub(super) struct Monitor {
    me: RobotId,
    team: usize,
    tau: SimTime,
    step_s: f64,
    /// μ.
    window: usize,
    /// Whether a robot that executes a task may wish for another one meanwhile.
    wishes_at_work: bool,
    /// By task: what is believed of who has made no trial, s; `None` of tasks that the robot itself has no behavior for.
    priors: Vec<Option<f64>>,
    /// By teammate: those that have spoken.
    seen: ByRank<Seen>,
    /// What the robot itself is at.
    own: Option<Attempt>,
    /// By task and robot: those who have made one.
    trials: Vec<((TaskId, RobotId), Trials)>,
}

/// What was heard from a teammate.
#[derive(Clone, Copy, Debug, Default)]
struct Seen {
    latest: (Incarnation, u64),
    /// When it was heard last, and when that was sent.
    heard: SimTime,
    sent: SimTime,
    at: Option<Attempt>,
}

/// A trial that goes on.
#[derive(Clone, Copy, Debug)]
struct Attempt {
    task: TaskId,
    began: SimTime,
    progress: u32,
}

/// The latest trials of a robot on a task.
#[derive(Clone, Debug, Default)]
struct Trials {
    /// At most μ, from the oldest on, s.
    times: SmallVec<[f64; 8]>,
    /// How many there have been.
    count: u32,
    estimate: f64,
}

impl Monitor {
    /// Nothing heard yet; `prior_units` units of a task's work are believed to be needed for it.
    pub fn new(me: &Me, window: usize, prior_units: f64, wishes_at_work: bool) -> Self {
        let is_own = |task: usize| me.behaviors.iter().any(|own| own.task.index() == task);
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
            seen: ByRank::default(),
            own: None,
            trials: Vec::new(),
        }
    }

    /// Takes in what was learned of a robot and a task in an earlier run, as if it had just been seen.
    pub fn recall(&mut self, task: TaskId, robot: RobotId, times: &KnownTimes) {
        for &time_s in &times.latest_s {
            self.store(robot, task, time_s);
        }
        if let Ok(place) = self.place(task, robot) {
            self.trials[place].1.count = times.trials;
        }
    }

    /// All that is known, by task and robot. A trial that goes on is none yet.
    pub fn learned(&self) -> Vec<(TaskId, RobotId, KnownTimes)> {
        let known = self.trials.iter().map(|((task, robot), trials)| {
            let times = KnownTimes {
                trials: trials.count,
                latest_s: trials.times.to_vec(),
            };
            (*task, *robot, times)
        });
        known.collect()
    }

    /// Takes in what is heard in a step, and ends the trials of those who have been silent for τ.
    pub fn hear<'a>(&mut self, now: SimTime, heard: impl IntoIterator<Item = &'a Arc<Broadcast>>) {
        for broadcast in heard {
            self.take(now, broadcast);
        }
        for place in self.seen.places() {
            let (robot, seen) = self.seen.entry_mut(place);
            if now.since(seen.heard) >= self.tau
                && let Some(attempt) = seen.at.take()
            {
                let sent = seen.sent;
                self.fail(robot, attempt, sent);
            }
        }
    }

    fn take(&mut self, now: SimTime, broadcast: &Broadcast) {
        let sender = broadcast.sender;
        let task = match &broadcast.body {
            Content::Heartbeat(heartbeat) => heartbeat.task,
            Content::Bulletin(bulletin) => bulletin.about.map(|about| about.task),
            Content::Allocation(_) => None,
        };
        let is_known = |task: TaskId| task.index() < self.priors.len();
        if sender == self.me || sender.index() >= self.team || !task.is_none_or(is_known) {
            return;
        }
        let seen = self.seen.get_or_insert_with(sender, Seen::default);
        let stamp = (broadcast.incarnation, broadcast.seq);
        if stamp <= seen.latest {
            return;
        }
        let before = *seen;
        // Nobody speaks in the future, whatever it says.
        let sent = broadcast.sent.min(now);
        (seen.latest, seen.heard, seen.sent) = (stamp, now, sent);
        let mut at = before.at;
        if stamp.0 > before.latest.0
            && let Some(attempt) = at.take()
        {
            self.fail(sender, attempt, before.sent);
        }
        let (progress, goes_on) = match &broadcast.body {
            Content::Heartbeat(heartbeat) => {
                let is_same = at.is_some_and(|at| Some(at.task) == heartbeat.task);
                let goes_on = match heartbeat.state {
                    TaskState::Executing => is_same,
                    TaskState::Released => !is_same,
                    TaskState::Waiting => self.wishes_at_work && !is_same,
                    TaskState::Idle => false,
                };
                (is_same.then_some(heartbeat.progress), goes_on)
            }
            Content::Bulletin(bulletin) => {
                let about = bulletin.about.as_ref();
                let same = about.filter(|about| at.is_some_and(|at| at.task == about.task));
                (same.map(|about| about.progress), true)
            }
            Content::Allocation(_) => (None, true),
        };
        if let (Some(attempt), Some(progress)) = (&mut at, progress) {
            let units = progress.saturating_sub(attempt.progress);
            attempt.progress = attempt.progress.max(progress);
            self.succeed(sender, attempt, units, sent);
        }
        if !goes_on && let Some(attempt) = at.take() {
            self.fail(sender, attempt, sent);
        }
        if let Content::Heartbeat(heartbeat) = &broadcast.body
            && let (TaskState::Executing, Some(task), None) = (heartbeat.state, heartbeat.task, at)
        {
            at = Some(Attempt {
                task,
                began: sent,
                progress: heartbeat.progress,
            });
        }
        self.seen.get_or_insert_with(sender, Seen::default).at = at;
    }

    /// Takes note of what the robot itself achieved since its step before.
    pub fn note_progress(&mut self, now: SimTime, progressed: &[TaskId]) {
        if let Some(mut attempt) = self.own {
            let units = progressed.iter().filter(|&&task| task == attempt.task);
            let units = units.count() as u32;
            self.succeed(self.me, &mut attempt, units, now);
            self.own = Some(attempt);
        }
    }

    /// Takes note of what the robot itself is at after a step.
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

    /// What the robot itself is at, and since when its trial goes on.
    pub fn own(&self) -> Option<(TaskId, SimTime)> {
        self.own.map(|attempt| (attempt.task, attempt.began))
    }

    /// task_time(k, j) of one of the robot's own tasks, s; the prior of any other.
    pub fn time_s(&self, task: TaskId, robot: RobotId) -> f64 {
        let prior_s = || self.priors[task.index()].unwrap_or(self.step_s);
        let known = self.place(task, robot);
        known.map_or_else(|_| prior_s(), |place| self.trials[place].1.estimate)
    }

    /// What is believed of who has made no trial of an own task, s.
    pub fn prior_s(&self, task: TaskId) -> f64 {
        self.priors[task.index()].unwrap_or(self.step_s)
    }

    /// The robots that have made trials of a task, the robot itself included, and what they need, by rank.
    pub fn tried(&self, task: TaskId) -> impl Iterator<Item = (RobotId, f64)> {
        let from = self.trials.partition_point(|((of, _), _)| *of < task);
        let those = self.trials[from..].iter();
        those
            .take_while(move |((of, _), _)| *of == task)
            .map(|((_, robot), trials)| (*robot, trials.estimate))
    }

    /// How many trials of a task the robot itself has made.
    pub fn own_trials(&self, task: TaskId) -> u32 {
        let known = self.place(task, self.me);
        known.map_or(0, |place| self.trials[place].1.count)
    }

    /// How many teammates are heard executing a task.
    pub fn executing(&self, task: TaskId) -> usize {
        let seen = self.seen.iter();
        seen.filter(|(_, seen)| seen.at.is_some_and(|at| at.task == task))
            .count()
    }

    /// Those of the teammates that were heard within τ, by rank.
    pub fn present(&self, now: SimTime) -> impl Iterator<Item = RobotId> {
        let seen = self.seen.iter();
        seen.filter(move |(_, seen)| now.since(seen.heard) < self.tau)
            .map(|(robot, _)| robot)
    }

    fn place(&self, task: TaskId, robot: RobotId) -> Result<usize, usize> {
        self.trials
            .binary_search_by_key(&(task, robot), |&(key, _)| key)
    }

    /// Progress of so many units: as many trials, of which each took its share of the time.
    fn succeed(&mut self, robot: RobotId, attempt: &mut Attempt, units: u32, now: SimTime) {
        if units == 0 {
            return;
        }
        let time_s = now.since(attempt.began).as_secs_f64() / f64::from(units);
        attempt.began = now;
        // More than μ of the same leave no trace of older ones.
        for _ in 0..units.min(self.window as u32) {
            self.store(robot, attempt.task, time_s);
        }
    }

    /// A trial that led to nothing takes what was believed, or longer. One that has only just begun is none.
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
        // What takes no time is not told from what takes a step.
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

/// Mean plus one standard deviation (n - 1; 0 of one value).
fn mean_and_deviation(values: &[f64]) -> f64 {
    let count = values.len() as f64;
    let mean = values.iter().sum::<f64>() / count;
    if values.len() < 2 {
        return mean;
    }
    let squares: f64 = values.iter().map(|it| (it - mean) * (it - mean)).sum();
    mean + (squares / (count - 1.0)).sqrt()
}
