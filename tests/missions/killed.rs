//! Killed and restarted agents: the team continues, and nothing is lost or left.

use std::time::Duration;

use alliance_tests::harness::{Lab, command_line};
use alliance_tests::team::Team;
use alliance_tests::testkit::ROBOTS;
use missions::waste::data::WasteRow;
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;
use run_log::{EventRow, Input, RunLog};

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
    let finished = team.wait().expect(0).json();
    assert_eq!(finished["outcome"], "complete");
    assert_eq!(finished["result"]["items"]["delivered"], 24);

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

/// The number of kills and restarts, and the items of a mission that lasts longer.
const KILLS: usize = 12;
const ITEMS: u32 = 80;

/// The allowed growth of the world's private memory in KiB, because of the memory allocator's cache. A leak of 100
/// bytes per tick exceeds it.
const LEVEL_KIB: u64 = 4096;

/// Returns the private resident memory in KiB and the number of open files of a process.
fn holdings(pid: u32) -> Option<(u64, usize)> {
    let rollup = std::fs::read_to_string(format!("/proc/{pid}/smaps_rollup")).ok()?;
    let memory_kib = rollup
        .lines()
        .filter(|line| line.starts_with("Private_"))
        .filter_map(|line| line.split_whitespace().nth(1)?.parse::<u64>().ok())
        .sum();
    let files = std::fs::read_dir(format!("/proc/{pid}/fd")).ok()?.count();
    Some((memory_kib, files))
}

/// Kills and restarts robots at random times. Each new incarnation starts without shared knowledge.
#[test]
fn many_kills_and_restarts_lose_no_item_and_leave_nothing() {
    let lab = Lab::new();
    let long = lab.mission_of(ITEMS);
    let options = ["--speed", "100x", "--limit", "100000", "--log", "summary"];
    let mut team = Team::start(&lab, &[&[long.as_str()][..], &options].concat());
    let mut rng = ChaCha8Rng::seed_from_u64(7);
    team.wait_for_row("events.csv", &[",delivered,"]);
    let early = holdings(team.pid("world")).unwrap();
    // The restarted agents are kept, because a dropped process is killed.
    let mut agents = Vec::new();
    let mut incarnations = [1_usize; 3];
    for _ in 0..KILLS {
        team.run_for(Duration::from_millis(rng.random_range(20..150)));
        let victim = rng.random_range(0..ROBOTS.len());
        team.kill(ROBOTS[victim]);
        agents.push(team.restart(ROBOTS[victim]));
        incarnations[victim] += 1;
        let joined = format!("incarnation {}", incarnations[victim]);
        team.wait_for_row("events.csv", &[",joined,", ROBOTS[victim], &joined]);
    }
    let late = holdings(team.pid("world")).unwrap();
    assert_eq!(late.1, early.1, "open files of the world");
    assert!(late.0 <= early.0 + LEVEL_KIB, "{early:?} -> {late:?} KiB");

    let processes = ["world", "blue", "gold", "green"].map(|name| team.pid(name));
    let finished = team.wait().expect(0).json();
    assert_eq!(finished["outcome"], "complete");
    assert_eq!(finished["result"]["items"]["delivered"], ITEMS);
    for agent in agents {
        // The agent was killed or received the end of the run.
        let ended = agent.wait();
        assert!(matches!(ended.status.code(), Some(0) | None), "{ended:?}");
    }
    assert!(processes.iter().all(|pid| command_line(*pid).is_none()));
    let announcements = std::fs::read_dir(lab.path("runtime/alliance")).unwrap();
    assert_eq!(announcements.count(), 0);
    let log = lab.log("run");
    assert_nothing_lost(&log, ITEMS);
    for (robot, incarnations) in ROBOTS.iter().zip(incarnations) {
        let count = |kind| events(&log, kind, robot).len();
        let counts = (count("joined"), count("gone"));
        assert_eq!(counts, (incarnations, incarnations - 1), "{robot}");
    }
    for line in log.inputs().unwrap() {
        assert!(
            matches!(line.input, Input::Join { .. } | Input::Gone { .. }),
            "a kill must be recorded as a crash only: {line:?}"
        );
    }
}
