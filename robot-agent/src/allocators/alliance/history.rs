//! Communication history: *comm_received* (eq. 2.2) in O(robots · tasks) memory for a mission of any length.
//!
//! The equations use only windows that end now and intervals that start at the origin, so the first and the last
//! receive time are enough.

use proto::team::{Broadcast, BroadcastContent, Bulletin, TaskState};
use scenario::ids::{Incarnation, RobotId, TaskId};
use scenario::time::SimTime;
use scenario::{HistoryOrigin, Switches};
use smallvec::{SmallVec, smallvec};

use super::params::USUAL_BEHAVIORS;
use crate::by_rank::place_from;

/// The received messages by task of the robot and by teammate; pairs without a message are absent.
#[derive(Clone, Debug)]
pub(super) struct History {
    tasks: SmallVec<[TaskRecords; USUAL_BEHAVIORS]>,
}

/// The messages received about one task of the robot.
#[derive(Clone, Debug, Default)]
struct TaskRecords {
    /// The records by rank; every step reads all of them.
    records: Vec<(RobotId, Record)>,
    /// The place after the record of the latest message.
    next: usize,
}

/// The messages received from one teammate about one task.
#[derive(Clone, Debug, Default)]
pub(super) struct Record {
    latest: (Incarnation, u64),
    /// The latest progress count of that incarnation.
    progress: u32,
    /// The receive time of the first message since the origin, for impatience and reset.
    first: Option<SimTime>,
    /// The receive time of the last such message.
    last: Option<SimTime>,
    /// True if a release followed that message.
    released: bool,
    /// The receive time of the last message for acquiescence; `None` after a release. A wish always counts here.
    last_for_acquiescence: Option<SimTime>,
}

/// The equations in which a message about a task counts.
enum Weight {
    Full,
    /// The message counts in acquiescence, and elsewhere if the switch is set.
    Wish,
    /// The message counts nowhere and ends the sender's window.
    Release,
}

impl History {
    pub fn new(own_tasks: usize) -> Self {
        Self {
            tasks: smallvec![TaskRecords::default(); own_tasks],
        }
    }

    /// Stores a broadcast received at `now` if it is about a task of the robot. Returns whether it was new.
    pub fn receive(
        &mut self,
        now: SimTime,
        broadcast: &Broadcast,
        switches: &Switches,
        own_task: impl Fn(TaskId) -> Option<usize>,
    ) -> bool {
        let (task, weight, progress) = match &broadcast.body {
            BroadcastContent::Heartbeat(heartbeat) => {
                let weight = match heartbeat.state {
                    TaskState::Executing => Weight::Full,
                    TaskState::Waiting => Weight::Wish,
                    TaskState::Released => Weight::Release,
                    TaskState::Idle => return false,
                };
                let Some(task) = heartbeat.task else {
                    return false;
                };
                (task, weight, heartbeat.progress)
            }
            BroadcastContent::Bulletin(Bulletin {
                about: Some(about), ..
            }) => (about.task, Weight::Full, about.progress),
            BroadcastContent::Bulletin(_) | BroadcastContent::Allocation(_) => return false,
        };
        // Messages about tasks for which the robot has no set do not affect it.
        let Some(index) = own_task(task) else {
            return false;
        };
        let record = self.record(index, broadcast.sender);
        let stamp = (broadcast.incarnation, broadcast.seq);
        let is_news = record.latest < stamp;
        if is_news {
            record.take(stamp, progress, now, switches);
            record.count(weight, now, switches);
        }
        is_news
    }

    /// Returns the records on a task of the robot, by rank.
    pub fn records_of(&self, own_task: usize) -> &[(RobotId, Record)] {
        &self.tasks[own_task].records
    }

    fn record(&mut self, own_task: usize, teammate: RobotId) -> &mut Record {
        let TaskRecords { records, next } = &mut self.tasks[own_task];
        let place = place_from(records, *next, teammate, |&(rank, _)| rank);
        *next = place + 1;
        let known = records
            .get(place)
            .is_some_and(|&(rank, _)| rank == teammate);
        if !known {
            records.insert(place, (teammate, Record::default()));
        }
        &mut records[place].1
    }
}

impl Record {
    /// Computes comm_received(t-span, t) for impatience.
    pub fn within(&self, span: SimTime, now: SimTime) -> bool {
        !self.released && self.last.is_some_and(|last| now.since(last) < span)
    }

    /// Computes comm_received(t-span, t) for acquiescence.
    pub fn within_for_acquiescence(&self, span: SimTime, now: SimTime) -> bool {
        self.last_for_acquiescence
            .is_some_and(|last| now.since(last) < span)
    }

    /// Computes comm_received(0, t-span), with the origin in place of 0.
    pub fn until(&self, span: SimTime, now: SimTime) -> bool {
        self.first.is_some_and(|first| now.since(first) >= span)
    }

    /// Returns the times after `now` at which [`Record::within`] or [`Record::until`] changes without a new message.
    pub fn changes_after(
        &self,
        tau: SimTime,
        phi: SimTime,
        now: SimTime,
    ) -> impl Iterator<Item = SimTime> {
        let ends = self.last.map(|last| last + tau);
        let counts = self.first.map(|first| first + phi);
        ends.into_iter().chain(counts).filter(move |&at| at > now)
    }

    /// Computes comm_received(t-δt, t) and not comm_received(0, t-δt): the history begins in this step.
    pub fn begins(&self, now: SimTime) -> bool {
        self.first == Some(now)
    }

    /// Moves the origin if the message reports progress. The count of a new incarnation starts from 0, which is no
    /// progress.
    fn take(
        &mut self,
        stamp: (Incarnation, u64),
        progress: u32,
        now: SimTime,
        switches: &Switches,
    ) {
        let known = if stamp.0 == self.latest.0 {
            self.progress
        } else {
            0
        };
        if progress > known && switches.history_origin == HistoryOrigin::Progress {
            // The interval [origin, t] contains the messages received earlier in this step.
            self.first = self.last.filter(|&last| last == now);
        }
        self.latest = stamp;
        self.progress = progress;
    }

    fn count(&mut self, weight: Weight, now: SimTime, switches: &Switches) {
        let (counts, for_acquiescence) = match weight {
            Weight::Full => (true, true),
            Weight::Wish => (switches.waiting_counts, true),
            Weight::Release => (false, false),
        };
        if counts {
            self.first.get_or_insert(now);
            self.last = Some(now);
            self.released = false;
        }
        if for_acquiescence {
            self.last_for_acquiescence = Some(now);
        } else {
            self.released = true;
            self.last_for_acquiescence = None;
        }
    }
}
