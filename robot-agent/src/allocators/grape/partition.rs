//! The coalition of each robot, exchanged as one value. The partition with more decisions wins; a tie goes to the
//! larger stamp (the D-mutex of Jang, Shin, Tsourdos 2018).

use std::cmp::Ordering;

use proto::allocation::grape::{CoalitionMember, CoalitionPartition as Message, MEMBERS_MAX};
use scenario::ids::{RobotId, TaskId};
use scenario::time::SimTime;

use crate::broken::is_broken;

#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Version {
    /// The number of decisions so far.
    pub evolution: u64,
    /// The random number drawn with the last decision.
    pub stamp: f64,
}

impl Version {
    pub fn is_newer_than(&self, other: &Self) -> bool {
        let by_stamp = || self.stamp.total_cmp(&other.stamp);
        self.evolution.cmp(&other.evolution).then_with(by_stamp) == Ordering::Greater
    }
}

#[derive(Clone, Debug, Default, PartialEq)]
pub struct Partition {
    pub version: Version,
    /// The robots with a task, in ascending order.
    members: Vec<CoalitionMember>,
}

#[derive(Clone, Debug, PartialEq)]
struct Incomplete {
    version: Version,
    parts: Vec<Option<Vec<CoalitionMember>>>,
}

/// The received parts of the newest partition.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PartReceiver(Option<Incomplete>);

impl Partition {
    pub fn task_of(&self, robot: RobotId) -> Option<TaskId> {
        let at = self.place(robot).ok()?;
        Some(self.members[at].task)
    }

    pub fn other_members(&self, task: TaskId, me: RobotId) -> usize {
        self.members_of(task).filter(|robot| *robot != me).count()
    }

    /// Returns the members of a coalition, by rank.
    pub fn members_of(&self, task: TaskId) -> impl Iterator<Item = RobotId> {
        let members = self.members.iter();
        members
            .filter(move |member| member.task == task)
            .map(|member| member.robot)
    }

    pub fn move_robot(&mut self, robot: RobotId, task: Option<TaskId>, seen: SimTime) {
        match (self.place(robot), task) {
            (Ok(at), Some(task)) => self.members[at] = CoalitionMember { robot, task, seen },
            (Ok(at), None) => {
                self.members.remove(at);
            }
            (Err(at), Some(task)) => self
                .members
                .insert(at, CoalitionMember { robot, task, seen }),
            (Err(_), None) => {}
        }
    }

    pub fn record_sign_of_life(&mut self, robot: RobotId, seen: SimTime) {
        if let Ok(at) = self.place(robot) {
            let member = &mut self.members[at];
            member.seen = member.seen.max(seen);
        }
    }

    /// Removes the members without a sign of life for τ for which `has_met` is true. Returns whether there were any.
    pub fn remove_silent(
        &mut self,
        now: SimTime,
        tau: SimTime,
        has_met: impl Fn(RobotId) -> bool,
    ) -> bool {
        let before = self.members.len();
        self.members
            .retain(|member| now.since(member.seen) < tau || !has_met(member.robot));
        self.members.len() < before
    }

    /// Merges the signs of life that another robot reports.
    fn merge_seen(&mut self, members: &[CoalitionMember], now: SimTime) {
        // Times in the future are invalid.
        for member in members.iter().filter(|member| member.seen <= now) {
            self.record_sign_of_life(member.robot, member.seen);
        }
    }

    /// Counts a decision and stores its stamp.
    pub fn count_decision(&mut self, stamp: f64) {
        if is_broken("grape-decisions-are-not-counted") {
            return;
        }
        self.version = Version {
            evolution: self.version.evolution.saturating_add(1),
            stamp,
        };
    }

    fn place(&self, robot: RobotId) -> Result<usize, usize> {
        self.members
            .binary_search_by_key(&robot, |member| member.robot)
    }

    /// Returns the number of messages that the partition needs.
    pub fn parts(&self) -> u16 {
        let parts = self.members.len().div_ceil(MEMBERS_MAX).max(1);
        // A team has at most 65,536 robots.
        parts as u16
    }

    pub fn message(&self, part: u16) -> Message {
        let mut chunks = self.members.chunks(MEMBERS_MAX);
        Message {
            evolution: self.version.evolution,
            stamp: self.version.stamp,
            part,
            parts: self.parts(),
            members: chunks.nth(usize::from(part)).unwrap_or_default().to_vec(),
        }
    }
}

impl PartReceiver {
    /// Stores a part. Returns whether it completed a newer partition, which then replaces `known`. Invalid messages are
    /// ignored.
    pub fn receive(
        &mut self,
        message: &Message,
        known: &mut Partition,
        (team, tasks): (usize, usize),
        now: SimTime,
    ) -> bool {
        let version = Version {
            evolution: message.evolution,
            stamp: message.stamp,
        };
        // Most messages repeat the known partition.
        if !version.is_newer_than(&known.version) {
            if version == known.version {
                known.merge_seen(&message.members, now);
            }
            return false;
        }
        let Some(mut members) = self.complete(version, message, team, tasks) else {
            return false;
        };
        for member in &mut members {
            member.seen = member.seen.min(now);
        }
        let mut newer = Partition { version, members };
        newer.merge_seen(&known.members, now);
        *known = newer;
        true
    }

    /// Returns all members if this was the last missing part.
    fn complete(
        &mut self,
        version: Version,
        message: &Message,
        team: usize,
        tasks: usize,
    ) -> Option<Vec<CoalitionMember>> {
        let parts = usize::from(message.parts);
        let in_team =
            |member: &CoalitionMember| member.robot.index() < team && member.task.index() < tasks;
        let is_sound = (0.0..1.0).contains(&version.stamp)
            && (1..=team.div_ceil(MEMBERS_MAX)).contains(&parts)
            && message.part < message.parts
            && message.members.len() <= MEMBERS_MAX
            && message.members.iter().all(in_team);
        if !is_sound {
            return None;
        }
        let is_newer = |other: &Incomplete| version.is_newer_than(&other.version);
        if self.0.as_ref().is_none_or(is_newer) {
            self.0 = Some(Incomplete {
                version,
                parts: vec![None; parts],
            });
        }
        let incomplete = self.0.as_mut()?;
        if incomplete.version != version || incomplete.parts.len() != parts {
            return None;
        }
        incomplete.parts[usize::from(message.part)] = Some(message.members.clone());
        let all: Option<Vec<Vec<CoalitionMember>>> = incomplete.parts.iter().cloned().collect();
        let members = all?.concat();
        self.0 = None;
        let is_sorted = members.is_sorted_by(|a, b| a.robot < b.robot);
        is_sorted.then_some(members)
    }
}
