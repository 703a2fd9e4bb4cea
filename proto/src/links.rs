//! What becomes of a manifest's broadcasts on their way to this robot: the state of each link, applied (DESIGN §4, §6).
//!
//! The state that the link has in the tick whose manifest lists a message decides the message's delivery; what befalls the link
//! later does not. In this order:
//!
//! 1. **cut** or **dropped**: the message is gone.
//! 2. **held**: it is kept until the world no longer says that its sender is held, and audible in that tick; of ticks in which
//!    the robot took no part it knows nothing, so one that was let go meanwhile is audible when the robot is back.
//! 3. **overtaken**: it is kept until a later message of its sender is audible, and audible one step after that, but no
//!    earlier than its delay allows. The one that overtakes is not overtaken itself, so that even with probability 1 messages
//!    get through, each pair the wrong way round.
//! 4. **delayed**: by delay and jitter, rounded up to whole steps.
//!
//! A message that was due while the robot took no part is cut: a robot is deaf then. A **duplicate** comes one step after
//! the message itself becomes audible, and goes unheard.
//!
//! All of this is part of what a step changes, and goes back with it when the step does not count.

mod draws;
#[cfg(test)]
mod tests;

use std::sync::Arc;

use crate::ids::{RobotId, Tick};
use crate::link::LinkState;
use crate::scenario::Setup;
use crate::team::{Broadcast, BroadcastKind, Bulletin, Content};
use crate::telemetry::{Delivery, Reception, Said};
use crate::tick::TickMessage;
use crate::time::SimTime;

use draws::Draws;

/// Most messages that are kept. More of them, let go at once, would make a report that is too large for the bus; what comes
/// beyond is dropped, as by any full queue.
const CAPACITY: usize = 4096;

/// What one step's listening gave.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Heard {
    /// Audible broadcasts, by (sender rank, incarnation, sequence number).
    pub inbox: Vec<Arc<Broadcast>>,
    /// The delivery of each broadcast that was listed, by (sender, tick, index); then of those kept from earlier ticks.
    pub receptions: Vec<Reception>,
}

impl Heard {
    /// Nothing is heard.
    #[inline]
    pub fn clear(&mut self) {
        self.inbox.clear();
        self.receptions.clear();
    }
}

/// All links to one robot, in one incarnation of it.
#[derive(Clone, Debug)]
pub struct Links {
    seed: u64,
    robot: RobotId,
    step: SimTime,
    /// In the order in which they came.
    kept: Vec<Kept>,
    /// Second copies, each due in the step after its message was audible.
    copies: Vec<Reception>,
}

/// A message on its way.
#[derive(Clone, Debug)]
struct Kept {
    /// Shared with whoever else hears it in the same process.
    broadcast: Arc<Broadcast>,
    until: Until,
    /// Whether a second copy follows.
    twice: bool,
}

/// When a kept message becomes audible.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Until {
    /// When its sender is held no more.
    LetGo,
    /// One step after a later message of its sender, but not before this.
    Overtaken(SimTime),
    /// Then.
    Due(SimTime),
}

/// What a link does to a message.
enum Passage {
    Audible,
    Gone(Delivery),
    Kept(Until),
}

impl Links {
    /// A new incarnation: nothing is on its way.
    #[must_use]
    pub fn new(robot: RobotId, setup: &Setup) -> Self {
        Self {
            seed: setup.seed,
            robot,
            step: SimTime(setup.scenario.step_ms),
            kept: Vec::new(),
            copies: Vec::new(),
        }
    }

    /// Writes to `heard` what the robot hears in this tick. `arrived` has a place for each broadcast of the manifest, in its
    /// order, and is emptied; `None` is one that has not arrived.
    #[inline]
    pub fn hear(
        &mut self,
        tick: &TickMessage,
        arrived: &mut Vec<Option<Arc<Broadcast>>>,
        heard: &mut Heard,
    ) {
        heard.clear();
        if tick.manifest.is_empty() && self.kept.is_empty() && self.copies.is_empty() {
            // As in most ticks.
            arrived.clear();
        } else {
            self.hear_some(tick, arrived, heard);
        }
    }

