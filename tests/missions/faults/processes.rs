//! Process faults: real signals in a stated tick, and restarted processes.

use proto::control::Phase;
use proto::tick::Outcome;
use run_log::{EventRow, MessageRow, MotivationRow, PoseRow, RunLog, RunOutcome};
use scenario::time::SimTime;

use super::{at, events, hit, mission, only};
use crate::harness::Lab;

#[test]
fn the_timeline_kills_pauses_terminates_and_restarts_processes() {
    let lab = Lab::new();
    let scenario = r#"
        [[faults.timeline]]
        id = "k"
        fault.kill = "gold"
        at_s = 60.0
        for_s = 40.0
        [[faults.timeline]]
        id = "p"
        fault.pause = "green"
        at_s = 50.0
        for_s = 30.0
        [[faults.timeline]]
        id = "t"
        fault.terminate = "blue"
        at_s = 110.0
        for_s = 20.0
        [[faults.timeline]]
        id = "r"
        fault.restart = "green"
        at_s = 150.0
    "#;
    let log = mission(&lab, "processes", scenario, &[], 0);
    for id in ["k", "p", "t", "r"] {
        assert_eq!(hit(&log, id).hits, 1, "{id}");
    }
    // There is no such event before the first fault.
    let first = at(50.0);
    let early = log.rows::<EventRow>().unwrap().into_iter().find(|row| {
        let kind = row.kind.as_str();
        row.t_ms < first && row.t_ms > at(0.0) && ["gone", "stalled", "joined"].contains(&kind)
    });
    assert_eq!(early, None);

    assert_eq!(only(&log, "stalled", "green").t_ms, at(50.0));
    assert_eq!(only(&log, "back", "green").t_ms, at(80.0));
    let gone = |robot| only(&log, "gone", robot);
    assert_eq!(gone("gold").t_ms, at(60.0));
    assert_eq!(
        gone("gold").detail,
        "incarnation 1; last counted in tick 1200; last broadcasts not listed"
    );
    assert_eq!(gone("blue").t_ms, at(110.0));
    assert_eq!(gone("green").t_ms, at(150.0));
    for (robot, back) in [("gold", 100.0), ("blue", 130.0), ("green", 150.0)] {
        let joined = events(&log, "joined", Some(robot));
        let joins: Vec<_> = joined
            .iter()
            .map(|row| (row.t_ms, row.detail.as_str()))
            .collect();
        assert_eq!(
            joins,
            [(at(0.0), "incarnation 1"), (at(back), "incarnation 2")],
            "{robot}"
        );
        // The new incarnation receives the locations by radio alone, and works.
        let after = |kind| {
            let rows = events(&log, kind, Some(robot));
            rows.into_iter().find(|row| row.t_ms > at(back))
        };
        assert!(
            after("locations-learned").is_some(),
            "{robot} does not learn the locations"
        );
        assert!(after("activated").is_some(), "{robot} activates nothing");
    }
    // Restarted robots also receive the time of the last report, so no report comes early. Two robots may report at
    // the same time.
    let reports: Vec<_> = events(&log, "reported", None)
        .iter()
        .map(|row| row.t_ms)
        .collect();
    assert!(reports.len() >= 2);
    assert!(
        reports
            .windows(2)
            .map(|pair| pair[1].since(pair[0]))
            .all(|gap| gap <= at(1.0) || gap >= at(100.0)),
        "{reports:?}"
    );
    // A crashed robot sends nothing. A stopped robot neither steps nor sends.
    let silent = |robot: &str, from: f64, to: f64| {
        let messages = log.rows::<MessageRow>().unwrap();
        let motivations = log.rows::<MotivationRow>().unwrap();
        messages
            .iter()
            .all(|row| row.sender != robot || !(at(from)..at(to)).contains(&row.sent_ms))
            && motivations
                .iter()
                .all(|row| row.robot != robot || !(at(from + 0.05)..at(to)).contains(&row.t_ms))
    };
    assert!(
        silent("gold", 60.0, 100.0),
        "the last tick counts but its broadcasts are not delivered"
    );
    assert!(silent("blue", 110.0, 130.0));
    assert!(silent("green", 50.0, 80.0));
}

