//! The ways from the robots' starts to points.

use std::collections::{BTreeMap, BTreeSet};

use glam::Vec2;
use scenario::{Robot, Scenario};
use world_server::world::Regions;

use super::ServiceSection;

/// The regions in which robots with each skill start.
#[derive(Debug)]
pub struct Ways {
    regions: Regions,
    homes: BTreeMap<String, BTreeSet<u32>>,
    /// The regions in which any robot starts.
    starts: BTreeSet<u32>,
    reach_m: f32,
}

impl Ways {
    /// Computes the ways of a scenario whose robots have these starts, by rank, m; `None` if nothing blocks a way.
    #[must_use]
    pub fn new(scenario: &Scenario, starts: &[Vec2]) -> Option<Self> {
        let section = ServiceSection::of(scenario);
        let regions = Regions::of(scenario)?;
        let near = starts.iter().map(|start| regions.near(*start, 0.0));
        let near: Vec<BTreeSet<u32>> = near.collect();
        let of_skill = |name: &str| -> BTreeSet<u32> {
            let robots = scenario.robots.iter().zip(&near);
            let able = robots.filter(|(robot, _)| skill(robot, name) > 0.0);
            able.flat_map(|(_, near)| near).copied().collect()
        };
        let skills = section.skills().into_iter();
        Some(Self {
            regions,
            starts: near.iter().flatten().copied().collect(),
            homes: skills.map(|name| (name.clone(), of_skill(&name))).collect(),
            reach_m: section.reach_m,
        })
    }

    /// Returns whether for each of these skills a robot has a way to a place.
    #[must_use]
    pub fn lead_to<'s>(&self, mut skills: impl Iterator<Item = &'s String>, at: Vec2) -> bool {
        let near = self.regions.near(at, self.reach_m);
        skills.all(|skill| !near.is_disjoint(&self.homes[skill]))
    }

    /// Returns whether any robot has a way to a place.
    pub(super) fn lead_any_robot_to(&self, at: Vec2) -> bool {
        !self
            .regions
            .near(at, self.reach_m)
            .is_disjoint(&self.starts)
    }

    /// Returns whether all places of the room can be reached by robots with this skill.
    pub(super) fn lead_everywhere(&self, skill: &str) -> bool {
        !self.regions.any_outside(&self.homes[skill])
    }
}

/// Returns the skill of a robot; 1 if the robot states no skills.
pub(super) fn skill(robot: &Robot, name: &str) -> f64 {
    robot.skill(name).unwrap_or(1.0)
}
