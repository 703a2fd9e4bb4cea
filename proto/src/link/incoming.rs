//! Delivery of broadcasts to one robot: applies the state of each link to the messages of a manifest.
//!
//! The link state of the tick whose manifest lists a message determines its delivery. Later changes of the link have no
//! effect on it. The rules apply in this order:
//!
//! 1. **cut**, **blocked**, **faded** or **dropped**: the message is lost.
//! 2. **corrupted**: bits of the payload flip. The message is lost if a checksum detects that, or if it cannot be decoded.
//!    Otherwise the damaged message takes its place.
//! 3. **held**: the message is kept until the world no longer lists its sender as held, and is received in that tick. A
//!    robot gets no information about ticks in which it does not take part. If the sender was released in such a tick,
//!    the message is received when the robot is back.
//! 4. **overtaken**: the message is kept until a later message of its sender is received. It is received one step after
//!    that, but not before its delay is over. The overtaking message itself is not overtaken. With probability 1,
//!    messages are therefore still received, each pair in reverse order.
//! 5. **delayed**: by delay plus jitter, rounded up to whole steps.
//!
//! A message that was due while the robot did not take part is cut. A **duplicate** arrives one step after the message
//! is received, and is ignored.
//!
//! These changes belong to the step, and are undone if the step does not count.

#[cfg(test)]
mod tests;

use std::sync::Arc;

use crate::team::{Broadcast, BroadcastContent, BroadcastKind, Bulletin};
use crate::telemetry::{BroadcastSummary, Delivery, Reception};
use crate::tick::TickMessage;
use scenario::Setup;
use scenario::ids::{RobotId, Tick};
use scenario::time::SimTime;

use super::corruption::{self, Arrival};
use super::draws::{self, Draws};
use super::{LinkState, Probability};

/// The largest number of kept messages. The release of more messages at once would exceed the size limit of a report.
/// Further messages are dropped, as by any full queue.
const CAPACITY: usize = 4096;

/// The messages of one step.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct StepMessages {
    /// The received broadcasts, by (sender rank, incarnation, sequence number).
    pub inbox: Vec<Arc<Broadcast>>,
    /// The delivery of each listed broadcast, by (sender, tick, index), then the deliveries of messages kept from
    /// earlier ticks.
    pub receptions: Vec<Reception>,
}

impl StepMessages {
    #[inline]
    pub fn clear(&mut self) {
        self.inbox.clear();
        self.receptions.clear();
    }
}

/// The messages in flight to one incarnation of a robot.
#[derive(Clone, Debug)]
pub struct IncomingMessages {
    seed: u64,
    robot: RobotId,
    step: SimTime,
    kept: Vec<Kept>,
    /// Second copies, each due one step after its message was received.
    copies: Vec<Reception>,
}

/// A message in flight.
#[derive(Clone, Debug)]
struct Kept {
    /// The message, shared with other receivers in the same process.
    broadcast: Arc<Broadcast>,
    until: Until,
    /// `true` if a second copy follows.
    twice: bool,
    is_damaged: bool,
}

/// The condition for the reception of a kept message.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Until {
    /// The sender is no longer held.
    Released,
    /// A later message of the sender was received in an earlier step, and this time has come.
    Overtaken(SimTime),
    Due(SimTime),
}

/// The effect of a link on a message.
enum Passage {
    Received,
    Lost(Delivery),
    Kept(Until),
}

/// A message after a link's effects on it.
struct Passed {
    passage: Passage,
    /// The message with bit errors; `None` if it is intact.
    damaged: Option<Arc<Broadcast>>,
    /// `true` if a second copy follows.
    twice: bool,
}

impl Passed {
    fn lost(delivery: Delivery) -> Self {
        Self {
            passage: Passage::Lost(delivery),
            ..Self::received()
        }
    }

    fn received() -> Self {
        Self {
            passage: Passage::Received,
            damaged: None,
            twice: false,
        }
    }
}

impl IncomingMessages {
    /// Creates the state of a new incarnation, without messages in flight.
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

    /// Writes the messages of a tick to `messages`. `arrived` has an element per broadcast of the manifest, in the same
    /// order, and `None` for a missing one. It is emptied.
    #[inline]
    pub fn receive(
        &mut self,
        tick: &TickMessage,
        arrived: &mut Vec<Option<Arc<Broadcast>>>,
        messages: &mut StepMessages,
    ) {
        messages.clear();
        if tick.manifest.is_empty() && self.kept.is_empty() && self.copies.is_empty() {
            // Most ticks have no messages.
            arrived.clear();
        } else {
            self.receive_messages(tick, arrived, messages);
        }
    }

