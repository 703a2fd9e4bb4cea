//! Checks of service scenarios, and the values derived from them.

mod faults;

use std::collections::BTreeSet;

use proptest::prelude::*;
use scenario::Catalog;
use scenario::testkit::{entry, refusals};
use scenario::time::SimTime;

use super::*;
use crate::fixtures::{parse, read, resolve};
use crate::service::data::family::family;

/// Two kinds of work, and a robot with all skills.
const TWO_KINDS: &str = "[service]\n\
    [[service.kinds]]\nname = 'garbage'\nwork_s = { min = 6, max = 10 }\n\
    [[service.kinds]]\nname = 'dust'\nwork_s = { min = 20, max = 30 }\n";

/// Returns the scenario of [`TWO_KINDS`] with more lines.
fn two_kinds(more: &str) -> Scenario {
    parse(&format!("{TWO_KINDS}{more}"))
}

/// Returns a point of a kind at a place.
fn point(kind: &str, x_m: f32, y_m: f32) -> String {
    format!("[[service.points]]\nkind = '{kind}'\nx_m = {x_m}\ny_m = {y_m}\n")
}

#[test]
fn mistakes_give_one_line_of_error() {
    let with = |more: &str| format!("{TWO_KINDS}{more}");
    let texts = [
        TWO_KINDS.to_owned(),
        with(&point("dusk", 1.0, 1.0)),
        with("[[service.random]]\nn = 3\nkind = 'floor'\n"),
        with("[[service.random]]\nn = 999999\n[[service.random]]\nn = 999999\n"),
        with(&point("dust", 100.0, 1.0)),
        TWO_KINDS.replace("min = 6, max = 10", "min = 12, max = 10"),
        // Two robots of radius 0.2 m fit on opposite sides of a point within 0.3 m. Neighbors are 0.3·2·sin(60°) = 0.52 m
        // apart for three robots, and 0.35 m for five.
        with("workers = 5\n[[service.random]]\nn = 3\n"),
    ];
    insta::assert_snapshot!(refusals("s.toml", texts, read));
}

const ENERGY: &str = "energy = { capacity_j = 500, idle_w = 1, drive_w = 9 }\n";

#[test]
fn mistakes_in_properties_give_one_line_of_error() {
    let with = |more: &[&str]| {
        let places = (1..).map(|x_m| point("dust", x_m as f32, 1.0));
        let points: Vec<String> = places.zip(more).map(|(point, more)| point + more).collect();
        format!("{TWO_KINDS}{}", points.join("\n"))
    };
    let texts = [
        with(&["opens_s = 30\ndeadline_s = 30"]),
        with(&["opens_s = 30\ndeadline_s = 20.5"]),
        with(&["name = 'a'", "name = 'b'", "name = 'a'"]),
        with(&["name = 'p1'", "name = 'p1'"]),
        with(&["name = 'a b'"]),
        with(&["value = 0"]),
        with(&["value = nan"]),
        with(&["deadline_s = inf"]),
        with(&["priority = 0.5"]),
        with(&["deadline_s = -1"]),
        with(&["opens = 5"]),
        with(&["after = ['p0']"]),
        with(&["after = ['p1']", "after = ['p0']"]),
        with(&[
            "",
            "name = 'roof'\nafter = ['p2']",
            "after = ['p0', 'p3']",
            "after = ['roof']",
            "after = ['p3']",
        ]),
        with(&["name = 'roof'", "after = ['rook']"]),
        with(&["", "after = ['p0']"]).replace("max = 30 }", "max = 30 }\nperiod_s = 60"),
        with(&["deliver_to = [3, 100]"]),
        with(&["deliver_to = [3]"]),
        with(&["deliver_to = [4, 4]\n"]) + BLOCK,
        with(&["deliver_to = [3, 3]\nneeds = { arm = 2 }"]),
        with(&["deliver_to = [3, 3]"]).replace("max = 30 }", "max = 30 }\nperiod_s = 60"),
        with(&["needs = { arm = 0 }"]),
        with(&["needs = { arm = 17 }"]),
        with(&["needs = { 'an arm' = 1 }"]),
        with(&["", "needs = { arm = 2, camera = 2 }"]),
        with(&["needs = { arm = 1, camera = 1 }\n"])
            + "[[robots]]\nname = 'r1'\nskills = { arm = 1, camera = 1 }\n\
               [[robots]]\nname = 'r2'\nskills = { dust = 1 }\n",
        with(&["needs = { arm = 1 }"]).replace("[service]", "[service]\ntasks = 'kinds'"),
        with(&["[[service.chargers]]\nx_m = 3\ny_m = 3\nrate_w = 20\n"]),
        ENERGY.to_owned()
            + &with(&["[[service.chargers]]\nx_m = 3\ny_m = 3\nrate_w = 20\nslots = 7\n"]),
        ENERGY.to_owned()
            + &with(&["[[service.chargers]]\nx_m = 4\ny_m = 4\nrate_w = 20\n"])
            + BLOCK,
        ENERGY.to_owned() + &with(&["[[service.chargers]]\nx_m = 3\ny_m = 3\nrate_w = 0\n"]),
        with(&[""]).replace("[service]", "[service]\nreserve = 0.3"),
    ];
    insta::assert_snapshot!(refusals("s.toml", texts, read));
    let valid = with(&["name = 'p0'\nopens_s = 0\ndeadline_s = 40\nvalue = 2.5\npriority = -3"]);
    let scenario = parse(&valid);
    assert_eq!(Catalog::new(&scenario).tasks[0].priority, -3);
    let [spec] = points(&scenario, 1)[..] else {
        panic!("one point");
    };
    assert_eq!(
        (spec.value, spec.expires_after),
        (2.5, Some(SimTime(40_000)))
    );
    // A scenario survives writing and reading.
    assert_eq!(parse(&scenario.to_toml().unwrap()), scenario);
}

