//! Checks of service scenarios, and the values derived from them.

use std::collections::BTreeSet;

use proptest::prelude::*;
use scenario::time::SimTime;
use scenario::{Catalog, Scenario, Setup};

use super::*;
use crate::Registry;
use crate::service::data::family::family;

/// Two kinds of work, and a robot with all skills.
const TWO_KINDS: &str = "[service]\n\
    [[service.kinds]]\nname = 'garbage'\nwork_s = { min = 6, max = 10 }\n\
    [[service.kinds]]\nname = 'dust'\nwork_s = { min = 20, max = 30 }\n";

fn parse(text: &str) -> Scenario {
    match Scenario::parse("s.toml", text, &Registry::built_in().vocabulary()) {
        Ok(scenario) => scenario,
        Err(error) => panic!("{error}"),
    }
}

#[track_caller]
fn refused(text: &str, expected: &str) {
    match Scenario::parse("s.toml", text, &Registry::built_in().vocabulary()) {
        Ok(_) => panic!("accepted: {text}"),
        Err(error) => assert_eq!(error.to_string(), expected, "for {text}"),
    }
}

#[test]
fn mistakes_give_one_line_of_error() {
    refused(
        TWO_KINDS,
        "s.toml:1: service: there are no points; give points, random or spare",
    );
    let with = |more: &str| format!("{TWO_KINDS}{more}");
    refused(
        &with("[[service.points]]\nkind = 'dusk'\nx_m = 1\ny_m = 1\n"),
        "s.toml:9: service.points[0].kind: there is no kind 'dusk'; did you mean 'dust'? (there are garbage, dust)",
    );
    refused(
        &with("[[service.random]]\nn = 3\nkind = 'floor'\n"),
        "s.toml:10: service.random[0].kind: there is no kind 'floor'; there are garbage, dust",
    );
    refused(
        &with("[[service.random]]\nn = 9999\n[[service.random]]\nn = 9999\n"),
        "s.toml:1: service: more than 10000 points in all; give fewer points, random and spare",
    );
    refused(
        &with("[[service.points]]\nkind = 'dust'\nx_m = 100\ny_m = 1\n"),
        "s.toml:10: service.points[0].x_m: 100 is out of range; it must be at least 0 and at most 12 m",
    );
    refused(
        &TWO_KINDS.replace("min = 6, max = 10", "min = 12, max = 10"),
        "s.toml:4: service.kinds[0].work_s: min 12 is above max 10; write the lower one as min",
    );
    // Two robots of radius 0.2 m fit on opposite sides of a point within 0.3 m. Neighbors are 0.3·2·sin(60°) = 0.52 m
    // apart for three robots, and 0.35 m for five.
    refused(
        &with("workers = 5\n[[service.random]]\nn = 3\n"),
        "s.toml:8: service.kinds[1].workers: 5 robots of radius 0.2 m have no room within reach_m, 0.3 m, of a point; give at most 4, or a longer reach_m",
    );
}

/// A task that no robot can do is a mistake, unless `uncovered` allows it.
#[test]
fn every_task_is_covered() {
    let points = "[[service.points]]\nkind = 'garbage'\nx_m = 1\ny_m = 1\n\
        [[service.points]]\nkind = 'dust'\nx_m = 1\ny_m = 2\n";
    let team = "[[robots]]\nname = 'gold'\nskills = { garbage = 1 }\n\
        [[robots]]\nname = 'blue'\nskills = { garbage = 0.5, dust = 0 }\n";
    let text = format!("{TWO_KINDS}{points}{team}");
    refused(
        &text,
        "s.toml:8: service.points: no robot has serve(p1) among its tasks and the skill dust; assign them to a robot, or set uncovered = true",
    );
    refused(
        &text.replace("dust = 0 ", "dusk = 1 "),
        "s.toml:21: robots[1].skills.dusk: there is no skill 'dusk'; did you mean 'dust'? (there are garbage, dust)",
    );
    let meant = text.replace("[service]\n", "[service]\nuncovered = true\n");
    let scenario = parse(&meant);
    assert!(
        !SERVICE.expected_properties(&scenario).ends,
        "p1 stays forever"
    );
    assert!(
        SERVICE
            .expected_properties(&parse(&text.replace("dust = 0 ", "dust = 0.1 ")))
            .ends
    );
}

