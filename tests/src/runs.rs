//! Whole runs in this process: scenarios by name or by text, and their logs.

use analysis::invariants::{Invariants, Violation};
use in_process::Team;
use missions::Registry;
use proto::tick::Outcome;
use run_log::recorder::Recorder;
use run_log::{EventRow, LogLevel, MemoryLog, RunLog};
use scenario::{Scenario, Setup, Vocabulary};
use world_server::simulation::Simulation;

/// Returns the vocabulary of the built-in missions and allocators.
#[must_use]
pub fn vocabulary() -> Vocabulary {
    Registry::built_in().vocabulary()
}

/// Returns the names of all allocators.
pub fn allocators() -> impl Iterator<Item = &'static str> {
    let allocators = vocabulary().allocators;
    allocators.into_iter().map(|allocator| allocator.name)
}

/// Parses a scenario.
///
/// # Panics
/// Panics if the scenario is invalid.
#[must_use]
#[track_caller]
pub fn parse(text: &str) -> Scenario {
    Scenario::parse("s.toml", text, &vocabulary()).unwrap_or_else(|error| panic!("{error}"))
}

/// Returns a built-in scenario.
///
/// # Panics
/// Panics if there is no such scenario.
#[must_use]
#[track_caller]
pub fn builtin(name: &str) -> Scenario {
    let vocabulary = vocabulary();
    let builtin = vocabulary.builtin(name).unwrap();
    Scenario::parse(builtin.name, builtin.text, &vocabulary).unwrap()
}

/// Resolves a scenario with a seed.
///
/// # Panics
/// Panics if the scenario is invalid.
#[must_use]
#[track_caller]
pub fn setup(scenario: Scenario, seed: u64) -> Setup {
    let resolved = Setup::resolve(scenario, seed, None);
    resolved.unwrap_or_else(|error| panic!("{error}")).setup
}

/// Returns a team before its first tick.
///
/// # Panics
/// Panics if the setup cannot be run.
#[must_use]
#[track_caller]
pub fn team(setup: Setup, level: LogLevel) -> Team<MemoryLog> {
    Team::new(setup, level, MemoryLog::default()).unwrap()
}

/// Runs a mission to its end.
///
/// # Panics
/// Panics if the setup cannot be run.
#[track_caller]
pub fn run(setup: Setup, level: LogLevel) -> (Outcome, Recorder<MemoryLog>) {
    team(setup, level).run().unwrap()
}

/// Runs a scenario to its end, and returns its outcome and its full log.
///
/// # Panics
/// Panics if the scenario is invalid.
#[track_caller]
pub fn play(scenario: Scenario, seed: u64) -> (Outcome, RunLog) {
    let (outcome, recorder) = run(setup(scenario, seed), LogLevel::Full);
    (outcome, log_of(recorder))
}

/// Returns the log of a recorder.
///
/// # Panics
/// Panics if the run has not ended.
#[must_use]
#[track_caller]
pub fn log_of(recorder: Recorder<MemoryLog>) -> RunLog {
    RunLog::from_memory(&recorder.into_sink(), &vocabulary()).unwrap()
}

/// Runs a scenario, and checks the invariants after each tick. Returns the outcome, the log and the first violation.
///
/// # Panics
/// Panics if the scenario is invalid.
#[track_caller]
pub fn checked(scenario: Scenario, level: LogLevel) -> (Outcome, RunLog, Option<Violation>) {
    let setup = setup(scenario, 1);
    let mut invariants = Invariants::new(&setup);
    let mut violation = None;
    let check = |simulation: &mut Simulation| {
        // The first call is before the first tick.
        if violation.is_none() && simulation.tick() > 0 {
            violation = invariants.check_simulation(simulation).err();
        }
    };
    let ended = team(setup, level).run_for(u64::MAX, Outcome::TimeLimit, check);
    let (outcome, recorder) = ended.unwrap();
    (outcome, log_of(recorder), violation)
}

/// The events of a log.
pub trait Events {
    /// Returns the events of a kind.
    fn events(&self, kind: &str) -> Vec<EventRow>;

    /// Returns the events of a kind of one robot.
    fn events_of(&self, robot: &str, kind: &str) -> Vec<EventRow> {
        let mut rows = self.events(kind);
        rows.retain(|row| row.robot == robot);
        rows
    }

    /// Returns the times of a robot's events of a kind, in ms.
    fn times_of(&self, robot: &str, kind: &str) -> Vec<u64> {
        let rows = self.events_of(robot, kind);
        rows.iter().map(|row| row.t_ms.0).collect()
    }
}

impl Events for RunLog {
    fn events(&self, kind: &str) -> Vec<EventRow> {
        let mut rows = self.rows::<EventRow>().unwrap();
        rows.retain(|row| row.kind == kind);
        rows
    }
}

/// Replaces the list of all allocators in error messages, so that a snapshot does not depend on their number.
#[must_use]
pub fn without_allocators(text: &str) -> String {
    let all: Vec<&str> = allocators().collect();
    text.replace(&all.join(", "), "ALL ALLOCATORS")
}
