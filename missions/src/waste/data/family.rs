//! The waste clean-up in any size: room, team and work grow together (`--robots N --spills M`).
//!
//! The default mission has three robots and two spills in a room of 12 × 9 m. A larger one consists of *districts* of
//! that size, without walls between them. No district has more than three robots and two spills. Deposit, spills and
//! starts lie as in the default room.
//!
//! - Each spill is a task of the three robots that start nearest to it, and each robot has its two nearest spills. So
//!   teammates can take over the work of a lost robot, and no robot needs all knowledge.
//! - The three robots that start nearest to the report site also find the locations and report. In more than ten
//!   districts the search along the walls would take longer than the work, so the border is known beforehand.
//! - In teams of more than 20 robots the radio range is limited so that each robot receives from about 20 others.

use glam::Vec2;
use scenario::{Robot, Scenario, Start};
use terminal::counted;

use super::{Deposit, Spill, Spot, WasteSection, default_scenario};
use crate::districts::{self, DistrictSlot, Districts, Places, nearest_both_ways};

/// The maximum number of robots and spills per district, as in the default mission.
const ROBOTS: usize = 3;
const SPILLS: usize = 2;
const ROBOTS_PER_TASK: usize = 3;
const SPILLS_PER_ROBOT: usize = 2;
/// The approximate number of robots from which a robot receives, and the team size above which the radio range is
/// limited.
const NEIGHBORS: usize = 20;
/// The number of districts above which the border is known beforehand.
const SEARCHED: usize = 10;

/// Returns the waste clean-up with the given number of robots and spills, 1 to 1,000,000 each. 3 and 2 give the default
/// mission.
#[must_use]
pub fn family(robots: usize, spills: usize) -> Scenario {
    if (robots, spills) == (ROBOTS, SPILLS) {
        return default_scenario();
    }
    let districts = grid(robots, spills);
    let mut scenario = Scenario {
        description: format!(
            "{}, {}: room, team and work grow together.",
            counted(robots, "robot"),
            counted(spills, "spill"),
        ),
        ..default_scenario()
    };
    scenario.room.width_m *= districts.columns as f32;
    scenario.room.height_m *= districts.rows as f32;
    let one = WasteSection::default();
    let (spill, deposit) = (&one.spills[0], one.deposit);

    let waste = WasteSection::of_mut(&mut scenario);
    let (x, y) = (deposit.x_fraction, deposit.y_fraction);
    let mut deposits = (0..districts.count()).map(|district| spot(&districts, district, x, y));
    if let Some(Spot {
        x_fraction,
        y_fraction,
    }) = deposits.next()
    {
        waste.deposit = Deposit {
            x_fraction,
            y_fraction,
            ..deposit
        };
    }
    waste.further_deposits = deposits.collect();
    let places = districts.distribute(spills).zip(1..);
    let spread = places.map(|((district, share), number)| {
        let spot = spot(&districts, district, spill.x_fraction, share.height(1.0));
        Spill {
            name: format!("s{number}"),
            x_fraction: spot.x_fraction,
            y_fraction: spot.y_fraction,
            ..*spill
        }
    });
    waste.spills = spread.collect();
    waste.border_known = districts.count() > SEARCHED;
    let team = districts.distribute(robots).zip(1..);
    let team = team.map(|((district, share), number)| robot(&districts, number, district, share));
    scenario.robots = team.collect();
    if robots > ROBOTS_PER_TASK {
        assign(&mut scenario);
    }
    scenario.radio = districts::radio(NEIGHBORS, robots, &scenario.room);
    let items = spill.items as usize;
    // The time limit grows with the number of items per robot.
    let load = (spills * items) as f64 / robots as f64;
    let default_load = (SPILLS * items) as f64 / ROBOTS as f64;
    scenario.limit_s *= (load / default_load).ceil().max(1.0);
    scenario
}

fn grid(robots: usize, spills: usize) -> Districts {
    Districts::new(robots.div_ceil(ROBOTS).max(spills.div_ceil(SPILLS)))
}

fn spot(districts: &Districts, district: usize, x: f32, y: f32) -> Spot {
    let (column, row) = districts.column_and_row(district);
    Spot {
        x_fraction: (column as f32 + x) / districts.columns as f32,
        y_fraction: (row as f32 + y) / districts.rows as f32,
    }
}

