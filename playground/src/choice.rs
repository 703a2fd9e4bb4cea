//! The choice of a run: a scenario, an allocator and a seed.

use missions::Registry;
use proto::control::ControlCommand;
use scenario::ids::Tick;
use scenario::limits::{TIME, check_known};
use scenario::{Problem, Scenario, Setup};
use serde::{Deserialize, Serialize};

/// A run that a person chooses.
#[derive(Clone, Debug, Default, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Choice {
    /// The name of a built-in scenario; `None` for the default mission.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub scenario: Option<String>,
    /// A scenario of the person, instead of a built-in one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub file: Option<ScenarioFile>,
    /// The allocator of all robots; `None` for those of the scenario.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub allocator: Option<String>,
    /// The allocator of a second run beside this one; `None` without a second run.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub beside: Option<String>,
    /// A text, because the numbers of JavaScript have 53 bits only; `None` for 1.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub seed: Option<String>,
    /// The time limit in simulated seconds; `None` for that of the scenario.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub limit_s: Option<f64>,
    /// Orders of a person that the run repeats, by tick.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub orders: Vec<GivenOrder>,
}

/// A scenario file that a person has written.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct ScenarioFile {
    /// The name of the file, for problems and for the command.
    pub name: String,
    pub text: String,
}

/// A command to the run, and the tick before which it is given.
pub type GivenOrder = (Tick, ControlCommand);

impl Choice {
    /// Returns the file of the scenario. That of a built-in one has its text.
    ///
    /// # Errors
    /// If no built-in scenario has the name, or the choice has two scenarios.
    pub fn scenario_file(&self) -> Result<ScenarioFile, Problem> {
        let vocabulary = Registry::current().vocabulary();
        let mut builtins = vocabulary.builtins();
        let builtin = match (&self.file, &self.scenario) {
            (Some(file), None) => return Ok(file.clone()),
            (Some(_), Some(_)) => {
                let what = "the choice has a file and a built-in scenario";
                return Err(Problem::at(["file"], what, "omit one of them"));
            }
            // The first one is the default mission.
            (None, None) => builtins.next(),
            (None, Some(name)) => {
                let names = vocabulary.builtins().map(|builtin| builtin.name);
                check_known(["scenario"], "no built-in scenario", name, names)?;
                vocabulary.builtin(name)
            }
        };
        let (name, text) = builtin.map_or(("scenario", ""), |found| (found.name, found.text));
        Ok(ScenarioFile {
            name: format!("{name}.toml"),
            text: text.to_owned(),
        })
    }

    /// Returns the scenario without the rest of the choice.
    ///
    /// # Errors
    /// If the scenario is invalid.
    pub fn scenario(&self) -> Result<Scenario, Problem> {
        let file = self.scenario_file()?;
        Scenario::parse(&file.name, &file.text, &Registry::current().vocabulary())
    }

    /// Returns the setup of the run.
    ///
    /// # Errors
    /// If the scenario, the allocator or a number is invalid, or the scenario does not accept the allocator.
    pub fn setup(&self) -> Result<Setup, Problem> {
        let registry = Registry::current();
        let vocabulary = registry.vocabulary();
        let mut scenario = self.scenario()?;
        if let Some(name) = &self.allocator {
            scenario.set_allocator(name);
        }
        if let Some(limit_s) = self.limit_s {
            TIME.check(["limit_s"], limit_s)?;
            scenario.limit_s = limit_s;
        }
        scenario.check_allocators(&vocabulary.allocators)?;
        let setup = Setup::resolve(scenario, self.seed()?, None)?.setup;
        let world = registry.worlds().find(&setup.scenario);
        let world = world.map_err(|error| Problem::of_value(error.to_string(), ""))?;
        world
            .start_poses(&setup.scenario)
            .map_err(|error| Problem::of_value(error.describe(&setup.scenario), ""))?;
        Ok(setup)
    }

    /// Returns the choice of the second run, which differs only in its allocator.
    #[must_use]
    pub fn second(&self) -> Option<Self> {
        let allocator = Some(self.beside.clone()?);
        Some(Self {
            allocator,
            beside: None,
            ..self.clone()
        })
    }

    fn seed(&self) -> Result<u64, Problem> {
        let Some(text) = &self.seed else {
            return Ok(1);
        };
        text.parse().map_err(|_| {
            let remedy = format!("use a whole number from 0 to {}", u64::MAX);
            Problem::at(["seed"], format!("'{text}' is no seed"), remedy)
        })
    }

    /// Returns the command that repeats the run natively, without orders of a person.
    #[must_use]
    pub fn command(&self) -> String {
        let mut command = "alliance run".to_owned();
        let mut add = |option: &str, value: &Option<String>| {
            if let Some(value) = value {
                command.push_str(option);
                command.push_str(value);
            }
        };
        add(" ", &self.file.as_ref().map(|file| file.name.clone()));
        add(" ", &self.scenario);
        add(" --allocator ", &self.allocator);
        add(" --seed ", &self.seed);
        add(
            " --limit ",
            &self.limit_s.map(|limit_s| limit_s.to_string()),
        );
        command + " --in-process"
    }
}

#[cfg(test)]
mod tests {
    use serde_json::{Value, json};

    use super::*;

    #[test]
    fn mistakes_are_refused_in_one_line() {
        let refusal = |json: Value| {
            let choice: Choice = serde_json::from_value(json).unwrap();
            choice.setup().unwrap_err().to_string()
        };
        for (choice, start) in [
            (
                json!({"scenario": "nowhere"}),
                "scenario: no built-in scenario 'nowhere'; ",
            ),
            (
                json!({"allocator": "mine"}),
                "allocator: there is no allocator 'mine'",
            ),
            (
                json!({"seed": "-1"}),
                "seed: '-1' is no seed; use a whole number from 0 to 18446744073709551615",
            ),
            (json!({"limit_s": -1.0}), "limit_s: "),
            (
                json!({"file": {"name": "mine.toml", "text": "limit_s = 9\nrobot = 3"}}),
                "mine.toml:2: robot: ",
            ),
            (
                json!({"scenario": "janitorial", "file": {"name": "mine.toml", "text": ""}}),
                "file: the choice has a file and a built-in scenario; omit one of them",
            ),
        ] {
            let found = refusal(choice);
            assert!(found.starts_with(start), "{found}");
            assert_eq!(found.lines().count(), 1, "{found}");
        }
    }

    #[test]
    fn the_command_has_the_choice() {
        let choice =
            json!({"scenario": "janitorial", "allocator": "cbba", "seed": "7", "limit_s": 60.5});
        let choice: Choice = serde_json::from_value(choice).unwrap();
        let command = "alliance run janitorial --allocator cbba --seed 7 --limit 60.5 --in-process";
        assert_eq!(choice.command(), command);
        let choice = json!({"file": {"name": "mine.toml", "text": ""}});
        let choice: Choice = serde_json::from_value(choice).unwrap();
        assert_eq!(choice.command(), "alliance run mine.toml --in-process");
        assert_eq!(Choice::default().command(), "alliance run --in-process");
    }
}
