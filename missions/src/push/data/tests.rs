//! Valid and invalid scenarios of push, and their catalogs.

use std::collections::BTreeSet;

use scenario::{Catalog, Setup};

use super::*;
use crate::Registry;

const ONE: &str = "[push]\n[[push.bars]]\nx_m = 2\ny_m = 3\ngoal_x_m = 9\n";

fn read(text: &str) -> Result<Scenario, String> {
    Scenario::parse("s.toml", text, &Registry::built_in().vocabulary())
        .map_err(|error| error.to_string())
}

#[track_caller]
fn refused(text: &str, expected: &str) {
    assert_eq!(read(text).unwrap_err(), expected, "for {text}");
}

#[test]
fn mistakes_give_messages_of_one_line() {
    let with = |from: &str, to: &str| ONE.replace(from, to);
    let key = |line: &str| with("[push]\n", &format!("[push]\n{line}\n"));
    refused(
        &with("y_m = 3", "y_m = 0.5"),
        "s.toml:4: push.bars[0].y_m: a bar of 2.4 m does not fit there; it must be at least 1.3 m from the border",
    );
    refused(
        &with("x_m = 2", "x_m = 0.4"),
        "s.toml:3: push.bars[0].x_m: no robot of radius 0.2 m fits behind the bar; write at least 0.5",
    );
    refused(
        &with("goal_x_m = 9", "goal_x_m = 1"),
        "s.toml:5: push.bars[0].goal_x_m: 1 cannot be reached from 2; it must be above 2 and at most 11.1, because one end leads",
    );
    refused(
        &key("length_m = 1"),
        "s.toml:2: push.length_m: two robots of radius 0.2 m have no room behind a bar of 1 m; write at least 1.2",
    );
    refused(
        &key("skew_m = 2"),
        "s.toml:2: push.skew_m: a bar of 2.4 m would stand at more than 30 degrees; write at most 1.2",
    );
    refused(
        &key("stroke_m = 0.7"),
        "s.toml:2: push.stroke_m: a stroke of one robot alone would end at the skew of 0.8 m; write at most 0.418",
    );
    refused(
        &format!("{ONE}[[push.bars]]\nx_m = 2.1\ny_m = 4\ngoal_x_m = 9\n"),
        "s.toml:6: push.bars[1]: it overlaps bars[0]; move one of them",
    );
    refused(
        &format!("{ONE}[[obstacles]]\nx_m = 1.5\ny_m = 3\nwidth_m = 1\nheight_m = 1\n"),
        "s.toml:2: push.bars[0]: a bar overlaps an obstacle; move one of them",
    );
    refused(
        &format!("{ONE}[[robots]]\nname = 'a'\ntasks = ['push(left)']\n"),
        "s.toml:2: push.bars: no robot has push(right) among its tasks; assign the tasks to a robot",
    );
    assert!(read("[push]\n").unwrap_err().contains("bars"));
    let device = read(&format!(
        "{ONE}[[robots]]\nname = 'a'\ndevices = ['sonar']\n"
    ))
    .unwrap_err();
    assert!(
        device.contains("sonar") && device.lines().count() == 1,
        "{device}"
    );
}

#[test]
fn each_bar_has_two_tasks_and_a_robot_is_impatient_for_its_own_end() {
    let vocabulary = Registry::built_in().vocabulary();
    let builtin = vocabulary.builtin("parker-box").unwrap();
    let text = builtin
        .text
        .split("# Each robot is impatient")
        .next()
        .unwrap();
    let scenario = read(text).unwrap();
    let catalog = Catalog::new(&scenario);
    let names: Vec<&str> = catalog
        .tasks
        .iter()
        .map(|task| task.name.as_str())
        .collect();
    assert_eq!(names, ["push(left)", "push(right)"]);
    // The statements of the scenario equal the built-in values.
    let impatience = |scenario: &Scenario| -> Vec<f64> {
        let setup = Setup::resolve(scenario.clone(), 1, None).unwrap().setup;
        let robots = setup.alliance.robots.values();
        robots
            .flat_map(|robot| robot.sets.values().map(|set| set.fast_impatience))
            .collect()
    };
    assert_eq!(
        impatience(&scenario),
        impatience(&read(builtin.text).unwrap())
    );
    let two = read(&format!(
        "{ONE}[[push.bars]]\nx_m = 4\ny_m = 6\ngoal_x_m = 9\n"
    ))
    .unwrap();
    let tasks = Catalog::new(&two).tasks;
    let names: Vec<&str> = tasks.iter().map(|task| task.name.as_str()).collect();
    assert_eq!(
        names,
        [
            "push(b0-left)",
            "push(b0-right)",
            "push(b1-left)",
            "push(b1-right)"
        ]
    );
}

#[test]
fn the_family_is_valid_in_every_size() {
    for robots in [1, 2, 3, 4, 9, 10, 50, 300] {
        for bars in [1, 2, 3, 20, 67, 200] {
            let scenario = family(robots, bars);
            assert_eq!(scenario.robots.len(), robots);
            assert_eq!(PushSection::of(&scenario).bars.len(), bars);
            Registry::built_in()
                .worlds()
                .find(&scenario)
                .unwrap()
                .start_poses(&scenario)
                .unwrap();
            let setup = Setup::resolve(scenario, 1, None)
                .unwrap_or_else(|error| panic!("{robots} robots, {bars} bars: {error}"))
                .setup;
            let robots_of = setup.scenario.robots.iter();
            let tasks: BTreeSet<_> = robots_of
                .flat_map(|robot| setup.catalog.behaviors_of(robot))
                .collect();
            assert_eq!(tasks.len(), 2 * bars, "{robots} robots, {bars} bars");
        }
    }
    let largest = Setup::resolve(family(10_000, 10_000), 1, None)
        .unwrap()
        .setup;
    let task_counts = largest
        .alliance
        .robots
        .values()
        .map(|robot| robot.sets.len());
    assert!(task_counts.max() <= Some(12));
}
