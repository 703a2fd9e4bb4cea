//! The holder of each place of each task, as one robot stores it. A task for several robots has several places, each
//! auctioned separately. A task for all robots at once has no places and needs no auction.

use proto::allocation::ssi::{AWARD_BLOCK_TASKS, AuctionBid, Award};
use scenario::ids::{RobotId, TaskId};
use scenario::time::SimTime;

use crate::allocator::{Choice, SelfState};

/// A robot that holds a place, with its award.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Holder {
    pub robot: RobotId,
    pub award: Award,
}

impl Holder {
    /// Returns whether this robot keeps the place against another one. The earlier auction wins, then the lower bid,
    /// then the lower rank.
    pub fn beats(&self, other: &Self) -> bool {
        let by_auction = self.award.auction.cmp(&other.award.auction);
        let by_cost = self.award.bid.cost.total_cmp(&other.award.bid.cost);
        let order = by_auction.then(by_cost);
        order.then(self.robot.cmp(&other.robot)).is_lt()
    }
}

/// One place of one task.
#[derive(Clone, Debug, PartialEq)]
pub struct Place {
    pub task: TaskId,
    /// The number of the place within the task.
    pub slot: u16,
    /// The time since which the task has been due.
    pub round: SimTime,
    pub holder: Option<Holder>,
}

/// A task for which the robot has a behavior.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct OwnTask {
    pub task: TaskId,
    /// The task's priority; higher goes first.
    pub priority: i32,
    /// The index of the first place; the places are `places[first..first + slots]`.
    first: usize,
    /// The number of places; 0 if the task is not auctioned.
    pub slots: usize,
}

#[derive(Clone, Debug)]
pub struct Awards {
    me: RobotId,
    tasks: Vec<OwnTask>,
    places: Vec<Place>,
    /// True if a holder has changed since the last [`Awards::take_changed`].
    has_changed: bool,
    /// The blocks in which the robot's own awards have changed since they were sent, in ascending order.
    unsent: Vec<u32>,
}

impl Awards {
    pub fn new(me: &SelfState) -> Self {
        let mut behaviors = me.behaviors.clone();
        behaviors.sort_by_key(|behavior| behavior.task);
        behaviors.dedup_by_key(|behavior| behavior.task);
        let mut places = Vec::new();
        let mut tasks = Vec::with_capacity(behaviors.len());
        for behavior in behaviors {
            let is_auctioned = behavior.max_robots < me.team;
            let slots = if is_auctioned { behavior.max_robots } else { 0 };
            tasks.push(OwnTask {
                task: behavior.task,
                priority: behavior.priority,
                first: places.len(),
                slots,
            });
            places.extend((0..slots).map(|slot| Place {
                task: behavior.task,
                slot: slot as u16,
                round: SimTime::ZERO,
                holder: None,
            }));
        }
        Self {
            me: me.robot,
            tasks,
            places,
            has_changed: true,
            unsent: Vec::new(),
        }
    }

    pub fn tasks(&self) -> &[OwnTask] {
        &self.tasks
    }

    pub fn place(&self, place: usize) -> &Place {
        &self.places[place]
    }

    /// Returns the index in [`Awards::tasks`].
    pub fn own(&self, task: TaskId) -> Option<usize> {
        self.tasks.binary_search_by_key(&task, |own| own.task).ok()
    }

    /// Returns the index of a task's place; `None` if the robot lacks the behavior or the place does not exist.
    pub fn find(&self, task: TaskId, slot: u16) -> Option<usize> {
        let key = |place: &Place| (place.task, place.slot);
        self.places.binary_search_by_key(&(task, slot), key).ok()
    }

    /// Returns the first place of a task without a holder; `None` as well if the robot holds another place of the task.
    pub fn free_place(&self, own: usize) -> Option<usize> {
        let OwnTask { first, slots, .. } = self.tasks[own];
        let mut places = first..first + slots;
        if places.clone().any(|place| self.is_mine(place)) {
            return None;
        }
        places.find(|&place| self.places[place].holder.is_none())
    }

    pub fn is_mine(&self, place: usize) -> bool {
        self.places[place]
            .holder
            .is_some_and(|holder| holder.robot == self.me)
    }

