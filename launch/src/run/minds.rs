//! Minds that are programs of their own: which there are, and how they are started.
//!
//! A scenario has their names. Their commands come from the command line alone, for a scenario from elsewhere must not run programs.

use std::collections::BTreeMap;

use alliance_proto::keys::is_name;
use alliance_proto::scenario::{Scenario, instead};
use anyhow::bail;
use robot_agent::args::{ROBOT, RUN};

/// A mind as `--mind` states it: `NAME[@VERSION]=COMMAND`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct MindCommand {
    /// As scenarios call it.
    pub name: String,
    /// What its author calls this state of it.
    pub version: Option<String>,
    /// For a shell.
    pub command: String,
}

impl MindCommand {
    /// Reads the words of `--mind`.
    ///
    /// # Errors
    /// What is wrong, and what would be right.
    pub fn parse(text: &str) -> Result<Self, String> {
        let (name, command) = text
            .split_once('=')
            .filter(|(_, command)| !command.trim().is_empty())
            .ok_or("use NAME=COMMAND, such as greedy='python3 greedy.py'")?;
        let (name, version) = match name.split_once('@') {
            Some((name, version)) => (name, Some(version)),
            None => (name, None),
        };
        if !is_name(name) {
            return Err(format!(
                "'{name}' is no name of a mind; use letters, digits, '-' and '_', at most 32"
            ));
        }
        if version.is_some_and(|it| it.is_empty() || it.contains(char::is_control)) {
            return Err("use NAME@VERSION=COMMAND, or leave the @ out".to_owned());
        }
        Ok(Self {
            name: name.to_owned(),
            version: version.map(ToOwned::to_owned),
            command: command.trim().to_owned(),
        })
    }
}

/// The commands of all minds that are programs of their own, by robot.
///
/// # Errors
/// A mind without a command, or a command for no mind.
pub fn commands(
    scenario: &Scenario,
    stated: &[MindCommand],
) -> anyhow::Result<BTreeMap<String, String>> {
    let minds = scenario.minds();
    for (index, mind) in stated.iter().enumerate() {
        let name = mind.name.as_str();
        if stated[..index].iter().any(|other| other.name == name) {
            bail!("--mind {name}: it is stated twice; a mind has one command");
        }
        if minds.is_empty() {
            bail!(
                "--mind {name}: no robot of '{}' has a mind of its own; state mind = \"{name}\" for one in [[robots]]",
                scenario.name
            );
        }
        if !minds.contains(name) {
            let remedy = instead(name, minds.iter().copied());
            bail!(
                "--mind {name}: no robot of '{}' has that mind; {remedy}",
                scenario.name
            );
        }
    }
    let mut commands = BTreeMap::new();
    for robot in &scenario.robots {
        let Some(mind) = &robot.mind else { continue };
        let Some(stated) = stated.iter().find(|it| it.name == *mind) else {
            bail!(
                "the mind '{mind}' of {} is a program of its own; say how it is started: --mind {mind}=COMMAND",
                robot.name
            );
        };
        commands.insert(robot.name.clone(), stated.command.clone());
    }
    Ok(commands)
}

/// The variables that tell a program whose mind it is to be.
pub fn variables(robot: &str, run: &str) -> [(&'static str, String); 3] {
    [
        (ROBOT, robot.to_owned()),
        (RUN, run.to_owned()),
        // So that walking through a set of texts gives the same order each time.
        ("PYTHONHASHSEED", "0".to_owned()),
    ]
}

#[cfg(test)]
mod tests {
    use alliance_proto::testkit::default_setup;

    use super::*;

    #[test]
    fn name_version_and_command() {
        let parsed = MindCommand::parse("greedy@1.2= python3 greedy.py --x='a=b'").unwrap();
        assert_eq!(parsed.name, "greedy");
        assert_eq!(parsed.version.as_deref(), Some("1.2"));
        assert_eq!(parsed.command, "python3 greedy.py --x='a=b'");
        assert_eq!(MindCommand::parse("a=b").unwrap().version, None);
        for (text, wrong) in [
            ("greedy", "use NAME=COMMAND"),
            ("greedy= ", "use NAME=COMMAND"),
            ("=x", "'' is no name"),
            ("a b=x", "'a b' is no name"),
            ("a@=x", "NAME@VERSION=COMMAND"),
        ] {
            let said = MindCommand::parse(text).unwrap_err();
            assert!(said.contains(wrong), "{text}: {said}");
        }
    }

    #[test]
    fn each_mind_has_one_command_and_each_command_a_mind() {
        let mut scenario = default_setup(1).scenario;
        let stated = |texts: &[&str]| -> Vec<_> {
            let parsed = texts.iter().map(|text| MindCommand::parse(text));
            parsed.map(Result::unwrap).collect()
        };
        assert!(commands(&scenario, &[]).unwrap().is_empty());
        let refusal = |scenario: &Scenario, texts: &[&str]| {
            commands(scenario, &stated(texts)).unwrap_err().to_string()
        };
        assert!(refusal(&scenario, &["greedy=x"]).contains("has a mind of its own; state mind"));
        scenario.robots[1].mind = Some("greedy".to_owned());
        let name = scenario.robots[1].name.clone();
        assert!(refusal(&scenario, &[]).contains("--mind greedy=COMMAND"));
        assert!(refusal(&scenario, &["gredy=x"]).contains("did you mean 'greedy'?"));
        assert!(refusal(&scenario, &["greedy=x", "greedy=y"]).contains("twice"));
        let found = commands(&scenario, &stated(&["greedy=x"])).unwrap();
        assert_eq!(found, BTreeMap::from([(name, "x".to_owned())]));
    }
}
