//! Spills, deposits and report sites from which obstacles keep the robots.

use std::collections::{BTreeMap, BTreeSet};

use glam::Vec2;
use scenario::{KeyPath, Problem, Scenario};
use world_server::world::{Places, Regions};

use super::{INSIDE_DEPOSIT_M, WasteSection, report_site};

/// The number of places that are tried in a deposit and in the report site.
const TRIES: usize = 1000;

/// Returns a problem for each spill to which no robot has a way at the start, or none that goes on to the deposit of
/// its waste, and for a report site without a way.
pub(super) fn warnings(scenario: &Scenario, starts: &[Vec2]) -> Vec<Problem> {
    let Some(regions) = Regions::of(scenario) else {
        return Vec::new();
    };
    let places = Places::of(scenario);
    let waste = WasteSection::of(scenario);
    let body = scenario.body;
    let arm_m = body.radius_m + body.reach_m + waste.item_radius_m;
    let robots = starts.iter().flat_map(|start| regions.near(*start, 0.0));
    let robots: BTreeSet<u32> = robots.collect();
    let can_stand = |place: Vec2| places.can_stand(place);
    // The regions from which a robot enters a rectangle at places that will do.
    let entered = |rectangle: [Vec2; 2], will_do: &dyn Fn(Vec2) -> bool| -> BTreeSet<u32> {
        let places = places.spread(rectangle).take(TRIES);
        let places = places.filter(|place| will_do(*place) && can_stand(*place));
        places
            .flat_map(|place| regions.each_near(place, 0.0))
            .collect()
    };
    let deposits: Vec<Vec2> = waste
        .deposits()
        .map(|spot| spot.in_room(&scenario.room))
        .collect();
    let within_m = waste.deposit.radius_m - INSIDE_DEPOSIT_M;
    let mut ways_in: BTreeMap<usize, BTreeSet<u32>> = BTreeMap::new();
    let at = KeyPath::new(["waste"]);
    let mut found = Vec::new();
    for (index, spill) in waste.spills.iter().enumerate() {
        let center = spill.spot().in_room(&scenario.room);
        let mut near = regions.near(center, waste.spill_radius_m + arm_m);
        near.retain(|region| robots.contains(region));
        // The waste of a spill goes to the deposit nearest to it.
        let distance = |deposit: &Vec2| deposit.distance_squared(center);
        let of_spill = deposits.iter().enumerate();
        let of_spill = of_spill.min_by(|(_, a), (_, b)| distance(a).total_cmp(&distance(b)));
        let reaches_deposit = of_spill.is_none_or(|(number, deposit)| {
            let ways_in = ways_in.entry(number).or_insert_with(|| {
                entered([deposit - within_m, deposit + within_m], &|place| {
                    place.distance(*deposit) <= within_m
                })
            });
            !near.is_disjoint(ways_in)
        });
        let name = &spill.name;
        let what = if near.is_empty() {
            format!("obstacles leave no way to spill '{name}'")
        } else if !reaches_deposit {
            format!("obstacles leave no way from spill '{name}' into the nearest deposit")
        } else {
            continue;
        };
        let at = at.key("spills").index(index);
        found.push(Problem::at(at, what, "move it or the obstacles"));
    }
    if robots.is_disjoint(&entered(report_site(scenario), &|_| true)) {
        let what = "obstacles leave no way to the report site";
        let remedy = "move the obstacles, or let a robot start there";
        found.push(Problem::at(at.key("report_site"), what, remedy));
    }
    found
}
