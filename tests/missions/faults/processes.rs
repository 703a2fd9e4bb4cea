//! Process faults: real signals in a stated tick, and restarted processes.

use alliance_tests::harness::Lab;
use alliance_tests::runs::Events;
use proto::control::Phase;
use proto::tick::Outcome;
use run_log::{EventRow, MessageRow, MotivationRow, PoseRow, RunOutcome};
use scenario::time::SimTime;

use super::{at, hit, mission, mission_by_processes, only};

#[test]
fn the_timeline_kills_pauses_terminates_and_restarts_processes() {
    let scenario = r#"
        [faults]
        timeline = [
            { id = "k", fault.kill = "gold", at_s = 60.0, for_s = 40.0 },
            { id = "p", fault.pause = "green", at_s = 50.0, for_s = 30.0 },
            { id = "t", fault.terminate = "blue", at_s = 110.0, for_s = 20.0 },
            { id = "r", fault.restart = "green", at_s = 150.0 },
        ]
    "#;
    let log = mission_by_processes(scenario, "", 0);
    for id in ["k", "p", "t", "r"] {
        assert_eq!(hit(&log, id).hits, 1, "{id}");
    }
    // There is no such event before the first fault.
    let mut events = log.rows::<EventRow>().unwrap().into_iter();
    let early = events.find(|row| {
        let is_of_process = ["gone", "stalled", "joined"].contains(&row.kind.as_str());
        is_of_process && row.t_ms > at(0.0) && row.t_ms < at(50.0)
    });
    assert_eq!(early, None);

    for (kind, robot, at_s) in [
        ("stalled", "green", 50.0),
        ("back", "green", 80.0),
        ("gone", "gold", 60.0),
        ("gone", "blue", 110.0),
        ("gone", "green", 150.0),
    ] {
        assert_eq!(only(&log, kind, robot).t_ms, at(at_s), "{kind} {robot}");
    }
    assert_eq!(
        only(&log, "gone", "gold").detail,
        "incarnation 1; last counted in tick 1200; last broadcasts not listed"
    );
    for (robot, back) in [("gold", 100.0), ("blue", 130.0), ("green", 150.0)] {
        let joined = log.events_of(robot, "joined");
        let joins = joined.iter().map(|row| (row.t_ms, row.detail.as_str()));
        let expected = [(at(0.0), "incarnation 1"), (at(back), "incarnation 2")];
        assert_eq!(joins.collect::<Vec<_>>(), expected, "{robot}");
        // The new incarnation receives the locations by radio alone, and works.
        for kind in ["locations-learned", "activated"] {
            let mut rows = log.events_of(robot, kind).into_iter();
            let is_there = rows.any(|row| row.t_ms > at(back));
            assert!(is_there, "no {kind} of {robot} after its return");
        }
    }
    // Restarted robots also receive the time of the last report, so no report comes early. Two robots may report at
    // the same time.
    let reports = log.events("reported");
    assert!(reports.len() >= 2);
    for pair in reports.windows(2) {
        let gap = pair[1].t_ms.since(pair[0].t_ms);
        assert!(gap <= at(1.0) || gap >= at(100.0), "{pair:?}");
    }
    // A crashed robot sends nothing. A stopped robot neither steps nor sends. The last tick before a crash counts, but
    // its broadcasts are not delivered.
    let messages = log.rows::<MessageRow>().unwrap();
    let motivations = log.rows::<MotivationRow>().unwrap();
    for (robot, from, to) in [
        ("gold", 60.0, 100.0),
        ("blue", 110.0, 130.0),
        ("green", 50.0, 80.0),
    ] {
        let mut sent = messages.iter().filter(|row| row.sender == robot);
        assert!(!sent.any(|row| (at(from)..at(to)).contains(&row.sent_ms)));
        let mut steps = motivations.iter().filter(|row| row.robot == robot);
        assert!(!steps.any(|row| (at(from + 0.05)..at(to)).contains(&row.t_ms)));
    }
}

