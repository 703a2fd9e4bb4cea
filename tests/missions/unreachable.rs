//! Points behind walls do not keep robots from the other points, by every allocator.

use alliance_tests::runs::{self, Events, allocators, parse};
use proto::tick::Outcome;
use run_log::RunLog;

/// A wall over the whole height of the room, from x = 2 m to 2.2 m: from the start, and one that appears while the first
/// robot is on its way to a point behind it.
const OBSTACLE: &str = "obstacles = [{ x_m = 2.0, y_m = 0.0, width_m = 0.2, height_m = 4.0 }]\n";
const FAULT: &str = "faults.timeline = [{ at_s = 1.0, \
     fault.obstacle = { x_m = 2.0, y_m = 0.0, width_m = 0.2, height_m = 4.0 } }]\n";

fn play(
    allocator: &str,
    wall: &str,
    service: &str,
    robots: &[f32],
    points: &[[f32; 2]],
) -> (Outcome, RunLog) {
    // Its robots leave a task only by chance.
    let limit_s = match allocator {
        "threshold" => 1800.0,
        _ => 600.0,
    };
    let mut text = format!(
        "allocator = '{allocator}'\nlimit_s = {limit_s:?}\nroom = {{ width_m = 8.0, height_m = 4.0 }}\n{wall}\
         [service]\n{service}\n\
         [[service.kinds]]\nname = 't'\nwork_s = {{ min = 5.0, max = 5.0 }}\n"
    );
    for [x_m, y_m] in points {
        text += &format!("[[service.points]]\nkind = 't'\nx_m = {x_m:?}\ny_m = {y_m:?}\n");
    }
    for (rank, y_m) in robots.iter().enumerate() {
        let start = format!("{{ x_m = 3.5, y_m = {y_m:?}, heading_deg = 180.0 }}");
        text += &format!("[[robots]]\nname = 'r{rank}'\nstart = {start}\n");
    }
    runs::play(parse(&text), 1)
}

/// Returns the points that are done, in ascending order.
fn done(log: &RunLog) -> Vec<String> {
    let done = log.events("done").into_iter();
    let mut done: Vec<String> = done.map(|row| row.subject).collect();
    done.sort();
    done
}

/// The nearest point is behind the wall. A rule that always selects the nearest one again would never do the others.
#[test]
fn a_robot_leaves_an_unreachable_point_and_does_the_others() {
    for allocator in allocators() {
        // At the nearer one of these points, something else than a wall could be in the way.
        for (wall, service, x_m) in [
            (OBSTACLE, "", 0.5),
            (OBSTACLE, "", 1.5),
            (FAULT, "", 0.5),
            (OBSTACLE, "tasks = 'kinds'", 0.5),
        ] {
            let points = [[x_m, 2.0], [6.5, 1.0], [6.5, 3.0]];
            let (outcome, log) = play(allocator, wall, service, &[2.0], &points);
            let run = format!("{allocator}, {wall} {service}, {x_m} m");
            assert_eq!(outcome, Outcome::TimeLimit, "{run}");
            assert_eq!(done(&log), ["p1", "p2"], "{run}");
        }
    }
}

/// The first point is delivered behind the wall. Its work succeeds each time, but its load never arrives.
#[test]
fn an_unreachable_delivery_keeps_no_robot_from_the_other_points() {
    let points = "points = [
        { kind = 't', x_m = 4.0, y_m = 2.0, deliver_to = [0.5, 2.0] },
        { kind = 't', x_m = 6.5, y_m = 1.0, arrival_s = 20.0 },
        { kind = 't', x_m = 6.5, y_m = 3.0, arrival_s = 20.0 },
    ]";
    for allocator in allocators() {
        for wall in [OBSTACLE, FAULT] {
            let (outcome, log) = play(allocator, wall, points, &[2.0], &[]);
            let run = format!("{allocator}, {wall}");
            assert_eq!(outcome, Outcome::TimeLimit, "{run}");
            assert_eq!(done(&log), ["p1", "p2"], "{run}");
        }
    }
}

/// The first point needs two robots, which a wall keeps apart. The robot at the point does not wait there for ever.
#[test]
fn a_partner_behind_a_wall_keeps_no_robot_from_the_other_points() {
    let wall = "faults.timeline = [{ at_s = 1.0, \
         fault.obstacle = { x_m = 0.0, y_m = 1.9, width_m = 8.0, height_m = 0.2 } }]\n";
    let points = "points = [
        { kind = 't', x_m = 4.5, y_m = 1.0, needs = { t = 2 } },
        { kind = 't', x_m = 6.5, y_m = 0.5, arrival_s = 20.0 },
        { kind = 't', x_m = 6.5, y_m = 3.5, arrival_s = 20.0 },
    ]";
    for allocator in allocators() {
        let (outcome, log) = play(allocator, wall, points, &[1.0, 3.0], &[]);
        assert_eq!(outcome, Outcome::TimeLimit, "{allocator}");
        assert_eq!(done(&log), ["p1", "p2"], "{allocator}");
    }
}

#[test]
fn a_team_does_all_reachable_points() {
    let points = [0.5, 0.5, 0.5, 0.5, 5.5, 6.5, 5.5, 6.5].into_iter();
    let points: Vec<[f32; 2]> = points
        .zip([0.5, 1.5, 2.5, 3.5].into_iter().cycle())
        .map(|(x_m, y_m)| [x_m, y_m])
        .collect();
    for allocator in allocators() {
        for wall in [OBSTACLE, FAULT] {
            let (_, log) = play(allocator, wall, "", &[1.0, 2.0, 3.0], &points);
            let reachable = ["p4", "p5", "p6", "p7"];
            assert_eq!(done(&log), reachable, "{allocator}, {wall}");
        }
    }
}
