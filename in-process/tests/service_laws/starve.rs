//! Scenarios in which a place that robots cannot use must not keep them from the rest.

use missions::Registry;

use crate::{Run, laws, parse, run};

/// A room with a walled corner, for a robot that must charge several times. The nearest charger is in the corner, and
/// another one is free.
const CHARGERS: &str = "\
    limit_s = 1200\nstep_ms = 200\nroom = { width_m = 8, height_m = 8 }\n\
    energy = { capacity_j = 1500, idle_w = 2, drive_w = 20 }\n\
    [service]\nreserve = 0.6\ncosts = 'COSTS'\n\
    [[service.chargers]]\nx_m = 0.9\ny_m = 0.9\nrate_w = 60\n\
    [[service.chargers]]\nx_m = 7\ny_m = 7\nrate_w = 60\n\
    [[service.kinds]]\nname = 't'\nwork_s = { min = 20, max = 20 }\n\
    [[robots]]\nname = 'r0'\nstart = { x_m = 3.2, y_m = 3.2 }\n";
const PLACES: [(f32, f32); 12] = [
    (2.8, 2.8),
    (3.5, 2.5),
    (2.5, 3.6),
    (3.2, 1.0),
    (1.0, 3.4),
    (3.0, 3.0),
    (4.0, 2.0),
    (2.0, 4.0),
    (3.6, 3.6),
    (2.6, 2.6),
    (3.0, 1.6),
    (1.6, 3.0),
];
const CORNER: [&str; 2] = [
    "{ x_m = 1.8, y_m = 0, width_m = 0.3, height_m = 2.1 }",
    "{ x_m = 0, y_m = 1.8, width_m = 2.1, height_m = 0.3 }",
];

/// Returns a scenario with points of kind t at these places, each with further keys.
pub fn with_points(text: &str, places: &[(f32, f32)], more: &str) -> String {
    let points = places.iter().map(|(x_m, y_m)| {
        format!("[[service.points]]\nkind = 't'\nx_m = {x_m}\ny_m = {y_m}\n{more}\n")
    });
    text.to_owned() + &points.collect::<String>()
}

/// Runs a scenario with an allocator. Returns the run, the number of points that are done, and that of all points.
pub fn outcome(allocator: &str, text: &str) -> (Run, [u64; 2]) {
    let run = run(parse(&format!("allocator = '{allocator}'\n{text}")), 1);
    let mission = &run.log.run.result.mission;
    let counts = ["done", "open"].map(|name| mission.get(name).count());
    let total = counts[0] + counts[1] + mission.get("expired").count();
    (run, [counts[0], total])
}

/// The memory of failed attempts holds for chargers: with walls from the start or walls that appear, a lone robot
/// charges at the charger that it can reach, and does all points.
#[test]
fn a_walled_charger_does_not_keep_a_robot_from_another() {
    let walls =
        CORNER.map(|wall| format!("[[faults.timeline]]\nat_s = 1\nfault.obstacle = {wall}\n"));
    let appearing = walls.concat();
    let stated = format!("obstacles = [{}]\n", CORNER.join(", "));
    let allocators = Registry::built_in().vocabulary().allocators.into_iter();
    // The rule of response thresholds promises no end.
    for allocator in allocators.filter(|allocator| allocator.name != "threshold") {
        for (before, after, costs) in [
            (stated.as_str(), "", "line"),
            (stated.as_str(), "", "path"),
            ("", appearing.as_str(), "line"),
        ] {
            let text = format!("{before}{}{after}", with_points(CHARGERS, &PLACES, ""));
            let (run, counts) = outcome(allocator.name, &text.replace("COSTS", costs));
            laws::check_energy(&run);
            assert_eq!(counts, [12, 12], "{} {costs} {before}", allocator.name);
        }
    }
}

/// A stated point arrives at its time, also after `duration_s`, which ends the arrivals of drawn points.
#[test]
fn a_point_after_the_duration_is_done() {
    let text = "limit_s = 300\nstep_ms = 200\nroom = { width_m = 6, height_m = 6 }\n\
        [service]\nduration_s = 30\n\
        [[service.kinds]]\nname = 't'\nwork_s = { min = 2, max = 2 }\n\
        [[service.random]]\nn = 1\nat_s = 40\n\
        [[robots]]\nname = 'a'\n";
    for places in [&[(3.0, 3.0)][..], &[(3.0, 3.0), (4.0, 3.0)]] {
        let text = with_points(text, places, "arrival_s = 40");
        for allocator in ["alliance", "cbba", "nearest", "ssi"] {
            let total = places.len() as u64;
            assert_eq!(outcome(allocator, &text).1, [total; 2], "{allocator}");
        }
    }
}