    /// Returns the holder of a task; of several, the one in the first place.
    pub fn holder(&self, task: TaskId) -> Option<RobotId> {
        let OwnTask { first, slots, .. } = self.tasks[self.own(task)?];
        let mut places = self.places[first..first + slots].iter();
        places.find_map(|place| place.holder).map(|held| held.robot)
    }

    /// Replaces the holder of a place.
    pub fn set(&mut self, place: usize, holder: Option<Holder>) {
        let before = self.places[place].holder;
        if before == holder {
            return;
        }
        let me = self.me;
        let is_own = |holder: Option<Holder>| holder.is_some_and(|holder| holder.robot == me);
        if is_own(before) || is_own(holder) {
            let block = self.places[place].task.0 / AWARD_BLOCK_TASKS;
            if let Err(at) = self.unsent.binary_search(&block) {
                self.unsent.insert(at, block);
            }
        }
        self.places[place].holder = holder;
        self.has_changed = true;
    }

    /// Removes the holder if `round` is newer.
    fn start_round(&mut self, place: usize, round: SimTime) {
        if self.places[place].round < round {
            self.set(place, None);
            self.places[place].round = round;
            self.has_changed = true;
        }
    }

    pub fn apply_rounds(&mut self, choices: &[Choice]) {
        for choice in choices {
            if let Some(own) = self.own(choice.task) {
                let OwnTask { first, slots, .. } = self.tasks[own];
                for place in first..first + slots {
                    self.start_round(place, choice.round);
                }
            }
        }
    }

    /// Removes all awards of a robot.
    pub fn remove_holder(&mut self, robot: RobotId) {
        for place in 0..self.places.len() {
            if self.places[place]
                .holder
                .is_some_and(|held| held.robot == robot)
            {
                self.set(place, None);
            }
        }
    }

    /// Stores the sender's awards in a block, and removes its earlier awards that the message does not contain.
    pub fn receive(&mut self, sender: RobotId, message: &AuctionBid, now: SimTime) {
        let from = TaskId(message.block.saturating_mul(AWARD_BLOCK_TASKS));
        let start = self.places.partition_point(|place| place.task < from);
        for place in start..self.places.len() {
            let Place { task, holder, .. } = self.places[place];
            if task.0 / AWARD_BLOCK_TASKS != message.block {
                break;
            }
            let is_of_sender = holder.filter(|held| held.robot == sender);
            if let Some(held) = is_of_sender
                && held.award.auction < message.auction
                && !message.awards.contains(&held.award)
            {
                self.set(place, None);
            }
        }
        for award in &message.awards {
            let Some(place) = self.find(award.bid.task, award.bid.slot) else {
                continue;
            };
            let is_sound = award.bid.cost.is_finite()
                && award.bid.cost >= 0.0
                && award.auction <= message.auction
                && award.bid.task.0 / AWARD_BLOCK_TASKS == message.block
                && (self.places[place].round..=now).contains(&award.round);
            if !is_sound {
                continue;
            }
            self.start_round(place, award.round);
            let holder = Holder {
                robot: sender,
                award: *award,
            };
            if self.places[place]
                .holder
                .is_none_or(|held| holder.beats(&held))
            {
                self.set(place, Some(holder));
            }
        }
    }

    pub fn take_changed(&mut self) -> bool {
        std::mem::take(&mut self.has_changed)
    }

    /// Returns the first block in which the robot's awards have changed since they were sent, and marks it as sent.
    pub fn take_unsent(&mut self) -> Option<u32> {
        (!self.unsent.is_empty()).then(|| self.unsent.remove(0))
    }

    /// Marks all blocks with an award of the robot for sending.
    pub fn mark_own_unsent(&mut self) {
        for place in 0..self.places.len() {
            if self.is_mine(place) {
                let block = self.places[place].task.0 / AWARD_BLOCK_TASKS;
                if let Err(at) = self.unsent.binary_search(&block) {
                    self.unsent.insert(at, block);
                }
            }
        }
    }

    /// Returns the robot's own awards in a block.
    pub fn of_block(&self, block: u32) -> Vec<Award> {
        let own = self.places.iter().filter_map(|place| place.holder);
        let own = own
            .filter(|held| held.robot == self.me)
            .map(|held| held.award);
        own.filter(|award| award.bid.task.0 / AWARD_BLOCK_TASKS == block)
            .collect()
    }
}
