//! Runs the default mission with each allocator in this process, without a log on the disk, and prints the outcomes.

use std::error::Error;

use in_process::Team;
use missions::Registry;
use run_log::{LogLevel, MemoryLog, RunFile};
use scenario::Setup;

fn main() -> Result<(), Box<dyn Error>> {
    for allocator in Registry::current().vocabulary().allocators {
        let run = run(allocator.name, 1)?;
        println!(
            "{}: {:?} at {}",
            allocator.name, run.outcome, run.result.sim_time_ms
        );
    }
    Ok(())
}

/// Runs the default mission with the allocator and seed.
fn run(allocator: &str, seed: u64) -> Result<RunFile, Box<dyn Error>> {
    let mut scenario = Registry::current().vocabulary().default_scenario()?;
    scenario.allocator = Some(allocator.to_owned());
    let setup = Setup::resolve(scenario, seed, None)?.setup;
    let team = Team::new(setup, LogLevel::Off, MemoryLog::default())?;
    let mut finished = None;
    let mut team = Some(team);
    while let Some(mut running) = team.take() {
        match running.tick()? {
            None => team = Some(running),
            Some(outcome) => finished = Some(running.end(outcome)?.0),
        }
    }
    finished.ok_or_else(|| "the run did not end".into())
}

#[test]
fn the_same_seed_gives_the_same_run_and_another_seed_a_different_run() {
    let hash = |seed| run("nearest", seed).unwrap().hash.unwrap();
    assert_eq!(hash(1), hash(1));
    assert_ne!(hash(1), hash(2));
}
