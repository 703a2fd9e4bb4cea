//! The ways from the robots' starts to points.

use std::collections::{BTreeMap, BTreeSet};

use glam::Vec2;
use scenario::{Robot, Scenario, fill_slots};
use world_server::world::Regions;

use super::ServiceSection;

/// The regions in which robots start, and their skills.
#[derive(Debug)]
pub struct Ways {
    regions: Regions,
    /// The regions in which each robot starts, by rank.
    homes: Vec<BTreeSet<u32>>,
    /// The ranks of the robots with each skill.
    able: BTreeMap<String, Vec<usize>>,
    reach_m: f32,
}

impl Ways {
    /// Computes the ways of a scenario whose robots have these starts, by rank, m; `None` if nothing blocks a way.
    #[must_use]
    pub fn new(scenario: &Scenario, starts: &[Vec2]) -> Option<Self> {
        let section = ServiceSection::of(scenario);
        let regions = Regions::of(scenario)?;
        let of_skill = |name: &str| -> Vec<usize> {
            let robots = scenario.robots.iter().take(starts.len()).enumerate();
            let able = robots.filter(|(_, robot)| skill(robot, name) > 0.0);
            able.map(|(rank, _)| rank).collect()
        };
        let homes = starts.iter().map(|start| regions.near(*start, 0.0));
        let skills = section.skills().into_iter();
        Some(Self {
            homes: homes.collect(),
            able: skills.map(|name| (name.clone(), of_skill(&name))).collect(),
            reach_m: section.reach_m,
            regions,
        })
    }

    /// Returns whether robots with these skills have a way to a place, one robot for each skill, and whether one of them
    /// has a way on to the place of delivery.
    #[must_use]
    pub fn lead_to(&self, skills: &[&String], at: Vec2, deliver_to: Option<Vec2>) -> bool {
        let near = self.regions.near(at, self.reach_m);
        let starts_near = |rank: usize| !near.is_disjoint(&self.homes[rank]);
        let able = |slot: usize| self.able[skills[slot]].iter().copied();
        let all = || {
            (0..skills.len())
                .flat_map(able)
                .filter(|rank| starts_near(*rank))
        };
        let is_carried = deliver_to.is_none_or(|deliver_to| {
            let mut both = self.regions.near(deliver_to, self.reach_m);
            both.retain(|region| near.contains(region));
            all().any(|rank| !both.is_disjoint(&self.homes[rank]))
        });
        is_carried
            && match skills {
                [_] => all().next().is_some(),
                _ => {
                    let robots: BTreeSet<usize> = all().collect();
                    let robots = robots.into_iter().map(|rank| (rank, None));
                    let can_fill = |rank, slot| able(slot).any(|able| able == rank);
                    let filled = fill_slots(skills.len(), robots, can_fill);
                    filled.iter().all(Option::is_some)
                }
            }
    }

    /// Returns whether any robot has a way to a place.
    pub(super) fn lead_any_robot_to(&self, at: Vec2) -> bool {
        let near = self.regions.near(at, self.reach_m);
        self.homes.iter().any(|home| !near.is_disjoint(home))
    }

    /// Returns whether all places of the room can be reached by robots with this skill.
    pub(super) fn lead_everywhere(&self, skill: &str) -> bool {
        let homes = self.able[skill].iter().map(|rank| &self.homes[*rank]);
        let homes: BTreeSet<u32> = homes.flatten().copied().collect();
        !self.regions.any_outside(&homes)
    }
}

/// Returns the skill of a robot; 1 if the robot states no skills.
pub(super) fn skill(robot: &Robot, name: &str) -> f64 {
    robot.skill(name).unwrap_or(1.0)
}
