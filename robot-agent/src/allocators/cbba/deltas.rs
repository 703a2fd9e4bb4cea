//! Changes between robots: what ACBBA says and when, what is heard and believed, and who is taken for dead. Of heartbeats only that there
//! are some is read: they tell who is alive.

use alliance_proto::allocation::AllocationMessage;
use alliance_proto::allocation::consensus::Deltas as Message;
use alliance_proto::allocation::consensus::{Belief, Claim, DELTAS_MAX, Delta};
use alliance_proto::ids::{Incarnation, RobotId};
use alliance_proto::team::{Broadcast, Content};
use alliance_proto::time::SimTime;

use super::beliefs::Beliefs;
use super::bundle::Bundle;
use super::records::Records;
use super::{Consensus, Rules};
use crate::allocator::{Input, Me};

/// What is known of the team.
#[derive(Clone, Debug)]
pub struct Deltas {
    me: RobotId,
    repeat: SimTime,
    /// When all beliefs were told last.
    repeated: Option<SimTime>,
    /// Of each entry of the beliefs, what is known of all bids.
    places: Vec<Place>,
    /// Of whom there is news that is younger than τ, by rank.
    known: Vec<Known>,
    /// The entry that comes first among those that are to be told, so that each has its turn.
    next: usize,
}

/// What is known of all bids for one place of one task.
#[derive(Clone, Debug, Default)]
struct Place {
    round: SimTime,
    records: Records,
}

/// What is known of a teammate's words.
#[derive(Clone, Copy, Debug)]
struct Known {
    robot: RobotId,
    /// When the latest news of it was sent.
    sent: SimTime,
    /// Its incarnation; `None` for one that only others have told of.
    incarnation: Option<Incarnation>,
    /// Sequence number of the latest message of its allocator in that incarnation.
    word: Option<u64>,
}

impl Deltas {
    fn known(&self, robot: RobotId) -> Result<usize, usize> {
        self.known.binary_search_by_key(&robot, |known| known.robot)
    }

    /// Anything that a teammate sends tells that it is alive. Whether it was not known to be.
    fn note(&mut self, broadcast: &Broadcast, beliefs: &mut Beliefs) -> bool {
        let (robot, sent) = (broadcast.sender, broadcast.sent);
        let incarnation = Some(broadcast.incarnation);
        match self.known(robot) {
            Ok(at) => {
                let known = &mut self.known[at];
                known.sent = known.sent.max(sent);
                if known.incarnation < incarnation {
                    let is_restarted = known.incarnation.is_some();
                    known.incarnation = incarnation;
                    known.word = None;
                    if is_restarted {
                        self.strike(robot, sent, beliefs);
                    }
                }
                false
            }
            Err(at) => {
                let known = Known {
                    robot,
                    sent,
                    incarnation,
                    word: None,
                };
                self.known.insert(at, known);
                true
            }
        }
    }

    /// Somebody else tells of a robot that has made a bid.
    fn note_bidder(&mut self, robot: RobotId, sent: SimTime) {
        if let Err(at) = self.known(robot) {
            let known = Known {
                robot,
                sent,
                incarnation: None,
                word: None,
            };
            self.known.insert(at, known);
        }
    }

    /// Whether that is the latest word of its sender; if so it has been heard.
    fn is_new(&mut self, broadcast: &Broadcast) -> bool {
        let Ok(at) = self.known(broadcast.sender) else {
            return false;
        };
        let known = &mut self.known[at];
        let is_new = known.incarnation == Some(broadcast.incarnation)
            && known.word.is_none_or(|word| word < broadcast.seq);
        if is_new {
            known.word = Some(broadcast.seq);
        }
        is_new
    }

    fn hear_entry(
        &mut self,
        me: &Me,
        broadcast: &Broadcast,
        delta: &Delta,
        now: SimTime,
        beliefs: &mut Beliefs,
    ) {
        let Belief { task, round, claim } = delta.belief;
        let Some(place) = beliefs.find(task, delta.slot) else {
            return;
        };
        let is_sound = |claim: Claim| {
            claim.robot.index() < me.team && claim.value.is_finite() && claim.value >= 0.0
        };
        let is_old = round < beliefs.entries()[place].round;
        let is_of_future = round > now || delta.made > now;
        if is_old || is_of_future || !claim.is_none_or(is_sound) {
            return;
        }
        beliefs.renew(place, round);
        self.renew(place, round);
        let Some(claim) = claim else { return };
        let records = &mut self.places[place].records;
        // What others know of the robot itself changes nothing for it; if it is not so, the robot dates anew what is.
        if records.hear(claim, delta.made) && claim.robot != me.robot {
            beliefs.set_others(place, records.best_but(me.robot));
            if claim.value > 0.0 {
                self.note_bidder(claim.robot, broadcast.sent);
            }
        }
    }