#[test]
fn a_restarted_robot_learns_the_empty_spill() {
    let lab = Lab::new();
    let scenario = r#"
        [[waste.spills]]
        name = "top"
        items = 2
        y_fraction = 0.6667
        [[waste.spills]]
        name = "bottom"
        items = 12
        y_fraction = 0.3333
        [[faults.timeline]]
        id = "r"
        fault.restart = "green"
        at_s = 130.0
    "#;
    let log = mission(&lab, "empty", scenario, &[], 0);
    hit(&log, "r");
    let emptied = &events(&log, "spill-empty", None)[0];
    let back = events(&log, "joined", Some("green"))[1].t_ms;
    assert!(back > emptied.t_ms);
    // Soon after its return the robot treats the top spill as empty, though it has never sensed it.
    let rows = log.rows::<MotivationRow>().unwrap();
    let top = rows.iter().filter(|row| {
        row.robot == "green"
            && row.behavior_set == "move-spill(top)"
            && (back + at(5.0)..back + at(20.0)).contains(&row.t_ms)
    });
    let applicable: Vec<_> = top.map(|row| row.sensory_feedback).collect();
    assert!(!applicable.is_empty() && applicable.iter().all(|applicable| !applicable));
    let bottom = rows.iter().any(|row| {
        row.robot == "green"
            && row.behavior_set == "move-spill(bottom)"
            && row.t_ms == back + at(5.0)
            && row.sensory_feedback
    });
    assert!(bottom, "the bottom spill must be applicable");
}

#[test]
fn a_kill_by_an_event_precedes_the_delivery_of_its_broadcast() {
    let lab = Lab::new();
    // Blue must be the first robot to activate the task.
    let scenario = r#"
        [[faults.timeline]]
        id = "k"
        fault.kill = "blue"
        when = "blue activates move-spill(top)"
        [alliance.robots.blue.sets."move-spill(top)"]
        fast_impatience = 20.0
    "#;
    for order in ["simultaneous", "in-order"] {
        for seed in ["1", "2", "3"] {
            let name = format!("event-{order}-{seed}");
            let arguments = ["--seed", seed, "--step-order", order];
            let log = mission(&lab, &name, scenario, &arguments, 0);
            hit(&log, "k");
            let activated = events(&log, "activated", Some("blue"));
            let last = activated.last().unwrap();
            assert_eq!(last.subject, "move-spill(top)");
            assert_eq!(only(&log, "gone", "blue").t_ms, last.t_ms);
            let messages = log.rows::<MessageRow>().unwrap();
            let from_blue: Vec<_> = messages.iter().filter(|row| row.sender == "blue").collect();
            assert!(!from_blue.is_empty());
            assert!(from_blue.iter().all(|row| row.sent_ms < last.t_ms));
            // The report of that tick counts: the last motivation row is of that tick.
            let motivations = log.rows::<MotivationRow>().unwrap();
            let counted = motivations.iter().filter(|row| row.robot == "blue");
            assert_eq!(counted.map(|row| row.t_ms).max(), Some(last.t_ms));
            // The other robots complete the mission.
            let took_over = events(&log, "activated", None)
                .into_iter()
                .find(|row| row.robot != "blue" && row.subject == "move-spill(top)");
            assert!(took_over.unwrap().t_ms >= last.t_ms);
        }
    }
    let arguments = ["--seed", "1", "--step-order", "simultaneous"];
    mission(&lab, "event-again", scenario, &arguments, 0);
    lab.assert_same_bytes("event-simultaneous-1", "event-again");
}

