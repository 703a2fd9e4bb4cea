//! The situational awareness of a robot: the costs of its teammates, from their messages.

use std::ops::Range;

use proto::allocation::AllocationMessage;
use proto::allocation::awareness::{Awareness as Message, TaskCost};
use proto::allocation::consensus::BLOCK_TASKS;
use proto::team::BroadcastContent;
use scenario::ids::{Incarnation, RobotId};
use scenario::time::SimTime;

use crate::allocator::{Input, SelfState};
use crate::allocators::cbba::Bidder;
use crate::allocators::consensus::known::Known;
use crate::allocators::consensus::tables::Tables;
use crate::allocators::consensus::winners::{OwnTask, Winners};

/// The latest costs of one teammate, by the index of the task in [`Winners::tasks`].
#[derive(Clone, Debug, Default)]
pub struct TeammateCosts {
    /// The incarnation and sequence number of its latest message.
    latest: Option<(Incarnation, u64)>,
    /// The costs by task; `None` for a task that it cannot execute now. Empty before the first message.
    pub costs: Vec<Option<TaskCost>>,
}

#[derive(Clone, Debug)]
pub struct Awareness {
    tasks: Vec<OwnTask>,
    teammates: Known<TeammateCosts>,
    /// The numbers of the blocks of the robot's tasks.
    blocks: Vec<u32>,
    /// The number of blocks that must still be sent, from the end of the list.
    unsent: usize,
    last_sent: Option<SimTime>,
}

impl Awareness {
    pub fn new(beliefs: &Winners) -> Self {
        let tasks = beliefs.tasks().to_vec();
        let mut blocks: Vec<u32> = tasks.iter().map(block_of).collect();
        blocks.dedup();
        Self {
            tasks,
            teammates: Known::default(),
            blocks,
            unsent: 0,
            last_sent: None,
        }
    }

    /// Returns the teammates whose costs are known, by rank.
    pub fn teammates(&self) -> impl Iterator<Item = (RobotId, &[Option<TaskCost>])> {
        let all = self.teammates.iter_all();
        all.map(|(robot, teammate)| (robot, &teammate.costs[..]))
    }

    /// Receives costs, and removes those older than `age_max`.
    pub fn receive(&mut self, me: &SelfState, input: &Input<'_>, age_max: SimTime) {
        let now = input.now;
        for broadcast in input.received {
            let (robot, sent) = (broadcast.sender, broadcast.sent);
            let BroadcastContent::Allocation(AllocationMessage::Awareness(message)) =
                &broadcast.body
            else {
                continue;
            };
            let is_fresh = sent <= now && now.since(sent) < age_max;
            let costs = message.costs.iter();
            let is_sound = costs
                .clone()
                .all(|cost| cost.cost_s.is_finite() && cost.worth.is_finite());
            if !me.is_teammate(robot) || !is_fresh || !is_sound {
                continue;
            }
            let number = (broadcast.incarnation, broadcast.seq);
            let known = self.teammates.get_mut(robot);
            if known.is_some_and(|known| known.latest >= Some(number)) {
                continue;
            }
            self.teammates.note(robot, sent);
            let range = self.range(message.block);
            let Some(known) = self.teammates.get_mut(robot) else {
                continue;
            };
            if known.latest.is_none_or(|latest| latest.0 < number.0) {
                known.costs = vec![None; self.tasks.len()];
            }
            known.latest = Some(number);
            let tasks = &self.tasks[range.clone()];
            let of_block = &mut known.costs[range];
            of_block.fill(None);
            for cost in costs {
                if let Ok(at) = tasks.binary_search_by_key(&cost.task, |task| task.task) {
                    of_block[at].get_or_insert(*cost);
                }
            }
        }
        while self.teammates.remove_silent(now, age_max).is_some() {}
    }

    /// Sends the robot's costs if it has planned anew or `refresh` has passed. Blocks for which a message
    /// is no longer allowed in this step are sent in the next one.
    pub fn send(
        &mut self,
        has_planned: bool,
        now: SimTime,
        refresh: SimTime,
        bidder: &Bidder<Tables>,
        input: &Input<'_>,
        messages: &mut Vec<AllocationMessage>,
    ) {
        let is_late = |last_sent| now.since(last_sent) >= refresh;
        if has_planned || self.last_sent.is_none_or(is_late) {
            self.unsent = self.blocks.len();
            self.last_sent = Some(now);
        }
        let most = 1 + self.tasks.len();
        self.send_rest(most, bidder, input, messages);
    }

    /// Sends the remaining blocks, as far as `most` messages are allowed.
    pub fn send_rest(
        &mut self,
        most: usize,
        bidder: &Bidder<Tables>,
        input: &Input<'_>,
        messages: &mut Vec<AllocationMessage>,
    ) {
        let mut offers = Vec::new();
        while self.unsent > 0 && messages.len() < most {
            let block = self.blocks[self.blocks.len() - self.unsent];
            self.unsent -= 1;
            let tasks = &self.tasks[self.range(block)];
            bidder.utilities(input).offers(tasks, &mut offers);
            let costs = tasks.iter().zip(&offers).filter_map(|(task, offer)| {
                offer.map(|offer| TaskCost {
                    task: task.task,
                    cost_s: offer.cost_s,
                    worth: offer.worth,
                })
            });
            messages.push(AllocationMessage::Awareness(Message {
                block,
                costs: costs.collect(),
            }));
        }
    }

    /// Returns the indices of the tasks of a block.
    fn range(&self, block: u32) -> Range<usize> {
        let first = self.tasks.partition_point(|task| block_of(task) < block);
        let end = self.tasks.partition_point(|task| block_of(task) <= block);
        first..end
    }
}

fn block_of(task: &OwnTask) -> u32 {
    task.task.0 / BLOCK_TASKS
}
