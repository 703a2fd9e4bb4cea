//! Checks of service scenarios, and the values derived from them.

use std::collections::BTreeSet;

use proptest::prelude::*;
use scenario::testkit::refusals;
use scenario::time::SimTime;
use scenario::{Catalog, Problem, Scenario, Setup};

use super::*;
use crate::Registry;
use crate::service::data::family::family;

/// Two kinds of work, and a robot with all skills.
const TWO_KINDS: &str = "[service]\n\
    [[service.kinds]]\nname = 'garbage'\nwork_s = { min = 6, max = 10 }\n\
    [[service.kinds]]\nname = 'dust'\nwork_s = { min = 20, max = 30 }\n";

fn read(text: &str) -> Result<Scenario, Problem> {
    Scenario::parse("s.toml", text, &Registry::built_in().vocabulary())
}

fn parse(text: &str) -> Scenario {
    read(text).unwrap_or_else(|error| panic!("{error}"))
}

#[test]
fn mistakes_give_one_line_of_error() {
    let with = |more: &str| format!("{TWO_KINDS}{more}");
    let texts = [
        TWO_KINDS.to_owned(),
        with("[[service.points]]\nkind = 'dusk'\nx_m = 1\ny_m = 1\n"),
        with("[[service.random]]\nn = 3\nkind = 'floor'\n"),
        with("[[service.random]]\nn = 9999\n[[service.random]]\nn = 9999\n"),
        with("[[service.points]]\nkind = 'dust'\nx_m = 100\ny_m = 1\n"),
        TWO_KINDS.replace("min = 6, max = 10", "min = 12, max = 10"),
        // Two robots of radius 0.2 m fit on opposite sides of a point within 0.3 m. Neighbors are 0.3·2·sin(60°) = 0.52 m
        // apart for three robots, and 0.35 m for five.
        with("workers = 5\n[[service.random]]\nn = 3\n"),
    ];
    insta::assert_snapshot!(refusals("s.toml", texts, read));
}

/// A block covers the room from (3, 3) to (5, 5).
const BLOCK: &str = "[[obstacles]]\nx_m = 3\ny_m = 3\nwidth_m = 2\nheight_m = 2\n";

#[test]
fn a_stated_point_that_no_robot_can_work_on_is_refused() {
    let at = |x_m: f32, y_m: f32| {
        let point = format!("[[service.points]]\nkind = 'dust'\nx_m = {x_m}\ny_m = {y_m}\n");
        let answer = read(&format!("{TWO_KINDS}{point}{BLOCK}"));
        answer
            .map_err(|error| error.to_string())
            .map(|scenario| points(&scenario, 1)[0].at)
    };
    let inside = "s.toml:8: service.points[0]: p0 at (4, 4) lies in the solid obstacles[0]; move one of them";
    assert_eq!(at(4.0, 4.0), Err(inside.to_owned()));
    let corner = "s.toml:8: service.points[0]: no robot has room within reach_m, 0.3 m, of p0 at (0, 0); move the point away from walls and obstacles, or increase reach_m";
    assert_eq!(at(0.0, 0.0), Err(corner.to_owned()));
    // A place at a wall or at the block is kept as it is stated.
    for (x_m, y_m) in [(0.0, 4.0), (5.0, 4.0), (8.0, 4.0)] {
        assert_eq!(at(x_m, y_m), Ok(glam::Vec2::new(x_m, y_m)));
    }
}

