//! Link faults: the state of every directed link in a tick, composed of all that is in force (DESIGN §6), and which fault is
//! to blame for what became of a message.
//!
//! What befalls a message is decided by the state of its link in the tick whose manifest lists it; the receiver applies it.

#[cfg(test)]
mod tests;

use std::sync::Arc;

use alliance_proto::fault::{Fault, LinkTerms, Who};
use alliance_proto::ids::{RobotId, Tick};
use alliance_proto::link::{LinkState, Probability};
use alliance_proto::scenario::{Roster, Setup, StepOrder};
use alliance_proto::telemetry::{Delivery, Reception};
use alliance_proto::time::SimTime;
use glam::Vec2;

use super::bursts::Bursts;
use super::schedule::FaultIndex;

/// All directed links of a team.
#[derive(Clone, Debug)]
pub struct Links {
    seed: u64,
    roster: Arc<Roster>,
    step: SimTime,
    order: StepOrder,
    tick: Tick,
    /// The link faults in force.
    acting: Vec<Acting>,
    /// Those that doubled messages, with the tick in which they no longer did: a second copy may come long after.
    healed: Vec<(Acting, Tick)>,
    /// By rank; up to date while a radio range is in force.
    positions: Vec<Vec2>,
}

/// A link fault in force.
#[derive(Clone, Debug)]
struct Acting {
    fault: FaultIndex,
    /// The tick in which it was applied.
    since: Tick,
    scope: Scope,
    /// What befalls the links in its scope, but for bursts.
    state: LinkState,
    bursts: Option<Bursts>,
}

/// The directed links that a fault concerns.
#[derive(Clone, Debug)]
enum Scope {
    /// Senders and receivers, by rank.
    Between { from: Vec<bool>, to: Vec<bool> },
    /// Across groups, by rank; `None` is in no group.
    Across {
        groups: Vec<Option<usize>>,
        one_way: bool,
    },
    /// Farther apart than this, m.
    Beyond(f32),
}

impl Links {
    /// Links without faults.
    #[must_use]
    pub fn new(setup: &Setup) -> Self {
        Self {
            seed: setup.seed,
            roster: Arc::clone(&setup.roster),
            step: SimTime(setup.scenario.step_ms),
            order: setup.step_order,
            tick: 0,
            acting: Vec::new(),
            healed: Vec::new(),
            positions: Vec::new(),
        }
    }

    /// Begins a tick, or the same one anew after a fault was applied or cleared in it: the faults in force, of which those
    /// that concern no link are passed over, and where the robots are, m.
    pub fn begin<'f>(
        &mut self,
        tick: Tick,
        in_force: impl Iterator<Item = (FaultIndex, &'f Fault)>,
        position: impl Fn(RobotId) -> Vec2,
    ) {
        self.tick = tick;
        let mut in_force = in_force.peekable();
        if self.acting.is_empty() && in_force.peek().is_none() {
            // As in most runs.
            return;
        }
        let mut before = std::mem::take(&mut self.acting);
        for (index, fault) in in_force {
            let known = before.iter().position(|acting| acting.fault == index);
            let acting = match known {
                Some(place) => Some(before.swap_remove(place)),
                None => self.apply(index, fault),
            };
            if let Some(mut acting) = acting {
                if let Some(bursts) = &mut acting.bursts {
                    bursts.advance(tick);
                }
                self.acting.push(acting);
            }
        }
        before.retain(|acting| acting.state.duplicate > Probability::NEVER);
        self.healed.extend(before.into_iter().map(|acting| {
            let bursts = None;
            (Acting { bursts, ..acting }, tick)
        }));

        let by_distance = |acting: &Acting| matches!(acting.scope, Scope::Beyond(_));
        if self.acting.iter().any(by_distance) {
            let robots = (0..self.roster.names().len() as u16).map(RobotId);
            self.positions = robots.map(position).collect();
        }
    }

    /// What befalls messages from `sender` to `receiver` in this tick; `None` is nothing.
    #[must_use]
    #[inline]
    pub fn state(&self, sender: RobotId, receiver: RobotId) -> Option<LinkState> {
        // As in most runs.
        if self.acting.is_empty() {
            return None;
        }
        self.state_by_acting(sender, receiver)
    }

    fn state_by_acting(&self, sender: RobotId, receiver: RobotId) -> Option<LinkState> {
        let states = self
            .acting
            .iter()
            .map(|acting| self.done_by(acting, sender, receiver));
        states
            .reduce(LinkState::and)
            .filter(|state| !state.is_clear())
    }

    /// Writes to `held` the senders whose messages to `receiver` are held back in this tick, by rank.
    #[inline]
    pub fn held(&self, receiver: RobotId, held: &mut Vec<RobotId>) {
        held.clear();
        // In most runs there is none at all.
        if !self.acting.iter().any(|acting| acting.state.hold) {
            return;
        }
        let senders = (0..self.roster.names().len() as u16).map(RobotId);
        let senders = senders
            .filter(|&sender| sender != receiver)
            .filter(|&sender| self.state(sender, receiver).is_some_and(|state| state.hold));
        held.extend(senders);
    }