    /// There is something to hear, perhaps.
    #[inline]
    fn hear_some(
        &mut self,
        tick: &TickMessage,
        arrived: &mut Vec<Option<Arc<Broadcast>>>,
        heard: &mut Heard,
    ) {
        if self.kept.is_empty() && self.copies.is_empty() {
            self.take_in(tick, arrived, heard);
        } else {
            // Before what ripens now leaves its own copies. Of one that came while the robot took no part nothing is left to say.
            let copies = std::mem::take(&mut self.copies);
            let copies = copies.into_iter().filter(|copy| copy.at == tick.now);
            let mut late = self.ripen(tick);
            late.receptions.extend(copies);
            self.take_in(tick, arrived, heard);
            heard.inbox.append(&mut late.inbox);
            heard.receptions.append(&mut late.receptions);
        }
        heard.inbox.sort_unstable_by_key(|broadcast| {
            let (sender, incarnation, seq) = order(broadcast);
            (sender, incarnation, seq, broadcast.index)
        });
        self.overtake(&heard.inbox, tick.now);
    }

    /// The kept messages whose wait is over.
    fn ripen(&mut self, tick: &TickMessage) -> Heard {
        let mut heard = Heard::default();
        for kept in std::mem::take(&mut self.kept) {
            let due = match kept.until {
                Until::LetGo if !tick.held.contains(&kept.broadcast.sender) => tick.now,
                Until::Due(due) if due <= tick.now => due,
                _ => {
                    self.kept.push(kept);
                    continue;
                }
            };
            if due < tick.now {
                let missed = self.reception(&kept.broadcast, Delivery::Cut, due);
                heard.receptions.push(missed);
                continue;
            }
            let delayed = self.reception(&kept.broadcast, Delivery::Delayed, due);
            heard.receptions.push(delayed);
            if kept.twice {
                self.copy(&kept.broadcast, due);
            }
            heard.inbox.push(kept.broadcast);
        }
        heard
    }

    /// The manifest's messages.
    #[inline]
    fn take_in(
        &mut self,
        tick: &TickMessage,
        arrived: &mut Vec<Option<Arc<Broadcast>>>,
        heard: &mut Heard,
    ) {
        let now = tick.now;
        let mut arrived = arrived.drain(..);
        for entry in &tick.manifest {
            let link = entry.link.as_deref().filter(|link| !link.is_clear());
            let mut indices = [0; BroadcastKind::ALL.len()];
            for _ in 0..entry.count {
                let Some(broadcast) = arrived.next().flatten() else {
                    heard.receptions.push(Reception {
                        at: now,
                        sender: entry.sender,
                        incarnation: entry.incarnation,
                        sent: self.sent(entry.tick),
                        delivery: Delivery::Lost,
                        said: None,
                    });
                    continue;
                };
                let index = &mut indices[broadcast.body.kind() as usize];
                let (passage, twice) = match link {
                    Some(link) => self.pass(*link, &broadcast, *index, now),
                    None => (Passage::Audible, false),
                };
                *index += 1;
                let (delivery, at) = match passage {
                    Passage::Audible => (Delivery::Heard, now),
                    Passage::Gone(delivery) => (delivery, now),
                    Passage::Kept(Until::Due(due)) => (Delivery::Pending, due),
                    Passage::Kept(_) => (Delivery::Pending, now),
                };
                heard
                    .receptions
                    .push(self.reception(&broadcast, delivery, at));
                match passage {
                    Passage::Audible => {
                        if twice {
                            self.copy(&broadcast, now);
                        }
                        heard.inbox.push(broadcast);
                    }
                    Passage::Gone(_) => {}
                    Passage::Kept(until) => self.kept.push(Kept {
                        broadcast,
                        until,
                        twice,
                    }),
                }
            }
        }
    }