#[test]
fn a_drawn_point_in_an_obstacle_is_drawn_again() {
    let drawn = "[[service.random]]\nn = 200\n";
    let free = parse(&format!("{TWO_KINDS}{drawn}"));
    let blocked = parse(&format!("{TWO_KINDS}{drawn}{BLOCK}"));
    let is_clear = |at: glam::Vec2| {
        let outside = (at - at.clamp(glam::Vec2::splat(3.0), glam::Vec2::splat(5.0))).length();
        outside >= blocked.body.radius_m - 1e-4
    };
    let (before, after) = (points(&free, 7), points(&blocked, 7));
    let first = before.iter().position(|point| !is_clear(point.at)).unwrap();
    assert_eq!(
        before[..first],
        after[..first],
        "points before the first redraw"
    );
    assert!(after.iter().all(|point| is_clear(point.at)));
    let full = "[[obstacles]]\nx_m = 0.5\ny_m = 0.3\nwidth_m = 11.2\nheight_m = 8.4\n";
    let robot = "[[robots]]\nname = 'a'\nstart = { x_m = 0.25, y_m = 4 }\n";
    let narrow = read(&format!("{TWO_KINDS}{drawn}{robot}{full}"));
    let left = points(&narrow.unwrap(), 1);
    assert!(
        left.iter().all(|point| point.at.x <= 0.3),
        "only the left lane is free"
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
    let skill = text.replace("dust = 0 ", "dusk = 1 ");
    insta::assert_snapshot!(refusals("s.toml", [&text, &skill], read));
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
fn work_that_cannot_be_done_in_time_gives_a_warning() {
    let warned = |kind: &str, more: &str| -> Vec<String> {
        let text =
            format!("limit_s = 120\n[service]\n[[service.kinds]]\nname = 't'\n{kind}\n{more}");
        let warnings = SERVICE.warnings(&parse(&text), &[]);
        warnings
            .iter()
            .map(|warning| warning.to_string().split("; ").next().unwrap().to_owned())
            .collect()
    };
    let work = "work_s = { min = 3, max = 5 }";
    let random = "[[service.random]]\nn = 4\n";
    let point = |arrival_s: f64| {
        format!("[[service.points]]\nkind = 't'\nx_m = 3\ny_m = 3\narrival_s = {arrival_s}\n")
    };
    assert_eq!(warned(work, random), [""; 0]);
    assert_eq!(warned(work, &point(117.0)), [""; 0]);
    let with = |more: &str| format!("{work}\n{more}");
    for (kind, more, expected) in [
        (
            work,
            &*point(4000.0),
            "service.points[0].arrival_s: p0 arrives at 4000 s, not before limit_s, 120 s",
        ),
        (
            work,
            &*point(120.0),
            "service.points[0].arrival_s: p0 arrives at 120 s, not before limit_s, 120 s",
        ),
        (
            work,
            &*point(119.99),
            "service.points[0].arrival_s: p0 arrives at 119.99 s and cannot be done before 122.99 s, after limit_s, 120 s",
        ),
        (
            work,
            "[[service.random]]\nn = 4\nat_s = 200\n",
            "service.random[0].at_s: the points arrive from 200 s on, not before limit_s, 120 s",
        ),
        (
            work,
            "[[service.random]]\nn = 40\nrate_hz = 0.1\n",
            "service.random[0].rate_hz: the last point arrives at about 400 s, not before limit_s, 120 s",
        ),
        (
            "work_s = { min = 1e6, max = 1e6 }",
            random,
            "service.kinds[0].work_s: a point takes at least 1000000.0 s, more than limit_s, 120 s",
        ),
        (
            &*with("deadline_s = { min = 1, max = 2 }"),
            random,
            "service.kinds[0].deadline_s: a point expires after at most 2 s, but takes at least 3.0 s",
        ),
        (
            &*with("period_s = 1"),
            random,
            "service.kinds[0].period_s: a point comes back after 1 s, but takes at least 3.0 s",
        ),
        (
            &*with("period_s = 10\ndeadline_s = { min = 30, max = 30 }"),
            random,
            "service.kinds[0].deadline_s: a deadline of at least 30 s has no effect: a point expires when it comes back, after period_s, 10 s",
        ),
        (
            work,
            &*format!(
                "{random}[[robots]]\nname = 'a'\n[[robots]]\nname = 'b'\nskills = {{ t = 1e-30 }}\n"
            ),
            "robots[1].skills.t: 'b' takes at least 3e30 s for a point, more than limit_s, 120 s",
        ),
    ] {
        assert_eq!(warned(kind, more), [expected], "{kind}\n{more}");
    }
}

#[test]
fn orders_for_points_without_a_task_are_refused() {
    use scenario::fault::{Fault, MissionFault, Order};
    let order = |kind: &str, every_s: Option<f64>| Order {
        every_s,
        ..Order::now(Fault::Mission(
            MissionFault::new(POINT, &[("x_m", 1.0), ("y_m", 1.0)]).with_name("kind", kind),
        ))
    };
    let check = |spare: usize, kind: &str, every_s: Option<f64>| {
        let text = TWO_KINDS.replace(
            "[service]",
            &format!("limit_s = 100\n[service]\nspare = {spare}"),
        );
        let scenario = parse(&format!("{text}[[service.random]]\nn = 1\n"));
        let checked = order(kind, every_s).check(&scenario, &Catalog::new(&scenario));
        checked.map_err(|error| error.to_string())
    };
    assert_eq!(check(1, "dust", None), Ok(()));
    assert_eq!(check(3, "dust", Some(50.0)), Ok(()));
    for (spare, kind, every_s, refusal) in [
        (
            1,
            "dusk",
            None,
            "fault.point.kind: there is no kind 'dusk'; did you mean 'dust'? (there are garbage, dust)",
        ),
        (
            0,
            "dust",
            None,
            "fault.point: no task is reserved for another point; set service.spare to the number of points that faults add",
        ),
        (
            2,
            "dust",
            Some(50.0),
            "every_s: 3 points until limit_s are more than service.spare, 2; order them less often, or increase service.spare",
        ),
    ] {
        assert_eq!(check(spare, kind, every_s), Err(refusal.to_owned()));
    }
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
        each.map(|set| SERVICE.behavior_properties(scenario, set).max_robots)
            .collect()
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

#[test]
fn points_without_a_way_give_a_warning() {
    let warned = |walls: &str, points: &str, skills: &str, starts: &[f32]| -> Vec<String> {
        let text = format!(
            "room = {{ width_m = 8, height_m = 4 }}\n[service]\n{points}\n\
             [[service.kinds]]\nname = 't'\nwork_s = {{ min = 5, max = 5 }}\n\
             [[service.kinds]]\nname = 'u'\nwork_s = {{ min = 5, max = 5 }}\n{walls}\n\
             [[robots]]\nname = 'a'\n[[robots]]\nname = 'b'\n{skills}\n"
        );
        let starts: Vec<Vec2> = starts.iter().map(|x_m| Vec2::new(*x_m, 2.0)).collect();
        let warnings = SERVICE.warnings(&parse(&text), &starts);
        let remedy = "; move the obstacles, or let a robot start there";
        let lines = warnings.iter().map(ToString::to_string);
        lines
            .map(|line| line.strip_suffix(remedy).unwrap_or(&line).to_owned())
            .collect()
    };
    let wall = "[[obstacles]]\nx_m = 4\ny_m = 0\nwidth_m = 0.2\nheight_m = 4";
    let gap = wall.replace("height_m = 4", "height_m = 3.5");
    let points = "points = [{ kind = 't', x_m = 6, y_m = 2 }, { kind = 'u', x_m = 2, y_m = 3 }]";
    let no_way = ["service.points[0]: obstacles leave no way to p0 at (6, 2)"];
    assert_eq!(warned(wall, points, "", &[1.0, 1.0]), no_way);
    assert_eq!(warned(wall, points, "", &[1.0, 7.0]), [""; 0]);
    assert_eq!(
        warned(wall, points, "skills = { u = 1 }", &[1.0, 7.0]),
        no_way,
        "b cannot do t"
    );
    assert_eq!(warned(&gap, points, "", &[1.0, 1.0]), [""; 0]);
    let near = points.replace("x_m = 6", "x_m = 4.4");
    assert_eq!(
        warned(wall, &near, "", &[1.0, 1.0]).len(),
        1,
        "0.6 m behind the wall"
    );
    let random = "random = [{ kind = 't', n = 4 }, { kind = 'u', n = 4 }]";
    let drawn = |index: usize| {
        format!(
            "service.random[{index}]: obstacles leave no way to a part of the room, and points may be drawn there"
        )
    };
    assert_eq!(warned(wall, random, "", &[1.0, 1.0]), [drawn(0), drawn(1)]);
    assert_eq!(warned(wall, random, "", &[1.0, 7.0]), [""; 0]);
    assert_eq!(
        warned(wall, random, "skills = { u = 1 }", &[1.0, 7.0]),
        [drawn(0)]
    );
    // A narrow strip in which no robot has room holds no drawn point.
    let strip = "[[obstacles]]\nx_m = 0\ny_m = 0.3\nwidth_m = 8\nheight_m = 0.1";
    assert_eq!(warned(strip, random, "", &[1.0, 1.0]), [""; 0]);
}
