//! Scenarios and logs of runs for tests.

use in_process::{Team, joins_of};
use missions::Registry;
use run_log::{InputLine, LogLevel, MemoryLog, RunLog};
use scenario::{Scenario, Setup};

pub fn scenario(text: &str) -> Scenario {
    Scenario::parse("mission.toml", text, &Registry::built_in().vocabulary()).unwrap()
}

/// Returns a scenario that ships with the program.
pub fn shipped(name: &str) -> Scenario {
    let vocabulary = Registry::built_in().vocabulary();
    scenario(vocabulary.builtin(name).unwrap().text)
}

/// Resolves a scenario with seed 1.
pub fn setup(scenario: Scenario) -> Setup {
    Setup::resolve(scenario, 1, None).unwrap().setup
}

/// Runs a mission and returns its full log.
pub fn run(setup: Setup) -> RunLog {
    run_with(setup, Vec::new())
}

/// Runs a mission with additional inputs.
pub fn run_with(setup: Setup, more: Vec<InputLine>) -> RunLog {
    let mut inputs = joins_of(&setup);
    inputs.extend(more);
    inputs.sort_by_key(|line| line.tick);
    let team = Team::with_inputs(setup, inputs, LogLevel::Full, MemoryLog::default()).unwrap();
    open(&team.run().unwrap().1.into_sink())
}

pub fn open(memory: &MemoryLog) -> RunLog {
    RunLog::from_memory(memory, &Registry::built_in().vocabulary()).unwrap()
}
