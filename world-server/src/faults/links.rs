//! Link faults: the state of every directed link in a tick, and the faults that caused the delivery of a message.
//!
//! The state of the link in the tick whose manifest lists a message determines its delivery. The receiver applies that
//! state ([`proto::link::IncomingMessages`]). [`LinkFaults`] holds the faults and no messages: the bytes of reports are
//! part of the hash, so a reported delivery cannot name its cause, and [`LinkFaults::causes`] looks it up.

#[cfg(test)]
mod tests;

use std::collections::VecDeque;
use std::ops::Range;
use std::sync::Arc;

use glam::Vec2;
use proto::link::{LinkEffect, LinkState, Probability};
use proto::telemetry::{Delivery, Reception};
use scenario::fault::{Fault, LinkEnd, LinkQuality};
use scenario::ids::{RobotId, Tick};
use scenario::time::SimTime;
use scenario::{Roster, Setup, StepOrder};

use super::bursts::Bursts;
use super::schedule::FaultIndex;

#[derive(Clone, Debug)]
pub struct LinkFaults {
    seed: u64,
    roster: Arc<Roster>,
    step: SimTime,
    order: StepOrder,
    tick: Tick,
    active: Vec<ActiveFault>,
    /// The ended faults that duplicated or damaged messages. A second copy or a late message can arrive long afterwards.
    healed: Vec<HealedFault>,
    /// The positions, indexed by rank. They are current only while a radio range is in force.
    positions: Vec<Vec2>,
}

#[derive(Clone, Debug)]
struct ActiveFault {
    fault: FaultIndex,
    /// The tick in which it was applied.
    since: Tick,
    scope: Scope,
    /// The effect on the links in the scope, without bursts.
    state: LinkState,
    bursts: Option<Bursts>,
}

/// The largest number of ranges of ticks that are kept of an ended fault, which may be periodic. The attribution of a second
/// copy fails only if its message was kept back for more periods than that.
const MAX_RANGES: usize = 256;

/// A fault that has ended at least once.
#[derive(Clone, Debug)]
struct HealedFault {
    fault: ActiveFault,
    /// The ticks in which it was in force, the latest last.
    in_force: VecDeque<Range<Tick>>,
}

/// The directed links that a fault affects.
#[derive(Clone, Debug)]
enum Scope {
    /// Senders and receivers, indexed by rank.
    Between { from: Vec<bool>, to: Vec<bool> },
    /// Groups, indexed by rank; `None` means no group.
    Across {
        groups: Vec<Option<usize>>,
        one_way: bool,
    },
    /// The distance beyond which links are cut, m.
    Beyond(f32),
}

impl LinkFaults {
    #[must_use]
    pub fn new(setup: &Setup) -> Self {
        Self {
            seed: setup.seed,
            roster: Arc::clone(&setup.roster),
            step: SimTime(setup.scenario.step_ms),
            order: setup.step_order,
            tick: 0,
            active: Vec::new(),
            healed: Vec::new(),
            positions: Vec::new(),
        }
    }

    /// Starts a tick with the faults in force and the robots' positions, m. Call it again after a fault changed in the same tick.
    pub fn begin<'f>(
        &mut self,
        tick: Tick,
        in_force: impl Iterator<Item = (FaultIndex, &'f Fault)>,
        position: impl Fn(RobotId) -> Vec2,
    ) {
        self.tick = tick;
        let mut in_force = in_force.peekable();
        if self.active.is_empty() && in_force.peek().is_none() {
            // Most runs have no faults.
            return;
        }
        let mut before = std::mem::take(&mut self.active);
        for (index, fault) in in_force {
            let known = before.iter().position(|active| active.fault == index);
            let active = match known {
                Some(place) => Some(before.swap_remove(place)),
                None => self.apply(index, fault),
            };
            if let Some(mut active) = active {
                if let Some(bursts) = &mut active.bursts {
                    bursts.advance(tick);
                }
                self.active.push(active);
            }
        }
        before.retain(|active| {
            active.state.has(LinkEffect::Copy) || active.state.has(LinkEffect::Corruption)
        });
        for ended in before {
            self.keep_healed(ended, tick);
        }

        let by_distance = |active: &ActiveFault| matches!(active.scope, Scope::Beyond(_));
        if self.active.iter().any(by_distance) {
            let robots = (0..self.roster.names().len() as u32).map(RobotId);
            self.positions = robots.map(position).collect();
        }
    }

