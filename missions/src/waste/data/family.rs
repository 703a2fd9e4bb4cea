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

use super::{Spill, Spot, WasteSection, default_scenario};
use crate::districts::{DistrictSlot, Districts, nearest, nearest_both_ways, range_for_neighbors};
use scenario::{Radio, Robot, Room, Scenario, Start};

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

/// Returns the waste clean-up with the given number of robots and spills, 1 to 10,000 each. 3 and 2 give the default
/// mission.
#[must_use]
pub fn family(robots: usize, spills: usize) -> Scenario {
    if (robots, spills) == (ROBOTS, SPILLS) {
        return default_scenario();
    }
    let districts = districts(robots, spills);
    let mut scenario = Scenario {
        description: format!(
            "{robots} robots, {spills} spills: room, team and work grow together."
        ),
        ..default_scenario()
    };
    scenario.room.width_m *= districts.columns as f32;
    scenario.room.height_m *= districts.rows as f32;
    let one = WasteSection::default();
    let items = one.spills[0].items as usize;

    let mut deposits = (0..districts.count()).map(|district| {
        spot(
            &districts,
            district,
            one.deposit.x_fraction,
            one.deposit.y_fraction,
        )
    });
    if let Some(first) = deposits.next() {
        WasteSection::of_mut(&mut scenario).deposit.x_fraction = first.x_fraction;
        WasteSection::of_mut(&mut scenario).deposit.y_fraction = first.y_fraction;
    }
    WasteSection::of_mut(&mut scenario).further_deposits = deposits.collect();
    WasteSection::of_mut(&mut scenario).spills = districts
        .distribute(spills)
        .enumerate()
        .map(|(index, (district, share))| {
            let spot = spot(
                &districts,
                district,
                one.spills[0].x_fraction,
                share.height(1.0),
            );
            Spill {
                name: format!("s{}", index + 1),
                x_fraction: spot.x_fraction,
                y_fraction: spot.y_fraction,
                ..one.spills[0].clone()
            }
        })
        .collect();
    WasteSection::of_mut(&mut scenario).border_known = districts.count() > SEARCHED;
    scenario.robots = districts
        .distribute(robots)
        .enumerate()
        .map(|(index, (district, share))| robot(&districts, index, district, share))
        .collect();
    if robots > ROBOTS_PER_TASK {
        assign(&mut scenario);
    }
    if robots > NEIGHBORS {
        let Room { width_m, height_m } = scenario.room;
        scenario.radio = Radio {
            range_m: Some(range_for_neighbors(NEIGHBORS, robots, width_m, height_m)),
        };
    }
    // The time limit grows with the number of items per robot.
    let load = (spills * items) as f64 / robots as f64;
    let default_load = (SPILLS * items) as f64 / ROBOTS as f64;
    scenario.limit_s *= (load / default_load).ceil().max(1.0);
    scenario
}

fn districts(robots: usize, spills: usize) -> Districts {
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
fn robot(districts: &Districts, index: usize, district: usize, share: DistrictSlot) -> Robot {
    let default = default_scenario();
    let (room, site) = (default.room, WasteSection::of(&default).report_site);
    let (column, row) = districts.column_and_row(district);
    let middle = (row as f32 + 0.5) * room.height_m;
    Robot {
        name: format!("r{}", index + 1),
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
    let at = |robot: &Robot| {
        robot
            .start
            .map_or((0.0, 0.0), |start| (start.x_m, start.y_m))
    };
    let robots: Vec<(f32, f32)> = scenario.robots.iter().map(at).collect();
    let spills: Vec<(f32, f32)> = WasteSection::of(scenario)
        .spills
        .iter()
        .map(|spill| spill.spot().in_room(&scenario.room).into())
        .collect();
    let site = (0.0, scenario.room.height_m / 2.0);

    let spills_of = nearest_both_ways(&robots, SPILLS_PER_ROBOT, &spills, ROBOTS_PER_TASK);
    let reporters = nearest(&robots, site, ROBOTS_PER_TASK);
    let names: Vec<String> = WasteSection::of(scenario)
        .spills
        .iter()
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

    use super::*;
    use scenario::{Catalog, Setup};

    #[test]
    fn with_three_robots_and_two_spills_it_is_the_default_mission() {
        assert_eq!(family(3, 2), default_scenario());
    }

    #[test]
    fn every_size_is_valid_and_has_the_requested_counts() {
        for robots in [1, 2, 3, 4, 7, 10, 20, 21, 30, 31, 100, 333] {
            for spills in [1, 2, 3, 5, 20, 67, 200] {
                let scenario = family(robots, spills);
                assert_eq!(scenario.robots.len(), robots);
                assert_eq!(WasteSection::of(&scenario).spills.len(), spills);
                Setup::resolve(scenario, 1, None)
                    .unwrap_or_else(|error| panic!("{robots} robots, {spills} spills: {error}"));
            }
        }
    }

    #[test]
    fn the_largest_one_is_valid() {
        let scenario = family(10_000, 6_667);
        assert_eq!(
            (scenario.room.width_m, scenario.room.height_m),
            (696.0, 522.0)
        );
        assert_eq!(WasteSection::of(&scenario).deposits().count(), 58 * 58);
        let setup = Setup::resolve(scenario, 1, None).unwrap().setup;
        // Each robot has parameter values only for its own sets, with one value for all teammates.
        let sets = setup.alliance.robots.values().map(|robot| robot.sets.len());
        assert!(sets.max() <= Some(16));
    }

    #[test]
    fn every_task_has_three_robots_and_every_robot_two_spills() {
        let scenario = family(100, 67);
        let mut robots_on = BTreeMap::new();
        for robot in &scenario.robots {
            let spills = robot
                .tasks
                .iter()
                .filter(|task| task.starts_with("move-spill"));
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
            let districts = districts(robots, spills);
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
        let at = |robot: &Robot| robot.start.map(|start| (start.x_m, start.y_m)).unwrap();
        let places: Vec<(f32, f32)> = scenario.robots.iter().map(at).collect();
        let in_range = |a: &(f32, f32), b: &(f32, f32)| (a.0 - b.0).hypot(a.1 - b.1) <= range_m;
        let pairs: usize = places
            .iter()
            .map(|a| places.iter().filter(|b| in_range(a, b)).count() - 1)
            .sum();
        let mean = pairs as f64 / places.len() as f64;
        assert!((15.0..25.0).contains(&mean), "{mean}");
        assert_eq!(family(20, 14).radio.range_m, None);
    }
}
