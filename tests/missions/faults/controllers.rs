//! Faulty sensors, broken actuators and babbling robots: the team detects them, takes over their tasks, and completes
//! the mission.

use alliance_tests::runs::Events;
use proto::tick::Outcome;
use run_log::{EventRow, MotivationRow};

use super::{at, hit, mission};

/// Returns the largest error of the border in a PositionUpdate, in m.
fn error_m(update: &EventRow) -> f32 {
    let numbers = update
        .detail
        .split(|letter: char| !(letter.is_ascii_digit() || ['.', '-'].contains(&letter)));
    let reported = numbers.filter_map(|number| number.parse::<f32>().ok());
    let errors = reported
        .zip([0.0, 0.0, 12.0, 9.0])
        .map(|(reported, real)| (reported - real).abs());
    errors.fold(0.0, f32::max)
}

#[test]
fn wrong_locations_are_detected_and_withdrawn() {
    for (name, mode, from) in [
        ("biased", "{ bias = { m = 1.5 } }", 5.0),
        ("noisy", "{ noise = { m = 1.0 } }", 5.0),
        ("stuck", "\"stuck\"", 40.0),
    ] {
        let scenario = format!(
            "[[faults.timeline]]\nid = \"s\"\nat_s = {from}\nfor_s = {}\n\
             fault.sensor = {{ robot = \"blue\", device = \"position\", mode = {mode} }}\n",
            75.0 - from
        );
        let log = mission(name, &scenario, Outcome::Complete);
        hit(&log, "s");
        let updates = log.events("position-update");
        let wrong = updates.iter().find(|update| error_m(update) > 1.0);
        let wrong = wrong.unwrap_or_else(|| panic!("{name}: never wrong: {updates:?}"));
        let mut withdrawn = log.events("locations-withdrawn");
        withdrawn.retain(|row| row.t_ms > wrong.t_ms);
        assert!(!withdrawn.is_empty(), "{name}: not withdrawn: {wrong:?}");
        // A teammate of the finder searches again and finds the right locations.
        let mut later = updates.iter().filter(|row| row.t_ms > withdrawn[0].t_ms);
        let is_corrected = later.any(|update| error_m(update) < 0.1);
        assert!(is_corrected, "{name}: {updates:?}");
    }
}

#[test]
fn the_tasks_of_robots_with_broken_actuators_or_babble_are_taken_over() {
    let task = "move-spill(top)";
    let activated = mission("undisturbed", "", Outcome::Complete).events("activated");
    let first = activated.iter().find(|row| row.subject == task).unwrap();
    let (robot, at_s) = (first.robot.as_str(), first.t_ms.as_secs_f64() + 5.0);
    let actuator = |mode: &str| format!("actuator = {{ robot = \"{robot}\", mode = {mode} }}");
    for (name, fault) in [
        ("gripper", actuator("\"gripper\"")),
        ("slow", actuator("{ slowed = 0.2 }")),
        ("dead-drive", actuator("\"dead\"")),
        ("no-power", format!("power = \"{robot}\"")),
        ("babble", format!("babble = \"{robot}\"")),
    ] {
        let scenario = format!("[[faults.timeline]]\nid = \"a\"\nat_s = {at_s}\nfault.{fault}\n");
        let log = mission(name, &scenario, Outcome::Complete);
        hit(&log, "a");
        let mut rows = log.rows::<MotivationRow>().unwrap();
        rows.retain(|row| row.robot == robot && row.behavior_set == task && row.t_ms == at(at_s));
        // A robot senses that it has no power, and gives up its task.
        let state = if name == "no-power" {
            "hibernating"
        } else {
            "active"
        };
        assert_eq!(rows[0].state, state, "{name}");
        let mut taken = log.events("activated");
        taken.retain(|row| row.detail == task && row.robot != robot && row.t_ms > at(at_s));
        assert!(!taken.is_empty(), "{name}: {task} is not taken over");
        // A robot without progress loses its task after patience φ, the fast rise and a wait of at most ψ + τ. A slow
        // robot still makes progress: its own λ applies, then the fast rise.
        let setup = &log.run.setup.alliance;
        let set = |name: &str| &setup.robots[name].sets[task];
        let teammate = set(&taken[0].robot);
        let patience_s = match name {
            "slow" => set(robot).before_giving_up_s,
            _ => teammate.willing_to_affect_s[robot] + teammate.before_yielding_s,
        };
        let up_s = setup.threshold / teammate.fast_impatience;
        let late = taken[0].t_ms.since(at(at_s));
        let is_in_time = late <= at(patience_s + up_s + teammate.ceased_after_s);
        assert!(is_in_time, "{name}: {late} after the fault");
        // The robot is not lost: its heartbeats continue.
        assert!(log.events("gone").is_empty());
    }
}
