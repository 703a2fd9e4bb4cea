//! The allocator of each robot, and the stated parameters of allocators. The reader of a scenario supplies the list of
//! allocators.

use std::collections::{BTreeMap, BTreeSet};

use serde_json::{Map, Value};

use super::error::{Problem, ScenarioError, instead};
use super::parameters::ParameterSpec;
use super::path::Path;
use super::{Robot, Scenario};

/// The section `[allocators]`: the stated values by allocator and parameter.
pub type Allocators = BTreeMap<String, Map<String, Value>>;

/// The properties of an allocator that a scenario depends on.
#[derive(Clone, Debug, PartialEq)]
pub struct AllocatorSpec {
    pub name: &'static str,
    /// The decision rule in one line.
    pub about: &'static str,
    /// The keys of `[allocators.NAME]`.
    pub parameters: Vec<ParameterSpec>,
    /// True if its robots receive the [ground truth](crate::tick::TickMessage::truth).
    pub wants_truth: bool,
    /// True if its robots learn times that a [`Profile`](super::Profile) carries to a later run.
    pub learns: bool,
}

impl AllocatorSpec {
    /// Returns the default allocator, whose parameters belong in `[alliance]`.
    #[must_use]
    pub fn alliance() -> Self {
        Self {
            name: Scenario::DEFAULT_ALLOCATOR,
            about: "ALLIANCE: motivations that grow until a behavior set activates (Parker 1998)",
            parameters: Vec::new(),
            wants_truth: false,
            learns: false,
        }
    }
}

impl Scenario {
    /// The allocator of a scenario that chooses none.
    pub const DEFAULT_ALLOCATOR: &str = "alliance";

    /// Returns the external controller of a robot, or else its allocator.
    #[must_use]
    pub fn allocator_of<'s>(&'s self, robot: &'s Robot) -> &'s str {
        let mind = robot.mind.as_deref();
        mind.unwrap_or_else(|| self.allocator_beside_mind(robot))
    }

    /// Returns the allocator of a robot regardless of an external controller: its own choice, or else the team's.
    #[must_use]
    pub fn allocator_beside_mind<'s>(&'s self, robot: &'s Robot) -> &'s str {
        let stated = robot.allocator.as_deref().or(self.allocator.as_deref());
        stated.unwrap_or(Self::DEFAULT_ALLOCATOR)
    }

    /// Returns the distinct names of the external controllers.
    #[must_use]
    pub fn minds(&self) -> BTreeSet<&str> {
        let minds = self.robots.iter().map(|robot| robot.mind.as_deref());
        minds.flatten().collect()
    }

    /// Returns the distinct names of the team's allocators, separated by commas.
    #[must_use]
    pub fn allocators_in_words(&self) -> String {
        let names = self.robots.iter().map(|robot| self.allocator_of(robot));
        let names: BTreeSet<&str> = names.collect();
        names.into_iter().collect::<Vec<_>>().join(", ")
    }

    /// Returns the stated values of an allocator as a JSON object.
    #[must_use]
    pub fn allocator_values(&self, allocator: &str) -> Value {
        let stated = self.allocators.get(allocator).cloned();
        Value::Object(stated.unwrap_or_default())
    }

    /// Checks the choice of allocators and their stated values.
    ///
    /// # Errors
    /// Returns the first unknown allocator or parameter, or the first value out of range.
    pub fn check_allocators(&self, known: &[AllocatorSpec]) -> Result<(), ScenarioError> {
        self.allocator_problem(known)
            .map_err(|problem| problem.located(None))
    }

    /// Checks the same and returns a problem, which can get a line of the scenario's file.
    pub(super) fn allocator_problem(&self, known: &[AllocatorSpec]) -> Result<(), Problem> {
        if let Some(name) = &self.allocator {
            find(name, known, &Path::of(["allocator"]))?;
        }
        for (index, robot) in self.robots.iter().enumerate() {
            if let Some(name) = &robot.allocator {
                let at = Path::of(["robots"]).index(index).key("allocator");
                find(name, known, &at)?;
            }
            if let Some(mind) = &robot.mind
                && known.iter().any(|spec| spec.name == mind)
            {
                let at = Path::of(["robots"]).index(index).key("mind");
                let what = format!("'{mind}' is an allocator, not a program");
                let remedy =
                    format!("state allocator = \"{mind}\", or give the program another name");
                return Err(Problem::at(at, what, remedy));
            }
        }
        for (name, stated) in &self.allocators {
            let at = Path::of(["allocators"]).key(name);
            let allocator = find(name, known, &at)?;
            for (key, value) in stated {
                let at = at.key(key);
                let mut parameters = allocator.parameters.iter();
                match parameters.find(|parameter| parameter.key == key) {
                    Some(parameter) => parameter.check(value, &at, &self.room)?,
                    None => return Err(unknown_parameter(allocator, key, known, at)),
                }
            }
        }
        Ok(())
    }
}

fn find<'k>(
    name: &str,
    known: &'k [AllocatorSpec],
    at: &Path,
) -> Result<&'k AllocatorSpec, Problem> {
    known.iter().find(|spec| spec.name == name).ok_or_else(|| {
        let what = format!("there is no allocator '{name}'");
        let names = known.iter().map(|spec| spec.name);
        Problem::at(at.clone(), what, instead(name, names))
    })
}

fn unknown_parameter(
    allocator: &AllocatorSpec,
    key: &str,
    known: &[AllocatorSpec],
    at: Path,
) -> Problem {
    let has = |spec: &&AllocatorSpec| spec.parameters.iter().any(|parameter| parameter.key == key);
    let what = match known.iter().find(has) {
        Some(owner) => format!(
            "the key is a parameter of {}, not of {}",
            owner.name, allocator.name
        ),
        None => format!("{} has no such parameter", allocator.name),
    };
    let keys = allocator.parameters.iter().map(|parameter| parameter.key);
    let remedy = match allocator.name {
        Scenario::DEFAULT_ALLOCATOR => "its parameters belong in [alliance]".to_owned(),
        _ => instead(key, keys),
    };
    Problem::at(at, what, remedy)
}
