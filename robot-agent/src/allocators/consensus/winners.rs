//! The winner and the winning bid of each task (z and y of the paper), as one robot stores them. A task for several
//! robots has several places, each negotiated separately. A task for all robots at once has no places and needs no
//! negotiation.

use proto::allocation::consensus::WinningBid;
use scenario::ids::{RobotId, TaskId};
use scenario::time::SimTime;

use crate::allocator::{Choice, SelfState};

/// The view of one place of one task.
#[derive(Clone, Debug, PartialEq)]
pub struct Entry {
    pub task: TaskId,
    /// The number of the place within the task.
    pub slot: u16,
    /// The time since which the task has been due.
    pub round: SimTime,
    pub claim: Option<WinningBid>,
    /// The best claim of the other robots, if it is known.
    others: Option<WinningBid>,
    /// True if the entry must be sent.
    pub must_send: bool,
}

/// A task for which the robot has a behavior.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct OwnTask {
    pub task: TaskId,
    /// The task's priority; higher goes first.
    pub priority: i32,
    /// The index of the first entry; the entries are `entries[first..first + slots]`.
    first: usize,
    slots: usize,
}

#[derive(Clone, Debug)]
pub struct Winners {
    me: RobotId,
    tasks: Vec<OwnTask>,
    entries: Vec<Entry>,
    /// True if an entry has changed since the last [`Winners::take_changed`].
    has_changed: bool,
}

impl Winners {
    pub fn new(me: &SelfState) -> Self {
        let mut behaviors = me.behaviors.clone();
        behaviors.sort_by_key(|behavior| behavior.task);
        behaviors.dedup_by_key(|behavior| behavior.task);
        let mut entries = Vec::new();
        let mut tasks = Vec::with_capacity(behaviors.len());
        for behavior in behaviors {
            let slots = if behavior.max_robots < me.team {
                behavior.max_robots
            } else {
                0
            };
            tasks.push(OwnTask {
                task: behavior.task,
                priority: behavior.priority,
                first: entries.len(),
                slots,
            });
            entries.extend((0..slots).map(|slot| Entry {
                task: behavior.task,
                slot: slot as u16,
                round: SimTime::ZERO,
                claim: None,
                others: None,
                must_send: false,
            }));
        }
        Self {
            me: me.robot,
            tasks,
            entries,
            has_changed: true,
        }
    }

    pub fn tasks(&self) -> &[OwnTask] {
        &self.tasks
    }

    pub fn entries(&self) -> &[Entry] {
        &self.entries
    }

    /// Returns the index of the entry for a task's place; `None` if the robot does not negotiate it.
    pub fn find(&self, task: TaskId, slot: u16) -> Option<usize> {
        let key = |entry: &Entry| (entry.task, entry.slot);
        self.entries.binary_search_by_key(&(task, slot), key).ok()
    }

    /// Replaces a claim and marks a change for sending.
    pub fn set(&mut self, place: usize, claim: Option<WinningBid>) {
        let entry = &mut self.entries[place];
        if entry.claim != claim {
            entry.claim = claim;
            entry.must_send = true;
            self.has_changed = true;
        }
    }

    /// Stores the best claim of the other robots. The robot's own claim stays if it is larger.
    pub fn set_others(&mut self, place: usize, others: Option<WinningBid>) {
        let entry = &mut self.entries[place];
        entry.others = others;
        let own = entry.claim.filter(|claim| claim.robot == self.me);
        let is_kept = own.is_some_and(|own| others.is_none_or(|other| own.beats(&other)));
        if !is_kept {
            self.set(place, others);
        }
    }

    /// Bids for a place. Returns whether the bid wins; otherwise the best other claim is stored.
    pub fn bid(&mut self, place: usize, value: f32) -> bool {
        let own = WinningBid {
            robot: self.me,
            value,
        };
        let others = self.entries[place].others;
        let is_won = others.is_none_or(|other| own.beats(&other));
        self.set(place, if is_won { Some(own) } else { others });
        is_won
    }

    /// Gives each place without a winner to the best other claim. Called after the robot has made its choice: earlier,
    /// others could see the robot in two places of a task.
    pub fn give_free_places(&mut self) {
        for place in 0..self.entries.len() {
            let entry = &self.entries[place];
            if entry.claim.is_none() && entry.others.is_some() {
                self.set(place, entry.others);
            }
        }
    }

    /// Clears the claims if `round` is newer.
    pub fn start_round(&mut self, place: usize, round: SimTime) {
        let entry = &mut self.entries[place];
        if entry.round < round {
            entry.round = round;
            entry.claim = None;
            entry.others = None;
            entry.must_send = true;
            self.has_changed = true;
        }
    }

    pub fn apply_rounds(&mut self, choices: &[Choice]) {
        for choice in choices {
            for place in self.places(choice.task) {
                self.start_round(place, choice.round);
            }
        }
    }

    /// Removes a robot's claims from all entries for which `concerns` is true.
    pub fn remove_claims_of(&mut self, robot: RobotId, mut concerns: impl FnMut(&Entry) -> bool) {
        for place in 0..self.entries.len() {
            let entry = &self.entries[place];
            if entry.claim.is_some_and(|claim| claim.robot == robot) && concerns(entry) {
                self.set(place, None);
            }
        }
    }

    fn places(&self, task: TaskId) -> std::ops::Range<usize> {
        match self.tasks.binary_search_by_key(&task, |own| own.task) {
            Ok(own) => self.places_of(&self.tasks[own]),
            Err(_) => 0..0,
        }
    }

    /// Returns the indices of a task's entries; none for a task without negotiation.
    pub fn places_of(&self, own: &OwnTask) -> std::ops::Range<usize> {
        own.first..own.first + own.slots
    }

    pub fn is_mine(&self, place: usize) -> bool {
        self.entries[place]
            .claim
            .is_some_and(|claim| claim.robot == self.me)
    }

    /// Returns the holder of a task; of several, the one in the first place.
    pub fn holder(&self, task: TaskId) -> Option<RobotId> {
        let entries = &self.entries[self.places(task)];
        entries
            .iter()
            .find_map(|entry| entry.claim)
            .map(|claim| claim.robot)
    }

    /// Returns the place that a bid wins: the one with the lowest claim, if the bid beats it.
    pub fn winnable_place(&self, own: &OwnTask, value: f32) -> Option<Opening> {
        if own.slots == 0 {
            return Some(Opening { place: None });
        }
        let places = self.places_of(own);
        let worst = places.reduce(|worst, place| {
            match (self.entries[worst].claim, self.entries[place].claim) {
                (Some(worse), Some(claim)) if worse.beats(&claim) => place,
                (Some(_), None) => place,
                _ => worst,
            }
        })?;
        let bid = WinningBid {
            robot: self.me,
            value,
        };
        let is_won = self.entries[worst]
            .claim
            .is_none_or(|holder| bid.beats(&holder));
        is_won.then_some(Opening { place: Some(worst) })
    }

    pub fn take_changed(&mut self) -> bool {
        std::mem::take(&mut self.has_changed)
    }

    pub fn mark_for_sending(&mut self, place: usize) {
        self.entries[place].must_send = true;
    }

    pub fn mark_sent(&mut self, place: usize) {
        self.entries[place].must_send = false;
    }
}

/// A place that a bid wins. A task without negotiation has room but no place.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Opening {
    pub place: Option<usize>,
}
