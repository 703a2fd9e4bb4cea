//! What a robot announces and when: at once on every change of state or progress, then every 1/ρ (ALLIANCE.md §3
//! "Messages").

use alliance_proto::ids::{SetId, TaskId};
use alliance_proto::team::TaskState;
use alliance_proto::telemetry::{SetState, StateChange};
use alliance_proto::time::SimTime;

use super::behavior::{Behavior, Stance};
use super::params::Config;

/// The ALLIANCE part of a heartbeat that is to be broadcast in this step.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Announcement {
    /// What the robot does about the task.
    pub state: TaskState,
    /// Since when.
    pub since: SimTime,
    /// The behavior set; `None` when idle.
    pub set: Option<SetId>,
    /// Its task; `None` when idle.
    pub task: Option<TaskId>,
    /// Effects that the robot has achieved on the task so far; 0 when idle.
    pub progress: u32,
}

/// The schedule of a robot's heartbeats.
#[derive(Clone, Debug)]
pub(super) struct Heartbeats {
    /// Last announcement per own set; of no account while the set hibernates.
    sent: Vec<SimTime>,
    /// While the robot is idle.
    idle: Option<Idle>,
}

#[derive(Clone, Copy, Debug)]
struct Idle {
    since: SimTime,
    sent: SimTime,
}

/// What happened in the step that is being announced.
pub(super) struct Happened<'a> {
    /// Changes of state.
    pub changes: &'a [StateChange],
    /// Tasks on which the robot made progress.
    pub progressed: &'a [TaskId],
    /// Progress count by own task, these included.
    pub progress: &'a [u32],
}

impl Heartbeats {
    /// Nothing announced yet.
    pub fn new(sets: usize) -> Self {
        Self {
            sent: vec![SimTime::ZERO; sets],
            idle: None,
        }
    }

    /// Adds the announcements of this step: released, then waiting, then executing, then idle, so that a robot's last word says
    /// what it does.
    pub fn announce(
        &mut self,
        now: SimTime,
        config: &Config,
        behaviors: &[Behavior],
        happened: &Happened<'_>,
        announcements: &mut Vec<Announcement>,
    ) {
        if config.switches.release_message && !happened.changes.is_empty() {
            announcements.extend(released(now, config, behaviors, happened));
        }

        let any_active = behaviors.iter().any(Behavior::is_active);
        let wishes = !any_active || config.switches.wish_when_suppressed;
        let mut executing = None;
        for (index, behavior) in behaviors.iter().enumerate() {
            let (state, since) = match behavior.stance {
                Stance::Active { since, .. } => (TaskState::Executing, since),
                Stance::Waiting { since } if wishes => (TaskState::Waiting, since),
                _ => continue,
            };
            let params = &config.sets[index];
            let at_once = happened.changes.iter().any(|it| it.set == behavior.set)
                || happened.progressed.contains(&params.task);
            if !at_once && now.since(self.sent[index]) < params.period {
                continue;
            }
            self.sent[index] = now;
            let announcement = about(state, since, behavior.set, params.task, config, happened);
            match state {
                TaskState::Executing => executing = Some(announcement),
                _ => announcements.push(announcement),
            }
        }
        announcements.extend(executing);

        let idle = behaviors.iter().all(|it| it.stance == Stance::Hibernating);
        if config.switches.idle_heartbeat {
            announcements.extend(self.idle(idle, now, config.idle_period));
        }
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
        Some(Announcement {
            state: TaskState::Idle,
            since,
            set: None,
            task: None,
            progress: 0,
        })
    }
}

/// One release for each set that hibernates after executing or waiting, unless another set goes on with its task.
fn released<'a>(
    now: SimTime,
    config: &'a Config,
    behaviors: &'a [Behavior],
    happened: &'a Happened<'_>,
) -> impl Iterator<Item = Announcement> + 'a {
    let goes_on = |task| {
        let mut own = behaviors.iter().zip(&config.sets);
        own.any(|(it, params)| params.task == task && it.stance != Stance::Hibernating)
    };
    let hibernates = |set| {
        let mut changes = happened.changes.iter();
        changes.any(|change| change.set == set && change.to == SetState::Hibernating)
    };
    behaviors
        .iter()
        .zip(&config.sets)
        .filter(move |(it, params)| hibernates(it.set) && !goes_on(params.task))
        .map(move |(it, params)| {
            let state = TaskState::Released;
            about(state, now, it.set, params.task, config, happened)
        })
}

fn about(
    state: TaskState,
    since: SimTime,
    set: SetId,
    task: TaskId,
    config: &Config,
    happened: &Happened<'_>,
) -> Announcement {
    let progress = config
        .own_task(task)
        .map_or(0, |own| happened.progress[own]);
    Announcement {
        state,
        since,
        set: Some(set),
        task: Some(task),
        progress,
    }
}