#[test]
fn a_robot_has_the_behaviors_that_its_skills_allow() {
    let text = format!(
        "{TWO_KINDS}[[service.points]]\nkind = 'dust'\nx_m = 1\ny_m = 1\n\
         [[service.random]]\nn = 3\n\
         [[robots]]\nname = 'gold'\nskills = {{ garbage = 1 }}\n[[robots]]\nname = 'blue'\n"
    );
    let own = |scenario: &Scenario, robot: usize| -> Vec<String> {
        let catalog = Catalog::new(scenario);
        let own = catalog.behaviors_of(&scenario.robots[robot]);
        own.map(|id| catalog.sets[id.index()].name.clone())
            .collect()
    };
    let scenario = parse(&text);
    // Drawn points take turns in kind: p1 garbage, p2 dust, p3 garbage.
    assert_eq!(own(&scenario, 0), ["serve(p1)", "serve(p3)"]);
    assert_eq!(own(&scenario, 1).len(), 4);
    let kinds = parse(&text.replace("[service]\n", "[service]\ntasks = 'kinds'\n"));
    assert_eq!(own(&kinds, 0), ["serve(garbage)"]);
    assert_eq!(own(&kinds, 1), ["serve(garbage)", "serve(dust)"]);
}

/// By hand: the way across 12 × 9 m is 15 m minus the reach of 0.3 m. 14.7 m take 29.4 s at 0.5 m/s, a half turn 2 s at
/// 90°/s. The most work of the kind, 30 s, takes 60 s at skill 0.5.
#[test]
fn alliance_values_follow_from_the_unit_of_work() {
    let text = format!(
        "{TWO_KINDS}[[service.random]]\nn = 2\n\
         [[robots]]\nname = 'gold'\nskills = {{ garbage = 1, dust = 0.5 }}\n"
    );
    let scenario = parse(&text);
    let catalog = Catalog::new(&scenario);
    let dust = &catalog.sets[1];
    let robot = &scenario.robots[0];
    let unit_s = SERVICE.work_unit_s(&scenario, &scenario.body, 0.5, dust);
    assert!((unit_s - 91.4).abs() < 1e-4, "{unit_s}");
    let built_in = SERVICE.default_alliance_params(&scenario, robot, dust);
    assert!((built_in.willing_to_affect_s - 182.8).abs() < 1e-4);
    assert!((built_in.before_yielding_s - 182.8).abs() < 1e-4);
    assert!((built_in.before_giving_up_s - 365.6).abs() < 1e-4);
    assert!((built_in.slow_impatience - 100.0 / 182.8).abs() < 1e-6);
    assert_eq!(built_in.fast_impatience, 20.0);
    // The faster robot has less patience: 29.4 + 2 + 10 s.
    let garbage = SERVICE.default_alliance_params(&scenario, robot, &catalog.sets[0]);
    assert!((garbage.willing_to_affect_s - 82.8).abs() < 1e-4);
    // Without travel, only the work counts.
    let still = parse(&text.replace("[service]\n", "[service]\nreach_m = 1000\n"));
    let unit_s = SERVICE.work_unit_s(&still, &still.body, 1.0, &catalog.sets[0]);
    assert_eq!(unit_s, 10.0);
}

#[test]
fn a_task_allows_as_many_robots_as_its_point() {
    let text = format!("{TWO_KINDS}workers = 2\n[[service.random]]\nn = 2\n");
    let most = |scenario: &Scenario| -> Vec<u32> {
        let catalog = Catalog::new(scenario);
        let each = catalog.sets.iter();
        each.map(|set| SERVICE.max_robots(scenario, set)).collect()
    };
    assert_eq!(most(&parse(&text)), [1, 2]);
    let kinds = text.replace("[service]\n", "[service]\ntasks = 'kinds'\n");
    assert_eq!(most(&parse(&kinds)), [1, 1]);
}

