//! Bars from which obstacles keep the robots or the goal.

use std::collections::BTreeSet;

use glam::Vec2;
use scenario::{Catalog, KeyPath, Problem, Scenario};
use world_server::world::Regions;

use super::{PUSH_PLACES, PushSection, bar_and_end};
use crate::push::bar::{axes, end};

/// Returns a problem for each end of a bar to which no robot with its task has a way at the start, and for each bar with
/// an obstacle before its goal.
pub(super) fn warnings(scenario: &Scenario, starts: &[Vec2]) -> Vec<Problem> {
    let Some(regions) = Regions::of(scenario) else {
        return Vec::new();
    };
    let section = PushSection::of(scenario);
    let catalog = Catalog::new(scenario);
    let at = KeyPath::new(["push", "bars"]);
    let mut homes = vec![BTreeSet::<u32>::new(); catalog.tasks.len()];
    for (robot, start) in scenario.robots.iter().zip(starts) {
        let region = regions.near(*start, 0.0);
        for behavior in catalog.behaviors_of(robot) {
            homes[catalog.sets[behavior.index()].task.index()].extend(&region);
        }
    }
    let behind_m = section.half_width_m + scenario.body.radius_m;
    let mut found = Vec::new();
    for (set, homes) in catalog.sets.iter().zip(&homes) {
        let (index, side) = bar_and_end(set.task);
        let pose = section.bars[index].pose();
        let (ahead, left) = axes(&pose);
        let outermost = end(&pose, side, section.length_m);
        let places = PUSH_PLACES.map(|share| {
            outermost - left * (side.sign() * share * section.length_m) - ahead * behind_m
        });
        let mut near = places
            .into_iter()
            .flat_map(|place| regions.near(place, 0.0));
        if !near.any(|region| homes.contains(&region)) {
            let name = section.name_of(index, Some(side));
            let what = format!("obstacles leave no way to push({name})");
            let remedy = "move the obstacles, or let a robot start there";
            found.push(Problem::at(at.index(index), what, remedy));
        }
    }
    for (index, bar) in section.bars.iter().enumerate() {
        let half = Vec2::new(section.half_width_m, section.length_m / 2.0);
        let low = Vec2::new(bar.x_m, bar.y_m) - half;
        let high = Vec2::new(bar.goal_x_m, bar.y_m) + half;
        let mut solid = scenario
            .obstacles
            .iter()
            .filter(|obstacle| obstacle.is_solid());
        let is_blocked = solid.any(|obstacle| {
            let min = Vec2::new(obstacle.x_m, obstacle.y_m);
            let max = min + Vec2::new(obstacle.width_m, obstacle.height_m);
            min.cmplt(high).all() && max.cmpgt(low).all()
        });
        if is_blocked {
            let what = format!(
                "an obstacle stands between the bar and its goal at x = {} m",
                bar.goal_x_m
            );
            found.push(Problem::at(at.index(index), what, "move one of them"));
        }
    }
    found
}
