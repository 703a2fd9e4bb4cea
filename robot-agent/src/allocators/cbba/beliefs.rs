//! What a robot believes about its tasks: who has each, by which bid (y and z of the paper). A task that several may do has so many
//! places, each of which is negotiated by itself; one that all may do at once has none, and nobody has to ask for it.

use alliance_proto::allocation::consensus::Claim;
use alliance_proto::ids::{RobotId, TaskId};
use alliance_proto::time::SimTime;

use crate::allocator::{Choice, Me};

/// Beliefs about one place of one task.
#[derive(Clone, Debug, PartialEq)]
pub struct Entry {
    /// The task.
    pub task: TaskId,
    /// Which of its places.
    pub slot: u16,
    /// Since when the task has been due.
    pub round: SimTime,
    /// Who has it.
    pub claim: Option<Claim>,
    /// Who would have it but for the robot itself, where that is known.
    others: Option<Claim>,
    /// Whether this is news to the team.
    pub is_unsaid: bool,
}

/// A task that the robot has a behavior for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct OwnTask {
    /// The task.
    pub task: TaskId,
    /// Higher goes first.
    pub priority: i32,
    /// Its entries are `entries[first..first + slots]`.
    first: usize,
    slots: usize,
}

/// All entries of a robot, by task and slot.
#[derive(Clone, Debug)]
pub struct Beliefs {
    me: RobotId,
    tasks: Vec<OwnTask>,
    entries: Vec<Entry>,
    /// Whether an entry has changed since this was last asked.
    has_changed: bool,
}

impl Beliefs {
    /// Nobody is believed to have anything.
    pub fn new(me: &Me) -> Self {
        let mut behaviors = me.behaviors.clone();
        behaviors.sort_by_key(|own| own.task);
        behaviors.dedup_by_key(|own| own.task);
        let mut entries = Vec::new();
        let mut tasks = Vec::with_capacity(behaviors.len());
        for own in behaviors {
            let slots = if own.max_robots < me.team {
                own.max_robots
            } else {
                0
            };
            tasks.push(OwnTask {
                task: own.task,
                priority: own.priority,
                first: entries.len(),
                slots,
            });
            entries.extend((0..slots).map(|slot| Entry {
                task: own.task,
                slot: slot as u16,
                round: SimTime::ZERO,
                claim: None,
                others: None,
                is_unsaid: false,
            }));
        }
        Self {
            me: me.robot,
            tasks,
            entries,
            has_changed: true,
        }
    }

    /// The robot's tasks, in ascending order.
    pub fn tasks(&self) -> &[OwnTask] {
        &self.tasks
    }

    /// All entries, by task and slot.
    pub fn entries(&self) -> &[Entry] {
        &self.entries
    }

    /// Where the entry of a task's place is; `None` if the robot does not negotiate it.
    pub fn find(&self, task: TaskId, slot: u16) -> Option<usize> {
        let key = |entry: &Entry| (entry.task, entry.slot);
        self.entries.binary_search_by_key(&(task, slot), key).ok()
    }

    /// Believes something else.
    pub fn set(&mut self, place: usize, claim: Option<Claim>) {
        let entry = &mut self.entries[place];
        if entry.claim != claim {
            entry.claim = claim;
            entry.is_unsaid = true;
            self.has_changed = true;
        }
    }

    /// The largest bid of others is a different one now; the robot's own counts if it is larger.
    pub fn set_others(&mut self, place: usize, others: Option<Claim>) {
        let entry = &mut self.entries[place];
        entry.others = others;
        let own = entry.claim.filter(|claim| claim.robot == self.me);
        let is_kept = own.is_some_and(|own| others.is_none_or(|other| own.beats(&other)));
        if !is_kept {
            self.set(place, others);
        }
    }

    /// The robot bids for a place. Whether it has it so; if not, it believes what others bid.
    pub fn bid(&mut self, place: usize, value: f32) -> bool {
        let own = Claim {
            robot: self.me,
            value,
        };
        let others = self.entries[place].others;
        let is_won = others.is_none_or(|other| own.beats(&other));
        self.set(place, if is_won { Some(own) } else { others });
        is_won
    }

    /// A place that nobody has any more goes to the best of the others, now that the robot has made its choice. Not sooner: a robot that
    /// gives up everything and chooses anew would else go from one place of a task to another, and have both in the eyes of others.
    pub fn yield_places(&mut self) {
        for place in 0..self.entries.len() {
            let entry = &self.entries[place];
            if entry.claim.is_none() && entry.others.is_some() {
                self.set(place, entry.others);
            }
        }
    }

    /// A newer round voids what was believed.
    pub fn renew(&mut self, place: usize, round: SimTime) {
        let entry = &mut self.entries[place];
        if entry.round < round {
            entry.round = round;
            entry.claim = None;
            entry.others = None;
            entry.is_unsaid = true;
            self.has_changed = true;
        }
    }

    /// Takes over the rounds that the robot itself knows.
    pub fn note_rounds(&mut self, choices: &[Choice]) {
        for choice in choices {
            for place in self.places(choice.task) {
                self.renew(place, choice.round);
            }
        }
    }

    /// Takes everything from a robot.
    pub fn strike(&mut self, robot: RobotId, mut concerns: impl FnMut(&Entry) -> bool) {
        for place in 0..self.entries.len() {
            let entry = &self.entries[place];
            if entry.claim.is_some_and(|claim| claim.robot == robot) && concerns(entry) {
                self.set(place, None);
            }
        }
    }

    /// The entries of a task.
    fn places(&self, task: TaskId) -> std::ops::Range<usize> {
        match self.tasks.binary_search_by_key(&task, |own| own.task) {
            Ok(own) => self.tasks[own].first..self.tasks[own].first + self.tasks[own].slots,
            Err(_) => 0..0,
        }
    }

    /// Whether the robot itself is believed to have that.
    pub fn is_mine(&self, place: usize) -> bool {
        self.entries[place]
            .claim
            .is_some_and(|claim| claim.robot == self.me)
    }

    /// Who has a task; of several the one in the first place.
    pub fn holder(&self, task: TaskId) -> Option<RobotId> {
        let entries = &self.entries[self.places(task)];
        entries
            .iter()
            .find_map(|entry| entry.claim)
            .map(|claim| claim.robot)
    }

    /// Which place of a task a bid wins: the one that is held by the worst claim, if it beats that.
    pub fn opening(&self, own: &OwnTask, value: f32) -> Option<Opening> {
        if own.slots == 0 {
            return Some(Opening { place: None });
        }
        let places = own.first..own.first + own.slots;
        let worst = places.reduce(|worst, place| {
            match (self.entries[worst].claim, self.entries[place].claim) {
                (Some(worse), Some(claim)) if worse.beats(&claim) => place,
                (Some(_), None) => place,
                _ => worst,
            }
        })?;
        let bid = Claim {
            robot: self.me,
            value,
        };
        let is_won = self.entries[worst]
            .claim
            .is_none_or(|holder| bid.beats(&holder));
        is_won.then_some(Opening { place: Some(worst) })
    }

    /// Whether anything has changed since the last call.
    pub fn take_changed(&mut self) -> bool {
        std::mem::take(&mut self.has_changed)
    }

    /// An entry is to be told, though it has not changed.
    pub fn tell(&mut self, place: usize) {
        self.entries[place].is_unsaid = true;
    }

    /// An entry has been told.
    pub fn note_said(&mut self, place: usize) {
        self.entries[place].is_unsaid = false;
    }
}

/// A place that a bid wins; a task that is not negotiated has room without a place.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Opening {
    /// Its entry.
    pub place: Option<usize>,
}
