//! Registered missions by name, and the mission of a scenario. A scenario stores its mission with an erased type,
//! because missions are defined in terms of scenarios.

use std::fmt::{self, Debug};
use std::ops::Deref;
use std::sync::Arc;

use serde::de::DeserializeOwned;

use super::data::{MissionData, MissionVocabulary};
use super::section::{MissionSection, Section};
use crate::{BehaviorSpec, Problem, Scenario, UntypedTable};

/// A registered mission. Two missions are equal if their names are.
#[derive(Clone, Copy)]
pub struct Mission {
    name: &'static str,
    about: &'static str,
    data: &'static dyn MissionData,
}

impl Mission {
    /// Creates a mission. The name is one word, the mission's section in a scenario file. `about` describes the work in
    /// one line.
    #[must_use]
    pub const fn new(
        name: &'static str,
        about: &'static str,
        data: &'static dyn MissionData,
    ) -> Self {
        Self { name, about, data }
    }

    /// Returns the name, one word: the mission's section in a scenario file.
    #[must_use]
    pub fn name(&self) -> &'static str {
        self.name
    }

    /// Returns a description of the work in one line.
    #[must_use]
    pub fn about(&self) -> &'static str {
        self.about
    }

    /// Returns the name of a scenario of this mission that states none.
    #[must_use]
    pub fn scenario_name(&self) -> &'static str {
        self.data.vocabulary().scenario_name.unwrap_or(self.name)
    }

    /// Returns true if the mission's robots have a gripper, which can fail.
    #[must_use]
    pub fn has_gripper(&self) -> bool {
        self.data.vocabulary().devices.contains(&"gripper")
    }
}

impl Deref for Mission {
    type Target = dyn MissionData;

    fn deref(&self) -> &Self::Target {
        self.data
    }
}

impl PartialEq for Mission {
    fn eq(&self, other: &Self) -> bool {
        self.name() == other.name()
    }
}

impl Eq for Mission {}

impl Debug for Mission {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

/// The mission of a scenario without one: there is no work.
pub const NO_MISSION: Mission = Mission::new("none", "nothing to do", &Nothing);

#[derive(Debug)]
struct Nothing;

impl MissionData for Nothing {
    fn section(&self, text: UntypedTable<'_>) -> Result<Box<dyn Section>, Problem> {
        read_section::<()>(text)
    }

    fn vocabulary(&self) -> MissionVocabulary {
        MissionVocabulary::NONE
    }

    fn catalog(&self, _scenario: &Scenario) -> (Vec<String>, Vec<BehaviorSpec>) {
        (Vec::new(), Vec::new())
    }
}

impl Scenario {
    /// Returns the mission of the scenario.
    #[must_use]
    pub fn mission(&self) -> Mission {
        self.mission.mission().copied().unwrap_or(NO_MISSION)
    }
}

impl MissionSection {
    /// Creates a section of a mission from values of the mission's own type.
    #[must_use]
    pub fn new(mission: Mission, values: impl Section) -> Self {
        Self::of(mission, Box::new(values))
    }

    /// Reads the section of a mission from a file.
    pub fn read(mission: Mission, text: UntypedTable<'_>) -> Result<Self, Problem> {
        let values = mission.section(text.with_defaults(&mission.parameters()))?;
        Ok(Self::of(mission, values))
    }

    fn of(mission: Mission, values: Box<dyn Section>) -> Self {
        if mission == NO_MISSION {
            return Self::default();
        }
        Self::from_values(mission.name(), Arc::new(mission), values)
    }
}

/// Reads a section as a value of type `T`, for [`MissionData::section`].
pub fn read_section<T: Section + DeserializeOwned>(
    text: UntypedTable<'_>,
) -> Result<Box<dyn Section>, Problem> {
    Ok(Box::new(text.deserialize::<T>()?))
}
