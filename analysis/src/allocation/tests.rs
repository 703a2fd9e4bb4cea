use super::*;
use crate::testkit;

/// Two robots in a line and four points, two near each. All times differ, so that no rule meets a tie.
const LINE: &str = "\
name = 'line'
robots = [
    { name = 'blue', start = { x_m = 1.0, y_m = 2.0 } },
    { name = 'gold', start = { x_m = 11.0, y_m = 2.0 } },
]
[service]
kinds = [{ name = 'task', work_s = { min = 5.0, max = 5.0 } }]
points = [
    { kind = 'task', x_m = 2.0, y_m = 2.0 },
    { kind = 'task', x_m = 3.5, y_m = 2.0 },
    { kind = 'task', x_m = 9.6, y_m = 2.0 },
    { kind = 'task', x_m = 8.0, y_m = 2.0 },
]
";

fn allocation(allocator: &str, limit: u64) -> (Setup, Allocation) {
    let mut scenario = testkit::scenario(LINE);
    scenario.allocator = Some(allocator.to_owned());
    let setup = testkit::setup(scenario);
    let found = allocate(&setup, limit).unwrap();
    (setup, found)
}

fn tasks(allocation: &Allocation) -> Vec<Vec<usize>> {
    let robots = allocation.robots.iter();
    robots
        .map(|tasks| tasks.iter().map(|task| task.index()).collect())
        .collect()
}

#[test]
fn sequential_auctions_assign_all_tasks_and_the_hungarian_method_one_each() {
    for objective in ["minisum", "minimax", "miniave"] {
        let text = format!("{LINE}\n[allocators.ssi]\nobjective = \"{objective}\"\n");
        let mut scenario = testkit::scenario(&text);
        scenario.allocator = Some("ssi".to_owned());
        let found = allocate(&testkit::setup(scenario), 1000).unwrap();
        assert!(found.is_stable, "{objective}");
        assert_eq!(tasks(&found), [vec![0, 1], vec![2, 3]], "{objective}");
    }
    let (_, dhba) = allocation("dhba", 1000);
    assert!(dhba.is_stable);
    assert_eq!(tasks(&dhba), [vec![0], vec![2]]);
}

#[test]
fn a_bundle_algorithm_assigns_all_tasks_and_an_auction_one_each() {
    let (_, cbba) = allocation("cbba", 1000);
    assert_eq!(tasks(&cbba), [vec![0, 1], vec![2, 3]]);
    let objective = cbba.objective.clone().unwrap();
    // 0.7 m and 1.2 m at 0.5 m/s and 5 s of work each; 1.1 m and 1.3 m.
    let expected = [
        0.7 / 0.5 + 5.0 + 1.2 / 0.5 + 5.0,
        1.1 / 0.5 + 5.0 + 1.3 / 0.5 + 5.0,
    ];
    for (found, expected) in objective.robots_s.iter().zip(expected) {
        assert!((found - expected).abs() < 1e-4, "{found} {expected}");
    }
    assert_eq!(
        (objective.assigned, objective.shared, objective.tasks),
        (4, 0, 4)
    );
    assert!(cbba.is_stable && cbba.messages > 0, "{cbba:?}");

    for allocator in ["cbaa", "murdoch", "ble", "first-come"] {
        let (_, found) = allocation(allocator, 1000);
        assert_eq!(tasks(&found), [[0], [2]], "{allocator}");
        assert!(found.is_stable, "{allocator}");
    }
}

/// A slot has the place of its point. By hand: 4 m and 6 m to p0, 3 m from there to p1 and 5 m to its delivery, 0.3 m less
/// to each point, at 0.5 m/s, and 5 s of work each.
#[test]
fn a_point_is_assigned_if_different_robots_have_its_slots() {
    let scenario = testkit::scenario(
        "\
robots = [
    { name = 'blue', start = { x_m = 1.0, y_m = 2.0 }, skills = { a = 1, b = 1 } },
    { name = 'gold', start = { x_m = 11.0, y_m = 2.0 }, skills = { a = 1, b = 1 } },
]
[service]
kinds = [{ name = 'a', work_s = { min = 5.0, max = 5.0 } }]
points = [
    { kind = 'a', x_m = 5.0, y_m = 2.0, needs = { a = 1, b = 1 } },
    { kind = 'a', x_m = 8.0, y_m = 2.0, deliver_to = [8.0, 7.0] },
]
",
    );
    let setup = testkit::setup(scenario);
    let (blue_s, gold_s, delivery_s) = (
        3.7 / 0.5 + 5.0,
        5.7 / 0.5 + 5.0,
        2.7 / 0.5 + 5.0 + 5.0 / 0.5,
    );
    // The tasks of blue and gold, their times, and the numbers of assigned and shared points. Task 2 is the second slot
    // of p0.
    type Case = (&'static [u32], &'static [u32], [f64; 2], [usize; 2]);
    let cases: [Case; 4] = [
        (&[0, 1], &[2], [blue_s + delivery_s, gold_s], [2, 0]),
        (&[0, 2], &[], [blue_s, 0.0], [0, 0]),
        (&[0], &[0], [blue_s, gold_s], [0, 1]),
        (&[0, 2], &[0, 2], [blue_s, gold_s], [1, 1]),
    ];
    for (blue, gold, times_s, counts) in cases {
        let of_robot = |tasks: &[u32]| -> BTreeSet<TaskId> {
            tasks.iter().map(|task| TaskId(*task)).collect()
        };
        let robots = [blue, gold].map(of_robot);
        let found = Objective::new(&setup, &robots).unwrap().unwrap();
        for (found, expected) in found.robots_s.iter().zip(times_s) {
            assert!((found - expected).abs() < 1e-4, "{blue:?} {gold:?} {found}");
        }
        assert_eq!([found.assigned, found.shared], counts, "{blue:?} {gold:?}");
    }
}

#[test]
fn each_allocator_has_a_result_within_the_limit() {
    for spec in &missions::Registry::built_in().vocabulary().allocators {
        let (_, found) = allocation(spec.name, 1000);
        assert!(found.rounds <= 1000, "{}", spec.name);
        let is_empty = found.robots.iter().all(BTreeSet::is_empty);
        assert!(!is_empty || !found.is_stable, "{}: {found:?}", spec.name);
        // By response thresholds, a robot without progress gives up its task in the last of these rounds.
        assert_eq!(
            is_empty,
            spec.name == "threshold",
            "{}: {found:?}",
            spec.name
        );
        // The same inputs give the same rounds and messages.
        assert_eq!(allocation(spec.name, 1000).1, found, "{}", spec.name);
    }
}

#[test]
fn a_limit_that_is_too_low_is_reported() {
    let (setup, found) = allocation("cbba", 1);
    assert!(!found.is_stable);
    assert_eq!(json(&setup, &found)["stable"], false);
}

#[test]
fn the_text_has_a_line_per_robot() {
    let (setup, found) = allocation("cbba", 1000);
    insta::assert_snapshot!(text(&setup, &found));
}