/// The target is the robot that executed the task in the previous tick. Without such a robot the fault waits for the
/// next one.
#[test]
fn a_fault_on_the_executing_robot_applies_at_its_time_or_waits_for_one() {
    let lab = Lab::new();
    let scenario = r#"
        [[faults.timeline]]
        id = "now"
        fault.kill = "executing:move-spill(top)"
        at_s = 150.0
        for_s = 30.0
        [[faults.timeline]]
        id = "next"
        fault.mute = "executing:report-progress"
        at_s = 30.0
        for_s = 2.0
    "#;
    let log = mission(&lab, "role", scenario, &[], 0);
    let motivations = log.rows::<MotivationRow>().unwrap();
    let active = |set: &str, t_ms: SimTime| {
        let mut rows = motivations.iter();
        let is_active = |row: &&MotivationRow| row.state == "active";
        let found = rows.find(|row| row.t_ms == t_ms && row.behavior_set == set && is_active(row));
        found.map(|row| row.robot.clone())
    };
    let applied = |id: &str| {
        let all = events(&log, "applied", None);
        all.into_iter().find(|row| row.subject == id).unwrap()
    };
    let mover = active("move-spill(top)", at(149.95)).expect("a robot must move the spill");
    let killed = applied("now");
    assert_eq!((killed.t_ms, &killed.robot), (at(150.0), &mover));
    assert_eq!(killed.detail, format!("kill {mover}"));
    assert_eq!(
        events(&log, "gone", Some(&mover)).first().unwrap().t_ms,
        at(150.0)
    );
    assert_eq!(hit(&log, "now").hits, 1);

    assert_eq!(
        active("report-progress", at(29.95)),
        None,
        "no robot may report yet"
    );
    let muted = applied("next");
    let before = SimTime(muted.t_ms.0 - 50);
    assert_eq!(active("report-progress", before), Some(muted.robot.clone()));
    assert_eq!(active("report-progress", SimTime(before.0 - 50)), None);
}

/// The target is the first robot without a task in the previous tick. A crashed robot is not idle.
#[test]
fn a_fault_on_an_idle_robot_applies_at_its_time_or_waits_for_one() {
    let lab = Lab::new();
    let scenario = r#"
        limit_s = 60.0
        [[faults.timeline]]
        id = "gold"
        fault.kill = "idle"
        at_s = 30.0
        for_s = 20.0
        [[faults.timeline]]
        id = "green"
        fault.mute = "idle"
        at_s = 35.0
        for_s = 2.0
    "#;
    let log = mission(&lab, "alliance", scenario, &[], 1);
    let victim = |log: &RunLog, id: &str| {
        let mut all = events(log, "applied", None).into_iter();
        let row = all.find(|row| row.subject == id)?;
        Some((row.t_ms, row.robot, row.detail))
    };
    // Blue is the only robot that follows the walls.
    let killed = (at(30.0), "gold".to_owned(), "kill gold".to_owned());
    assert_eq!(victim(&log, "gold"), Some(killed));
    assert_eq!(events(&log, "gone", Some("gold"))[0].t_ms, at(30.0));
    let muted = (at(35.0), "green".to_owned(), "mute green".to_owned());
    assert_eq!(victim(&log, "green"), Some(muted));
    assert!(hit(&log, "gold").hits == 1 && hit(&log, "green").hits > 0);

    // With `first-come` all robots search until they receive each other's claims. With `nearest` each robot always
    // has a task.
    let scenario_text =
        "limit_s = 10.0\n[[faults.timeline]]\nid = \"waits\"\nfault.kill = \"idle\"\nat_s = 0.05\n";
    let first_come = mission(
        &lab,
        "first-come",
        scenario_text,
        &["--allocator", "first-come"],
        1,
    );
    let poses = first_come.rows::<PoseRow>().unwrap();
    let is_idle = |row: &&PoseRow| row.behavior_set.is_empty();
    let (applied, robot, _) = victim(&first_come, "waits").unwrap();
    let first = poses.iter().find(is_idle).unwrap();
    assert!(first.t_ms > SimTime(0), "no robot may be idle at first");
    assert_eq!(
        (&first.robot, SimTime(first.t_ms.0 + 50)),
        (&robot, applied)
    );

    let nearest = mission(
        &lab,
        "nearest",
        scenario_text,
        &["--allocator", "nearest"],
        1,
    );
    assert_eq!(victim(&nearest, "waits"), None);
    let status = &nearest.run.faults[0];
    assert_eq!((status.phase, status.hits), (Phase::Armed, 0));
}

