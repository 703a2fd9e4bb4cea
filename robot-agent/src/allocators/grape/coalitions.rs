//! Coalitions of robots with different skills. Robots join a group of tasks as a whole, and its tasks are slots for them.

use std::collections::BTreeMap;
use std::sync::Arc;

use scenario::fill_slots;
use scenario::ids::{RobotId, TaskId};

use super::partition::Partition;
use crate::allocator::TaskBrief;

/// The tasks that robots must execute at the same time, by the first of them.
#[derive(Clone, Debug)]
pub struct Coalitions {
    briefs: Arc<[TaskBrief]>,
    slots: Arc<BTreeMap<TaskId, Vec<TaskId>>>,
}

impl Coalitions {
    pub fn new(briefs: &Arc<[TaskBrief]>) -> Self {
        let mut slots: BTreeMap<TaskId, Vec<TaskId>> = BTreeMap::new();
        for (brief, task) in briefs.iter().zip((0..).map(TaskId)) {
            if let Some(first) = brief.coalition {
                slots.entry(first).or_default().push(task);
            }
        }
        Self {
            briefs: Arc::clone(briefs),
            slots: Arc::new(slots),
        }
    }

    /// Returns the task that represents a task in partitions: the first one of its coalition.
    pub fn joined_task(&self, task: TaskId) -> TaskId {
        self.briefs[task.index()].coalition.unwrap_or(task)
    }

    /// Returns the number of tasks that robots can join.
    pub fn count(&self) -> usize {
        let tasks = self.briefs.iter().zip((0..).map(TaskId));
        tasks
            .filter(|(brief, task)| brief.coalition.is_none_or(|first| first == *task))
            .count()
    }

    /// Returns the robot in each slot of a joined task, from its members and possibly one more robot; `None` if its robots
    /// need no different skills.
    fn filled(
        &self,
        joined: TaskId,
        partition: &Partition,
        more: Option<RobotId>,
    ) -> Option<Vec<Option<RobotId>>> {
        let slots = self.slots.get(&joined)?;
        let members = partition
            .members_of(joined)
            .filter(|member| Some(*member) != more);
        let robots = members.chain(more).map(|robot| (robot, None));
        let can_fill = |robot: RobotId, slot: usize| {
            self.briefs[slots[slot].index()]
                .robots
                .binary_search(&robot)
                .is_ok()
        };
        Some(fill_slots(slots.len(), robots, can_fill))
    }

    /// Returns the number of slots without a robot if this robot joins; `None` if no slot is left for it. 0 for tasks without
    /// slots.
    pub fn missing_with(
        &self,
        joined: TaskId,
        partition: &Partition,
        robot: RobotId,
    ) -> Option<usize> {
        let Some(filled) = self.filled(joined, partition, Some(robot)) else {
            return Some(0);
        };
        let missing = filled.iter().filter(|member| member.is_none()).count();
        filled.contains(&Some(robot)).then_some(missing)
    }

    /// Returns whether robots with different skills join this task.
    pub fn has_slots(&self, joined: TaskId) -> bool {
        self.slots.contains_key(&joined)
    }

    /// Returns the task of a member's slot.
    pub fn slot_of(&self, joined: TaskId, partition: &Partition, robot: RobotId) -> Option<TaskId> {
        let filled = self.filled(joined, partition, None)?;
        let slot = filled.iter().position(|member| *member == Some(robot))?;
        Some(self.slots[&joined][slot])
    }

    /// Returns the robot that holds a task: the robot in the slot, or the lowest member of a coalition of equal robots.
    pub fn holder(&self, task: TaskId, partition: &Partition) -> Option<RobotId> {
        let joined = self.joined_task(task);
        match self.filled(joined, partition, None) {
            Some(filled) => {
                let slot = self.slots[&joined].iter().position(|slot| *slot == task)?;
                filled[slot]
            }
            None => partition.members_of(joined).next(),
        }
    }
}
