//! What the agents did, hashed section by section as it comes.
//!
//! Not at the end of the tick: when a report comes it is in the cache, and a world that waits for other robots has the time.

use alliance_proto::ids::{BehaviorId, RobotId};
use alliance_proto::log::Section;
use alliance_proto::readings::{Actuation, Readings};
use alliance_proto::telemetry::{BehaviorState, Delivery, Motivation, Reception};
use alliance_proto::tick::Report;

use super::hash::SectionHash;

/// The latest answer of each robot.
#[derive(Clone, Default)]
pub struct Answers {
    by_rank: Vec<Answer>,
    hash: SectionHash,
}

/// A robot's part in a tick.
#[derive(Clone, Debug, Default)]
pub struct Answer {
    /// Whether it counts in the tick at hand.
    pub counts: bool,
    /// What the agent did; where that does not count, what it did last.
    pub report: Report,
    /// What became of the messages that it lists.
    pub deliveries: Deliveries,
    hashes: Option<Hashes>,
    /// Whether what the robot was told last is what its hash is of.
    readings_hold: bool,
}

/// Number of messages by delivery. Counted when the report arrives: at the end of the tick the list is a cache miss.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Deliveries {
    /// In the step after they were sent.
    pub heard: u32,
    /// Later.
    pub delayed: u32,
    /// Not at all, whatever the reason.
    pub lost: u32,
    /// Second copies.
    pub duplicate: u32,
    /// Still on their way.
    pub pending: u32,
}

impl Deliveries {
    fn of(receptions: &[Reception]) -> Self {
        let mut deliveries = Self::default();
        for reception in receptions {
            *match reception.delivery {
                Delivery::Heard => &mut deliveries.heard,
                Delivery::Delayed => &mut deliveries.delayed,
                Delivery::Lost | Delivery::Dropped | Delivery::Cut => &mut deliveries.lost,
                Delivery::Duplicate => &mut deliveries.duplicate,
                Delivery::Pending => &mut deliveries.pending,
            } += 1;
        }
        deliveries
    }

    /// Whether nothing befell any message.
    #[must_use]
    pub fn are_usual(&self) -> bool {
        *self
            == Self {
                heard: self.heard,
                ..Self::default()
            }
    }
}

/// Hashes of a robot's sections.
#[derive(Clone, Copy, Debug)]
struct Hashes {
    readings: u64,
    /// In ticks with messages.
    messages: Option<u64>,
    motivations: u64,
    commands: u64,
}

impl Answers {
    /// Nobody has answered yet.
    #[must_use]
    pub fn new(robots: usize) -> Self {
        Self {
            by_rank: vec![Answer::default(); robots],
            hash: SectionHash::default(),
        }
    }

    /// A robot is told something else than before.
    ///
    /// # Panics
    /// If there is no such robot.
    pub fn readings_change(&mut self, robot: RobotId) {
        self.by_rank[robot.index()].readings_hold = false;
    }

    /// A robot that was told these readings has answered with a report.
    ///
    /// # Panics
    /// If the report is of a robot that there is not.
    pub fn take(&mut self, readings: &Readings, report: &Report) {
        let answer = &mut self.by_rank[report.robot.index()];
        let has_messages = report.broadcasts > 0 || !report.receptions.is_empty();
        let before = answer.hashes;
        // A robot at work has the same motivations for many ticks.
        let same_motivations = have_same_motivations(&answer.report, report);
        answer.hashes = Some(Hashes {
            readings: match before {
                // A robot that waits where nobody comes by senses the same for many ticks.
                Some(before) if answer.readings_hold => before.readings,
                _ => self.hash.of(readings),
            },
            messages: has_messages.then(|| self.hash.of(&(report.broadcasts, &report.receptions))),
            motivations: match before {
                Some(before) if same_motivations => before.motivations,
                _ => self.hash.of(&(
                    report.active,
                    &report.motivations,
                    &report.allocation,
                    &report.changes,
                    &report.notes,
                )),
            },
            commands: match before {
                // As of a robot that waits.
                Some(before) if have_same_commands(&answer.report, report) => before.commands,
                _ => self.hash.of(&report.actuation),
            },
        });
        answer.readings_hold = true;
        answer.deliveries = Deliveries::of(&report.receptions);
        answer.keep(report, same_motivations);
    }

    /// Says whose answers count in the tick at hand, by rank.
    pub fn count(&mut self, counted: &[bool]) {
        for (answer, counts) in self.by_rank.iter_mut().zip(counted) {
            answer.counts = *counts;
        }
    }

    /// All of them, by rank.
    #[must_use]
    pub fn all(&self) -> &[Answer] {
        &self.by_rank
    }

    /// The latest report of a robot; an empty one before its first.
    ///
    /// # Panics
    /// If there is no such robot.
    #[must_use]
    pub fn report(&self, robot: RobotId) -> &Report {
        &self.by_rank[robot.index()].report
    }
}

impl Answer {
    /// Copies a report to where the one before was: the buffers that are in the cache stay with whoever steps the robots.
    fn keep(&mut self, report: &Report, same_motivations: bool) {
        let kept = &mut self.report;
        kept.robot = report.robot;
        kept.incarnation = report.incarnation;
        kept.tick = report.tick;
        kept.actuation = report.actuation;
        kept.broadcasts = report.broadcasts;
        kept.broadcast_bytes = report.broadcast_bytes;
        if !same_motivations {
            kept.active = report.active;
            kept.motivations.clone_from(&report.motivations);
            kept.allocation.clone_from(&report.allocation);
            kept.changes.clone_from(&report.changes);
            kept.notes.clone_from(&report.notes);
        }
        kept.receptions.clone_from(&report.receptions);
    }

    /// Calls this with each section and its hash.
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

/// Whether the sections of commands have the same bits.
fn have_same_commands(a: &Report, b: &Report) -> bool {
    let bits = |it: &Actuation| [it.speed_m_s, it.turn_rad_s].map(f32::to_bits);
    let (a, b) = (&a.actuation, &b.actuation);
    bits(a) == bits(b) && a.deed == b.deed
}

/// Whether the sections of motivations have the same bits.
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

/// All of a motivation, in comparable form.
pub(super) type MotivationBits = (BehaviorId, [u64; 2], [bool; 4], BehaviorState);

#[inline(always)]
pub(super) fn motivation_bits(it: &Motivation) -> MotivationBits {
    let Motivation {
        set,
        motivation,
        impatience,
        sensory_feedback,
        activity_suppression,
        impatience_reset,
        acquiescence,
        state,
    } = *it;
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