proptest! {
    /// A check finds a cycle exactly if the points have no order, by a search for an order.
    #[test]
    fn cycles_are_found(edges in proptest::collection::vec((0..7_usize, 0..7_usize), 0..14)) {
        let mut after = vec![Vec::new(); 7];
        for (point, before) in &edges {
            after[*point].push(format!("'p{before}'"));
        }
        let lines = after.iter().map(|after| point("dust", 1.0, 1.0) + &format!("after = [{}]\n", after.join(", ")));
        let lines: Vec<String> = lines.collect();
        let text = format!("{TWO_KINDS}{}", lines.concat());
        let mut done = BTreeSet::new();
        for _ in 0..7 {
            let is_free = |point: &usize| edges.iter().all(|(each, before)| each != point || done.contains(before));
            let free: Vec<usize> = (0..7).filter(is_free).collect();
            done.extend(free);
        }
        let answer = read(&text);
        prop_assert_eq!(answer.is_ok(), done.len() == 7);
        if let Err(problem) = answer {
            prop_assert!(problem.to_string().contains("a cycle of precedence"), "{}", problem);
        }
    }
}

/// Each slot is a task, and the robots with its skill have a behavior for it.
#[test]
fn each_slot_is_a_task() {
    let text = format!(
        "{TWO_KINDS}spare = 1\n{}needs = {{ arm = 1, dust = 2 }}\n{}\
         [[robots]]\nname = 'gold'\nskills = {{ dust = 1 }}\n[[robots]]\nname = 'blue'\nskills = {{ arm = 1, dust = 2 }}\n\
         [[robots]]\nname = 'green'\nskills = {{ garbage = 1, dust = 0.5 }}\n",
        point("garbage", 1.0, 1.0),
        point("garbage", 3.0, 1.0),
    );
    let text = text
        .replace("spare = 1\n", "")
        .replace("[service]\n", "[service]\nspare = 1\n");
    let scenario = parse(&text);
    let catalog = Catalog::new(&scenario);
    let names: Vec<&str> = catalog
        .tasks
        .iter()
        .map(|task| task.name.as_str())
        .collect();
    let expected = [
        "serve(p0-arm)",
        "serve(p1)",
        "serve(p2)",
        "serve(p0-dust-1)",
        "serve(p0-dust-2)",
    ];
    assert_eq!(names, expected);
    let own = scenario.robots.iter().map(|robot| {
        let own = catalog.behaviors_of(robot);
        own.map(|id| catalog.sets[id.index()].task.0)
            .collect::<Vec<u32>>()
    });
    assert!(own.eq([vec![2, 3, 4], vec![0, 2, 3, 4], vec![1, 2, 3, 4]]));
    assert!(catalog.tasks.iter().all(|task| task.max_robots == 1));
    assert_eq!(parse(&scenario.to_toml().unwrap()), scenario);
}

