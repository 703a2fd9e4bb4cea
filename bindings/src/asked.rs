//! What is to be run: the words of `alliance run`, a scenario as a document, faults, and who has which mind.

use std::sync::{Arc, Mutex};

use alliance_proto::scenario::{Robot, Scenario, Setup};
use clap::Parser;
use launch::Registry;
use launch::arguments::parse_words;
use pyo3::prelude::*;
use pyo3::types::PyType;
use world_server::args::{Known, MissionArgs};

use crate::errors::mistake;
use crate::mind::{Class, Failure};

/// Every robot for which nothing else is said.
const ALL: &str = "*";

/// The words of the command line that say what is run.
#[derive(Parser)]
#[command(name = "run")]
struct Words {
    #[command(flatten)]
    mission: MissionArgs,
}

/// What a caller asks for, in Python's types.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub struct Asked {
    /// The words, as on the command line.
    words: Vec<String>,
    /// A scenario in JSON, in the place of one that the words name.
    document: Option<String>,
    /// `[faults]` in JSON, in the place of the scenario's.
    faults: Option<String>,
    /// By robot, or for [`ALL`] others: the name of an allocator, and its class if it is one of Python.
    minds: Vec<(String, String, Option<Py<PyType>>)>,
    /// Whether each of these makes each step twice.
    twice: bool,
}

/// A run that is ready to begin.
pub struct Ready {
    pub setup: Setup,
    pub registry: Registry,
    /// What is done about a mind in Python that fails.
    pub failure: Failure,
}

impl Asked {
    /// Reads and checks all of it; the registry has what there is beside the minds in Python.
    ///
    /// # Errors
    /// One line, as the program has it.
    pub fn ready(self, registry: Registry) -> PyResult<Ready> {
        let failure = Failure::Kept(Arc::new(Mutex::new(None)));
        let built_in = registry.vocabulary().allocators;
        let mut registry = registry;
        for (_, name, class) in &self.minds {
            if let Some(class) = class {
                if built_in.iter().any(|spec| spec.name == name) {
                    return Err(mistake(format!(
                        "minds: '{name}' is one of the simulator's allocators; give the class another name"
                    )));
                }
                let class = Python::attach(|py| class.clone_ref(py));
                registry = registry.mind(Arc::new(Class::new(
                    name,
                    class,
                    failure.clone(),
                    self.twice,
                )));
            }
        }
        let known = Known {
            vocabulary: registry.vocabulary(),
            worlds: registry.worlds().clone(),
        };
        let mut words: Words = parse_words(&known.vocabulary, &self.words).map_err(mistake)?;
        if let Some(asked) = &mut words.mission.scenario {
            // A mission's name stands for the scenario that comes in any size.
            let mut missions = known.vocabulary.missions.iter();
            if let Some(mission) = missions.find(|mission| mission.name() == asked.as_str()) {
                *asked = mission.scenario_name().to_owned();
            }
        }
        let mut scenario = match &self.document {
            Some(document) => read_document(document, &known)?,
            None => words.mission.scenario(&known).map_err(one_line)?,
        };
        if let Some(faults) = &self.faults {
            scenario = with_faults(&scenario, faults, &known)?;
        }
        self.give_minds(&mut scenario)?;
        let setup = words.mission.resolve(scenario, &known).map_err(one_line)?;
        Ok(Ready {
            setup,
            registry,
            failure,
        })
    }

    fn give_minds(&self, scenario: &mut Scenario) -> PyResult<()> {
        let mut of_others = None;
        for (robot, name, class) in &self.minds {
            let is_class = class.is_some();
            if robot == ALL {
                of_others = Some((name, is_class));
                continue;
            }
            let mut robots = scenario.robots.iter_mut();
            let Some(robot) = robots.find(|it| it.name == *robot) else {
                let names: Vec<_> = scenario.robots.iter().map(|it| &*it.name).collect();
                let names = names.join(", ");
                let told = format!("minds: there is no robot '{robot}'; there are {names}");
                return Err(mistake(told));
            };
            give(robot, name, is_class);
        }
        let stated = |robot: &str| self.minds.iter().any(|(it, ..)| it == robot);
        for robot in scenario.robots.iter_mut().filter(|it| !stated(&it.name)) {
            if let Some((name, is_class)) = of_others {
                give(robot, name, is_class);
            } else if let Some(mind) = &robot.mind {
                return Err(mistake(format!(
                    "minds: the scenario gives the mind '{mind}' to {robot}; give its class: minds={{'{robot}': …}}",
                    robot = robot.name
                )));
            }
        }
        Ok(())
    }
}

/// A class is a mind of its own, any other name an allocator of the simulator.
fn give(robot: &mut Robot, name: &str, is_class: bool) {
    let name = Some(name.to_owned());
    if is_class {
        robot.mind = name;
    } else {
        (robot.allocator, robot.mind) = (name, None);
    }
}

/// A scenario in JSON, as a TOML file would state it.
fn read_document(document: &str, known: &Known) -> PyResult<Scenario> {
    let table: toml::Table =
        serde_json::from_str(document).map_err(|error| mistake(format!("scenario: {error}")))?;
    Scenario::from_table(&table, &known.vocabulary).map_err(mistake)
}

/// The scenario with these faults alone.
fn with_faults(scenario: &Scenario, faults: &str, known: &Known) -> PyResult<Scenario> {
    let faults: toml::Value =
        serde_json::from_str(faults).map_err(|error| mistake(format!("faults: {error}")))?;
    let mut table = toml::Table::try_from(scenario)
        .map_err(|error| mistake(format!("scenario '{}': {error}", scenario.name)))?;
    table.insert("faults".to_owned(), faults);
    Scenario::from_table(&table, &known.vocabulary).map_err(mistake)
}

fn one_line(error: anyhow::Error) -> PyErr {
    mistake(format!("{error:#}"))
}
