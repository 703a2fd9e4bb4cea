//! Messages of ACBBA and the removal of silent robots. Heartbeats count only as signs of life.

use proto::allocation::AllocationMessage;
use proto::allocation::consensus::Deltas as Message;
use proto::allocation::consensus::{BidChange, DELTAS_MAX, TableEntry, WinningBid};
use proto::team::{Broadcast, BroadcastContent};
use scenario::ids::{Incarnation, RobotId};
use scenario::time::SimTime;

use super::bundle::Bundle;
use super::records::Records;
use super::{Consensus, Rules};
use crate::allocator::{Input, SelfState};
use crate::allocators::consensus::known::Known;
use crate::allocators::consensus::winners::Winners;
use crate::broken::is_broken;

#[derive(Clone, Debug)]
pub struct Deltas {
    me: RobotId,
    repeat: SimTime,
    last_repeat: Option<SimTime>,
    /// The known bids of all robots, by index of the entry.
    places: Vec<Place>,
    known: Known<Latest>,
    /// The entry that is sent first, so that all entries get a turn.
    next: usize,
}

#[derive(Clone, Debug, Default)]
struct Place {
    round: SimTime,
    records: Records,
}

/// The latest messages of a teammate.
#[derive(Clone, Copy, Debug, Default)]
struct Latest {
    /// The latest incarnation; `None` if only other robots have reported the teammate.
    incarnation: Option<Incarnation>,
    /// The sequence number of its latest allocator message in that incarnation.
    seq: Option<u64>,
}

impl Deltas {
    /// Records a sign of life of the sender. Returns whether the sender is new.
    fn note(&mut self, broadcast: &Broadcast, beliefs: &mut Winners) -> bool {
        let (robot, sent) = (broadcast.sender, broadcast.sent);
        let is_new = self.known.note(robot, sent);
        let incarnation = Some(broadcast.incarnation);
        if let Some(latest) = self.known.get_mut(robot)
            && latest.incarnation < incarnation
        {
            let is_restarted = latest.incarnation.is_some();
            *latest = Latest {
                incarnation,
                seq: None,
            };
            if is_restarted {
                self.strike(robot, sent, beliefs);
            }
        }
        is_new
    }

    /// Checks that a broadcast is newer than the sender's last one, and stores its number.
    fn is_new(&mut self, broadcast: &Broadcast) -> bool {
        let Some(latest) = self.known.get_mut(broadcast.sender) else {
            return false;
        };
        let is_new = latest.incarnation == Some(broadcast.incarnation)
            && latest.seq.is_none_or(|seq| seq < broadcast.seq);
        if is_new {
            latest.seq = Some(broadcast.seq);
        }
        is_new
    }

    fn receive_entry(
        &mut self,
        me: &SelfState,
        broadcast: &Broadcast,
        delta: &BidChange,
        now: SimTime,
        beliefs: &mut Winners,
    ) {
        let TableEntry { task, round, claim } = delta.belief;
        let Some(place) = beliefs.find(task, delta.slot) else {
            return;
        };
        let is_sound = |claim: WinningBid| {
            claim.robot.index() < me.team && claim.value.is_finite() && claim.value >= 0.0
        };
        let is_old = round < beliefs.entries()[place].round;
        let is_of_future = round > now || delta.made > now;
        if is_old || is_of_future || !claim.is_none_or(is_sound) {
            return;
        }
        beliefs.start_round(place, round);
        self.renew(place, round);
        let Some(claim) = claim else { return };
        if claim.robot == me.robot && is_broken("acbba-ignores-reports-about-itself") {
            return;
        }
        let records = &mut self.places[place].records;
        // Reports about the robot itself are not applied. If one is wrong, the robot's current bid gets a new time.
        if records.receive(claim, delta.made) && claim.robot != me.robot {
            beliefs.set_others(place, records.best_except(me.robot));
            // The report of another robot is a sign of life only of an unknown bidder.
            if claim.value > 0.0 && self.known.sent(claim.robot).is_none() {
                self.known.note(claim.robot, broadcast.sent);
            }
        }
    }

    /// Clears all bids of a place if `round` is newer.
    fn renew(&mut self, place: usize, round: SimTime) {
        let place = &mut self.places[place];
        if place.round < round {
            place.round = round;
            place.records.clear();
        }
    }

    /// Treats all bids of a robot as withdrawn at the time `then`.
    fn strike(&mut self, robot: RobotId, then: SimTime, beliefs: &mut Winners) {
        for (place, known) in self.places.iter_mut().enumerate() {
            let record = known.records.record_of(robot);
            if record.is_some_and(|record| record.claim.value > 0.0) {
                let none = WinningBid { robot, value: 0.0 };
                known.records.receive(none, then);
                beliefs.set_others(place, known.records.best_except(self.me));
            }
        }
    }

