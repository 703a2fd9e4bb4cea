//! The agents' reports of a tick, hashed section by section on arrival.
//!
//! Hashing on arrival is faster than at the end of the tick: the report is still in the cache, and the world waits for other
//! robots anyway.

use crate::Section;
use prefetch::{Layer, prefetch};
use proto::readings::{Actuation, Readings};
use proto::telemetry::{BehaviorState, Delivery, Motivation, Reception};
use proto::tick::Report;
use scenario::ids::{BehaviorId, RobotId};

use super::section_hash::SectionHash;

#[derive(Clone, Default)]
pub struct Answers {
    by_rank: Vec<Answer>,
    /// `None` if reports are not hashed.
    hash: Option<SectionHash>,
}

#[derive(Clone, Debug, Default)]
pub struct Answer {
    pub counts: bool,
    /// The report of the current tick, or the latest earlier one if none counts.
    pub report: Report,
    pub deliveries: Deliveries,
    hashes: Option<Hashes>,
    /// `true` if the readings are the same as those that were hashed last.
    readings_hold: bool,
}

/// The number of messages by delivery. Counted when the report arrives, because the list is no longer in the cache when the tick
/// ends.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Deliveries {
    /// Messages delivered in the step after they were sent.
    pub received: u32,
    pub delayed: u32,
    /// Messages delivered with bit errors.
    pub damaged: u32,
    /// Messages that were not delivered, for any reason.
    pub lost: u32,
    /// Second copies of delivered messages.
    pub duplicate: u32,
    pub pending: u32,
}

impl Deliveries {
    fn of(receptions: &[Reception]) -> Self {
        let mut deliveries = Self::default();
        for reception in receptions {
            *match reception.delivery {
                Delivery::Received => &mut deliveries.received,
                Delivery::Delayed => &mut deliveries.delayed,
                Delivery::Damaged => &mut deliveries.damaged,
                Delivery::Lost
                | Delivery::Dropped
                | Delivery::Cut
                | Delivery::Faded
                | Delivery::Blocked
                | Delivery::Corrupted => &mut deliveries.lost,
                Delivery::Duplicate => &mut deliveries.duplicate,
                Delivery::Pending => &mut deliveries.pending,
            } += 1;
        }
        deliveries
    }

    /// Returns `true` if all messages were delivered in time.
    #[must_use]
    pub fn all_in_time(&self) -> bool {
        *self
            == Self {
                received: self.received,
                ..Self::default()
            }
    }
}

#[derive(Clone, Copy, Debug)]
struct Hashes {
    readings: u64,
    /// The hash of the messages; `None` in ticks without messages.
    messages: Option<u64>,
    motivations: u64,
    commands: u64,
}

impl Answers {
    #[must_use]
    pub fn new(robots: usize) -> Self {
        Self {
            by_rank: vec![Answer::default(); robots],
            hash: Some(SectionHash::default()),
        }
    }

    /// Stores the reports from now on without hashes, which a run without a hash does not need.
    pub fn omit_hashes(&mut self) {
        self.hash = None;
    }

    #[must_use]
    pub fn are_hashed(&self) -> bool {
        self.hash.is_some()
    }

    /// Stores and hashes a report together with the readings that the robot received before it.
    pub fn store(&mut self, readings: &Readings, report: &Report) {
        let answer = &mut self.by_rank[report.robot.index()];
        match &mut self.hash {
            Some(hash) => answer.update(hash, readings, report),
            None => {
                answer.hashes = None;
                let same_motivations = have_same_motivations(&answer.report, report);
                answer.store(report, same_motivations);
            }
        }
    }

    pub fn count(&mut self, counted: &[bool]) {
        for (answer, counts) in self.by_rank.iter_mut().zip(counted) {
            answer.counts = *counts;
        }
    }

    #[must_use]
    pub fn all(&self) -> &[Answer] {
        &self.by_rank
    }

    /// Returns the answers by rank, for [`Answer::update`].
    #[must_use]
    pub fn all_mut(&mut self) -> &mut [Answer] {
        &mut self.by_rank
    }

    /// Requests the memory of a layer below the answers themselves, see [`prefetch`](mod@prefetch).
    #[inline]
    pub fn prefetch(&self, layer: Layer) {
        match layer {
            Layer::Lists => {
                prefetch(&*self.by_rank);
                if let Some(hash) = &self.hash {
                    hash.prefetch();
                }
            }
            Layer::Elements => {
                for Answer { report, .. } in &self.by_rank {
                    prefetch(&*report.motivations);
                    prefetch(&*report.allocation);
                    prefetch(&*report.receptions);
                }
            }
            Layer::Fields | Layer::Contents => {}
        }
    }

