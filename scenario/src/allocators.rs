//! The allocator of each robot, and the stated parameters of allocators. The reader of a scenario supplies the list of
//! allocators.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use serde_json::{Map, Value};

use super::error::{Problem, name_remedy};
use super::parameters::ParameterSpec;
use super::path::KeyPath;
use super::{Robot, Scenario};

/// The section `[allocators]`: the stated values by allocator and parameter.
pub type Allocators = BTreeMap<String, Map<String, Value>>;

/// The properties of an allocator that a scenario depends on.
#[derive(Clone, Debug, PartialEq)]
pub struct AllocatorSpec {
    pub name: &'static str,
    /// The decision rule in one line.
    pub about: &'static str,
    /// The keys of `[allocators.NAME]`. Copies share them.
    pub parameters: Arc<[ParameterSpec]>,
    /// True if its robots receive the ground truth.
    pub needs_ground_truth: bool,
    /// True if its robots learn times that a [`Profile`](super::Profile) carries to a later run.
    pub learns_times: bool,
}

impl AllocatorSpec {
    /// Returns the default allocator, whose parameters belong in `[alliance]`.
    #[must_use]
    pub fn alliance() -> Self {
        Self {
            name: Scenario::DEFAULT_ALLOCATOR,
            about: "ALLIANCE: motivations that grow until a behavior set activates (Parker 1998)",
            parameters: [].into(),
            needs_ground_truth: false,
            learns_times: false,
        }
    }
}

impl Scenario {
    /// The allocator of a scenario that chooses none.
    pub const DEFAULT_ALLOCATOR: &str = "alliance";

    /// Returns the external controller of a robot, or else its allocator.
    #[must_use]
    pub fn decider_of<'s>(&'s self, robot: &'s Robot) -> &'s str {
        let controller = robot.controller.as_deref();
        controller.unwrap_or_else(|| self.stated_allocator(robot))
    }

    /// Returns the allocator of a robot regardless of an external controller: its own choice, or else the team's.
    #[must_use]
    pub fn stated_allocator<'s>(&'s self, robot: &'s Robot) -> &'s str {
        let stated = robot.allocator.as_deref().or(self.allocator.as_deref());
        stated.unwrap_or(Self::DEFAULT_ALLOCATOR)
    }

    /// Returns the distinct names of the external controllers.
    #[must_use]
    pub fn external_controllers(&self) -> BTreeSet<&str> {
        let controllers = self.robots.iter().map(|robot| robot.controller.as_deref());
        controllers.flatten().collect()
    }

    /// Returns the distinct names of the team's allocators, separated by commas.
    #[must_use]
    pub fn allocator_list(&self) -> String {
        let names = self.robots.iter().map(|robot| self.decider_of(robot));
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
    pub fn check_allocators(&self, known: &[AllocatorSpec]) -> Result<(), Problem> {
        if let Some(name) = &self.allocator {
            find(name, known, &KeyPath::new(["allocator"]))?;
        }
        for (index, robot) in self.robots.iter().enumerate() {
            if let Some(name) = &robot.allocator {
                let at = KeyPath::new(["robots"]).index(index).key("allocator");
                find(name, known, &at)?;
            }
            if let Some(controller) = &robot.controller
                && known.iter().any(|spec| spec.name == controller)
            {
                let at = KeyPath::new(["robots"]).index(index).key("controller");
                let what = format!("'{controller}' is an allocator, not a program");
                let remedy =
                    format!("state allocator = \"{controller}\", or give the program another name");
                return Err(Problem::at(at, what, remedy));
            }
        }
        let external = self.external_controllers();
        for (name, stated) in &self.allocators {
            // An external controller checks its own parameters.
            if external.contains(name.as_str()) {
                continue;
            }
            let at = KeyPath::new(["allocators"]).key(name);
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
    at: &KeyPath,
) -> Result<&'k AllocatorSpec, Problem> {
    known.iter().find(|spec| spec.name == name).ok_or_else(|| {
        let what = format!("there is no allocator '{name}'");
        let names = known.iter().map(|spec| spec.name);
        Problem::at(at, what, name_remedy(name, names))
    })
}

fn unknown_parameter(
    allocator: &AllocatorSpec,
    key: &str,
    known: &[AllocatorSpec],
    at: KeyPath,
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
        _ => name_remedy(key, keys),
    };
    Problem::at(at, what, remedy)
}