    fn keep_healed(&mut self, ended: ActiveFault, tick: Tick) {
        let range = ended.since..tick;
        let mut healed = self.healed.iter_mut();
        match healed.find(|healed| healed.fault.fault == ended.fault) {
            Some(healed) => {
                if healed.in_force.len() == MAX_RANGES {
                    healed.in_force.pop_front();
                }
                healed.in_force.push_back(range);
            }
            None => self.healed.push(HealedFault {
                in_force: VecDeque::from([range]),
                fault: ActiveFault {
                    bursts: None,
                    ..ended
                },
            }),
        }
    }

    /// Returns the state of the link from `sender` to `receiver` in this tick; `None` if no fault affects it.
    #[must_use]
    #[inline]
    pub fn state(&self, sender: RobotId, receiver: RobotId) -> Option<LinkState> {
        // Most runs have no link faults.
        if self.active.is_empty() {
            return None;
        }
        self.combined_state(sender, receiver)
    }

    fn combined_state(&self, sender: RobotId, receiver: RobotId) -> Option<LinkState> {
        let states = self
            .active
            .iter()
            .map(|active| self.effect_of(active, sender, receiver));
        states
            .reduce(LinkState::and)
            .filter(|state| !state.is_clear())
    }

    /// Writes the senders, by rank, whose messages to `receiver` are held back in this tick to `held`.
    #[inline]
    pub fn write_held_senders(&self, receiver: RobotId, held: &mut Vec<RobotId>) {
        held.clear();
        // Most runs hold no messages.
        if !self.active.iter().any(|active| active.state.hold) {
            return;
        }
        let senders = (0..self.roster.names().len() as u32).map(RobotId);
        let senders = senders
            .filter(|&sender| sender != receiver)
            .filter(|&sender| self.state(sender, receiver).is_some_and(|state| state.hold));
        held.extend(senders);
    }

    /// Returns the faults that may have caused a reported delivery in this tick, each once.
    ///
    /// A delayed message counts only when it becomes [`Delivery::Pending`]. No link fault causes the cut of a message that is due
    /// while its receiver is out.
    pub fn causes(
        &self,
        receiver: RobotId,
        reception: &Reception,
    ) -> impl Iterator<Item = FaultIndex> {
        let (sender, delivery) = (reception.sender, reception.delivery);
        let listed = self.listed(sender, receiver, reception.sent);
        // The message of a second copy may have been listed long ago, in another state of the link.
        let effect = match self.state(sender, receiver) {
            _ if delivery == Delivery::Duplicate => Some(LinkEffect::Copy),
            _ if delivery == Delivery::Damaged => Some(LinkEffect::Corruption),
            Some(state) if listed == self.tick => state.effect_behind(delivery),
            _ => None,
        };
        let causes = move |fault: &ActiveFault| {
            effect.is_some_and(|effect| self.effect_of(fault, sender, receiver).has(effect))
        };
        let active = self.active.iter();
        let active = active.filter(move |active| active.since <= listed && causes(active));
        let healed = self.healed.iter().filter(move |healed| {
            matches!(delivery, Delivery::Duplicate | Delivery::Damaged)
                && healed.in_force.iter().any(|range| range.contains(&listed))
                && causes(&healed.fault)
        });
        healed
            .map(|healed| healed.fault.fault)
            .chain(active.map(|active| active.fault))
    }

    /// Returns the tick whose manifest listed a message sent at `sent`.
    fn listed(&self, sender: RobotId, receiver: RobotId, sent: SimTime) -> Tick {
        let at_once = self.order == StepOrder::InOrder && sender < receiver;
        sent.0 / self.step.0 + Tick::from(!at_once)
    }

    /// Returns the effect of one fault on a link in this tick.
    fn effect_of(&self, active: &ActiveFault, sender: RobotId, receiver: RobotId) -> LinkState {
        if !self.concerns(&active.scope, sender, receiver) {
            return LinkState::default();
        }
        let bursts = active.bursts.as_ref();
        let is_bad = bursts.is_some_and(|bursts| bursts.is_bad(sender, receiver));
        LinkState {
            drop: if is_bad {
                Probability::ALWAYS
            } else {
                active.state.drop
            },
            ..active.state
        }
    }