#[test]
fn a_kill_by_an_event_precedes_the_delivery_of_its_broadcast() {
    // Blue must be the first robot to activate the task.
    let task = "move-spill(top)";
    let scenario = format!(
        "[[faults.timeline]]\nid = 'k'\nfault.kill = 'blue'\nwhen = 'blue activates {task}'\n\
         [alliance.robots.blue.sets.'{task}']\nfast_impatience = 20.0\n"
    );
    for order in ["simultaneous", "in-order"] {
        let log = mission_by_processes(&scenario, format!("--step-order {order}"), 0);
        hit(&log, "k");
        let last = log.events_of("blue", "activated").pop().unwrap();
        assert_eq!(last.subject, task);
        assert_eq!(only(&log, "gone", "blue").t_ms, last.t_ms);
        let mut messages = log.rows::<MessageRow>().unwrap();
        messages.retain(|row| row.sender == "blue");
        assert!(!messages.is_empty());
        assert!(messages.iter().all(|row| row.sent_ms < last.t_ms));
        // The report of that tick counts: the last motivation row is of that tick.
        let motivations = log.rows::<MotivationRow>().unwrap();
        let counted = motivations.iter().filter(|row| row.robot == "blue");
        assert_eq!(counted.map(|row| row.t_ms).max(), Some(last.t_ms));
        // The other robots complete the mission.
        let mut activated = log.events("activated").into_iter();
        let took_over = activated.find(|row| row.robot != "blue" && row.subject == task);
        assert!(took_over.unwrap().t_ms >= last.t_ms);
    }
}

/// The target is the robot that executed the task in the previous tick. Without such a robot the fault waits for the
/// next one.
#[test]
fn a_fault_on_the_executing_robot_applies_at_its_time_or_waits_for_one() {
    let scenario = r#"
        [faults]
        timeline = [
            { id = "now", fault.kill = "executing:move-spill(top)", at_s = 150.0, for_s = 30.0 },
            { id = "next", fault.mute = "executing:report-progress", at_s = 30.0, for_s = 2.0 },
        ]
    "#;
    let log = mission("role", scenario, Outcome::Complete);
    let mut active = log.rows::<MotivationRow>().unwrap();
    active.retain(|row| row.state == "active");
    let active = |set: &str, t_ms: SimTime| {
        let mut rows = active.iter();
        let found = rows.find(|row| row.t_ms == t_ms && row.behavior_set == set);
        found.map(|row| row.robot.clone())
    };
    let applied = |id: &str| {
        let mut all = log.events("applied").into_iter();
        all.find(|row| row.subject == id).unwrap()
    };
    let mover = active("move-spill(top)", at(149.95)).expect("a robot must move the spill");
    let killed = applied("now");
    assert_eq!((killed.t_ms, &killed.robot), (at(150.0), &mover));
    assert_eq!(killed.detail, format!("kill {mover}"));
    assert_eq!(log.times_of(&mover, "gone")[0], 150_000);
    assert_eq!(hit(&log, "now").hits, 1);

    let report = "report-progress";
    assert_eq!(active(report, at(29.95)), None, "no robot may report yet");
    let muted = applied("next");
    let before = SimTime(muted.t_ms.0 - 50);
    assert_eq!(active(report, before), Some(muted.robot));
    assert_eq!(active(report, SimTime(before.0 - 50)), None);
}

#[test]
fn a_crashed_or_stopped_team_is_restored_on_time() {
    let mut scenario = String::new();
    for robot in ["blue", "gold", "green"] {
        scenario += &format!(
            "[[faults.timeline]]\nfault.kill = \"{robot}\"\nat_s = 70.0\nfor_s = 10.0\n\
             [[faults.timeline]]\nfault.pause = \"{robot}\"\nat_s = 100.0\nfor_s = 5.0\n"
        );
    }
    let log = mission_by_processes(&scenario, "", 0);
    assert_eq!(log.events("gone").len(), 3);
    assert_eq!(log.events("stalled").len(), 3);
    let back = log.events("back");
    assert!(back.len() == 3 && back.iter().all(|row| row.t_ms == at(105.0)));
}

#[test]
fn a_restart_ends_a_kill() {
    let scenario = r#"
        limit_s = 60.0
        [faults]
        timeline = [
            { id = "k", fault.kill = "gold", at_s = 20.0 },
            { fault.restart = "gold", at_s = 40.0 },
        ]
    "#;
    let log = mission("anew", scenario, Outcome::TimeLimit);
    let kill = hit(&log, "k");
    assert_eq!((kill.phase, kill.healed_ms), (Phase::Over, Some(at(40.0))));
    assert_eq!(log.events_of("gold", "joined").len(), 2);
}

