//! Messages of the consensus and the removal of silent robots.
//!
//! The entries are sent in parts ([`Table`]), each a separate consensus with its own times of news s.

use proto::allocation::AllocationMessage;
use proto::allocation::consensus::{
    BLOCK_TASKS, BidTable, TIME_STAMPS_MAX, TableEntry, TimeStamp, WinningBid,
};
use proto::team::{Broadcast, BroadcastContent};
use scenario::ids::{Incarnation, RobotId};
use scenario::time::SimTime;

use super::known::Known;
use super::rules::{Action, Stamps, merge_action};
use super::winners::{Entry, Winners};
use crate::allocator::{Input, SelfState};
use crate::broken::is_broken;

/// The meaning of the bids in a table. A robot ignores tables of the other kind.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TableKind {
    /// Bids of CBAA, CBBA and HIPC, 0 or more.
    Bids,
    /// Negative impacts −γ of PI.
    Impacts,
}

impl TableKind {
    fn message(self, table: BidTable) -> AllocationMessage {
        match self {
            Self::Bids => AllocationMessage::Table(table),
            Self::Impacts => AllocationMessage::Impacts(table),
        }
    }

    fn table(self, content: &BroadcastContent) -> Option<&BidTable> {
        match (self, content) {
            (Self::Bids, BroadcastContent::Allocation(AllocationMessage::Table(table)))
            | (Self::Impacts, BroadcastContent::Allocation(AllocationMessage::Impacts(table))) => {
                Some(table)
            }
            _ => None,
        }
    }

    fn is_sound(self, bid: f32) -> bool {
        bid.is_finite() && (self == Self::Impacts || bid >= 0.0)
    }
}

/// One robot's side of the consensus.
#[derive(Clone, Debug)]
pub struct Tables {
    kind: TableKind,
    refresh: SimTime,
    parts: Vec<Part>,
}

#[derive(Clone, Debug)]
struct Part {
    block: u32,
    slot: u16,
    last_sent: Option<SimTime>,
    /// The send times s_im of the latest news, directly or through others, with the incarnation and sequence number of
    /// each robot's latest message that arrived directly.
    known: Known<Option<(Incarnation, u64)>>,
}

impl Part {
    fn has(&self, entry: &Entry) -> bool {
        (self.block, self.slot) == (entry.task.0 / BLOCK_TASKS, entry.slot)
    }

    fn table(&self, beliefs: &Winners, now: SimTime) -> BidTable {
        let entries = || beliefs.entries().iter().filter(|entry| self.has(entry));
        let mut all_news: Vec<TimeStamp> = self
            .known
            .iter()
            .map(|(robot, sent)| TimeStamp {
                robot,
                // News older than τ has been removed.
                age_ms: u32::try_from(now.since(sent).0).unwrap_or(u32::MAX),
            })
            .collect();
        if all_news.len() > TIME_STAMPS_MAX {
            // A receiver does not adopt a claim without news of its winner, so winners go first.
            let is_winner = |robot| {
                let mut claims = entries().filter_map(|entry| entry.claim);
                claims.any(|claim| claim.robot == robot)
            };
            all_news.sort_by_key(|news| (!is_winner(news.robot), news.robot));
            all_news.truncate(TIME_STAMPS_MAX);
            all_news.sort_by_key(|news| news.robot);
        }
        let belief = |entry: &Entry| TableEntry {
            task: entry.task,
            round: entry.round,
            claim: entry.claim,
        };
        BidTable {
            block: self.block,
            slot: self.slot,
            beliefs: entries().map(belief).collect(),
            news: all_news,
        }
    }
}

/// The times of news in a part and in a message about it.
struct Both<'a> {
    part: &'a Part,
    table: &'a BidTable,
    sender: RobotId,
    sent: SimTime,
    /// The send time up to which news is too old: the robot in question counts as lost.
    lost_until: Option<SimTime>,
}

impl Stamps for Both<'_> {
    fn own_news(&self, robot: RobotId) -> Option<SimTime> {
        self.part.known.sent(robot)
    }

    fn sender_news(&self, robot: RobotId) -> Option<SimTime> {
        if robot == self.sender {
            return Some(self.sent);
        }
        let news = &self.table.news;
        let at = news.binary_search_by_key(&robot, |news| news.robot).ok()?;
        stamp(&news[at], self.sent).filter(|&sent| Some(sent) > self.lost_until)
    }
}

/// Returns the send time of news; `None` if it would be before the mission.
fn stamp(news: &TimeStamp, sent: SimTime) -> Option<SimTime> {
    sent.0.checked_sub(u64::from(news.age_ms)).map(SimTime)
}