    /// Handles a tick with messages.
    #[inline]
    fn receive_messages(
        &mut self,
        tick: &TickMessage,
        arrived: &mut Vec<Option<Arc<Broadcast>>>,
        messages: &mut StepMessages,
    ) {
        if self.kept.is_empty() && self.copies.is_empty() {
            self.take_arrived(tick, arrived, messages);
        } else {
            // Copies are taken before `take_due` adds new ones. A copy that was due while the robot did not take part
            // is discarded.
            let copies = std::mem::take(&mut self.copies);
            let copies = copies.into_iter().filter(|copy| copy.at == tick.now);
            let mut late = self.take_due(tick);
            late.receptions.extend(copies);
            self.take_arrived(tick, arrived, messages);
            messages.inbox.append(&mut late.inbox);
            messages.receptions.append(&mut late.receptions);
        }
        messages.inbox.sort_unstable_by_key(|broadcast| {
            let (sender, incarnation, seq) = order(broadcast);
            (sender, incarnation, seq, broadcast.index)
        });
        self.overtake(&messages.inbox, tick.now);
    }

    /// Removes the kept messages that are due and returns them with their deliveries.
    fn take_due(&mut self, tick: &TickMessage) -> StepMessages {
        let mut messages = StepMessages::default();
        for kept in std::mem::take(&mut self.kept) {
            let due = match kept.until {
                Until::Released if !tick.held.contains(&kept.broadcast.sender) => tick.now,
                Until::Due(due) if due <= tick.now => due,
                _ => {
                    self.kept.push(kept);
                    continue;
                }
            };
            if due < tick.now {
                let missed = self.reception(&kept.broadcast, Delivery::Cut, due);
                messages.receptions.push(missed);
                continue;
            }
            let delivery = if kept.is_damaged {
                Delivery::Damaged
            } else {
                Delivery::Delayed
            };
            let late = self.reception(&kept.broadcast, delivery, due);
            messages.receptions.push(late);
            if kept.twice {
                self.copy(&kept.broadcast, due);
            }
            messages.inbox.push(kept.broadcast);
        }
        messages
    }

    /// Applies the links to the messages of the manifest.
    #[inline]
    fn take_arrived(
        &mut self,
        tick: &TickMessage,
        arrived: &mut Vec<Option<Arc<Broadcast>>>,
        messages: &mut StepMessages,
    ) {
        let now = tick.now;
        let mut arrived = arrived.drain(..);
        for entry in &tick.manifest {
            let link = entry.link.as_deref().filter(|link| !link.is_clear());
            let mut indices = [0; BroadcastKind::ALL.len()];
            for _ in 0..entry.count {
                let Some(mut broadcast) = arrived.next().flatten() else {
                    messages.receptions.push(Reception {
                        at: now,
                        sender: entry.sender,
                        incarnation: entry.incarnation,
                        sent: self.sent(entry.tick),
                        delivery: Delivery::Lost,
                        content: None,
                    });
                    continue;
                };
                let count = &mut indices[broadcast.body.kind() as usize];
                let Passed {
                    passage,
                    damaged,
                    twice,
                } = match link {
                    Some(link) => self.pass(*link, &broadcast, *count, now),
                    None => Passed::received(),
                };
                *count += 1;
                let is_damaged = damaged.is_some();
                if let Some(damaged) = damaged {
                    broadcast = damaged;
                }
                let (delivery, at) = match passage {
                    Passage::Received if is_damaged => (Delivery::Damaged, now),
                    Passage::Received => (Delivery::Received, now),
                    Passage::Lost(delivery) => (delivery, now),
                    Passage::Kept(Until::Due(due)) => (Delivery::Pending, due),
                    Passage::Kept(_) => (Delivery::Pending, now),
                };
                messages
                    .receptions
                    .push(self.reception(&broadcast, delivery, at));
                match passage {
                    Passage::Received => {
                        if twice {
                            self.copy(&broadcast, now);
                        }
                        messages.inbox.push(broadcast);
                    }
                    Passage::Lost(_) => {}
                    Passage::Kept(until) => self.kept.push(Kept {
                        broadcast,
                        until,
                        twice,
                        is_damaged,
                    }),
                }
            }
        }
    }