    fn concerns(&self, scope: &Scope, sender: RobotId, receiver: RobotId) -> bool {
        let (sender, receiver) = (sender.index(), receiver.index());
        match scope {
            Scope::Between { from, to } => from[sender] && to[receiver],
            Scope::Across { groups, one_way } => match (groups[sender], groups[receiver]) {
                (Some(from), Some(to)) => from > to || (from < to && !one_way),
                _ => false,
            },
            Scope::Beyond(range_m) => {
                self.positions[sender].distance_squared(self.positions[receiver])
                    > range_m * range_m
            }
        }
    }

    /// Creates the state of a fault that takes effect in this tick; `None` if it affects no link.
    fn apply(&self, fault: FaultIndex, what: &Fault) -> Option<ActiveFault> {
        let clear = LinkState::default();
        let cut = LinkState { cut: true, ..clear };
        let (scope, state, loss) = match what {
            Fault::Drop(loss) => (
                self.between(&loss.from, &loss.to),
                clear,
                Some((loss.p, loss.burst_s)),
            ),
            Fault::Delay(delay) => {
                let state = LinkState {
                    delay: SimTime::from_secs_f64(delay.delay_s),
                    jitter: SimTime::from_secs_f64(delay.jitter_s),
                    ..clear
                };
                (self.between(&delay.from, &delay.to), state, None)
            }
            Fault::Duplicate(chance) => {
                let duplicate = Probability::from_share(chance.p);
                let state = LinkState { duplicate, ..clear };
                (self.between(&chance.from, &chance.to), state, None)
            }
            Fault::Reorder(chance) => {
                let reorder = Probability::from_share(chance.p);
                let state = LinkState { reorder, ..clear };
                (self.between(&chance.from, &chance.to), state, None)
            }
            Fault::Corrupt(corruption) => {
                let state = LinkState {
                    corrupt: Probability::from_share(corruption.p),
                    checksum: corruption.checksum,
                    ..clear
                };
                (self.between(&corruption.from, &corruption.to), state, None)
            }
            Fault::Hold(link) => {
                let state = LinkState {
                    hold: true,
                    ..clear
                };
                (self.between(&link.from, &link.to), state, None)
            }
            Fault::Partition(partition) => {
                let group = |name: &str| {
                    let mut groups = partition.groups.iter();
                    groups.position(|group| group.iter().any(|member| member == name))
                };
                let scope = Scope::Across {
                    groups: self.roster.names().map(group).collect(),
                    one_way: partition.one_way,
                };
                (scope, cut, None)
            }
            Fault::Mute(robot) => {
                let scope = self.between(&LinkEnd::Robot(robot.clone()), &LinkEnd::All);
                (scope, cut, None)
            }
            Fault::Deaf(robot) => {
                let scope = self.between(&LinkEnd::All, &LinkEnd::Robot(robot.clone()));
                (scope, cut, None)
            }
            Fault::Range(range) => (Scope::Beyond(range.range_m), cut, None),
            Fault::Radio(quality) => {
                let LinkQuality {
                    loss,
                    burst_s,
                    delay_s,
                    jitter_s,
                    duplicate,
                    reorder,
                } = quality.link_quality();
                let state = LinkState {
                    delay: SimTime::from_secs_f64(delay_s),
                    jitter: SimTime::from_secs_f64(jitter_s),
                    duplicate: Probability::from_share(duplicate),
                    reorder: Probability::from_share(reorder),
                    ..clear
                };
                let scope = self.between(&LinkEnd::All, &LinkEnd::All);
                (scope, state, Some((loss, burst_s)))
            }
            _ => return None,
        };
        let mut active = ActiveFault {
            fault,
            since: self.tick,
            scope,
            state,
            bursts: None,
        };
        match loss {
            Some((share, burst_s)) if burst_s > 0.0 => {
                let mean_ticks = burst_s / self.step.as_secs_f64();
                let applied = (fault, self.tick);
                let robots = self.roster.names().len() as u32;
                active.bursts = Some(Bursts::new(self.seed, robots, applied, share, mean_ticks));
            }
            Some((share, _)) => active.state.drop = Probability::from_share(share),
            None => {}
        }
        Some(active)
    }

    fn between(&self, from: &LinkEnd, to: &LinkEnd) -> Scope {
        let ranks = |who: &LinkEnd| self.roster.names().map(|name| who.includes(name)).collect();
        Scope::Between {
            from: ranks(from),
            to: ranks(to),
        }
    }
}
