//! `alliance missions`: lists the missions, or the parameters of one.

use std::process::ExitCode;

use analysis::table;
use clap::Args;
use missions::Registry;
use scenario::mission::registry::Mission;
use scenario::name_remedy;
use terminal::stderr_line;

use crate::parameters::blocks;

/// List the missions, or the parameters of one.
#[derive(Args, Clone, Debug)]
pub struct MissionsCommand {
    /// Mission whose parameters to list; they are the keys of its section in a scenario file
    name: Option<String>,
}

impl MissionsCommand {
    /// Prints the list or the description. Exit status 0, or 2 for an unknown name.
    #[must_use]
    pub fn run(&self) -> ExitCode {
        let missions = Registry::current().vocabulary().missions;
        let Some(name) = &self.name else {
            let listed = missions.iter();
            let listed = listed.map(|mission| (mission.name(), mission.about()));
            return say(table::list(listed));
        };
        if let Some(mission) = missions.iter().find(|mission| mission.name() == name) {
            return say(description(*mission));
        }
        let names = missions.iter().map(|mission| mission.name());
        stderr_line!(
            "alliance missions: there is no mission '{name}'; {}",
            name_remedy(name, names)
        );
        ExitCode::from(2)
    }
}

fn say(text: String) -> ExitCode {
    terminal::print_result("alliance missions", text, ExitCode::SUCCESS)
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
