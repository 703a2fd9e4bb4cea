//! Process faults: real signals in a stated tick, and restarted processes.

use alliance_tests::harness::Lab;
use proto::control::Phase;
use proto::tick::Outcome;
use run_log::{EventRow, MessageRow, MotivationRow, PoseRow, RunOutcome};
use scenario::time::SimTime;

use super::{at, events, hit, mission, mission_by_processes, only};

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
    let log = mission_by_processes(&lab, scenario, &[], 0);
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
fn a_kill_by_an_event_precedes_the_delivery_of_its_broadcast() {
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
        let lab = Lab::new();
        let log = mission_by_processes(&lab, scenario, &["--step-order", order], 0);
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

/// The target is the robot that executed the task in the previous tick. Without such a robot the fault waits for the
/// next one.
#[test]
fn a_fault_on_the_executing_robot_applies_at_its_time_or_waits_for_one() {
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
    let log = mission("role", scenario, Outcome::Complete);
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
    let log = mission_by_processes(&lab, &scenario, &[], 0);
    assert_eq!(events(&log, "gone", None).len(), 3);
    assert_eq!(events(&log, "stalled", None).len(), 3);
    let back = events(&log, "back", None);
    assert!(back.len() == 3 && back.iter().all(|row| row.t_ms == at(105.0)));
}

#[test]
fn a_restart_ends_a_kill() {
    let scenario = r#"
        limit_s = 60.0
        [[faults.timeline]]
        id = "k"
        fault.kill = "gold"
        at_s = 20.0
        [[faults.timeline]]
        fault.restart = "gold"
        at_s = 40.0
    "#;
    let log = mission("anew", scenario, Outcome::TimeLimit);
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
    let log = mission_by_processes(&lab, &pauses.concat(), &["--limit", "60"], 1);
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
    let log = mission_by_processes(&lab, scenario, &[], 0);
    hit(&log, "a");
    hit(&log, "r");
    assert_eq!(only(&log, "joined", "red").t_ms, at(80.0));
    assert_eq!(only(&log, "gone", "gold").t_ms, at(120.0));
    let first = events(&log, "activated", Some("red"))[0].t_ms;
    assert!(first > at(80.0));
    let poses = log.rows::<PoseRow>().unwrap();
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