    /// Returns the latest report of a robot, or an empty one before its first.
    #[must_use]
    pub fn report(&self, robot: RobotId) -> &Report {
        &self.by_rank[robot.index()].report
    }
}

impl Answer {
    /// Marks the readings of the robot as changed since its last report.
    pub fn mark_readings_changed(&mut self) {
        self.readings_hold = false;
    }

    /// Stores and hashes a report of the robot together with the readings that the robot received before it.
    pub fn update(&mut self, hash: &mut SectionHash, readings: &Readings, report: &Report) {
        let has_messages = report.broadcasts > 0 || !report.receptions.is_empty();
        let before = self.hashes;
        // A working robot keeps the same motivations for many ticks.
        let same_motivations = have_same_motivations(&self.report, report);
        self.hashes = Some(Hashes {
            readings: match before {
                // An idle robot keeps the same readings for many ticks.
                Some(before) if self.readings_hold => before.readings,
                _ => hash.of(readings),
            },
            messages: has_messages.then(|| hash.of(&(report.broadcasts, &report.receptions))),
            motivations: match before {
                Some(before) if same_motivations => before.motivations,
                _ => hash.of(&(
                    report.active,
                    &report.motivations,
                    &report.allocation,
                    &report.changes,
                    &report.notes,
                )),
            },
            commands: match before {
                // An idle robot keeps the same commands.
                Some(before) if have_same_commands(&self.report, report) => before.commands,
                _ => hash.of(&report.actuation),
            },
        });
        self.readings_hold = true;
        self.store(report, same_motivations);
    }

    /// Copies a report into the existing buffers, so that the caller keeps its own buffers, which are in the cache.
    fn store(&mut self, report: &Report, same_motivations: bool) {
        self.deliveries = Deliveries::of(&report.receptions);
        let stored = &mut self.report;
        stored.robot = report.robot;
        stored.incarnation = report.incarnation;
        stored.tick = report.tick;
        stored.actuation = report.actuation;
        stored.broadcasts = report.broadcasts;
        stored.broadcast_bytes = report.broadcast_bytes;
        if !same_motivations {
            stored.active = report.active;
            stored.motivations.clone_from(&report.motivations);
            stored.allocation.clone_from(&report.allocation);
            stored.changes.clone_from(&report.changes);
            stored.notes.clone_from(&report.notes);
        }
        stored.receptions.clone_from(&report.receptions);
    }

    #[inline(always)]
    pub(super) fn for_each_section(&self, mut take: impl FnMut(Section, u64)) {
        if let Some(hashes) = &self.hashes {
            take(Section::Readings, hashes.readings);
            if let Some(messages) = hashes.messages {
                take(Section::Messages, messages);
            }
            take(Section::Motivations, hashes.motivations);
            take(Section::Commands, hashes.commands);
        }
    }
}

/// Returns `true` if the command sections are equal bit by bit.
fn have_same_commands(a: &Report, b: &Report) -> bool {
    let bits =
        |actuation: &Actuation| [actuation.speed_m_s, actuation.turn_rad_s].map(f32::to_bits);
    let (a, b) = (&a.actuation, &b.actuation);
    bits(a) == bits(b) && a.action == b.action
}

/// Returns `true` if the motivation sections are equal bit by bit.
fn have_same_motivations(a: &Report, b: &Report) -> bool {
    let is_quiet = |report: &Report| report.changes.is_empty() && report.notes.is_empty();
    is_quiet(a)
        && is_quiet(b)
        && a.active == b.active
        && a.allocation.is_empty()
        && b.allocation.is_empty()
        && a.motivations.len() == b.motivations.len()
        && a.motivations
            .iter()
            .zip(&b.motivations)
            .all(|(a, b)| motivation_bits(a) == motivation_bits(b))
}

/// The bits of all values of a motivation, for an exact comparison.
pub(super) type MotivationBits = (BehaviorId, [u64; 2], [bool; 4], BehaviorState);

#[inline(always)]
pub(super) fn motivation_bits(motivation_row: &Motivation) -> MotivationBits {
    let Motivation {
        set,
        motivation,
        impatience,
        sensory_feedback,
        activity_suppression,
        impatience_reset,
        acquiescence,
        state,
    } = *motivation_row;
    (
        set,
        [motivation, impatience].map(f64::to_bits),
        [
            sensory_feedback,
            activity_suppression,
            impatience_reset,
            acquiescence,
        ],
        state,
    )
}
