//! Spills from which obstacles keep the robots.

use std::collections::BTreeSet;

use glam::Vec2;
use scenario::{KeyPath, Problem, Scenario};
use world_server::world::Regions;

use super::WasteSection;

/// Returns a problem for each spill to which no robot has a way at the start, or none that goes on to a deposit.
pub(super) fn warnings(scenario: &Scenario, starts: &[Vec2]) -> Vec<Problem> {
    let Some(regions) = Regions::of(scenario) else {
        return Vec::new();
    };
    let waste = WasteSection::of(scenario);
    let body = scenario.body;
    let arm_m = body.radius_m + body.reach_m + waste.item_radius_m;
    let robots = starts.iter().flat_map(|start| regions.near(*start, 0.0));
    let robots: BTreeSet<u32> = robots.collect();
    let deposits = waste.deposits().flat_map(|spot| {
        let center = spot.in_room(&scenario.room);
        regions.near(center, waste.deposit.radius_m + arm_m)
    });
    let deposits: BTreeSet<u32> = deposits.collect();
    let mut found = Vec::new();
    for (index, spill) in waste.spills.iter().enumerate() {
        let center = spill.spot().in_room(&scenario.room);
        let mut near = regions.near(center, waste.spill_radius_m + arm_m);
        near.retain(|region| robots.contains(region));
        let what = if near.is_empty() {
            format!("obstacles leave no way to spill '{}'", spill.name)
        } else if near.is_disjoint(&deposits) {
            format!(
                "obstacles leave no way from spill '{}' to a deposit",
                spill.name
            )
        } else {
            continue;
        };
        let at = KeyPath::new(["waste", "spills"]).index(index);
        found.push(Problem::at(at, what, "move it or the obstacles"));
    }
    found
}
