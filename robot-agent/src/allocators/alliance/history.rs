//! Communication history: *comm_received* (eq. 2.2) in O(robots · tasks) memory for a mission of any length.
//!
//! The equations ask only for windows that end now and for intervals that start at the origin of the history, so the last
//! and the first receive time are all that is needed.

use std::ops::Range;

use alliance_proto::ids::{Incarnation, RobotId, TaskId};
use alliance_proto::scenario::{HistoryOrigin, Switches};
use alliance_proto::team::{Broadcast, Bulletin, Content, TaskState};
use alliance_proto::time::SimTime;
use smallvec::{SmallVec, smallvec};

use super::params::USUAL_BEHAVIORS;

/// What was heard, by own task and teammate; only of pairs that spoke.
#[derive(Clone, Debug)]
pub(super) struct History {
    /// By own task, and then by rank: all are looked at in every step.
    records: Vec<(RobotId, Record)>,
    /// Where those of each own task end.
    ends: SmallVec<[u16; USUAL_BEHAVIORS]>,
}

/// What was heard from one teammate about one task.
#[derive(Clone, Debug, Default)]
pub(super) struct Record {
    /// Incarnation and sequence number of the latest message.
    latest: (Incarnation, u64),
    /// Latest progress count of that incarnation.
    progress: u32,
    /// First message since the origin that counts in impatience and reset.
    first: Option<SimTime>,
    /// Last such message.
    last: Option<SimTime>,
    /// Whether the task was released after that one.
    released: bool,
    /// Last message that counts in acquiescence, where a wish always does, unless the task was released after it.
    last_for_acquiescence: Option<SimTime>,
}

/// How a message about a task counts.
enum Weight {
    /// Everywhere.
    Full,
    /// In acquiescence, and elsewhere by the switch.
    Wish,
    /// Nowhere, and it ends the sender's window.
    Release,
}

impl History {
    /// Nothing heard about any of so many own tasks.
    pub fn new(own_tasks: usize) -> Self {
        Self {
            records: Vec::new(),
            ends: smallvec![0; own_tasks],
        }
    }

    /// Takes in a broadcast that is heard at `now`, unless it is about another's task; says whether it was news.
    pub fn hear(
        &mut self,
        now: SimTime,
        broadcast: &Broadcast,
        switches: &Switches,
        own_task: impl Fn(TaskId) -> Option<usize>,
    ) -> bool {
        let (task, weight, progress) = match &broadcast.body {
            Content::Heartbeat(heartbeat) => {
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
            Content::Bulletin(Bulletin {
                about: Some(about), ..
            }) => (about.task, Weight::Full, about.progress),
            Content::Bulletin(_) | Content::Allocation(_) => return false,
        };
        // What others do about tasks that the robot has no set for changes nothing for it.
        let Some(own) = own_task(task) else {
            return false;
        };
        let record = self.record(own, broadcast.sender);
        let stamp = (broadcast.incarnation, broadcast.seq);
        let is_news = record.latest < stamp;
        if is_news {
            record.take(stamp, progress, now, switches);
            record.count(weight, now, switches);
        }
        is_news
    }

    /// The records on an own task, by rank.
    pub fn about(&self, own_task: usize) -> &[(RobotId, Record)] {
        &self.records[self.place(own_task)]
    }

    fn place(&self, own_task: usize) -> Range<usize> {
        let begin = match own_task.checked_sub(1) {
            Some(before) => self.ends[before],
            None => 0,
        };
        usize::from(begin)..usize::from(self.ends[own_task])
    }

    /// The record of a teammate, new where there is none yet.
    fn record(&mut self, own_task: usize, teammate: RobotId) -> &mut Record {
        let place = self.place(own_task);
        let known = self.records[place.clone()].binary_search_by_key(&teammate, |&(rank, _)| rank);
        let index = match known {
            Ok(index) => place.start + index,
            Err(index) => {
                let index = place.start + index;
                self.records.insert(index, (teammate, Record::default()));
                for end in &mut self.ends[own_task..] {
                    *end += 1;
                }
                index
            }
        };
        &mut self.records[index].1
    }
}

impl Record {
    /// comm_received(t-span, t) for impatience.
    pub fn within(&self, span: SimTime, now: SimTime) -> bool {
        !self.released && self.last.is_some_and(|last| now.since(last) < span)
    }

    /// comm_received(t-span, t) for acquiescence.
    pub fn wanted_within(&self, span: SimTime, now: SimTime) -> bool {
        self.last_for_acquiescence
            .is_some_and(|last| now.since(last) < span)
    }

    /// comm_received(0, t-span), with 0 standing for the origin.
    pub fn until(&self, span: SimTime, now: SimTime) -> bool {
        self.first.is_some_and(|first| now.since(first) >= span)
    }

    /// When, after `now`, what [`Record::within`] and [`Record::until`] say changes, if nothing more is heard.
    pub fn turns(&self, tau: SimTime, phi: SimTime, now: SimTime) -> impl Iterator<Item = SimTime> {
        let ends = self.last.map(|last| last + tau);
        let counts = self.first.map(|first| first + phi);
        ends.into_iter().chain(counts).filter(move |&at| at > now)
    }

    /// comm_received(t-δt, t) and not comm_received(0, t-δt): the history begins in this step.
    pub fn begins(&self, now: SimTime) -> bool {
        self.first == Some(now)
    }

    /// Moves the origin if the message reports progress. The count of a new incarnation starts from 0 again, which is no
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
            // The interval is [origin, t]: what was heard earlier in this step belongs to it.
            self.first = self.last.filter(|&last| last == now);
        }
        self.latest = stamp;
        self.progress = progress;
    }

    fn count(&mut self, weight: Weight, now: SimTime, switches: &Switches) {
        let (counts, wanted) = match weight {
            Weight::Full => (true, true),
            Weight::Wish => (switches.waiting_counts, true),
            Weight::Release => (false, false),
        };
        if counts {
            self.first.get_or_insert(now);
            self.last = Some(now);
            self.released = false;
        }
        if wanted {
            self.last_for_acquiescence = Some(now);
        } else {
            self.released = true;
            self.last_for_acquiescence = None;
        }
    }
}