/// 10,000 kinds are valid, each with a point.
#[test]
fn kinds_have_no_limit_worth_mentioning() {
    let kinds = (0..MAX_KINDS).map(|kind| {
        format!("[[service.kinds]]\nname = 'k{kind}'\nwork_s = {{ min = 1, max = 2 }}\n")
    });
    let kinds: Vec<String> = kinds.collect();
    let text = format!(
        "[service]\n{}[[service.random]]\nn = 10000\n",
        kinds.concat()
    );
    let setup = resolve(parse(&text));
    let last = setup.catalog.sets.last().unwrap();
    assert_eq!(last.skill.as_deref(), Some("k9999"));
}

/// A block covers the room from (3, 3) to (5, 5).
const BLOCK: &str = "[[obstacles]]\nx_m = 3\ny_m = 3\nwidth_m = 2\nheight_m = 2\n";

#[test]
fn a_stated_point_that_no_robot_can_work_on_is_refused() {
    let at = |x_m: f32, y_m: f32| format!("{TWO_KINDS}{}{BLOCK}", point("dust", x_m, y_m));
    let unreachable = [at(4.0, 4.0), at(0.0, 0.0)];
    insta::assert_snapshot!(refusals("s.toml", unreachable, read));
    // A place at a wall or at the block is kept as it is stated.
    for (x_m, y_m) in [(0.0, 4.0), (5.0, 4.0), (8.0, 4.0)] {
        let stated = points(&parse(&at(x_m, y_m)), 1)[0].at;
        assert_eq!(stated, Vec2::new(x_m, y_m));
    }
}

