//! Crews: the robots that fill the slots of a point. The work proceeds in a step only if each slot has a robot.

use std::collections::{BTreeMap, BTreeSet};

use scenario::ids::{RobotId, TaskId};
use scenario::time::SimTime;
use scenario::{Scenario, Setup};

use crate::service::data::{ServiceSection, Slots, crew_reach_m};

/// The time for which a team waits without motion and work until this counts as a deadlock.
const DEADLOCK_TIME: SimTime = SimTime(5000);

/// The slots of a run, and the skill of each robot for each of them.
#[derive(Debug)]
pub(super) struct Crews {
    pub slots: Slots,
    /// The reach of a point with several slots, m.
    pub reach_m: f32,
    /// By name of the skill, then by rank.
    skills: BTreeMap<String, Vec<f64>>,
    names: Vec<String>,
}

impl Crews {
    pub fn new(setup: &Setup) -> Self {
        let scenario: &Scenario = &setup.scenario;
        let slots = Slots::new(ServiceSection::of(scenario));
        let needed = slots.iter().flat_map(|(_, slots)| slots);
        let needed: BTreeSet<&String> = needed.map(|slot| &slot.skill).collect();
        let of_skill = |name: &String| {
            let robots = scenario.robots.iter();
            let skills = robots.map(|robot| robot.skill(name).unwrap_or(1.0));
            (name.clone(), skills.collect())
        };
        Self {
            skills: needed.into_iter().map(of_skill).collect(),
            names: scenario
                .robots
                .iter()
                .map(|robot| robot.name.clone())
                .collect(),
            slots,
            reach_m: crew_reach_m(scenario),
        }
    }

    /// Returns the point of a robot's work, and the slot if the point has slots.
    pub fn place(&self, task: u16) -> (u16, Option<usize>) {
        match self.slots.of_task(TaskId(task)) {
            Some((point, slot)) => (point, Some(slot)),
            None => (task, None),
        }
    }

    /// Returns the skill of a robot for a slot, and the name of the skill.
    pub fn skill(&self, robot: RobotId, point: u16, slot: usize) -> (f64, &str) {
        let name = &self.slots.of_point(point)[slot].skill;
        (self.skills[name][robot.index()], name)
    }

    /// Returns the names of robots, such as `r1, r4`.
    pub fn names(&self, crew: &[RobotId]) -> String {
        let names: Vec<&str> = crew
            .iter()
            .map(|robot| self.names[robot.index()].as_str())
            .collect();
        names.join(", ")
    }
}

/// The robots at points with slots in one step.
#[derive(Clone, Debug, Default)]
pub(super) struct Gathering {
    at_point: BTreeMap<u16, Vec<Option<Member>>>,
}

#[derive(Clone, Copy, Debug)]
pub(super) struct Member {
    pub robot: RobotId,
    /// True if the robot worked at the point in the previous step.
    pub has_worked: bool,
}

impl Gathering {
    /// Lets a robot fill a slot of a point with this number of slots. A robot at work keeps its slot. Returns the robot
    /// that is in excess, if any.
    pub fn fill(&mut self, point: u16, slot: usize, slots: usize, new: Member) -> Option<RobotId> {
        let crew = self.at_point.entry(point);
        let member = &mut crew.or_insert_with(|| vec![None; slots])[slot];
        match member {
            Some(known) if known.has_worked || !new.has_worked => Some(new.robot),
            _ => member.replace(new).map(|displaced| displaced.robot),
        }
    }

    /// Removes and returns the complete crews by point, and whether a robot waits in an incomplete one.
    pub fn take(&mut self) -> (Vec<(u16, Vec<RobotId>)>, bool) {
        let mut complete = Vec::new();
        let mut waits = false;
        for (point, crew) in std::mem::take(&mut self.at_point) {
            let robots = crew.iter().map(|member| Some((*member)?.robot));
            match robots.collect::<Option<Vec<RobotId>>>() {
                Some(crew) => complete.push((point, crew)),
                None => waits = true,
            }
        }
        (complete, waits)
    }
}

/// The search for deadlocks: robots wait at points with slots, and no robot moves or works.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct DeadlockSearch {
    since: Option<SimTime>,
    /// True if the present deadlock is counted.
    is_counted: bool,
    pub count: u64,
}

impl DeadlockSearch {
    /// Records a step. Returns whether it completes a new deadlock.
    pub fn record(&mut self, is_stuck: bool, now: SimTime) -> bool {
        if !is_stuck {
            (self.since, self.is_counted) = (None, false);
            return false;
        }
        let since = *self.since.get_or_insert(now);
        let is_new = !self.is_counted && now.since(since) >= DEADLOCK_TIME;
        self.is_counted |= is_new;
        self.count += u64::from(is_new);
        is_new
    }
}