    /// What a link in that state does to a message, the `index`-th of its kind in its tick, and whether it doubles it.
    fn pass(
        &self,
        link: LinkState,
        broadcast: &Broadcast,
        index: u16,
        now: SimTime,
    ) -> (Passage, bool) {
        let draws = Draws::of(self.seed, self.robot, broadcast, index);
        let twice = link.duplicate.decides(draws.duplicate);
        let due = now + self.whole_steps(link.delay + draws.share_of(link.jitter));
        let passage = if link.cut {
            Passage::Gone(Delivery::Cut)
        } else if link.drop.decides(draws.drop) {
            Passage::Gone(Delivery::Dropped)
        } else if link.hold {
            Passage::Kept(Until::LetGo)
        } else if link.reorder.decides(draws.reorder) && !self.awaits_overtaking(broadcast.sender) {
            Passage::Kept(Until::Overtaken(due))
        } else if due > now {
            Passage::Kept(Until::Due(due))
        } else {
            Passage::Audible
        };
        match passage {
            Passage::Kept(_) if self.kept.len() >= CAPACITY => {
                (Passage::Gone(Delivery::Dropped), false)
            }
            _ => (passage, twice),
        }
    }

    fn awaits_overtaking(&self, sender: RobotId) -> bool {
        self.kept.iter().any(|kept| {
            kept.broadcast.sender == sender && matches!(kept.until, Until::Overtaken(_))
        })
    }

    /// The messages that one of the audible ones overtakes have one step left to wait.
    fn overtake(&mut self, audible: &[Arc<Broadcast>], now: SimTime) {
        for kept in &mut self.kept {
            let Until::Overtaken(earliest) = kept.until else {
                continue;
            };
            let overtakes = |other: &Broadcast| {
                other.sender == kept.broadcast.sender && order(other) > order(&kept.broadcast)
            };
            if audible.iter().any(|other| overtakes(other)) {
                kept.until = Until::Due(earliest.max(now + self.step));
            }
        }
    }

    /// A second copy of a message that is audible at `at`.
    fn copy(&mut self, broadcast: &Broadcast, at: SimTime) {
        let copy = self.reception(broadcast, Delivery::Duplicate, at + self.step);
        self.copies.push(copy);
    }

    fn reception(&self, broadcast: &Broadcast, delivery: Delivery, at: SimTime) -> Reception {
        Reception {
            at,
            sender: broadcast.sender,
            incarnation: broadcast.incarnation,
            sent: self.sent(broadcast.tick),
            delivery,
            said: Some(said(broadcast)),
        }
    }

    fn sent(&self, tick: Tick) -> SimTime {
        SimTime(tick.saturating_mul(self.step.0))
    }

    /// The shortest span of whole steps that is no shorter.
    fn whole_steps(&self, span: SimTime) -> SimTime {
        SimTime(span.0.div_ceil(self.step.0).saturating_mul(self.step.0))
    }
}

/// What comes first of two messages.
fn order(broadcast: &Broadcast) -> (RobotId, u32, u64) {
    (broadcast.sender, broadcast.incarnation, broadcast.seq)
}

/// The part of a broadcast that goes into the log.
fn said(broadcast: &Broadcast) -> Said {
    let (state, since, set, task, progress) = match &broadcast.body {
        Content::Heartbeat(heartbeat) => (
            Some(heartbeat.state),
            Some(heartbeat.since),
            heartbeat.set,
            heartbeat.task,
            Some(heartbeat.progress),
        ),
        Content::Bulletin(Bulletin { about, .. }) => {
            let (set, task) = (about.map(|it| it.set), about.map(|it| it.task));
            (None, None, set, task, about.map(|it| it.progress))
        }
        Content::Allocation(_) => (None, None, None, None, None),
    };
    Said {
        seq: broadcast.seq,
        kind: broadcast.body.kind(),
        state,
        since,
        set,
        task,
        progress,
    }
}
