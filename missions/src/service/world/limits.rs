//! Points that the team cannot do: no robot has the task and its skill, or no able robot has a way at the start.

use std::collections::BTreeSet;

use glam::Vec2;
use scenario::Setup;

use crate::coverage::uncovered_tasks;
use crate::service::data::{
    Kind, PointSpec, ServiceSection, Slots, TaskGranularity, Ways, too_heavy,
};

#[derive(Debug)]
pub(super) struct TeamLimits {
    tasks: TaskGranularity,
    /// The tasks that no robot can do, as indices of the catalog.
    uncovered: BTreeSet<usize>,
    /// The points whose slots the team cannot fill at the same time, and those that no robot can carry.
    unfillable: BTreeSet<u32>,
    /// The number of points at the start. Faults add further ones, of any kind.
    initial: usize,
    /// The kinds for which no robot has the skill.
    unskilled: BTreeSet<usize>,
    /// The points of the start to which obstacles leave no way, by number.
    unreachable: BTreeSet<u32>,
}

impl TeamLimits {
    /// Computes the limits of a team with these starts, by rank, m.
    pub fn new(setup: &Setup, specs: &[PointSpec], starts: &[Vec2]) -> Self {
        let (scenario, catalog) = (&setup.scenario, &setup.catalog);
        let section = ServiceSection::of(scenario);
        let unfillable = Slots::new(section).unfillable(scenario, catalog);
        let unfillable = unfillable.into_iter().map(|(point, _)| point);
        let heavy = too_heavy(scenario, catalog).into_iter();
        let heavy = heavy.map(|(point, _)| point);
        let is_unskilled = |kind: &Kind| {
            let mut robots = scenario.robots.iter();
            !robots.any(|robot| robot.skill(&kind.name).unwrap_or(1.0) > 0.0)
        };
        let kinds = section.kinds.iter().enumerate();
        let unskilled = kinds.filter(|(_, kind)| is_unskilled(kind));
        let ways = Ways::new(scenario, starts);
        let unreachable = ways.iter().flat_map(|ways| {
            let points = specs.iter().zip(0..);
            points.filter(|(point, number)| {
                let skills: Vec<&String> = section.skills_of(*number, point.kind).collect();
                !ways.lead_to(&skills, point.at, point.deliver_to)
            })
        });
        Self {
            tasks: section.tasks,
            initial: specs.len(),
            unskilled: unskilled.map(|(index, _)| index).collect(),
            unfillable: unfillable.chain(heavy).collect(),
            uncovered: uncovered_tasks(scenario, catalog),
            unreachable: unreachable.map(|(_, number)| number).collect(),
        }
    }

    pub fn is_uncovered(&self, point: u32, spec: &PointSpec) -> bool {
        let task = match self.tasks {
            TaskGranularity::Points => point as usize,
            TaskGranularity::Kinds => spec.kind,
        };
        // The task of an added point requires no skill, because its kind is not known before.
        let is_added = point as usize >= self.initial;
        self.uncovered.contains(&task)
            || self.unfillable.contains(&point)
            || (is_added && self.unskilled.contains(&spec.kind))
    }

    pub fn is_unreachable(&self, point: u32) -> bool {
        self.unreachable.contains(&point)
    }
}