    /// The faults that may have brought about what `receiver` reports of a message in this tick, each once.
    ///
    /// A message that is kept counts when it is [`Delivery::Pending`], not once more when it is heard; one that was due while its
    /// receiver was out is cut by none of these faults.
    pub fn causes(
        &self,
        receiver: RobotId,
        reception: &Reception,
    ) -> impl Iterator<Item = FaultIndex> {
        let (sender, delivery) = (reception.sender, reception.delivery);
        let listed = self.listed(sender, receiver, reception.sent);
        let is_new = listed == self.tick;
        // Holding comes before delaying and overtaking.
        let is_held = delivery == Delivery::Pending
            && (self.state(sender, receiver)).is_some_and(|state| state.hold);
        let acting = self.acting.iter().filter(move |acting| {
            let state = self.done_by(acting, sender, receiver);
            match delivery {
                Delivery::Dropped => is_new && state.drop > Probability::NEVER,
                Delivery::Cut => is_new && state.cut,
                Delivery::Pending if is_held => is_new && state.hold,
                Delivery::Pending => is_new && state.may_delay(),
                Delivery::Duplicate => {
                    acting.since <= listed && state.duplicate > Probability::NEVER
                }
                Delivery::Heard | Delivery::Lost | Delivery::Delayed => false,
            }
        });
        let healed = self.healed.iter().filter(move |(acting, until)| {
            delivery == Delivery::Duplicate
                && (acting.since..*until).contains(&listed)
                && self.done_by(acting, sender, receiver).duplicate > Probability::NEVER
        });
        healed
            .map(|(acting, _)| acting.fault)
            .chain(acting.map(|acting| acting.fault))
    }

    /// The tick whose manifest listed what was sent then.
    fn listed(&self, sender: RobotId, receiver: RobotId, sent: SimTime) -> Tick {
        let at_once = self.order == StepOrder::InOrder && sender < receiver;
        sent.0 / self.step.0 + Tick::from(!at_once)
    }

    /// What one fault does to a link in this tick.
    fn done_by(&self, acting: &Acting, sender: RobotId, receiver: RobotId) -> LinkState {
        if !self.concerns(&acting.scope, sender, receiver) {
            return LinkState::default();
        }
        let bursts = acting.bursts.as_ref();
        let is_bad = bursts.is_some_and(|bursts| bursts.is_bad(sender, receiver));
        LinkState {
            drop: if is_bad {
                Probability::ALWAYS
            } else {
                acting.state.drop
            },
            ..acting.state
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

    /// A fault that takes effect in this tick; `None` if it concerns no link.
    fn apply(&self, fault: FaultIndex, what: &Fault) -> Option<Acting> {
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
                let duplicate = Probability::of(chance.p);
                let state = LinkState { duplicate, ..clear };
                (self.between(&chance.from, &chance.to), state, None)
            }
            Fault::Reorder(chance) => {
                let reorder = Probability::of(chance.p);
                let state = LinkState { reorder, ..clear };
                (self.between(&chance.from, &chance.to), state, None)
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
                let scope = self.between(&Who::Robot(robot.clone()), &Who::All);
                (scope, cut, None)
            }
            Fault::Deaf(robot) => {
                let scope = self.between(&Who::All, &Who::Robot(robot.clone()));
                (scope, cut, None)
            }
            Fault::Range(range) => (Scope::Beyond(range.range_m), cut, None),
            Fault::Radio(quality) => {
                let LinkTerms {
                    loss,
                    burst_s,
                    delay_s,
                    jitter_s,
                    duplicate,
                    reorder,
                } = quality.terms();
                let state = LinkState {
                    delay: SimTime::from_secs_f64(delay_s),
                    jitter: SimTime::from_secs_f64(jitter_s),
                    duplicate: Probability::of(duplicate),
                    reorder: Probability::of(reorder),
                    ..clear
                };
                let scope = self.between(&Who::All, &Who::All);
                (scope, state, Some((loss, burst_s)))
            }
            _ => return None,
        };
        let mut acting = Acting {
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
                let robots = self.roster.names().len() as u16;
                acting.bursts = Some(Bursts::new(self.seed, robots, applied, share, mean_ticks));
            }
            Some((share, _)) => acting.state.drop = Probability::of(share),
            None => {}
        }
        Some(acting)
    }

    fn between(&self, from: &Who, to: &Who) -> Scope {
        let ranks = |who: &Who| self.roster.names().map(|name| who.includes(name)).collect();
        Scope::Between {
            from: ranks(from),
            to: ranks(to),
        }
    }
}