/// Creates a robot at the left end of its district, beside the other robots there.
fn robot(districts: &Districts, number: usize, district: usize, share: DistrictSlot) -> Robot {
    let default = default_scenario();
    let (room, site) = (default.room, WasteSection::of(&default).report_site);
    let (column, row) = districts.column_and_row(district);
    let middle = (row as f32 + 0.5) * room.height_m;
    Robot {
        name: format!("r{number}"),
        side_sensor: share.index == 0,
        start: Some(Start {
            x_m: column as f32 * room.width_m + site.width_m / 2.0,
            y_m: middle + (share.height(0.5) - 0.5) * site.height_m,
            heading_deg: 180.0,
        }),
        ..Robot::default()
    }
}

fn assign(scenario: &mut Scenario) {
    let (room, team) = (scenario.room, &scenario.robots);
    let spills = WasteSection::of(scenario).spills.iter();
    let places: Vec<Vec2> = spills.map(|spill| spill.spot().in_room(&room)).collect();
    let spills_of = nearest_both_ways(team, SPILLS_PER_ROBOT, &places, ROBOTS_PER_TASK);
    let site = Vec2::new(0.0, room.height_m / 2.0);
    let reporters = Places::new(&districts::starts(team)).nearest(site, ROBOTS_PER_TASK);
    let spills = WasteSection::of(scenario).spills.iter();
    let names: Vec<String> = spills
        .map(|spill| format!("move-spill({})", spill.name))
        .collect();
    for (index, (robot, spills)) in scenario.robots.iter_mut().zip(spills_of).enumerate() {
        robot.tasks = spills
            .into_iter()
            .map(|spill| names[spill].clone())
            .collect();
        if reporters.contains(&index) {
            robot.tasks.insert(0, "find-locations".to_owned());
            robot.tasks.push("report-progress".to_owned());
        }
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use scenario::Catalog;

    use super::*;
    use crate::fixtures::resolve;

    #[test]
    fn every_size_is_valid_and_has_the_requested_counts() {
        assert_eq!(family(3, 2), default_scenario());
        for robots in [1, 2, 3, 4, 7, 10, 20, 21, 30, 31, 100, 333] {
            for spills in [1, 2, 3, 5, 20, 67, 200] {
                let scenario = family(robots, spills);
                assert_eq!(scenario.robots.len(), robots);
                assert_eq!(WasteSection::of(&scenario).spills.len(), spills);
                resolve(scenario);
            }
        }
    }

    #[test]
    fn the_largest_one_is_valid() {
        let scenario = family(10_000, 6_667);
        assert_eq!(scenario.room.size(), Vec2::new(696.0, 522.0));
        assert_eq!(WasteSection::of(&scenario).deposits().count(), 58 * 58);
        // Each robot has parameter values only for its own sets, with one value for all teammates.
        let robots = resolve(scenario).alliance.robots;
        let sets = robots.values().map(|robot| robot.sets.len());
        assert!(sets.max() <= Some(16));
    }

    #[test]
    fn every_task_has_three_robots_and_every_robot_two_spills() {
        let scenario = family(100, 67);
        let mut robots_on = BTreeMap::new();
        for robot in &scenario.robots {
            let tasks = robot.tasks.iter();
            let spills = tasks.filter(|task| task.starts_with("move-spill"));
            assert!(spills.count() >= 2, "{}", robot.name);
            for task in &robot.tasks {
                *robots_on.entry(task.clone()).or_insert(0) += 1;
            }
        }
        for task in Catalog::new(&scenario).tasks {
            assert!(robots_on[&task.name] >= 3, "{}", task.name);
        }
    }

    #[test]
    fn a_district_has_no_more_than_the_default_room() {
        for (robots, spills) in [(10, 7), (100, 67), (50, 100), (9, 1)] {
            let districts = grid(robots, spills);
            for (count, most) in [(robots, ROBOTS), (spills, SPILLS)] {
                let mut there = vec![0; districts.count()];
                for (district, share) in districts.distribute(count) {
                    assert_eq!(share.index, there[district]);
                    assert!(share.count <= most && share.index < share.count);
                    there[district] += 1;
                }
            }
        }
    }

    #[test]
    fn each_robot_receives_from_about_twenty_others() {
        let scenario = family(900, 600);
        let range_m = scenario.radio.range_m.unwrap();
        let places = districts::starts(&scenario.robots);
        let in_range = |a: &Vec2, b: &Vec2| a.distance(*b) <= range_m;
        let near = |a| places.iter().filter(|b| in_range(a, b)).count() - 1;
        let pairs: usize = places.iter().map(near).sum();
        let mean = pairs as f64 / places.len() as f64;
        assert!((15.0..25.0).contains(&mean), "{mean}");
        assert_eq!(family(20, 14).radio.range_m, None);
    }
}
