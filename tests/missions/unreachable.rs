//! Points behind walls do not keep robots from the other points, by every allocator.

use missions::Registry;
use proto::tick::Outcome;
use run_log::{EventRow, LogLevel, RunLog};
use scenario::{Scenario, Setup};

use crate::in_process::run;
use crate::recompute::log_of;

/// A wall over the whole height of the room, from x = 2 m to 2.2 m.
const WALL: &str = "x_m = 2.0, y_m = 0.0, width_m = 0.2, height_m = 4.0";

/// A wall from the start.
fn obstacle() -> String {
    format!("obstacles = [{{ {WALL} }}]\n")
}

/// A wall that appears while the first robot is on its way to a point behind it.
fn fault() -> String {
    format!("faults.timeline = [{{ at_s = 1.0, fault.obstacle = {{ {WALL} }} }}]\n")
}

fn play(
    allocator: &str,
    wall: &str,
    service: &str,
    robots: &[f32],
    points: &[[f32; 2]],
) -> (Outcome, RunLog) {
    let mut text = format!(
        "allocator = '{allocator}'\nlimit_s = 1800.0\nroom = {{ width_m = 8.0, height_m = 4.0 }}\n{wall}\
         [service]\n{service}\n\
         [[service.kinds]]\nname = 't'\nwork_s = {{ min = 5.0, max = 5.0 }}\n"
    );
    for [x_m, y_m] in points {
        text += &format!("[[service.points]]\nkind = 't'\nx_m = {x_m:?}\ny_m = {y_m:?}\n");
    }
    for (rank, y_m) in robots.iter().enumerate() {
        text += &format!(
            "[[robots]]\nname = 'r{rank}'\nstart = {{ x_m = 3.5, y_m = {y_m:?}, heading_deg = 180.0 }}\n"
        );
    }
    let known = Registry::built_in().vocabulary();
    let scenario = Scenario::parse("s.toml", &text, &known).unwrap_or_else(|why| panic!("{why}"));
    let (outcome, recorder) = run(
        Setup::resolve(scenario, 1, None).unwrap().setup,
        LogLevel::Full,
    );
    (outcome, log_of(recorder))
}

/// Returns the points that are done, in ascending order.
fn done(log: &RunLog) -> Vec<String> {
    let rows = log.rows::<EventRow>().unwrap().into_iter();
    let mut done: Vec<String> = rows
        .filter(|row| row.kind == "done")
        .map(|row| row.subject)
        .collect();
    done.sort();
    done
}

/// The nearest point is behind the wall. A rule that always selects the nearest one again would never do the others.
#[test]
fn a_robot_leaves_an_unreachable_point_and_does_the_others() {
    for allocator in Registry::built_in().vocabulary().allocators {
        // At the nearer one of these points, something else than a wall could be in the way.
        for (wall, service, x_m) in [
            (obstacle(), "", 0.5),
            (obstacle(), "", 1.5),
            (fault(), "", 0.5),
            (obstacle(), "tasks = 'kinds'", 0.5),
        ] {
            let points = [[x_m, 2.0], [6.5, 1.0], [6.5, 3.0]];
            let (outcome, log) = play(allocator.name, &wall, service, &[2.0], &points);
            let run = format!("{}, {wall} {service}, {x_m} m", allocator.name);
            assert_eq!(outcome, Outcome::TimeLimit, "{run}");
            assert_eq!(done(&log), ["p1", "p2"], "{run}");
        }
    }
}

/// The attempts at an unreachable point become rare.
#[test]
fn the_time_between_attempts_doubles() {
    let (_, log) = play(
        "nearest",
        &obstacle(),
        "",
        &[2.0],
        &[[0.5, 2.0], [6.5, 1.0]],
    );
    let rows = log.rows::<EventRow>().unwrap();
    let of_p0 = |kind: &str| -> Vec<u64> {
        let rows = rows
            .iter()
            .filter(|row| row.kind == kind && row.detail == "serve(p0)");
        rows.map(|row| row.t_ms.0).collect()
    };
    let (begun, ended) = (of_p0("activated"), of_p0("hibernated"));
    let spans: Vec<u64> = ended
        .iter()
        .zip(&begun[1..])
        .map(|(end, begin)| begin - end)
        .collect();
    // The robot is at another point when the first suspension of 30 s is over. It leaves its task one step after the failure.
    assert_eq!(
        spans[1..],
        [59_950, 119_950, 239_950, 479_950],
        "{begun:?} {ended:?}"
    );
}

#[test]
fn a_team_does_all_reachable_points() {
    const POINTS: [[f32; 2]; 8] = [
        [0.5, 0.5],
        [0.5, 1.5],
        [0.5, 2.5],
        [0.5, 3.5],
        [5.5, 0.5],
        [6.5, 1.5],
        [5.5, 2.5],
        [6.5, 3.5],
    ];
    for allocator in Registry::built_in().vocabulary().allocators {
        for wall in [obstacle(), fault()] {
            let (_, log) = play(allocator.name, &wall, "", &[1.0, 2.0, 3.0], &POINTS);
            let reachable = ["p4", "p5", "p6", "p7"];
            assert_eq!(done(&log), reachable, "{}, {wall}", allocator.name);
        }
    }
}
