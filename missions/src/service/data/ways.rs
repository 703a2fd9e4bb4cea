//! The ways from the robots' starts to points.

use std::collections::BTreeSet;

use glam::Vec2;
use scenario::{Robot, Scenario};
use world_server::world::Regions;

use super::{Kind, ServiceSection};

/// The regions in which robots with the skill for each kind of work start.
#[derive(Debug)]
pub struct Ways {
    regions: Regions,
    /// By kind.
    homes: Vec<BTreeSet<u32>>,
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
        let of_kind = |kind: &Kind| -> BTreeSet<u32> {
            let robots = scenario.robots.iter().zip(&near);
            let able = robots.filter(|(robot, _)| skill(robot, &kind.name) > 0.0);
            able.flat_map(|(_, near)| near).copied().collect()
        };
        let homes = section.kinds.iter().map(of_kind).collect();
        Some(Self {
            regions,
            homes,
            reach_m: section.reach_m,
        })
    }

    /// Returns whether a robot with the skill for this kind has a way to a point.
    #[must_use]
    pub fn lead_to(&self, kind: usize, at: Vec2) -> bool {
        let near = self.regions.near(at, self.reach_m);
        !near.is_disjoint(&self.homes[kind])
    }

    /// Returns whether all places of the room can be reached by robots with the skill for this kind.
    pub(super) fn lead_everywhere(&self, kind: usize) -> bool {
        !self.regions.any_outside(&self.homes[kind])
    }
}

/// Returns the skill of a robot; 1 if the robot states no skills.
pub(super) fn skill(robot: &Robot, name: &str) -> f64 {
    robot.skill(name).unwrap_or(1.0)
}
