//! Killed and restarted agents: the team continues, and no item is lost.

use std::time::Duration;

use missions::waste::data::WasteRow;
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;
use run_log::{EventRow, Input, RunLog};

use crate::harness::{Finished, Lab};
use crate::team::Team;

/// Parses the output of `alliance run --json`.
fn result(finished: &Finished) -> serde_json::Value {
    serde_json::from_str(&finished.stdout).unwrap()
}

/// Checks that each row of mission.csv accounts for all items.
#[track_caller]
fn assert_nothing_lost(log: &RunLog, items: u32) {
    let rows = log.rows::<WasteRow>().unwrap();
    assert!(!rows.is_empty());
    for row in rows {
        let counts =
            row.items_in_spills + row.items_carried + row.items_on_floor + row.items_delivered;
        assert_eq!(counts, items, "at {} ms", row.t_ms);
    }
}

fn events(log: &RunLog, kind: &str, robot: &str) -> Vec<EventRow> {
    let rows = log.rows::<EventRow>().unwrap();
    rows.into_iter()
        .filter(|row| row.kind == kind && row.robot == robot)
        .collect()
}

#[test]
fn a_killed_robot_loses_no_item_and_its_task_is_taken_over() {
    let lab = Lab::new();
    let mut team = Team::start(&lab, &["--speed", "60x"]);
    let row = team.wait_for_row("events.csv", &[",picked,"]);
    let victim = row.split(',').nth(2).unwrap().to_owned();
    team.kill(&victim);
    let finished = team.wait().expect(0);
    assert_eq!(result(&finished)["outcome"], "complete");
    assert_eq!(result(&finished)["result"]["items"]["delivered"], 24);

    let log = lab.log("run");
    assert_nothing_lost(&log, 24);
    let gone = events(&log, "gone", &victim);
    assert_eq!(gone.len(), 1);
    let crash = gone[0].t_ms;
    assert!(
        !events(&log, "activated", &victim)
            .iter()
            .any(|row| row.t_ms > crash),
        "a crashed robot activates nothing"
    );
    // A teammate takes over the last task of the killed robot.
    let task = events(&log, "activated", &victim)
        .last()
        .unwrap()
        .detail
        .clone();
    let taken_over = log.rows::<EventRow>().unwrap().into_iter().any(|row| {
        row.kind == "activated" && row.detail == task && row.robot != victim && row.t_ms > crash
    });
    assert!(taken_over, "no robot took over {task}");
}

#[test]
fn the_last_of_three_robots_completes_the_mission() {
    let lab = Lab::new();
    let mut team = Team::start(&lab, &["--speed", "60x", "--limit", "10000"]);
    team.wait_for_row("events.csv", &[",delivered,"]);
    team.kill("blue");
    team.wait_for_row("events.csv", &[",gone,blue,"]);
    team.kill("green");
    let finished = team.wait().expect(0);
    assert_eq!(result(&finished)["result"]["items"]["delivered"], 24);
    let log = lab.log("run");
    assert_nothing_lost(&log, 24);
    let last_crash = events(&log, "gone", "green")[0].t_ms;
    for delivered in log.rows::<EventRow>().unwrap() {
        if delivered.kind == "delivered" && delivered.t_ms > last_crash {
            assert_eq!(delivered.robot, "gold");
        }
    }
}

#[test]
fn without_blue_the_other_robots_find_the_locations_with_wander() {
    let lab = Lab::new();
    let mut team = Team::start(&lab, &["--speed", "30x", "--limit", "10000"]);
    team.wait_for_row(
        "events.csv",
        &[",activated,blue,find-locations-methodical,"],
    );
    team.kill("blue");
    let finished = team.wait().expect(0);
    assert_eq!(result(&finished)["result"]["items"]["delivered"], 24);
    let log = lab.log("run");
    assert!(
        events(&log, "position-update", "blue").is_empty(),
        "blue must crash before it finds the locations"
    );
    let finders: Vec<EventRow> = log
        .rows::<EventRow>()
        .unwrap()
        .into_iter()
        .filter(|row| row.kind == "position-update")
        .collect();
    assert!(!finders.is_empty());
    assert!(
        finders
            .iter()
            .all(|row| row.robot == "gold" || row.robot == "green")
    );
}

/// Kills and restarts a robot at a hundred random times in one mission. Each new incarnation starts without shared
/// knowledge.
#[test]
fn a_hundred_kills_and_restarts_lose_no_item() {
    let lab = Lab::new();
    let long = lab.mission_of(160);
    let mut team = Team::start(&lab, &[&long, "--speed", "60x", "--limit", "100000"]);
    let mut rng = ChaCha8Rng::seed_from_u64(7);
    let robots = ["blue", "gold", "green"];
    team.wait_for_row("events.csv", &[",activated,"]);
    // The restarted agents are kept, because a dropped process is killed.
    let mut agents = Vec::new();
    let mut incarnations = [1_u32; 3];
    for _ in 0..100 {
        team.run_for(Duration::from_millis(rng.random_range(20..300)));
        let victim = rng.random_range(0..robots.len());
        team.kill(robots[victim]);
        agents.push(team.restart(robots[victim]));
        incarnations[victim] += 1;
        let joined = format!("incarnation {}", incarnations[victim]);
        team.wait_for_row("events.csv", &[",joined,", robots[victim], &joined]);
    }
    let finished = team.wait().expect(0);
    assert_eq!(result(&finished)["outcome"], "complete");
    assert_eq!(result(&finished)["result"]["items"]["delivered"], 160);
    let log = lab.log("run");
    assert_nothing_lost(&log, 160);
    for (robot, incarnations) in robots.iter().zip(incarnations) {
        assert_eq!(
            events(&log, "joined", robot).len() as u32,
            incarnations,
            "{robot}"
        );
        assert_eq!(
            events(&log, "gone", robot).len() as u32,
            incarnations - 1,
            "{robot}"
        );
    }
    for line in log.inputs().unwrap() {
        assert!(
            matches!(line.input, Input::Join { .. } | Input::Gone { .. }),
            "a kill must be recorded as a crash only: {line:?}"
        );
    }
}
