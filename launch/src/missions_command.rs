//! `alliance missions`: lists the missions, or the parameters of one.

use std::fmt::Write;
use std::process::ExitCode;

use alliance_proto::mission::data::Mission;
use alliance_proto::scenario::Vocabulary;
use alliance_proto::{tell, terminal};
use clap::Args;

/// List the missions, or the parameters of one.
#[derive(Args, Clone, Debug)]
pub struct MissionsCommand {
    /// Mission whose parameters to list: the keys of its section in a scenario file
    name: Option<String>,
}

impl MissionsCommand {
    /// Exit status 0, or 2 for an unknown name.
    #[must_use]
    pub fn run(&self) -> ExitCode {
        let missions = Vocabulary::default().missions;
        let Some(name) = &self.name else {
            let lines = missions
                .iter()
                .map(|mission| format!("{:<12} {}\n", mission.name(), mission.about()));
            return say(lines.collect::<String>());
        };
        if let Some(mission) = missions.iter().find(|mission| mission.name() == name) {
            return say(parameters(*mission));
        }
        let known: Vec<&str> = missions.iter().map(|mission| mission.name()).collect();
        let known = known.join(", ");
        tell!("alliance missions: no mission '{name}'; there are {known}");
        ExitCode::from(2)
    }
}

fn say(text: String) -> ExitCode {
    terminal::answer("alliance missions", text, ExitCode::SUCCESS)
}

/// A line for each parameter: key, unit, default, meaning, range.
fn parameters(mission: Mission) -> String {
    let mut text = format!("[{}] {}\n", mission.name(), mission.about());
    let all = mission.parameters();
    let width = all.iter().map(|it| it.key.len()).max().unwrap_or_default();
    for parameter in all {
        let (key, unit, default) = (parameter.key, parameter.unit, parameter.default.to_string());
        let (about, range) = (parameter.about, parameter.range);
        // Writing to a string cannot fail.
        let _ = writeln!(
            text,
            "  {key:<width$}  {unit:<2}  {default:<21}  {about}; {range}"
        );
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_parameter_has_a_line_with_its_unit_and_default() {
        for mission in Vocabulary::default().missions {
            let text = parameters(mission);
            for parameter in mission.parameters() {
                let mut lines = text.lines();
                let line = lines.find(|line| line.trim_start().starts_with(parameter.key));
                let line = line.unwrap();
                assert!(line.contains(&parameter.default.to_string()), "{line}");
                assert!(line.contains(parameter.about), "{line}");
            }
        }
    }
}
