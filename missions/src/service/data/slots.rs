//! Slots: the places of a point that robots with different skills must fill at the same time.
//!
//! Each slot is a task of its own, so that an allocator that assigns one robot to one task can fill it. The first slot
//! of a point has the number of the point as its task. The other slots have the numbers after all points.

use std::collections::{BTreeMap, BTreeSet};

use scenario::ids::{RobotId, TaskId};
use scenario::limits::{check_name, whole};
use scenario::{BehaviorSpec, Catalog, KeyPath, Problem, Scenario, fill_slots};

use super::{MAX_KINDS, Point, SLOT, ServiceSection, TaskGranularity};

/// A slot of a point.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Slot {
    /// The task of the slot.
    pub task: TaskId,
    /// The skill that a robot must have to fill the slot.
    pub skill: String,
    /// The name of the task, such as `serve(p3-arm)`.
    pub name: String,
}

/// The slots of all points that need several skills at once.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Slots {
    /// The slots of each point, by number. Empty if no point has slots.
    of_point: Vec<Vec<Slot>>,
    /// The points and slots of the tasks after those of the points, in the order of the tasks.
    beyond_points: Vec<(u32, usize)>,
    /// The first task after those of the points.
    first_beyond: usize,
}

impl Slots {
    /// Numbers the slots of a section. Empty if no point states needs.
    #[must_use]
    pub fn new(section: &ServiceSection) -> Self {
        let mut slots = Self::default();
        if section.points.iter().all(|point| point.needs.is_empty()) {
            return slots;
        }
        slots.first_beyond = section.kinds_of_points().count() + section.spare as usize;
        for (point, number) in section.points.iter().zip(0..) {
            let mut of_point: Vec<Slot> = Vec::new();
            for (skill, count) in &point.needs {
                for copy in 1..=*count {
                    let name = match count {
                        1 => format!("serve(p{number}-{skill})"),
                        _ => format!("serve(p{number}-{skill}-{copy})"),
                    };
                    let task = if of_point.is_empty() {
                        TaskId(number)
                    } else {
                        let next = slots.first_beyond + slots.beyond_points.len();
                        slots.beyond_points.push((number, of_point.len()));
                        // The check of the scenario limits the number of tasks.
                        TaskId(next.min(u32::MAX as usize) as u32)
                    };
                    of_point.push(Slot {
                        task,
                        skill: skill.clone(),
                        name,
                    });
                }
            }
            slots.of_point.push(of_point);
        }
        slots
    }

    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.of_point.is_empty()
    }

    /// Returns the slots of a point; empty for a point without needs.
    #[must_use]
    pub fn of_point(&self, point: u32) -> &[Slot] {
        let slots = self.of_point.get(point as usize);
        slots.map_or(&[], Vec::as_slice)
    }

    /// Returns the points with slots, in ascending order, and their slots.
    pub fn iter(&self) -> impl Iterator<Item = (u32, &[Slot])> {
        let points = (0..).zip(self.of_point.iter().map(Vec::as_slice));
        points.filter(|(_, slots)| !slots.is_empty())
    }

    /// Returns the point and the index of the slot that a task fills; `None` for the task of a point without needs.
    #[must_use]
    pub fn of_task(&self, task: TaskId) -> Option<(u32, usize)> {
        let first = || !self.of_point(task.0).is_empty();
        match task.index().checked_sub(self.first_beyond) {
            Some(beyond) => self.beyond_points.get(beyond).copied(),
            None => first().then_some((task.0, 0)),
        }
    }

    /// Returns the point of a task.
    #[must_use]
    pub fn point(&self, task: TaskId) -> u32 {
        self.of_task(task).map_or(task.0, |(point, _)| point)
    }

    /// Returns the slots whose tasks follow those of the points, in the order of their tasks.
    pub fn beyond_points(&self) -> impl Iterator<Item = (u32, &Slot)> {
        let beyond = self.beyond_points.iter();
        beyond.map(|(point, slot)| (*point, &self.of_point(*point)[*slot]))
    }

    /// Returns the points whose slots the team cannot fill at the same time, with the largest number of slots that it
    /// can fill.
    #[must_use]
    pub fn unfillable(&self, scenario: &Scenario, catalog: &Catalog) -> Vec<(u32, usize)> {
        if self.is_empty() {
            return Vec::new();
        }
        let mut robots: BTreeMap<TaskId, Vec<RobotId>> = BTreeMap::new();
        for (robot, rank) in scenario.robots.iter().zip(0..) {
            for behavior in catalog.behaviors_of(robot) {
                let task = catalog.sets[behavior.index()].task;
                if self.of_task(task).is_some() {
                    robots.entry(task).or_default().push(RobotId(rank));
                }
            }
        }
        let points = self.iter().map(|(point, slots)| {
            let able = |slot: usize| robots.get(&slots[slot].task).map_or(&[][..], Vec::as_slice);
            let all: BTreeSet<RobotId> = (0..slots.len())
                .flat_map(|slot| able(slot).iter().copied())
                .collect();
            let all = all.into_iter().map(|robot| (robot, None));
            let can_fill = |robot: RobotId, slot: usize| able(slot).binary_search(&robot).is_ok();
            let filled = fill_slots(slots.len(), all, can_fill);
            (point, filled.iter().flatten().count())
        });
        points
            .filter(|(point, most)| *most < self.of_point(*point).len())
            .collect()
    }
}

