//! `alliance list missions`: the missions, or the parameters of one.

use analysis::table;
use anyhow::bail;
use clap::Args;
use missions::Registry;
use scenario::mission::registry::Mission;
use scenario::name_remedy;

use super::parameters::blocks;

/// List the missions, or the parameters of one
#[derive(Args, Clone, Debug, Default)]
pub struct MissionsCommand {
    /// Mission whose parameters to list: the keys of its section in a scenario file
    #[arg(value_name = "MISSION")]
    mission: Option<String>,
}

impl MissionsCommand {
    /// Returns the list or the description.
    pub fn text(&self) -> anyhow::Result<String> {
        let missions = Registry::current().vocabulary().missions;
        let Some(name) = &self.mission else {
            let listed = missions.iter();
            let listed = listed.map(|mission| (mission.name(), mission.about()));
            return Ok(table::list(listed));
        };
        match missions.iter().find(|mission| mission.name() == name) {
            Some(mission) => Ok(description(*mission)),
            None => bail!(
                "there is no mission '{name}'; {}",
                name_remedy(name, missions.iter().map(|mission| mission.name()))
            ),
        }
    }
}

/// Returns the description of a mission with a block for each parameter.
fn description(mission: Mission) -> String {
    let (name, about) = (mission.name(), mission.about());
    format!(
        "{name}: {about}\n\n[{name}]\n{}",
        blocks(&mission.parameters())
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_parameter_is_described_with_its_default() {
        for mission in Registry::built_in().vocabulary().missions {
            let text = description(mission);
            for parameter in mission.parameters() {
                let line = format!("\n{} = {}", parameter.key, parameter.default);
                assert!(text.contains(&line), "{line}");
                assert!(text.contains(parameter.about), "{line}");
            }
        }
    }
}
