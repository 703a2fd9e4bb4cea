//! The allocators and missions of a program.

#![warn(missing_docs)]

use scenario::{Setup, Vocabulary};
use serde::de::DeserializeOwned;

use crate::allocator::{Allocator, AllocatorKind, ConfigError, ConfiguredAllocator};
use crate::allocators;
use crate::mission::ControllerKind;

/// The allocators, controllers and missions of a program, by name.
#[derive(Clone, Debug)]
pub struct AgentRegistry {
    kinds: Vec<AllocatorKind>,
    controllers: Vec<AllocatorKind>,
    missions: Vec<ControllerKind>,
}

impl AgentRegistry {
    /// Creates a registry with the built-in allocators and no mission.
    #[must_use]
    pub fn built_in() -> Self {
        Self {
            kinds: allocators::built_in(),
            controllers: Vec::new(),
            missions: Vec::new(),
        }
    }

    /// Adds an allocator type under a name, and replaces an allocator of the same name.
    #[must_use]
    pub fn with_allocator<A: Allocator>(self, name: &'static str, about: &'static str) -> Self
    where
        A::Config: DeserializeOwned,
    {
        self.with_allocator_kind(AllocatorKind::new::<A>(name, about))
    }

    /// Adds an allocator whose parameters do not come from the scenario, such as one in another language, and replaces
    /// an allocator of the same name.
    #[must_use]
    pub fn with_allocator_kind(mut self, kind: AllocatorKind) -> Self {
        let name = kind.spec().name;
        self.kinds.retain(|known| known.spec().name != name);
        self.kinds.push(kind);
        self
    }

    /// Adds a controller that a scenario can give to a robot in place of an [external
    /// program](scenario::Robot::controller), and replaces one of the same name. A scenario cannot select
    /// it as an allocator.
    #[must_use]
    pub fn with_controller(mut self, kind: AllocatorKind) -> Self {
        let name = kind.spec().name;
        self.controllers.retain(|known| known.spec().name != name);
        self.controllers.push(kind);
        self
    }

    /// Returns whether the registry has a controller of that name.
    #[must_use]
    pub fn has_controller(&self, name: &str) -> bool {
        self.controllers
            .iter()
            .any(|known| known.spec().name == name)
    }

    /// Adds a mission, and replaces one of the same name.
    #[must_use]
    pub fn with_mission(mut self, controller: ControllerKind) -> Self {
        self.missions.retain(|known| known.data != controller.data);
        self.missions.push(controller);
        self
    }

    /// Returns the vocabulary of scenarios: all missions and allocators, in the order of their addition.
    #[must_use]
    pub fn vocabulary(&self) -> Vocabulary {
        Vocabulary {
            missions: self
                .missions
                .iter()
                .map(|controller| controller.data)
                .collect(),
            allocators: self.kinds.iter().map(|kind| kind.spec().clone()).collect(),
        }
    }

    /// Returns whether the allocator of that name uses the tasks assigned before the start.
    #[must_use]
    pub fn uses_assignment(&self, name: &str) -> bool {
        let mut kinds = self.kinds.iter();
        kinds.any(|kind| kind.spec().name == name && kind.uses_assignment)
    }

    /// Returns whether the allocator of that name plans a sequence of several tasks for a robot.
    #[must_use]
    pub fn plans_sequences(&self, name: &str) -> bool {
        let mut kinds = self.kinds.iter();
        kinds.any(|kind| kind.spec().name == name && kind.plans_sequences)
    }

    /// Creates the controller of that name for a run.
    ///
    /// # Errors
    /// Fails if the name is unknown, or the controller does not support the run.
    pub(crate) fn prepare_controller(
        &self,
        name: &str,
        setup: &Setup,
    ) -> Result<ConfiguredAllocator, ConfigError> {
        let kind = self
            .controllers
            .iter()
            .find(|kind| kind.spec().name == name);
        let unknown = || ConfigError {
            subject: format!("controller '{name}'"),
            why: "this program does not contain it".to_owned(),
        };
        kind.ok_or_else(unknown)?.prepare(setup)
    }

    /// Creates the allocator of that name with the parameters of a run.
    ///
    /// # Errors
    /// Fails if the name is unknown or a parameter is invalid.
    pub(crate) fn prepare(
        &self,
        name: &str,
        setup: &Setup,
    ) -> Result<ConfiguredAllocator, ConfigError> {
        let kind = self.kinds.iter().find(|kind| kind.spec().name == name);
        let unknown = || {
            let names: Vec<_> = self
                .vocabulary()
                .allocators
                .iter()
                .map(|allocator| allocator.name)
                .collect();
            ConfigError {
                subject: format!("allocators.{name}"),
                why: format!("there is no such allocator; there are {}", names.join(", ")),
            }
        };
        kind.ok_or_else(unknown)?.prepare(setup)
    }

    /// Returns the controller type of the run's mission.
    ///
    /// # Errors
    /// Fails if the registry lacks the robots' side of the mission.
    pub(crate) fn controller_kind(&self, setup: &Setup) -> Result<ControllerKind, ConfigError> {
        let mission = setup.catalog.mission;
        let controller = self.missions.iter().find(|known| known.data == mission);
        controller.copied().ok_or_else(|| {
            let names: Vec<_> = self
                .missions
                .iter()
                .map(|known| known.data.name())
                .collect();
            ConfigError {
                subject: format!("mission {}", mission.name()),
                why: format!("there is no such mission; there are {}", names.join(", ")),
            }
        })
    }
}