/// Returns the tasks and behaviors of a section with slots: those of the points, then those of the other slots.
pub(super) fn catalog(section: &ServiceSection) -> (Vec<String>, Vec<BehaviorSpec>) {
    // A point that a fault adds may be of any kind.
    let spare = std::iter::repeat_n(MAX_KINDS, section.spare as usize);
    let kinds: Vec<usize> = section.kinds_of_points().chain(spare).collect();
    let slots = Slots::new(section);
    let (mut tasks, mut behaviors) = (Vec::new(), Vec::new());
    let mut add = |name: String, kind: u32, skill: Option<String>| {
        behaviors.push(BehaviorSpec {
            name: name.clone(),
            task: TaskId(tasks.len() as u32),
            kind,
            skill,
        });
        tasks.push(name);
    };
    for (kind, point) in kinds.iter().zip(0..) {
        match slots.of_point(point).first() {
            Some(slot) => add(
                slot.name.clone(),
                SLOT + *kind as u32,
                Some(slot.skill.clone()),
            ),
            None => {
                let skill = section.kinds.get(*kind).map(|kind| kind.name.clone());
                add(format!("serve(p{point})"), *kind as u32, skill);
            }
        }
    }
    for (point, slot) in slots.beyond_points() {
        let kind = SLOT + kinds[point as usize] as u32;
        add(slot.name.clone(), kind, Some(slot.skill.clone()));
    }
    (tasks, behaviors)
}

/// The largest number of robots that work together at a point.
const MOST_ROBOTS: u32 = 16;

/// Checks the skills and numbers that a point needs.
pub(super) fn check_needs(scenario: &Scenario, point: &Point, at: KeyPath) -> Result<(), Problem> {
    let section = ServiceSection::of(scenario);
    if point.has_needs() && section.tasks == TaskGranularity::Kinds {
        let what = "each slot is a task of its own, and the tasks are kinds";
        return Err(Problem::at(at, what, "set tasks = 'points'"));
    }
    for (skill, count) in &point.needs {
        check_name(at.key(skill), skill)?;
        whole(1, MOST_ROBOTS.into(), "").check(at.key(skill), f64::from(*count))?;
    }
    let count: u32 = point.needs.values().sum();
    if count > MOST_ROBOTS {
        let what = format!("{count} robots");
        return Err(Problem::at(
            at,
            what,
            format!("give at most {MOST_ROBOTS} in all"),
        ));
    }
    Ok(())
}

/// Checks that the team can fill the slots of all points.
pub(super) fn check_filled(scenario: &Scenario) -> Result<(), Problem> {
    let section = ServiceSection::of(scenario);
    let slots = Slots::new(section);
    let unfillable = slots.unfillable(scenario, &Catalog::new(scenario));
    let Some((point, most)) = unfillable.first() else {
        return Ok(());
    };
    let (of_point, index) = (slots.of_point(*point), *point as usize);
    let needs = section.points[index].needs.iter();
    let needs: Vec<String> = needs
        .map(|(skill, count)| format!("{count} {skill}"))
        .collect();
    let what = format!(
        "p{point} needs {} {} at once ({}), and the team can fill {most} of these slots",
        of_point.len(),
        if of_point.len() == 1 {
            "robot"
        } else {
            "robots"
        },
        needs.join(", ")
    );
    let remedy = "give robots the skills";
    let at = KeyPath::new(["service", "points"])
        .index(index)
        .key("needs");
    Err(Problem::at(at, what, remedy))
}
