//! The heartbeats of a robot. A heartbeat is sent at once on every change of state or progress, then every 1/ρ
//! (docs/ALLIANCE.md §3 "Messages").

use proto::team::TaskState;
use proto::telemetry::{BehaviorState, StateChange};
use scenario::ids::TaskId;
use scenario::time::SimTime;
use smallvec::{SmallVec, smallvec};

use crate::allocator::Announcement;

use super::behavior::{Behavior, NonHibernating, SetState};
use super::params::{Config, SetConfig, USUAL_BEHAVIORS};

#[derive(Clone, Debug)]
pub(super) struct Heartbeats {
    /// The time of the last announcement per set; unused while the set hibernates.
    sent: SmallVec<[SimTime; USUAL_BEHAVIORS]>,
    idle: Option<Idle>,
}

#[derive(Clone, Copy, Debug)]
struct Idle {
    since: SimTime,
    sent: SimTime,
}

pub(super) struct StepEvents<'a> {
    pub changes: &'a [StateChange],
    pub progressed: &'a [TaskId],
    /// The progress count by task of the robot, this step included.
    pub progress: &'a [u32],
}

impl Heartbeats {
    pub fn new(sets: usize) -> Self {
        Self {
            sent: smallvec![SimTime::ZERO; sets],
            idle: None,
        }
    }

    /// Adds the announcements of this step in the order released, waiting, executing, idle, so that the last one
    /// describes the current activity.
    pub fn announce(
        &mut self,
        now: SimTime,
        config: &Config,
        behaviors: &[Behavior],
        awake: NonHibernating,
        happened: &StepEvents<'_>,
        announcements: &mut Vec<Announcement>,
    ) {
        if config.switches.release_message && !happened.changes.is_empty() {
            announcements.extend(released(now, config, behaviors, happened));
        }

        let wishes = awake.active.is_none() || config.switches.wish_when_suppressed;
        if wishes && awake.waiting > 0 {
            for (index, behavior) in behaviors.iter().enumerate() {
                if let SetState::Waiting { since } = behavior.stance {
                    let set = &config.sets[index];
                    let announcement =
                        self.announce_if_due(now, index, set, TaskState::Waiting, since, happened);
                    announcements.extend(announcement);
                }
            }
        }
        if let Some(index) = awake.active
            && let SetState::Active { since, .. } = behaviors[index].stance
        {
            let set = &config.sets[index];
            let announcement =
                self.announce_if_due(now, index, set, TaskState::Executing, since, happened);
            announcements.extend(announcement);
        }
        if config.switches.idle_heartbeat {
            announcements.extend(self.idle(awake.is_none(), now, config.idle_period));
        }
    }

    /// Returns the announcement of a set if it is due or the set changed.
    fn announce_if_due(
        &mut self,
        now: SimTime,
        index: usize,
        set: &SetConfig,
        state: TaskState,
        since: SimTime,
        happened: &StepEvents<'_>,
    ) -> Option<Announcement> {
        let at_once = || {
            happened.changes.iter().any(|change| change.set == set.id)
                || happened.progressed.contains(&set.task)
        };
        if now.since(self.sent[index]) < set.params.period && !at_once() {
            return None;
        }
        self.sent[index] = now;
        Some(announcement(state, since, set, happened))
    }

    /// Returns the time of the next periodic announcement of a set.
    pub fn next(&self, index: usize, set: &SetConfig) -> SimTime {
        self.sent[index] + set.params.period
    }

    fn idle(&mut self, is_idle: bool, now: SimTime, period: SimTime) -> Option<Announcement> {
        let (since, due) = match self.idle {
            _ if !is_idle => {
                self.idle = None;
                return None;
            }
            None => (now, true),
            Some(idle) => (idle.since, now.since(idle.sent) >= period),
        };
        if !due {
            return None;
        }
        self.idle = Some(Idle { since, sent: now });
        Some(Announcement::idle(since))
    }
}

/// Returns one release for each set that hibernates after executing or waiting, unless another set continues its task.
fn released<'a>(
    now: SimTime,
    config: &'a Config,
    behaviors: &'a [Behavior],
    happened: &'a StepEvents<'_>,
) -> impl Iterator<Item = Announcement> + 'a {
    let continues = |task| {
        let mut pairs = behaviors.iter().zip(&config.sets);
        pairs.any(|(behavior, set)| set.task == task && behavior.stance != SetState::Hibernating)
    };
    let hibernates = |set| {
        let mut changes = happened.changes.iter();
        changes.any(|change| change.set == set && change.to == BehaviorState::Hibernating)
    };
    let sets = config.sets.iter();
    sets.filter(move |set| hibernates(set.id) && !continues(set.task))
        .map(move |set| announcement(TaskState::Released, now, set, happened))
}

fn announcement(
    state: TaskState,
    since: SimTime,
    set: &SetConfig,
    happened: &StepEvents<'_>,
) -> Announcement {
    Announcement {
        state,
        since,
        behavior: Some(set.id),
        task: Some(set.task),
        progress: happened.progress[set.task_index],
    }
}
