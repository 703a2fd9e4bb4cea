//! Missions in a row with random kills and restarts: memory and open files do not grow, and no process is left.
//!
//! A normal test runs three missions. For a full check:
//! `SOAK_MISSIONS=100 cargo test --release -p alliance-tests --test missions soak -- --nocapture`.

use std::time::Duration;

use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;

use crate::harness::{Lab, command_line};
use crate::team::Team;

const KILLS: usize = 6;

/// Enough items for all kills to occur during the work.
const ITEMS: u32 = 60;

/// The allowed growth in KiB during a mission and between missions, because of the memory allocator's cache. A leak
/// of 100 bytes per tick exceeds it in one mission.
const LEVEL_KIB: u64 = 4096;

#[derive(Clone, Copy, Debug)]
struct Holdings {
    /// The private resident memory, in KiB.
    memory_kib: u64,
    descriptors: usize,
}

fn holdings(pid: u32) -> Option<Holdings> {
    let rollup = std::fs::read_to_string(format!("/proc/{pid}/smaps_rollup")).ok()?;
    let memory_kib = rollup
        .lines()
        .filter(|line| line.starts_with("Private_"))
        .filter_map(|line| line.split_whitespace().nth(1)?.parse::<u64>().ok())
        .sum();
    let descriptors = std::fs::read_dir(format!("/proc/{pid}/fd")).ok()?.count();
    Some(Holdings {
        memory_kib,
        descriptors,
    })
}

#[test]
fn missions_with_kills_and_restarts_leave_no_process_and_do_not_grow() {
    let missions: u64 = std::env::var("SOAK_MISSIONS").map_or(3, |text| text.parse().unwrap());
    let robots = ["blue", "gold", "green"];
    let mut rng = ChaCha8Rng::seed_from_u64(100);
    let mut worlds: Vec<u64> = Vec::new();
    for seed in 1..=missions {
        let lab = Lab::new();
        let long = lab.mission_of(ITEMS);
        let seed_text = seed.to_string();
        let mut team = Team::start(
            &lab,
            &[
                &long, "--seed", &seed_text, "--speed", "150x", "--limit", "20000", "--log",
                "summary",
            ],
        );
        team.wait_for_row("events.csv", &[",delivered,"]);
        let early = holdings(team.pid("world")).unwrap();
        let mut young: Vec<Option<Holdings>> = robots
            .iter()
            .map(|robot| holdings(team.pid(robot)))
            .collect();
        let mut restarted = Vec::new();
        let mut incarnations = [1; 3];
        let mut late = early;
        for _ in 0..KILLS {
            team.run_for(Duration::from_millis(rng.random_range(20..200)));
            let victim = rng.random_range(0..robots.len());
            team.kill(robots[victim]);
            restarted.push(team.restart(robots[victim]));
            incarnations[victim] += 1;
            let joined = format!("incarnation {}", incarnations[victim]);
            team.wait_for_row("events.csv", &[",joined,", robots[victim], &joined]);
            late = holdings(team.pid("world")).unwrap_or(late);
            young[victim] = holdings(team.pid(robots[victim]));
        }
        // The current agents have run for a while.
        team.run_for(Duration::from_millis(200));
        for (robot, young) in robots.iter().zip(&young) {
            if let (Some(young), Some(old)) = (young, holdings(team.pid(robot))) {
                assert!(
                    old.memory_kib <= young.memory_kib + LEVEL_KIB
                        && old.descriptors <= young.descriptors + 2,
                    "seed {seed}, {robot}: {young:?} -> {old:?}"
                );
            }
        }
        let processes: Vec<u32> = ["world", "blue", "gold", "green"]
            .map(|name| team.pid(name))
            .to_vec();
        let finished = team.wait().expect(0);
        let result: serde_json::Value = serde_json::from_str(&finished.stdout).unwrap();
        assert_eq!(result["result"]["items"]["delivered"], ITEMS, "seed {seed}");
        for agent in restarted {
            let ended = agent.wait();
            // The agent was killed or received the end of the run.
            assert!(matches!(ended.status.code(), Some(0) | None), "{ended:?}");
        }
        for pid in processes {
            assert_eq!(command_line(pid), None, "seed {seed} left a process");
        }
        println!("seed {seed}: world {early:?} -> {late:?}");
        assert_eq!(
            late.descriptors, early.descriptors,
            "seed {seed}: descriptors of the world"
        );
        assert!(
            late.memory_kib <= early.memory_kib + LEVEL_KIB,
            "seed {seed}: {early:?} -> {late:?}"
        );
        worlds.push(late.memory_kib);
        let runtime = std::fs::read_dir(lab.path("runtime/alliance"))
            .unwrap()
            .count();
        assert_eq!(runtime, 0, "seed {seed} left its announcement");
    }
    let (least, most) = (worlds.iter().min().unwrap(), worlds.iter().max().unwrap());
    assert!(most - least <= LEVEL_KIB, "worlds of {least} to {most} KiB");
}
