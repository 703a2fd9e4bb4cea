//! Scenarios for the tests of this crate.

use scenario::{Problem, Scenario, Setup};

use crate::Registry;

/// Reads a scenario with all built-in missions and allocators.
pub(crate) fn read(text: &str) -> Result<Scenario, Problem> {
    Scenario::parse("s.toml", text, &Registry::built_in().vocabulary())
}

/// Returns the scenario of a valid text.
#[track_caller]
pub(crate) fn parse(text: &str) -> Scenario {
    read(text).unwrap_or_else(|error| panic!("{error}"))
}

/// Returns the setup of a valid scenario, for seed 1.
#[track_caller]
pub(crate) fn resolve(scenario: Scenario) -> Setup {
    let resolved = Setup::resolve(scenario, 1, None);
    resolved.unwrap_or_else(|error| panic!("{error}")).setup
}
