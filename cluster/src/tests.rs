//! The scenario of tests.

use anyhow::bail;
use scenario::Scenario;
use scenario::testkit::default_scenario;

/// Returns the scenario with this name, with the robots blue, gold and green.
pub fn read_scenario(name: &str) -> anyhow::Result<Scenario> {
    match name {
        "waste-cleanup" => Ok(default_scenario()),
        _ => bail!("no scenario '{name}'"),
    }
}
