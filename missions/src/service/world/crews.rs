//! Crews: the robots that fill the slots of a point. The work proceeds in a step only if each slot has a robot. Robots at a
//! point fill its slots by their skills, so that two robots with the same slot as their task need no message.

use std::collections::{BTreeMap, BTreeSet};

use scenario::ids::{RobotId, TaskId};
use scenario::time::SimTime;
use scenario::{Scenario, Setup, fill_slots};

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
    pub fn place(&self, task: u32) -> (u32, Option<usize>) {
        match self.slots.of_task(TaskId(task)) {
            Some((point, slot)) => (point, Some(slot)),
            None => (task, None),
        }
    }

    /// Returns the skill of a robot for a slot, and the name of the skill.
    pub fn skill(&self, robot: RobotId, point: u32, slot: usize) -> (f64, &str) {
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
    at_point: BTreeMap<u32, Vec<Member>>,
}

#[derive(Clone, Copy, Debug)]
pub(super) struct Member {
    pub robot: RobotId,
    /// The slot of the robot's task.
    pub slot: usize,
    /// True if the robot worked at the point in the previous step.
    pub has_worked: bool,
}

/// The robots at points with slots, after they have filled them.
#[derive(Debug, Default)]
pub(super) struct Gathered {
    /// The complete crews by point, in the order of slots.
    pub complete: Vec<(u32, Vec<RobotId>)>,
    /// The robots at points with a complete crew, or with skills only for slots that other robots fill.
    pub surplus: Vec<RobotId>,
    /// True if a robot waits in an incomplete crew.
    pub waits: bool,
}

impl Gathering {
    pub fn add(&mut self, point: u32, new: Member) {
        self.at_point.entry(point).or_default().push(new);
    }

    /// Removes the robots from all points and lets them fill the slots by their skills. Robots at work go first and keep
    /// their places. Each robot fills the slot of its task, if it can.
    pub fn take(&mut self, crews: &Crews) -> Gathered {
        let mut gathered = Gathered::default();
        for (point, mut members) in std::mem::take(&mut self.at_point) {
            members.sort_by_key(|member| (!member.has_worked, member.robot));
            let slots = crews.slots.of_point(point).len();
            let in_order = members
                .iter()
                .map(|member| (member.robot, Some(member.slot)));
            let crew = fill_slots(slots, in_order, |robot, slot| {
                crews.skill(robot, point, slot).0 > 0.0
            });
            let robots = members.iter().map(|member| member.robot);
            gathered
                .surplus
                .extend(robots.filter(|robot| !crew.contains(&Some(*robot))));
            match crew.into_iter().collect() {
                Some(crew) => gathered.complete.push((point, crew)),
                None => gathered.waits = true,
            }
        }
        gathered
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