    /// A newer round voids all bids.
    fn renew(&mut self, place: usize, round: SimTime) {
        let place = &mut self.places[place];
        if place.round < round {
            place.round = round;
            place.records.clear();
        }
    }

    /// All bids of a robot count as taken back then.
    fn strike(&mut self, robot: RobotId, then: SimTime, beliefs: &mut Beliefs) {
        for (place, known) in self.places.iter_mut().enumerate() {
            let record = known.records.of(robot);
            if record.is_some_and(|record| record.claim.value > 0.0) {
                let none = Claim { robot, value: 0.0 };
                known.records.hear(none, then);
                beliefs.set_others(place, known.records.best_but(self.me));
            }
        }
    }

    /// Dates what has become of the robot's own bids in this step, and what others have wrong about them.
    fn note_own(&mut self, now: SimTime, beliefs: &Beliefs) {
        let robot = self.me;
        for (place, entry) in beliefs.entries().iter().enumerate() {
            let records = &mut self.places[place].records;
            let own = entry.claim.filter(|claim| claim.robot == robot);
            let value = own.map_or(0.0, |claim| claim.value);
            let told = records.of(robot).map_or(0.0, |record| record.claim.value);
            if value != told {
                records.set(Claim { robot, value }, now);
            }
        }
    }

    /// FORGET: who has been silent for τ has nothing any more. Whether there is one.
    fn forget(&mut self, me: &Me, now: SimTime, beliefs: &mut Beliefs) -> bool {
        let is_silent = |known: &Known| now.since(known.sent) >= me.ceased_after;
        let mut is_gone = false;
        while let Some(at) = self.known.iter().position(is_silent) {
            let gone = self.known.remove(at).robot;
            self.strike(gone, now, beliefs);
            is_gone = true;
        }
        is_gone
    }
}

impl Consensus for Deltas {
    fn new(me: &Me, rules: &Rules, beliefs: &Beliefs) -> Self {
        Self {
            me: me.robot,
            repeat: rules.refresh,
            repeated: None,
            places: vec![Place::default(); beliefs.entries().len()],
            known: Vec::new(),
            next: 0,
        }
    }

    fn hear(
        &mut self,
        me: &Me,
        input: &Input<'_>,
        beliefs: &mut Beliefs,
        bundle: &mut Bundle,
    ) -> bool {
        let now = input.now;
        let mut has_changed = false;
        for (place, entry) in beliefs.entries().iter().enumerate() {
            self.renew(place, entry.round);
        }
        for broadcast in input.heard {
            let is_of_team = broadcast.sender.index() < me.team && broadcast.sender != me.robot;
            let is_fresh = broadcast.sent <= now && now.since(broadcast.sent) < me.ceased_after;
            if !is_of_team || !is_fresh {
                continue;
            }
            has_changed |= self.note(broadcast, beliefs);
            if let Content::Allocation(AllocationMessage::Deltas(deltas)) = &broadcast.body
                && self.is_new(broadcast)
            {
                for delta in &deltas.entries {
                    self.hear_entry(me, broadcast, delta, now, beliefs);
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

    fn say(&mut self, now: SimTime, beliefs: &mut Beliefs, say: &mut Vec<AllocationMessage>) {
        beliefs.yield_places();
        self.note_own(now, beliefs);
        let count = beliefs.entries().len();
        let is_due = |repeated| now.since(repeated) >= self.repeat;
        if self.repeated.is_none_or(is_due) {
            self.repeated = Some(now);
            for place in 0..count {
                match beliefs.entries()[place].claim {
                    Some(winner) => self.places[place].records.tell(winner.robot),
                    None => beliefs.tell(place),
                }
            }
        }
        let mut told: Vec<Delta> = Vec::new();
        // What does not go now goes in the next step.
        let most = DELTAS_MAX * (1 + beliefs.tasks().len());
        for place in (0..count).map(|place| (self.next + place) % count) {
            let entry = &beliefs.entries()[place];
            let delta = |claim, made| Delta {
                belief: Belief {
                    task: entry.task,
                    round: entry.round,
                    claim,
                },
                slot: entry.slot,
                made,
            };
            let before = told.len();
            let records = self.places[place].records.iter_mut();
            let unsaid = records.filter(|record| record.is_unsaid);
            for record in unsaid.take(most - before) {
                record.is_unsaid = false;
                told.push(delta(Some(record.claim), record.made));
            }
            // Of a place that nobody has the round is told.
            let is_free = entry.is_unsaid && entry.claim.is_none();
            if is_free && told.len() == before && before < most {
                told.push(delta(None, SimTime::ZERO));
            }
            if told.len() == most {
                self.next = place;
                break;
            }
            beliefs.note_said(place);
        }
        let messages = told.chunks(DELTAS_MAX).map(|entries| Message {
            entries: entries.to_vec(),
        });
        say.extend(messages.map(AllocationMessage::Deltas));
    }
}