proptest! {
    #[test]
    fn points_are_drawn_as_the_scenario_says(seed: u64, n in 1..60_u16, at_s in 0.0..100.0_f64, rate_hz in 0.01..10.0_f64) {
        let text = format!(
            "{TWO_KINDS}[[service.points]]\nkind = 'dust'\nx_m = 3\ny_m = 4\narrival_s = 5\nwork_s = 7\n\
             [[service.random]]\nn = {n}\nat_s = {at_s}\nrate_hz = {rate_hz}\n\
             [[service.random]]\nn = {n}\nkind = 'dust'\n"
        );
        let scenario = parse(&text);
        let drawn = points(&scenario, seed);
        prop_assert_eq!(&drawn, &points(&scenario, seed));
        prop_assert_ne!(&drawn, &points(&scenario, seed.wrapping_add(1)));
        let n = usize::from(n);
        prop_assert_eq!(drawn.len(), 1 + 2 * n);
        let placed = &drawn[0];
        prop_assert_eq!((placed.at, placed.work_s), (glam::Vec2::new(3.0, 4.0), 7.0));
        prop_assert_eq!(placed.arrives, SimTime::from_secs_f64(5.0));
        let kinds: Vec<usize> = drawn.iter().map(|point| point.kind).collect();
        prop_assert_eq!(&kinds, &ServiceSection::of(&scenario).kinds_of_points().collect::<Vec<_>>());
        for point in &drawn[1..] {
            let work = [6.0..=10.0, 20.0..=30.0];
            prop_assert!(work[point.kind].contains(&point.work_s));
            let radius_m = scenario.body.radius_m;
            prop_assert!(point.at.cmpge(glam::Vec2::splat(radius_m)).all());
            prop_assert!(point.at.cmple(glam::Vec2::new(12.0, 9.0) - radius_m).all());
        }
        let (coming, at_once) = drawn[1..].split_at(n);
        prop_assert!(coming[0].arrives >= SimTime::from_secs_f64(at_s));
        prop_assert!(coming.is_sorted_by_key(|point| point.arrives));
        prop_assert!(at_once.iter().all(|point| point.arrives == SimTime::ZERO));
    }
}

/// The last of 4,000 arrivals at 0.5 Hz comes at 8,000 ± 126 s. The share of gaps above the mean is 1/e.
#[test]
fn arrivals_are_a_poisson_process() {
    let text = format!("{TWO_KINDS}[[service.random]]\nn = 4000\nrate_hz = 0.5\n");
    let scenario = parse(&text);
    for seed in 1..=5 {
        let arrivals: Vec<f64> = points(&scenario, seed)
            .iter()
            .map(|point| point.arrives.as_secs_f64())
            .collect();
        let last_s = arrivals[3999];
        assert!((7500.0..8500.0).contains(&last_s), "{last_s}");
        let long = arrivals.windows(2).filter(|pair| pair[1] - pair[0] > 2.0);
        let share = long.count() as f64 / 3999.0;
        assert!((0.34..0.40).contains(&share), "{share}");
    }
}

#[test]
fn the_family_is_valid_in_every_size() {
    for robots in [1, 2, 3, 4, 10, 50, 300] {
        for points in [1, 2, 3, 20, 67, 200] {
            let scenario = family(robots, points);
            assert_eq!(scenario.robots.len(), robots);
            assert_eq!(ServiceSection::of(&scenario).points.len(), points);
            let setup = Setup::resolve(scenario, 1, None)
                .unwrap_or_else(|error| panic!("{robots} robots, {points} points: {error}"))
                .setup;
            let worked_on: BTreeSet<_> = setup
                .scenario
                .robots
                .iter()
                .flat_map(|robot| setup.catalog.behaviors_of(robot))
                .collect();
            assert_eq!(worked_on.len(), points, "{robots} robots, {points} points");
        }
    }
    let largest = Setup::resolve(family(10_000, 10_000), 1, None)
        .unwrap()
        .setup;
    // Each robot has parameter values only for its own behaviors.
    let own = largest
        .alliance
        .robots
        .values()
        .map(|robot| robot.sets.len());
    assert!(own.max() <= Some(12));
}

#[test]
fn a_point_of_the_family_has_three_robots_and_a_robot_two_points() {
    let scenario = family(100, 67);
    let mut robots_on = vec![0; 67];
    for robot in &scenario.robots {
        assert!(robot.tasks.len() >= 2, "{}", robot.name);
        for task in &robot.tasks {
            robots_on[task_number(task)] += 1;
        }
    }
    assert!(robots_on.iter().all(|robots| *robots >= 3));
}

fn task_number(task: &str) -> usize {
    let number = task.trim_start_matches("serve(p").trim_end_matches(')');
    number.parse().unwrap()
}