#[test]
fn a_crashed_or_stopped_team_is_restored_on_time() {
    let lab = Lab::new();
    let mut scenario = String::new();
    for robot in ["blue", "gold", "green"] {
        scenario += &format!(
            "[[faults.timeline]]\nfault.kill = \"{robot}\"\nat_s = 70.0\nfor_s = 10.0\n\
             [[faults.timeline]]\nfault.pause = \"{robot}\"\nat_s = 100.0\nfor_s = 5.0\n"
        );
    }
    let log = mission(&lab, "everybody", &scenario, &[], 0);
    assert_eq!(events(&log, "gone", None).len(), 3);
    assert_eq!(events(&log, "stalled", None).len(), 3);
    let back = events(&log, "back", None);
    assert!(back.len() == 3 && back.iter().all(|row| row.t_ms == at(105.0)));
}

#[test]
fn a_restart_ends_a_kill() {
    let lab = Lab::new();
    let scenario = r#"
        [[faults.timeline]]
        id = "k"
        fault.kill = "gold"
        at_s = 20.0
        [[faults.timeline]]
        fault.restart = "gold"
        at_s = 40.0
    "#;
    let log = mission(&lab, "anew", scenario, &["--limit", "60"], 1);
    let kill = hit(&log, "k");
    assert_eq!((kill.phase, kill.healed_ms), (Phase::Over, Some(at(40.0))));
    assert_eq!(events(&log, "joined", Some("gold")).len(), 2);
}

/// Time continues to the limit while all robots are stopped.
#[test]
fn a_team_that_is_paused_forever_stays_stopped_until_the_limit() {
    let lab = Lab::new();
    let pauses = [("blue", 5.0), ("gold", 5.0), ("green", 6.0)].map(|(robot, at_s)| {
        format!("[[faults.timeline]]\nfault.pause = \"{robot}\"\nat_s = {at_s:?}\n")
    });
    let log = mission(&lab, "paused", &pauses.concat(), &["--limit", "60"], 1);
    assert_eq!(log.run.outcome, RunOutcome::Ended(Outcome::TimeLimit));
    assert_eq!(log.run.result.ticks, 1200);
    assert_eq!(events(&log, "stalled", None).len(), 3);
}

#[test]
fn robots_are_added_and_removed_during_a_mission() {
    let lab = Lab::new();
    let scenario = r#"
        [[robots]]
        name = "blue"
        side_sensor = true
        [[robots]]
        name = "gold"
        [[robots]]
        name = "red"
        absent = true
        [[faults.timeline]]
        id = "a"
        fault.add = "red"
        at_s = 80.0
        [[faults.timeline]]
        id = "r"
        fault.remove = "gold"
        at_s = 120.0
    "#;
    let log = mission(&lab, "comings", scenario, &[], 0);
    hit(&log, "a");
    hit(&log, "r");
    assert_eq!(only(&log, "joined", "red").t_ms, at(80.0));
    assert_eq!(only(&log, "gone", "gold").t_ms, at(120.0));
    let first = events(&log, "activated", Some("red"))[0].t_ms;
    assert!(first > at(80.0));
    let poses = log.rows::<run_log::PoseRow>().unwrap();
    let seen = |robot: &str| -> Vec<_> {
        let rows = poses.iter().filter(|row| row.robot == robot);
        rows.map(|row| row.t_ms).collect()
    };
    assert_eq!(
        seen("red").first(),
        Some(&at(80.0)),
        "a robot has no body before it is added"
    );
    assert_eq!(
        seen("gold").last(),
        Some(&at(119.95)),
        "a robot has no body after it is removed"
    );
}
