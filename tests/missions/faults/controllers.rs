//! Faulty sensors, broken actuators and babbling robots: the team detects them, takes over their tasks, and completes
//! the mission.

use proto::tick::Outcome;
use run_log::{EventRow, MotivationRow, RunLog};
use scenario::time::SimTime;

use super::{at, events, hit, mission};

fn motivation_rows(log: &RunLog, robot: &str, set: &str) -> Vec<MotivationRow> {
    let mut rows = log.rows::<MotivationRow>().unwrap();
    rows.retain(|row| row.robot == robot && row.behavior_set == set);
    rows
}

/// Returns the first activation of a task by another robot after a time.
#[track_caller]
fn taken_over(log: &RunLog, task: &str, from: &str, after: SimTime) -> EventRow {
    let rows = events(log, "activated", None).into_iter();
    rows.filter(|row| row.detail == task && row.robot != from)
        .find(|row| row.t_ms > after)
        .unwrap_or_else(|| panic!("no robot takes {task} over from {from} after {after}"))
}

/// Returns the largest error of the border in a PositionUpdate, in m.
fn error_m(update: &EventRow) -> f32 {
    let numbers = update
        .detail
        .replace(['[', ']', ','], " ")
        .replace("to", " ");
    let reported: Vec<f32> = numbers
        .split_whitespace()
        .map(|number| number.parse().unwrap())
        .collect();
    let real = [0.0, 0.0, 12.0, 9.0];
    let errors = reported
        .iter()
        .zip(real)
        .map(|(reported, real)| (reported - real).abs());
    errors.fold(0.0, f32::max)
}

#[test]
fn wrong_locations_are_detected_and_withdrawn() {
    for (name, mode, from, to) in [
        ("biased", "{ bias = { m = 1.5 } }", 5.0, 75.0),
        ("noisy", "{ noise = { m = 1.0 } }", 5.0, 75.0),
        ("stuck", "\"stuck\"", 40.0, 75.0),
    ] {
        let seconds = to - from;
        let scenario = format!(
            "[[faults.timeline]]\nid = \"s\"\nat_s = {from}\nfor_s = {seconds}\n\
             fault.sensor = {{ robot = \"blue\", device = \"position\", mode = {mode} }}\n"
        );
        let log = mission(name, &scenario, Outcome::Complete);
        hit(&log, "s");
        let updates = events(&log, "position-update", None);
        let wrong = updates.iter().find(|update| error_m(update) > 1.0);
        let wrong = wrong.unwrap_or_else(|| panic!("{name}: never wrong: {updates:?}"));
        let withdrawn = events(&log, "locations-withdrawn", None);
        let withdrawn = withdrawn.iter().find(|row| row.t_ms > wrong.t_ms);
        let withdrawn = withdrawn.unwrap_or_else(|| panic!("{name}: not withdrawn: {wrong:?}"));
        // A teammate of the finder searches again and finds the right locations.
        let corrected = updates
            .iter()
            .find(|update| update.t_ms > withdrawn.t_ms && error_m(update) < 0.1);
        assert!(corrected.is_some(), "{name}: {updates:?}");
    }
}

/// Returns the robot that first moves items of the top spill, and the time of its activation.
fn mover() -> (String, SimTime) {
    let log = mission("undisturbed", "", Outcome::Complete);
    let activated = events(&log, "activated", None);
    let first = activated
        .iter()
        .find(|row| row.subject == "move-spill(top)");
    let first = first.unwrap();
    (first.robot.clone(), first.t_ms)
}

#[test]
fn the_tasks_of_robots_with_broken_actuators_or_babble_are_taken_over() {
    let (robot, since) = mover();
    let at_s = since.as_secs_f64() + 5.0;
    for (name, fault) in [
        (
            "gripper",
            format!("actuator = {{ robot = \"{robot}\", mode = \"gripper\" }}"),
        ),
        (
            "slow",
            format!("actuator = {{ robot = \"{robot}\", mode = {{ slowed = 0.2 }} }}"),
        ),
        (
            "dead-drive",
            format!("actuator = {{ robot = \"{robot}\", mode = \"dead\" }}"),
        ),
        ("no-power", format!("power = \"{robot}\"")),
        ("babble", format!("babble = \"{robot}\"")),
    ] {
        let scenario = format!("[[faults.timeline]]\nid = \"a\"\nat_s = {at_s}\nfault.{fault}\n");
        let log = mission(name, &scenario, Outcome::Complete);
        hit(&log, "a");
        let robot = robot.as_str();
        let active = motivation_rows(&log, robot, "move-spill(top)");
        let before = active.iter().find(|row| row.t_ms == at(at_s)).unwrap();
        assert_eq!(
            before.state, "active",
            "{name}: the robot must work before the fault"
        );
        let taken = taken_over(&log, "move-spill(top)", robot, at(at_s));
        // A robot without progress loses its task after patience φ, the fast rise and a wait of at most ψ + τ. A slow
        // robot still makes progress: its own λ applies, then the fast rise.
        let setup = &log.run.setup.alliance;
        let set = |name: &str| &setup.robots[name].sets["move-spill(top)"];
        let teammate = set(&taken.robot);
        let up_s = setup.threshold / teammate.fast_impatience;
        let bound_s = if name == "slow" {
            set(robot).before_giving_up_s + up_s + teammate.ceased_after_s
        } else {
            teammate.willing_to_affect_s[robot]
                + up_s
                + teammate.before_yielding_s
                + teammate.ceased_after_s
        };
        let late = taken.t_ms.since(at(at_s));
        assert!(late <= at(bound_s), "{name}: {late} after the fault");
        // The robot is not lost: its heartbeats continue.
        assert!(events(&log, "gone", None).is_empty());
    }
}
