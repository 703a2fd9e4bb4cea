//! The description of a run: arguments of `alliance run`, a scenario document, faults, and the controllers of robots.

use std::fmt::Display;
use std::sync::Arc;

use clap::Parser;
use launch::Registry;
use launch::arguments::parse_list;
use missions::Randomised;
use pyo3::prelude::*;
use pyo3::types::PyType;
use scenario::limits::check_known;
use scenario::{Problem, Robot, Scenario, Setup};
use world_server::mission_args::{Known, MissionArgs};

use crate::controller::FailureReaction;
use crate::controller_class::ControllerClass;
use crate::errors::scenario_error;

/// The key for all robots without their own entry.
const ALL: &str = "*";

/// The command-line arguments that describe a run.
#[derive(Parser)]
#[command(name = "run")]
struct RunArguments {
    #[command(flatten)]
    mission: MissionArgs,
}

/// A run request from Python.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub struct RunRequest {
    /// The arguments, as on the command line.
    arguments: Vec<String>,
    /// A scenario in JSON, which replaces a scenario in the arguments.
    document: Option<String>,
    /// `[faults]` in JSON, which replaces the faults of the scenario.
    faults: Option<String>,
    /// The controllers by robot, or by [`ALL`] for all others: the name of an allocator, and its class if it is written
    /// in Python.
    controllers: Vec<(String, String, Option<Py<PyType>>)>,
    /// `true` to execute each step of these controllers twice, as a check.
    twice: bool,
    /// The names of properties that are drawn from the seed.
    randomise: Vec<String>,
}

/// A run that is ready to begin.
pub struct PreparedRun {
    pub setup: Setup,
    pub registry: Registry,
    /// The reaction to an error of a controller in Python.
    pub failure: FailureReaction,
    /// The properties of the scenario that each run draws from its seed.
    pub randomised: Randomised,
}

impl RunRequest {
    /// Reads and checks the request. `registry` contains everything except the controllers in Python.
    ///
    /// # Errors
    /// Returns a `ScenarioError` with one line, as the program prints it.
    pub fn ready(self, registry: Registry) -> PyResult<PreparedRun> {
        let failure = FailureReaction::Stored(Arc::default());
        let built_in = registry.vocabulary().allocators;
        let mut registry = registry;
        for (_, name, class) in &self.controllers {
            if let Some(class) = class {
                if built_in.iter().any(|spec| spec.name == name) {
                    let what = format!("'{name}' is one of the simulator's allocators");
                    let remedy = "give the class another name";
                    return Err(scenario_error(Problem::at(["controllers"], what, remedy)));
                }
                let class = Python::attach(|py| class.clone_ref(py));
                let class = ControllerClass::new(name, class, failure.clone(), self.twice);
                registry = registry.with_controller(class.into_kind()?);
            }
        }
        let known = Known {
            vocabulary: registry.vocabulary(),
            worlds: registry.worlds().clone(),
        };
        let mut args: RunArguments =
            parse_list(&known.vocabulary, &self.arguments).map_err(argument_error)?;
        if let Some(name) = &mut args.mission.scenario {
            // The name of a mission selects its scenario of variable size.
            let mut missions = known.vocabulary.missions.iter();
            if let Some(mission) = missions.find(|mission| mission.name() == name.as_str()) {
                *name = mission.scenario_name().to_owned();
            }
        }
        let mut scenario = match &self.document {
            Some(document) => read_document(document, &known)?,
            None => args.mission.scenario(&known).map_err(one_line)?,
        };
        if let Some(faults) = &self.faults {
            scenario = with_faults(&scenario, faults, &known)?;
        }
        self.assign_controllers(&mut scenario)?;
        let setup = args.mission.resolve(scenario, &known).map_err(one_line)?;
        let names = self.randomise.iter().map(String::as_str);
        let randomised = Randomised::from_names(names).map_err(scenario_error)?;
        Ok(PreparedRun {
            setup,
            registry,
            failure,
            randomised,
        })
    }

    fn assign_controllers(&self, scenario: &mut Scenario) -> PyResult<()> {
        let mut default = None;
        for (robot, name, class) in &self.controllers {
            let is_class = class.is_some();
            if robot == ALL {
                default = Some((name, is_class));
                continue;
            }
            let names = scenario.robots.iter().map(|robot| robot.name.as_str());
            let known = check_known(["controllers"], "there is no robot", robot, names);
            known.map_err(scenario_error)?;
            let mut robots = scenario.robots.iter_mut();
            if let Some(robot) = robots.find(|other| other.name == *robot) {
                assign(robot, name, is_class);
            }
        }
        let stated = |robot: &str| self.controllers.iter().any(|(name, ..)| name == robot);
        for robot in scenario
            .robots
            .iter_mut()
            .filter(|robot| !stated(&robot.name))
        {
            if let Some((name, is_class)) = default {
                assign(robot, name, is_class);
            } else if let Some(controller) = &robot.controller {
                let robot = &robot.name;
                let what = format!("the scenario gives the controller '{controller}' to {robot}");
                let remedy = format!("give its class: controllers={{'{robot}': …}}");
                return Err(scenario_error(Problem::at(["controllers"], what, remedy)));
            }
        }
        Ok(())
    }
}

/// Assigns a Python class as the robot's external controller, or another name as its allocator.
fn assign(robot: &mut Robot, name: &str, is_class: bool) {
    let name = Some(name.to_owned());
    if is_class {
        robot.controller = name;
    } else {
        (robot.allocator, robot.controller) = (name, None);
    }
}

/// Parses a scenario in JSON with the structure of a TOML file.
fn read_document(document: &str, known: &Known) -> PyResult<Scenario> {
    let table: toml::Table = serde_json::from_str(document)
        .map_err(|error| scenario_error(Problem::at(["scenario"], error.to_string(), "")))?;
    Scenario::from_table(&table, &known.vocabulary).map_err(scenario_error)
}

/// Returns the scenario with its faults replaced.
fn with_faults(scenario: &Scenario, faults: &str, known: &Known) -> PyResult<Scenario> {
    let faults: toml::Value = serde_json::from_str(faults)
        .map_err(|error| scenario_error(Problem::at(["faults"], error.to_string(), "")))?;
    let mut table = toml::Table::try_from(scenario)
        .map_err(|error| scenario_error(format!("scenario '{}': {error}", scenario.name)))?;
    table.insert("faults".to_owned(), faults);
    Scenario::from_table(&table, &known.vocabulary).map_err(scenario_error)
}

/// Returns the error of a command-line argument with the name of the argument in Python: `robots: invalid value '0'; use …`.
fn argument_error(error: impl Display) -> PyErr {
    let text = error.to_string();
    let renamed = text.split_once(" for '--").and_then(|(value, rest)| {
        let (option, remedy) = rest.split_once("': ")?;
        let (name, _) = option.split_once(' ')?;
        Some(format!("{name}: {value}; {remedy}"))
    });
    scenario_error(renamed.unwrap_or(text))
}

fn one_line(error: anyhow::Error) -> PyErr {
    scenario_error(format!("{error:#}"))
}
