//! External controllers: the commands that start them.
//!
//! A scenario contains only their names. The commands come from the command line, because a scenario must not start programs.

use std::collections::BTreeMap;

use anyhow::bail;
use robot_agent::args::{ROBOT, RUN};
use scenario::limits::check_name;
use scenario::{Problem, Scenario, name_remedy};

/// A value of `--controller`: `NAME[@VERSION]=COMMAND`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ControllerCommand {
    pub name: String,
    /// The version label given by the author.
    pub version: Option<String>,
    pub command: String,
}

impl ControllerCommand {
    /// Parses a value of `--controller`.
    pub fn parse(text: &str) -> Result<Self, Problem> {
        let problem = |what| Problem::of_value(what, "");
        let (name, command) = text
            .split_once('=')
            .filter(|(_, command)| !command.trim().is_empty())
            .ok_or_else(|| problem("use NAME=COMMAND, such as greedy='python3 greedy.py'"))?;
        let (name, version) = match name.split_once('@') {
            Some((name, version)) => (name, Some(version)),
            None => (name, None),
        };
        check_name((), name)?;
        if version.is_some_and(|version| version.is_empty() || version.contains(char::is_control)) {
            return Err(problem("use NAME@VERSION=COMMAND, or leave the @ out"));
        }
        Ok(Self {
            name: name.to_owned(),
            version: version.map(ToOwned::to_owned),
            command: command.trim().to_owned(),
        })
    }
}

/// Returns the commands of all external controllers, by robot.
///
/// # Errors
/// If a controller has no command, or a command has no controller.
pub fn commands(
    scenario: &Scenario,
    stated: &[ControllerCommand],
) -> anyhow::Result<BTreeMap<String, String>> {
    let names = scenario.external_controllers();
    for (index, command) in stated.iter().enumerate() {
        let name = command.name.as_str();
        let problem = |what: String, remedy: String| {
            Problem::with_source(format!("--controller {name}"), what, remedy)
        };
        if stated[..index].iter().any(|other| other.name == name) {
            bail!(problem(
                "it is given twice".to_owned(),
                "a controller has one command".to_owned()
            ));
        }
        if names.is_empty() {
            let what = format!("no robot of '{}' has an external controller", scenario.name);
            bail!(problem(
                what,
                format!("set controller = \"{name}\" for one in [[robots]]")
            ));
        }
        if !names.contains(name) {
            let remedy = name_remedy(name, names.iter().copied());
            let what = format!("no robot of '{}' has that controller", scenario.name);
            bail!(problem(what, remedy));
        }
    }
    let mut commands = BTreeMap::new();
    for robot in &scenario.robots {
        let Some(controller) = &robot.controller else {
            continue;
        };
        let Some(stated) = stated.iter().find(|stated| stated.name == *controller) else {
            let what = format!(
                "the controller '{controller}' of {} is an external program",
                robot.name
            );
            let remedy = format!("give its command: --controller {controller}=COMMAND");
            bail!(Problem::of_value(what, remedy));
        };
        commands.insert(robot.name.clone(), stated.command.clone());
    }
    Ok(commands)
}

/// Returns the environment variables that assign a controller process to a robot and a run.
pub fn variables(robot: &str, run: &str) -> [(&'static str, String); 3] {
    [
        (ROBOT, robot.to_owned()),
        (RUN, run.to_owned()),
        // Makes the iteration order of Python sets of strings reproducible.
        ("PYTHONHASHSEED", "0".to_owned()),
    ]
}

#[cfg(test)]
mod tests {
    use scenario::testkit::default_setup;

    use super::*;

    #[test]
    fn parses_name_version_and_command() {
        let parsed = ControllerCommand::parse("greedy@1.2= python3 greedy.py --x='a=b'").unwrap();
        assert_eq!(parsed.name, "greedy");
        assert_eq!(parsed.version.as_deref(), Some("1.2"));
        assert_eq!(parsed.command, "python3 greedy.py --x='a=b'");
        assert_eq!(ControllerCommand::parse("a=b").unwrap().version, None);
        for (text, wrong) in [
            ("greedy", "use NAME=COMMAND"),
            ("greedy= ", "use NAME=COMMAND"),
            ("=x", "'' is not a"),
            ("a b=x", "'a b' is not a"),
            ("a@=x", "NAME@VERSION=COMMAND"),
        ] {
            let message = ControllerCommand::parse(text).unwrap_err().to_string();
            assert!(message.contains(wrong), "{text}: {message}");
        }
    }

    #[test]
    fn each_controller_has_one_command_and_each_command_a_controller() {
        let mut scenario = default_setup(1).scenario;
        let stated = |texts: &[&str]| -> Vec<_> {
            let parsed = texts.iter().map(|text| ControllerCommand::parse(text));
            parsed.map(Result::unwrap).collect()
        };
        assert!(commands(&scenario, &[]).unwrap().is_empty());
        let refusal = |scenario: &Scenario, texts: &[&str]| {
            commands(scenario, &stated(texts)).unwrap_err().to_string()
        };
        assert!(
            refusal(&scenario, &["greedy=x"])
                .contains("has an external controller; set controller")
        );
        scenario.robots[1].controller = Some("greedy".to_owned());
        let name = scenario.robots[1].name.clone();
        assert!(refusal(&scenario, &[]).contains("--controller greedy=COMMAND"));
        assert!(refusal(&scenario, &["gredy=x"]).contains("did you mean 'greedy'?"));
        assert!(refusal(&scenario, &["greedy=x", "greedy=y"]).contains("twice"));
        let found = commands(&scenario, &stated(&["greedy=x"])).unwrap();
        assert_eq!(found, BTreeMap::from([(name, "x".to_owned())]));
    }
}
