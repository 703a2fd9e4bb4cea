//! The built-in scenarios, for tests.

use missions::Registry;
use scenario::{Scenario, Vocabulary};

pub fn known() -> Vocabulary {
    Registry::built_in().vocabulary()
}

pub fn read_scenario(name: &str, vocabulary: &Vocabulary) -> anyhow::Result<Scenario> {
    let builtin = vocabulary
        .builtin(name)
        .ok_or_else(|| anyhow::anyhow!("no scenario '{name}'"))?;
    Ok(Scenario::parse(name, builtin.text, vocabulary)?)
}