/// Time continues to the limit while all robots are stopped.
#[test]
fn a_team_that_is_paused_forever_stays_stopped_until_the_limit() {
    let pauses = [("blue", 5.0), ("gold", 5.0), ("green", 6.0)].map(|(robot, at_s)| {
        format!("[[faults.timeline]]\nfault.pause = \"{robot}\"\nat_s = {at_s:?}\n")
    });
    let log = mission_by_processes(&pauses.concat(), "--limit 60", 1);
    assert_eq!(log.run.outcome, RunOutcome::Ended(Outcome::TimeLimit));
    assert_eq!(log.run.result.ticks, 1200);
    assert_eq!(log.events("stalled").len(), 3);
}

/// A robot has no body before it is added, and none after it is removed.
#[test]
fn robots_are_added_and_removed_during_a_mission() {
    let scenario = r#"
        robots = [
            { name = "blue", side_sensor = true },
            { name = "gold" },
            { name = "red", absent = true },
        ]
        [faults]
        timeline = [
            { id = "a", fault.add = "red", at_s = 80.0 },
            { id = "r", fault.remove = "gold", at_s = 120.0 },
        ]
    "#;
    let log = mission_by_processes(scenario, "", 0);
    hit(&log, "a");
    hit(&log, "r");
    assert_eq!(only(&log, "joined", "red").t_ms, at(80.0));
    assert_eq!(only(&log, "gone", "gold").t_ms, at(120.0));
    assert!(log.times_of("red", "activated")[0] > 80_000);
    let poses = log.rows::<PoseRow>().unwrap();
    let of = |robot: &'static str| poses.iter().filter(move |row| row.robot == robot);
    assert_eq!(of("red").next().unwrap().t_ms, at(80.0));
    assert_eq!(of("gold").next_back().unwrap().t_ms, at(119.95));
}

/// Faults that the world rules out when they are due fail, each with its reason in the log, on the terminal and in the
/// answer to an operator. Processes and one process have the same events.
#[test]
fn faults_that_are_impossible_when_due_are_reported() {
    let timeline = [
        ("k1", 5, "kill = 'gold'", ""),
        ("k2", 6, "kill = 'gold'", "no process of 'gold' takes part"),
        (
            "t",
            7,
            "terminate = 'gold'",
            "no process of 'gold' takes part",
        ),
        ("p", 8, "pause = 'gold'", "no process of 'gold' takes part"),
        (
            "c1",
            9,
            "continue = 'gold'",
            "no process of 'gold' takes part",
        ),
        ("c2", 10, "continue = 'blue'", "no fault has paused 'blue'"),
        ("m1", 11, "remove = 'gold'", ""),
        (
            "m2",
            12,
            "remove = 'gold'",
            "the robot is not in the mission",
        ),
        ("k3", 13, "kill = 'gold'", "no process of 'gold' takes part"),
    ];
    let mut scenario = "limit_s = 15\n".to_owned();
    for (id, at_s, fault, _) in timeline {
        scenario += &format!("[[faults.timeline]]\nid = '{id}'\nat_s = {at_s}\nfault.{fault}\n");
    }
    let lab = Lab::new();
    lab.write("faults.toml", scenario);
    let here = lab.run("run faults.toml --in-process --out here").expect(1);
    lab.mission("run", "faults.toml").expect(1);
    lab.assert_same_bytes("here", "run");
    lab.assert_repeated("run");
    let log = lab.log("run");
    for (id, at_s, _, why) in timeline {
        let failed = log.events("failed").into_iter();
        let failed: Vec<EventRow> = failed.filter(|row| row.subject == id).collect();
        if why.is_empty() {
            assert!(failed.is_empty(), "{id}: {failed:?}");
            continue;
        }
        let [row] = &failed[..] else {
            panic!("{id}: {failed:?}")
        };
        assert_eq!((row.t_ms, row.reason.as_str()), (at(f64::from(at_s)), why));
        let status = log.run.faults.iter().find(|fault| fault.id == id).unwrap();
        assert_eq!(
            (status.failed.as_deref(), status.hits),
            (Some(why), 0),
            "{id}"
        );
        here.shows(&format!("{at_s}.000 s: {id} failed "));
        here.shows(&format!("{id} ({why})"));
    }
}
