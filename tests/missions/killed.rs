//! Killed and restarted agents: the team continues, and nothing is lost or left.

use std::time::Duration;

use alliance_tests::harness::{Lab, command_line};
use alliance_tests::runs::Events;
use alliance_tests::team::Team;
use alliance_tests::testkit::ROBOTS;
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;
use run_log::Input;

use crate::faults::assert_items_accounted_for;

#[test]
fn a_killed_robot_loses_no_item_and_its_task_is_taken_over() {
    let lab = Lab::new();
    let mut team = Team::start(&lab, "--speed 60x");
    let row = team.wait_for_row("events.csv", &[",picked,"]);
    let victim = row.split(',').nth(2).unwrap();
    team.kill(victim);
    let finished = team.wait().expect(0).json();
    assert_eq!(finished["outcome"], "complete");
    assert_eq!(finished["result"]["items"]["delivered"], 24);

    let log = lab.log("run");
    assert_items_accounted_for(&log);
    assert_eq!(log.events_of(victim, "gone").len(), 1);
    let crash = log.events("gone")[0].t_ms;
    // A crashed robot activates nothing. A teammate takes over its last task.
    let last = log.events_of(victim, "activated").pop().unwrap();
    assert!(last.t_ms <= crash);
    let mut later = log.events("activated").into_iter();
    let is_taken_over = later.any(|row| row.detail == last.detail && row.t_ms > crash);
    assert!(is_taken_over, "no robot took over {}", last.detail);
}

/// The number of kills and restarts, and the items of a mission that lasts longer.
const KILLS: usize = 12;
const ITEMS: u32 = 80;

/// The allowed growth of the world's private memory during the second half of the kills, KiB. The memory allocator takes
/// 2 MiB at a time, and messages to a dead agent wait until its end is detected. `endless.rs` measures leaks exactly.
const LEVEL_KIB: u64 = 8192;

/// Returns the private resident memory in KiB and the number of open files of a process.
fn holdings(pid: u32) -> Option<(u64, usize)> {
    let rollup = std::fs::read_to_string(format!("/proc/{pid}/smaps_rollup")).ok()?;
    let private = rollup.lines().filter(|line| line.starts_with("Private_"));
    let memory_kib = private
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
    // The speed leaves time for all kills on a busy machine.
    let options = "--speed 20x --limit 100000 --log summary";
    let mut team = Team::start(&lab, format!("{long} {options}"));
    let mut rng = ChaCha8Rng::seed_from_u64(7);
    team.wait_for_row("events.csv", &[",picked,"]);
    // The restarted agents are kept, because a dropped process is killed.
    let mut agents = Vec::new();
    let mut incarnations = [1_usize; 3];
    let mut early = None;
    for kill in 0..KILLS {
        if kill == KILLS / 2 {
            early = holdings(team.pid("world"));
        }
        std::thread::sleep(Duration::from_millis(rng.random_range(20..150)));
        let victim = rng.random_range(0..ROBOTS.len());
        team.kill(ROBOTS[victim]);
        agents.push(team.restart(ROBOTS[victim]));
        incarnations[victim] += 1;
        let joined = format!("incarnation {}", incarnations[victim]);
        team.wait_for_row("events.csv", &[",joined,", ROBOTS[victim], &joined]);
    }
    let early = early.unwrap();
    let late = holdings(team.pid("world")).unwrap();
    assert_eq!(late.1, early.1, "open files of the world");
    assert!(late.0 <= early.0 + LEVEL_KIB, "{early:?} -> {late:?} KiB");
    lab.run("clock speed max").expect(0);

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
    assert_eq!(lab.names("runtime/alliance"), Vec::<String>::new());
    let log = lab.log("run");
    assert_items_accounted_for(&log);
    for (robot, incarnations) in ROBOTS.iter().zip(incarnations) {
        let counts = ["joined", "gone"].map(|kind| log.events_of(robot, kind).len());
        assert_eq!(counts, [incarnations, incarnations - 1], "{robot}");
    }
    // A kill is recorded as a crash only.
    for line in log.inputs().unwrap() {
        let is_crash = matches!(line.input, Input::Join { .. } | Input::Gone { .. });
        assert!(is_crash, "{line:?}");
    }
}