    /// Records the robot's current bids with their times if they changed or others have them wrong.
    fn note_own(&mut self, now: SimTime, beliefs: &Winners) {
        let robot = self.me;
        for (place, entry) in beliefs.entries().iter().enumerate() {
            let records = &mut self.places[place].records;
            let own = entry.claim.filter(|claim| claim.robot == robot);
            let value = own.map_or(0.0, |claim| claim.value);
            let recorded = records
                .record_of(robot)
                .map_or(0.0, |record| record.claim.value);
            if value != recorded {
                records.set(WinningBid { robot, value }, now);
            }
        }
    }

    /// Withdraws the bids of robots silent for τ. Returns whether there were any.
    fn forget(&mut self, me: &SelfState, now: SimTime, beliefs: &mut Winners) -> bool {
        if is_broken("acbba-keeps-bids-of-lost-robots") {
            return false;
        }
        let mut any_lost = false;
        while let Some(lost) = self.known.remove_silent(now, me.ceased_after) {
            self.strike(lost, now, beliefs);
            any_lost = true;
        }
        any_lost
    }
}

impl Consensus for Deltas {
    fn new(me: &SelfState, rules: &Rules, beliefs: &Winners) -> Self {
        Self {
            me: me.robot,
            repeat: rules.refresh,
            last_repeat: None,
            places: vec![Place::default(); beliefs.entries().len()],
            known: Known::default(),
            next: 0,
        }
    }

    fn receive(
        &mut self,
        me: &SelfState,
        input: &Input<'_>,
        beliefs: &mut Winners,
        bundle: &mut Bundle,
    ) -> bool {
        let now = input.now;
        let mut has_changed = false;
        for (place, entry) in beliefs.entries().iter().enumerate() {
            self.renew(place, entry.round);
        }
        for broadcast in input.received {
            let is_fresh = broadcast.sent <= now && now.since(broadcast.sent) < me.ceased_after;
            if !me.is_teammate(broadcast.sender) || !is_fresh {
                continue;
            }
            has_changed |= self.note(broadcast, beliefs);
            if let BroadcastContent::Allocation(AllocationMessage::Deltas(deltas)) = &broadcast.body
                && self.is_new(broadcast)
            {
                for delta in &deltas.entries {
                    self.receive_entry(me, broadcast, delta, now, beliefs);
                }
            }
            bundle.drop_lost(beliefs);
        }
        if self.forget(me, now, beliefs) {
            has_changed = true;
            bundle.drop_lost(beliefs);
        }
        has_changed
    }

    fn set_refresh(&mut self, refresh: SimTime) {
        self.repeat = refresh;
    }

    fn send(&mut self, now: SimTime, beliefs: &mut Winners, messages: &mut Vec<AllocationMessage>) {
        beliefs.give_free_places();
        self.note_own(now, beliefs);
        let count = beliefs.entries().len();
        let is_due = |last_repeat| now.since(last_repeat) >= self.repeat;
        if self.last_repeat.is_none_or(is_due) {
            self.last_repeat = Some(now);
            for place in 0..count {
                match beliefs.entries()[place].claim {
                    Some(winner) => self.places[place].records.tell(winner.robot),
                    None => beliefs.mark_for_sending(place),
                }
            }
        }
        let mut outgoing: Vec<BidChange> = Vec::new();
        // The remaining entries are sent in the next step.
        let most = DELTAS_MAX * (1 + beliefs.tasks().len());
        for place in (0..count).map(|place| (self.next + place) % count) {
            let entry = &beliefs.entries()[place];
            let delta = |claim, made| BidChange {
                belief: TableEntry {
                    task: entry.task,
                    round: entry.round,
                    claim,
                },
                slot: entry.slot,
                made,
            };
            let before = outgoing.len();
            let records = self.places[place].records.iter_mut();
            let unsaid = records.filter(|record| record.is_unsaid);
            for record in unsaid.take(most - before) {
                record.is_unsaid = false;
                outgoing.push(delta(Some(record.claim), record.made));
            }
            // For a place without a winner only the round is sent.
            let is_free = entry.must_send && entry.claim.is_none();
            if is_free && outgoing.len() == before && before < most {
                outgoing.push(delta(None, SimTime::ZERO));
            }
            if outgoing.len() == most {
                self.next = place;
                break;
            }
            beliefs.mark_sent(place);
        }
        let chunks = outgoing.chunks(DELTAS_MAX).map(|entries| Message {
            entries: entries.to_vec(),
        });
        messages.extend(chunks.map(AllocationMessage::Deltas));
    }
}