#[test]
fn a_drawn_point_in_an_obstacle_is_drawn_again() {
    let drawn = "[[service.random]]\nn = 200\n";
    let free = two_kinds(drawn);
    let blocked = two_kinds(&format!("{drawn}{BLOCK}"));
    let is_clear = |at: Vec2| {
        let outside = (at - at.clamp(Vec2::splat(3.0), Vec2::splat(5.0))).length();
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
    let mut left = points(&two_kinds(&format!("{drawn}{robot}{full}")), 1).into_iter();
    assert!(
        left.all(|point| point.at.x <= 0.3),
        "only the left lane is free"
    );
}

/// A task that no robot can do is a mistake, unless `uncovered` allows it.
#[test]
fn every_task_is_covered() {
    let points = point("garbage", 1.0, 1.0) + &point("dust", 1.0, 2.0);
    let team = "[[robots]]\nname = 'gold'\nskills = { garbage = 1 }\n\
        [[robots]]\nname = 'blue'\nskills = { garbage = 0.5, dust = 0 }\n";
    let text = format!("{TWO_KINDS}{points}{team}");
    let skill = text.replace("dust = 0 ", "dusk = 1 ");
    insta::assert_snapshot!(refusals("s.toml", [&text, &skill], read));
    let ends = |text: &str| SERVICE.expected_properties(&parse(text)).ends;
    let meant = text.replace("[service]\n", "[service]\nuncovered = true\n");
    assert!(!ends(&meant), "p1 stays forever");
    assert!(ends(&text.replace("dust = 0 ", "dust = 0.1 ")));
}

/// Returns the text of a scenario with its warnings, for a snapshot.
fn warned(text: &str, starts: &[f32]) -> String {
    let starts: Vec<Vec2> = starts.iter().map(|x_m| Vec2::new(*x_m, 2.0)).collect();
    let warnings = SERVICE.warnings(&parse(text), &starts);
    let lines: Vec<String> = warnings.iter().map(ToString::to_string).collect();
    match &lines[..] {
        [] => entry(text, "(no warning)"),
        lines => entry(text, &lines.join("\n")),
    }
}

#[test]
fn work_that_cannot_be_done_in_time_gives_a_warning() {
    let work = "work_s = { min = 3, max = 5 }";
    let random = "[[service.random]]\nn = 4";
    let arrives = |arrival_s: f64| point("t", 3.0, 3.0) + &format!("arrival_s = {arrival_s}");
    let with = |more: &str| format!("{work}\n{more}\n{random}");
    let answers = [
        with(""),
        format!("{work}\n{}", arrives(117.0)),
        format!("{work}\n{}", arrives(4000.0)),
        format!("{work}\n{}", arrives(120.0)),
        format!("{work}\n{}", arrives(119.99)),
        format!("{work}\n{random}\nat_s = 200"),
        format!("{work}\n[[service.random]]\nn = 40\nrate_hz = 0.1"),
        format!("work_s = {{ min = 1e6, max = 1e6 }}\n{random}"),
        with("deadline_s = { min = 1, max = 2 }"),
        with("period_s = 1"),
        format!(
            "{work}\n{}",
            arrives(0.0) + "\nopens_s = 5\ndeadline_s = 7.5"
        ),
        format!("{work}\n{}", arrives(0.0) + "\nopens_s = 5\ndeadline_s = 8"),
        format!("{work}\n{}", arrives(0.0) + "\nopens_s = 118"),
        with("period_s = 10\ndeadline_s = { min = 30, max = 30 }"),
        with("") + "\n[[robots]]\nname = 'a'\n[[robots]]\nname = 'b'\nskills = { t = 1e-30 }",
    ]
    .map(|kind| {
        let text = format!("limit_s = 120\n[service]\n[[service.kinds]]\nname = 't'\n{kind}");
        warned(&text, &[])
    });
    insta::assert_snapshot!(answers.concat());
}

#[test]
fn a_robot_has_the_behaviors_that_its_skills_allow() {
    let text = point("dust", 1.0, 1.0)
        + "[[service.random]]\nn = 3\n\
           [[robots]]\nname = 'gold'\nskills = { garbage = 1 }\n[[robots]]\nname = 'blue'\n";
    let text = format!("{TWO_KINDS}{text}");
    let own = |text: &str| -> Vec<Vec<String>> {
        let scenario = parse(text);
        let catalog = Catalog::new(&scenario);
        let name = |id| catalog.behavior_name(id).to_owned();
        let robots = scenario.robots.iter();
        robots
            .map(|robot| catalog.behaviors_of(robot).map(name).collect())
            .collect()
    };
    // Drawn points take turns in kind: p1 garbage, p2 dust, p3 garbage.
    let [gold, blue] = &own(&text)[..] else {
        panic!("two robots");
    };
    assert_eq!(*gold, ["serve(p1)", "serve(p3)"]);
    assert_eq!(blue.len(), 4);
    let kinds = own(&text.replace("[service]\n", "[service]\ntasks = 'kinds'\n"));
    let (garbage, dust) = ("serve(garbage)", "serve(dust)");
    assert_eq!(kinds, [vec![garbage], vec![garbage, dust]]);
}

/// By hand: the way across 12 × 9 m is 15 m minus the reach of 0.3 m. 14.7 m take 29.4 s at 0.5 m/s, a half turn 2 s at
/// 90°/s. The most work of the kind, 30 s, takes 60 s at skill 0.5.
#[test]
fn alliance_values_follow_from_the_unit_of_work() {
    let team = "[[robots]]\nname = 'gold'\nskills = { garbage = 1, dust = 0.5 }\n";
    let text = format!("{TWO_KINDS}[[service.random]]\nn = 2\n{team}");
    let scenario = parse(&text);
    let catalog = Catalog::new(&scenario);
    let [garbage, dust] = &catalog.sets[..] else {
        panic!("two behaviors");
    };
    let robot = &scenario.robots[0];
    let near = |found: f64, expected: f64| {
        assert!((found - expected).abs() < 1e-4, "{found} {expected}");
    };
    near(
        SERVICE.work_unit_s(&scenario)(&scenario.body, 0.5, dust),
        91.4,
    );
    let built_in = SERVICE.default_alliance_params(&scenario, robot, dust);
    near(built_in.willing_to_affect_s, 182.8);
    near(built_in.before_yielding_s, 182.8);
    near(built_in.before_giving_up_s, 365.6);
    near(100.0 * built_in.slow_impatience, 100.0 * 100.0 / 182.8);
    assert_eq!(built_in.fast_impatience, 20.0);
    // The faster robot has less patience: 29.4 + 2 + 10 s.
    let faster = SERVICE.default_alliance_params(&scenario, robot, garbage);
    near(faster.willing_to_affect_s, 82.8);
    // Without travel, only the work counts.
    let still = parse(&text.replace("[service]\n", "[service]\nreach_m = 1000\n"));
    let unit_s = SERVICE.work_unit_s(&still)(&still.body, 1.0, garbage);
    assert_eq!(unit_s, 10.0);
}

#[test]
fn a_task_allows_as_many_robots_as_its_point() {
    let text = format!("{TWO_KINDS}workers = 2\n[[service.random]]\nn = 2\n");
    let most = |text: &str| -> Vec<u32> {
        let tasks = Catalog::new(&parse(text)).tasks.into_iter();
        tasks.map(|task| task.max_robots).collect()
    };
    assert_eq!(most(&text), [1, 2]);
    let kinds = text.replace("[service]\n", "[service]\ntasks = 'kinds'\n");
    assert_eq!(most(&kinds), [1, 1]);
}

proptest! {
    #[test]
    fn points_are_drawn_as_the_scenario_says(seed: u64, n in 1..60_u32, at_s in 0.0..100.0_f64, rate_hz in 0.01..10.0_f64) {
        let scenario = two_kinds(&format!(
            "{}arrival_s = 5\nwork_s = 7\n\
             [[service.random]]\nn = {n}\nat_s = {at_s}\nrate_hz = {rate_hz}\n\
             [[service.random]]\nn = {n}\nkind = 'dust'\n",
            point("dust", 3.0, 4.0),
        ));
        let drawn = points(&scenario, seed);
        prop_assert_eq!(&drawn, &points(&scenario, seed));
        prop_assert_ne!(&drawn, &points(&scenario, seed.wrapping_add(1)));
        let n = n as usize;
        prop_assert_eq!(drawn.len(), 1 + 2 * n);
        let placed = &drawn[0];
        prop_assert_eq!((placed.at, placed.work_s), (Vec2::new(3.0, 4.0), 7.0));
        prop_assert_eq!(placed.arrives, SimTime::from_secs_f64(5.0));
        let kinds: Vec<usize> = drawn.iter().map(|point| point.kind).collect();
        prop_assert_eq!(&kinds, &ServiceSection::of(&scenario).kinds_of_points().collect::<Vec<_>>());
        for point in &drawn[1..] {
            let work = [6.0..=10.0, 20.0..=30.0];
            prop_assert!(work[point.kind].contains(&point.work_s));
            let radius_m = scenario.body.radius_m;
            prop_assert!(point.at.cmpge(Vec2::splat(radius_m)).all());
            prop_assert!(point.at.cmple(Vec2::new(12.0, 9.0) - radius_m).all());
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
    let scenario = two_kinds("[[service.random]]\nn = 4000\nrate_hz = 0.5\n");
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
            let setup = resolve(scenario);
            let team = setup.scenario.robots.iter();
            let behaviors = team.flat_map(|robot| setup.catalog.behaviors_of(robot));
            let worked_on: BTreeSet<_> = behaviors.collect();
            assert_eq!(worked_on.len(), points, "{robots} robots, {points} points");
        }
    }
    // Each robot has parameter values only for its own behaviors.
    let largest = resolve(family(10_000, 10_000)).alliance.robots;
    let own = largest.values().map(|robot| robot.sets.len());
    assert!(own.max() <= Some(12));
    // A point has three robots and a robot two points.
    let mut robots_on = std::collections::BTreeMap::new();
    for robot in family(100, 67).robots {
        assert!(robot.tasks.len() >= 2, "{}", robot.name);
        for task in robot.tasks {
            *robots_on.entry(task).or_insert(0) += 1;
        }
    }
    assert!(robots_on.len() == 67 && robots_on.values().all(|robots| *robots >= 3));
}

#[test]
fn points_without_a_way_give_a_warning() {
    let block = |x_m, y_m, width_m, height_m| {
        format!(
            "[[obstacles]]\nx_m = {x_m}\ny_m = {y_m}\nwidth_m = {width_m}\nheight_m = {height_m}"
        )
    };
    let wall = &block(4.0, 0.0, 0.2, 4.0);
    let gap = &block(4.0, 0.0, 0.2, 3.5);
    // A narrow strip in which no robot has room holds no drawn point.
    let strip = &block(0.0, 0.3, 8.0, 0.1);
    let points = "points = [{ kind = 't', x_m = 6, y_m = 2 }, { kind = 'u', x_m = 2, y_m = 3 }]";
    // 0.6 m behind the wall.
    let near: &str = &points.replace("x_m = 6", "x_m = 4.4");
    let random = "random = [{ kind = 't', n = 4 }, { kind = 'u', n = 4 }]";
    let only_u = "skills = { u = 1 }";
    let chargers = &format!(
        "{points}\nchargers = [{{ x_m = 7, y_m = 2, rate_w = 9 }}, {{ x_m = 2, y_m = 2, rate_w = 9 }}]"
    );
    let energy = "[energy]\ncapacity_j = 500\nidle_w = 1\ndrive_w = 9";
    let answers = [
        (wall, points, "", 1.0),
        (wall, points, "", 7.0),
        (wall, points, only_u, 7.0),
        (gap, points, "", 1.0),
        (wall, near, "", 1.0),
        (wall, random, "", 1.0),
        (wall, random, "", 7.0),
        (wall, random, only_u, 7.0),
        (strip, random, "", 1.0),
        (wall, chargers, energy, 1.0),
    ]
    .map(|(walls, points, skills, start_m)| {
        let text = format!(
            "room = {{ width_m = 8, height_m = 4 }}\n[service]\n{points}\n\
             [[service.kinds]]\nname = 't'\nwork_s = {{ min = 5, max = 5 }}\n\
             [[service.kinds]]\nname = 'u'\nwork_s = {{ min = 5, max = 5 }}\n{walls}\n\
             [[robots]]\nname = 'a'\n[[robots]]\nname = 'b'\n{skills}\n# b starts at {start_m} m"
        );
        warned(&text, &[1.0, start_m])
    });
    insta::assert_snapshot!(answers.concat());
}

/// A wall separates robot b, at 7 m, from robot a.
#[test]
fn robots_that_a_wall_separates_cannot_work_together() {
    for (point, expected) in [
        ("needs = { t = 1 }", ""),
        (
            "needs = { t = 2 }",
            "service.points[0]: obstacles leave no way to p0 at (6, 2) for all 2 robots that it needs; \
             move the obstacles, or let a robot start there",
        ),
        ("deliver_to = [7, 1]", ""),
        (
            "deliver_to = [2, 2]",
            "service.points[0].deliver_to: obstacles leave no way from p0 to its delivery at (2, 2); \
             move the obstacles, or let a robot start there",
        ),
    ] {
        let text = format!(
            "room = {{ width_m = 8, height_m = 4 }}\n\
             [[obstacles]]\nx_m = 4\ny_m = 0\nwidth_m = 0.2\nheight_m = 4\n\
             [service]\npoints = [{{ kind = 't', x_m = 6, y_m = 2, {point} }}]\n\
             [[service.kinds]]\nname = 't'\nwork_s = {{ min = 5, max = 5 }}\n\
             [[robots]]\nname = 'a'\n[[robots]]\nname = 'b'\n"
        );
        let starts = [Vec2::new(1.0, 2.0), Vec2::new(7.0, 2.0)];
        let warnings = SERVICE.warnings(&parse(&text), &starts);
        let warnings: Vec<String> = warnings.iter().map(ToString::to_string).collect();
        assert_eq!(warnings.concat(), expected);
    }
}

/// The graph of ways grows fast with the obstacles.
#[test]
fn costs_by_path_need_few_obstacles() {
    let text = |costs: &str, count: usize| {
        let obstacles = (0..count).map(|index| {
            let (x_m, y_m) = (
                0.5 + (index % 20) as f32 * 0.5,
                2.0 + (index / 20) as f32 * 0.8,
            );
            format!("[[obstacles]]\nx_m = {x_m}\ny_m = {y_m}\nwidth_m = 0.01\nheight_m = 0.01\n")
        });
        let obstacles: Vec<String> = obstacles.collect();
        let section = TWO_KINDS.replace("[service]", &format!("[service]\ncosts = '{costs}'"));
        format!(
            "{section}{}{}",
            point("dust", 11.0, 1.0),
            obstacles.concat()
        )
    };
    let refused = read(&text("path", 101)).unwrap_err().to_string();
    assert_eq!(
        refused,
        "s.toml:2: service.costs: the room has 101 solid obstacles, more than 100; set costs = 'line', or give fewer obstacles"
    );
    for (costs, count) in [("path", 100), ("line", 101)] {
        let scenario = parse(&text(costs, count));
        assert_eq!(parse(&scenario.to_toml().unwrap()), scenario);
        let robots = resolve(scenario).for_robots().scenario.obstacles.len();
        assert_eq!(
            robots,
            if costs == "path" { 100 } else { 0 },
            "the map of the robots"
        );
    }
    let refused = read(&text("walk", 1)).unwrap_err().to_string();
    assert!(
        refused.starts_with("s.toml:2: service.costs: "),
        "{refused}"
    );
}