    /// Returns the effects of a link on the `index`-th message of its kind in its tick.
    fn pass(&self, link: LinkState, broadcast: &Broadcast, index: u16, now: SimTime) -> Passed {
        let block = draws::block(broadcast, index);
        let draws = Draws::new(self.seed, self.robot, broadcast, block);
        if link.cut {
            return Passed::lost(Delivery::Cut);
        }
        if link.blocked {
            return Passed::lost(Delivery::Blocked);
        }
        if link.fade.hits(draws.fade) {
            return Passed::lost(Delivery::Faded);
        }
        if link.drop.hits(draws.drop) {
            return Passed::lost(Delivery::Dropped);
        }
        let damaged = match self.corrupt(link, broadcast, block) {
            Arrival::Intact => None,
            Arrival::Damaged(damaged) if !link.checksum => Some(damaged),
            Arrival::Damaged(_) | Arrival::Undecodable => {
                return Passed::lost(Delivery::Corrupted);
            }
        };
        let twice = link.duplicate.hits(draws.duplicate);
        let due = now + self.whole_steps(link.delay + draws.jitter_within(link.jitter));
        let passage = if link.hold {
            Passage::Kept(Until::Released)
        } else if link.reorder.hits(draws.reorder) && !self.awaits_overtaking(broadcast.sender) {
            Passage::Kept(Until::Overtaken(due))
        } else if due > now {
            Passage::Kept(Until::Due(due))
        } else {
            Passage::Received
        };
        match passage {
            Passage::Kept(_) if self.kept.len() >= CAPACITY => Passed::lost(Delivery::Dropped),
            _ => Passed {
                passage,
                damaged,
                twice,
            },
        }
    }

    /// Returns the effect of the link's bit errors on a message.
    fn corrupt(&self, link: LinkState, broadcast: &Broadcast, block: u128) -> Arrival {
        if link.corrupt == Probability::NEVER {
            return Arrival::Intact;
        }
        corruption::transmit(self.seed, self.robot, broadcast, block, link.corrupt)
    }

    fn awaits_overtaking(&self, sender: RobotId) -> bool {
        self.kept.iter().any(|kept| {
            kept.broadcast.sender == sender && matches!(kept.until, Until::Overtaken(_))
        })
    }

    /// Schedules the messages that a received message overtakes for the next step or later.
    fn overtake(&mut self, received: &[Arc<Broadcast>], now: SimTime) {
        for kept in &mut self.kept {
            let Until::Overtaken(earliest) = kept.until else {
                continue;
            };
            let overtakes = |other: &Broadcast| {
                other.sender == kept.broadcast.sender && order(other) > order(&kept.broadcast)
            };
            if received.iter().any(|other| overtakes(other)) {
                kept.until = Until::Due(earliest.max(now + self.step));
            }
        }
    }

    /// Adds a second copy of a message that is received at `at`.
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
            content: Some(summary(broadcast)),
        }
    }

    fn sent(&self, tick: Tick) -> SimTime {
        SimTime(tick.saturating_mul(self.step.0))
    }

    /// Rounds a time span up to whole steps.
    fn whole_steps(&self, span: SimTime) -> SimTime {
        SimTime(span.0.div_ceil(self.step.0).saturating_mul(self.step.0))
    }
}

/// Returns the sort key of a message.
fn order(broadcast: &Broadcast) -> (RobotId, u32, u64) {
    (broadcast.sender, broadcast.incarnation, broadcast.seq)
}

/// Returns the logged part of a broadcast.
fn summary(broadcast: &Broadcast) -> BroadcastSummary {
    let (state, since, set, task, progress) = match &broadcast.body {
        BroadcastContent::Heartbeat(heartbeat) => (
            Some(heartbeat.state),
            Some(heartbeat.since),
            heartbeat.set,
            heartbeat.task,
            Some(heartbeat.progress),
        ),
        BroadcastContent::Bulletin(Bulletin { about, .. }) => {
            let (set, task) = (about.map(|about| about.set), about.map(|about| about.task));
            (None, None, set, task, about.map(|about| about.progress))
        }
        BroadcastContent::Allocation(_) => (None, None, None, None, None),
    };
    BroadcastSummary {
        seq: broadcast.seq,
        kind: broadcast.body.kind(),
        state,
        since,
        set,
        task,
        progress,
    }
}