impl Tables {
    /// Merges one message into the entries. Returns whether it contains the first news of a robot.
    fn receive_table(
        &mut self,
        me: &SelfState,
        broadcast: &Broadcast,
        table: &BidTable,
        now: SimTime,
        beliefs: &mut Winners,
    ) -> bool {
        let (sender, sent) = (broadcast.sender, broadcast.sent);
        let is_of_team = |robot: RobotId| robot.index() < me.team;
        let is_fresh = |sent: SimTime| sent <= now && now.since(sent) < me.ceased_after;
        let mut parts = self.parts.iter_mut();
        let Some(part) = parts.find(|part| (part.block, part.slot) == (table.block, table.slot))
        else {
            return false;
        };
        if sender == me.robot || !is_of_team(sender) || !is_fresh(sent) {
            return false;
        }
        let number = (broadcast.incarnation, broadcast.seq);
        if let Some(Some(latest)) = part.known.get_mut(sender) {
            if *latest >= number {
                return false;
            }
            if latest.0 < number.0 {
                beliefs.remove_claims_of(sender, |entry| part.has(entry));
            }
        }
        let stamps = Both {
            part,
            table,
            sender,
            sent,
            lost_until: now.0.checked_sub(me.ceased_after.0).map(SimTime),
        };
        for belief in &table.beliefs {
            let Some(place) = beliefs.find(belief.task, table.slot) else {
                continue;
            };
            let is_sound =
                |claim: WinningBid| is_of_team(claim.robot) && self.kind.is_sound(claim.value);
            let is_old = belief.round < beliefs.entries()[place].round;
            if is_old || belief.round > now || !belief.claim.is_none_or(is_sound) {
                continue;
            }
            beliefs.start_round(place, belief.round);
            let own_claim = beliefs.entries()[place].claim;
            match merge_action(me.robot, sender, belief.claim, own_claim, &stamps) {
                Action::Leave => {}
                Action::Update => beliefs.set(place, belief.claim),
                Action::Reset => beliefs.set(place, None),
            }
        }
        let mut is_first = part.known.note(sender, sent);
        if let Some(latest) = part.known.get_mut(sender) {
            *latest = Some(number);
        }
        for news in &table.news {
            if let Some(sent) = stamp(news, sent)
                && news.robot != me.robot
                && is_of_team(news.robot)
                && is_fresh(sent)
            {
                is_first |= part.known.note(news.robot, sent);
            }
        }
        is_first
    }

    /// Removes the claims of robots silent for τ. Returns whether there were any.
    fn forget(&mut self, me: &SelfState, now: SimTime, beliefs: &mut Winners) -> bool {
        let mut any_lost = false;
        for part in &mut self.parts {
            while let Some(lost) = part.known.remove_silent(now, me.ceased_after) {
                if !is_broken("hipc-keeps-claims-of-lost-robots") {
                    beliefs.remove_claims_of(lost, |entry| part.has(entry));
                }
                any_lost = true;
            }
        }
        any_lost
    }
}

impl Tables {
    /// Creates the state of a robot without news, which sends each part of its list at least every `refresh`.
    pub fn new(kind: TableKind, refresh: SimTime, beliefs: &Winners) -> Self {
        let mut keys: Vec<(u32, u16)> = beliefs
            .entries()
            .iter()
            .map(|entry| (entry.task.0 / BLOCK_TASKS, entry.slot))
            .collect();
        keys.sort_unstable();
        keys.dedup();
        let part = |(block, slot)| Part {
            block,
            slot,
            last_sent: None,
            known: Known::default(),
        };
        Self {
            kind,
            refresh,
            parts: keys.into_iter().map(part).collect(),
        }
    }

    /// Receives messages and removes silent robots (FORGET). Calls `after_each` after each message and after the removal.
    /// Returns whether a robot was added or lost.
    pub fn receive(
        &mut self,
        me: &SelfState,
        input: &Input<'_>,
        beliefs: &mut Winners,
        mut after_each: impl FnMut(&mut Winners),
    ) -> bool {
        let mut has_changed = false;
        for broadcast in input.received {
            if let Some(table) = self.kind.table(&broadcast.body) {
                has_changed |= self.receive_table(me, broadcast, table, input.now, beliefs);
                after_each(beliefs);
            }
        }
        if self.forget(me, input.now, beliefs) {
            has_changed = true;
            after_each(beliefs);
        }
        has_changed
    }

    /// Replaces the time between two broadcasts of the whole list.
    pub fn set_refresh(&mut self, refresh: SimTime) {
        self.refresh = refresh;
    }

    /// Sends each part of the list that has changed or is due.
    pub fn send(
        &mut self,
        now: SimTime,
        beliefs: &mut Winners,
        messages: &mut Vec<AllocationMessage>,
    ) {
        // The remaining parts are sent in the next step, the longest unsent part first.
        while messages.len() <= beliefs.tasks().len() {
            let is_due = |part: &&mut Part| {
                let is_late = |last_sent| {
                    now.since(last_sent) >= self.refresh
                        && !is_broken("cbba-broadcasts-only-changes")
                };
                let mut entries = beliefs.entries().iter();
                let has_news = |entry: &Entry| entry.must_send && part.has(entry);
                part.last_sent != Some(now)
                    && (part.last_sent.is_none_or(is_late) || entries.any(has_news))
            };
            let due = self.parts.iter_mut().filter(is_due);
            let Some(part) = due.min_by_key(|part| part.last_sent) else {
                return;
            };
            messages.push(self.kind.message(part.table(beliefs, now)));
            for place in 0..beliefs.entries().len() {
                if part.has(&beliefs.entries()[place]) {
                    beliefs.mark_sent(place);
                }
            }
            part.last_sent = Some(now);
        }
    }
}
