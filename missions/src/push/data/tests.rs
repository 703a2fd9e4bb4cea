//! Valid and invalid scenarios of push, and their catalogs.

use std::collections::BTreeSet;

use scenario::Catalog;
use scenario::testkit::refusals;

use super::*;
use crate::Registry;
use crate::fixtures::{parse, read, resolve};

const ONE: &str = "[push]\n[[push.bars]]\nx_m = 2\ny_m = 3\ngoal_x_m = 9\n";

#[test]
fn mistakes_give_messages_of_one_line() {
    let with = |from: &str, to: &str| ONE.replace(from, to);
    let key = |line: &str| with("[push]\n", &format!("[push]\n{line}\n"));
    let texts = [
        with("y_m = 3", "y_m = 0.5"),
        with("x_m = 2", "x_m = 0.4"),
        with("goal_x_m = 9", "goal_x_m = 1"),
        key("length_m = 1"),
        key("skew_m = 2"),
        key("stroke_m = 0.7"),
        format!("{ONE}[[push.bars]]\nx_m = 2.1\ny_m = 4\ngoal_x_m = 9\n"),
        format!("{ONE}[[obstacles]]\nx_m = 1.5\ny_m = 3\nwidth_m = 1\nheight_m = 1\n"),
        format!("{ONE}[[robots]]\nname = 'a'\ntasks = ['push(left)']\n"),
        "[push]\n".to_owned(),
        format!("{ONE}[[robots]]\nname = 'a'\ndevices = ['sonar']\n"),
    ];
    insta::assert_snapshot!(refusals("s.toml", texts, read));
}

#[test]
fn bars_without_a_way_give_a_warning() {
    let warned = |more: &str, starts: &[(f32, f32)]| -> Vec<String> {
        let scenario = read(&format!("{ONE}{more}")).unwrap();
        let starts: Vec<Vec2> = starts.iter().map(|start| Vec2::from(*start)).collect();
        let warnings = PUSH.warnings(&scenario, &starts);
        let lines = warnings.iter().map(ToString::to_string);
        let what = lines.map(|line| line.split("; ").next().unwrap().to_owned());
        what.collect()
    };
    let none: [&str; 0] = [];
    let behind = [(1.0, 2.0), (1.0, 4.0)];
    assert_eq!(warned("", &behind), none);
    // A wall across the room behind the bar: robots on its other side have no way to either end.
    let wall = "[[obstacles]]\nx_m = 1.2\ny_m = 0\nwidth_m = 0.1\nheight_m = 9\n";
    let ends = [
        "push.bars[0]: obstacles leave no way to push(left)",
        "push.bars[0]: obstacles leave no way to push(right)",
    ];
    assert_eq!(warned(wall, &[(0.5, 2.0), (0.5, 4.0)]), ends);
    assert_eq!(warned(wall, &[(0.5, 2.0), (1.6, 5.0)]), none);
    // Only the robot on the other side has the task of the left end.
    let tasks = "[[robots]]\nname = 'a'\ntasks = ['push(left)']\n\
                 [[robots]]\nname = 'b'\ntasks = ['push(right)']\n";
    let both = format!("{wall}{tasks}");
    assert_eq!(warned(&both, &[(0.5, 2.0), (1.6, 5.0)]), ends[..1]);
    // The bar moves from x = 2 m to 9 m, between y = 2 m and 4 m or less.
    let before = "[[obstacles]]\nx_m = 6\ny_m = 2.9\nwidth_m = 0.2\nheight_m = 0.2\n";
    let blocked = ["push.bars[0]: an obstacle stands between the bar and its goal at x = 9 m"];
    assert_eq!(warned(before, &behind), blocked);
    assert_eq!(
        warned(&before.replace("y_m = 2.9", "y_m = 6"), &behind),
        none
    );
}

#[test]
fn each_bar_has_two_tasks_and_a_robot_is_impatient_for_its_own_end() {
    let names = |text: &str| -> Vec<String> {
        let tasks = Catalog::new(&parse(text)).tasks.into_iter();
        tasks.map(|task| task.name).collect()
    };
    assert_eq!(names(ONE), ["push(left)", "push(right)"]);
    let two = format!("{ONE}[[push.bars]]\nx_m = 4\ny_m = 6\ngoal_x_m = 9\n");
    let ends = ["b0-left", "b0-right", "b1-left", "b1-right"];
    assert_eq!(names(&two), ends.map(|end| format!("push({end})")));
    // The statements of the scenario equal the built-in values.
    let vocabulary = Registry::built_in().vocabulary();
    let stated = vocabulary.builtin("parker-box").unwrap().text;
    let (without, _) = stated.split_once("# Each robot is impatient").unwrap();
    let impatience = |text: &str| -> Vec<f64> {
        let robots = resolve(parse(text)).alliance.robots;
        let sets = robots.values().flat_map(|robot| robot.sets.values());
        sets.map(|set| set.fast_impatience).collect()
    };
    assert_eq!(impatience(without), impatience(stated));
}

#[test]
fn the_family_is_valid_in_every_size() {
    for robots in [1, 2, 3, 4, 9, 10, 50, 300] {
        for bars in [1, 2, 3, 20, 67, 200] {
            let scenario = family(robots, bars);
            assert_eq!(scenario.robots.len(), robots);
            assert_eq!(PushSection::of(&scenario).bars.len(), bars);
            let world = crate::push::MISSION.world;
            world.start_poses(&scenario).unwrap();
            let setup = resolve(scenario);
            let team = setup.scenario.robots.iter();
            let behaviors = team.flat_map(|robot| setup.catalog.behaviors_of(robot));
            let tasks: BTreeSet<_> = behaviors.collect();
            assert_eq!(tasks.len(), 2 * bars, "{robots} robots, {bars} bars");
        }
    }
    let largest = resolve(family(10_000, 10_000)).alliance.robots;
    let task_counts = largest.values().map(|robot| robot.sets.len());
    assert!(task_counts.max() <= Some(12));
}
