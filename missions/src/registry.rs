//! The registry of missions and allocators.

#![warn(missing_docs)]

use std::sync::OnceLock;

use robot_agent::allocator::{Allocator, AllocatorKind};
use robot_agent::mission::{ControllerConstructor, ControllerKind};
use robot_agent::registry::AgentRegistry;
use scenario::mission::registry::Mission;
use scenario::{Setup, Vocabulary};
use serde::de::DeserializeOwned;
use world_server::mission::{MissionRegistry, MissionWorld, WorldKind};

/// The registry of this program. The program's `main` sets it once, before the first read.
static OF_THIS_PROGRAM: OnceLock<Registry> = OnceLock::new();

/// The world side and the robot side of a mission.
#[derive(Clone, Copy, Debug)]
pub struct MissionParts {
    /// The world side, which only the world process uses.
    pub world: WorldKind,
    /// The robot side, with the same mission data as the world side.
    pub controller: ControllerKind,
}

impl MissionParts {
    /// Creates the parts of a mission from a world type and the constructor of its controllers. Both sides use the same
    /// types of sensor readings and actions.
    #[must_use]
    pub const fn new<W: MissionWorld>(
        data: Mission,
        constructor: fn(&Setup) -> ControllerConstructor,
    ) -> Self {
        Self {
            world: WorldKind::new::<W>(data),
            controller: ControllerKind::new(data, constructor),
        }
    }
}

/// The missions and allocators of a program, by name.
///
/// ```
/// use scenario::Scenario;
/// use missions::Registry;
/// use robot_agent::allocators::nearest::Nearest;
///
/// let registry = Registry::built_in().with_allocator::<Nearest>("mine", "a custom rule");
/// let read = |text| Scenario::parse("mine.toml", text, &registry.vocabulary());
/// assert!(read("allocator = 'mine'").is_ok());
/// let error = read("allocator = 'yours'").unwrap_err().to_string();
/// assert!(error.starts_with("mine.toml:1: allocator: there is no allocator 'yours'"));
/// ```
/// A `main` passes the registry to `launch::main(registry)`.
#[derive(Clone, Debug)]
pub struct Registry {
    worlds: MissionRegistry,
    agents: AgentRegistry,
}

impl Registry {
    /// Creates a registry with the built-in missions and allocators.
    #[must_use]
    pub fn built_in() -> Self {
        let none = Self {
            worlds: MissionRegistry::default(),
            agents: AgentRegistry::built_in(),
        };
        none.with_mission(crate::waste::MISSION)
            .with_mission(crate::service::MISSION)
            .with_mission(crate::push::MISSION)
            .with_mission(crate::observe::MISSION)
    }

    /// Makes this the registry of the program. All commands and processes of the program use it.
    ///
    /// # Panics
    /// If the program already has a registry. A second one would make the meaning of a scenario ambiguous.
    pub fn install(self) {
        let installed = OF_THIS_PROGRAM.set(self);
        assert!(installed.is_ok(), "the program already has a registry");
    }

    /// Returns the registry of the program, or the built-in registry if `main` installed none.
    #[must_use]
    pub fn current() -> &'static Self {
        OF_THIS_PROGRAM.get_or_init(Self::built_in)
    }

    /// Adds an allocator type under a name, with a summary of one line, or replaces the allocator of that name.
    #[must_use]
    pub fn with_allocator<A: Allocator>(mut self, name: &'static str, about: &'static str) -> Self
    where
        A::Config: DeserializeOwned,
    {
        self.agents = self.agents.with_allocator::<A>(name, about);
        self
    }

    /// Adds an allocator whose parameters do not come from the scenario, such as a rule in another language.
    #[must_use]
    pub fn with_allocator_kind(mut self, kind: AllocatorKind) -> Self {
        self.agents = self.agents.with_allocator_kind(kind);
        self
    }

    /// Adds a controller kind, or replaces the kind of that name. Scenarios treat other names as external controllers.
    #[must_use]
    pub fn with_controller(mut self, kind: AllocatorKind) -> Self {
        self.agents = self.agents.with_controller(kind);
        self
    }

    /// Adds a mission, or replaces the mission of the same name.
    #[must_use]
    pub fn with_mission(mut self, parts: MissionParts) -> Self {
        self.worlds.add(parts.world);
        self.agents = self.agents.with_mission(parts.controller);
        self
    }

    /// Returns the names that scenarios may use, in the order in which they were added.
    #[must_use]
    pub fn vocabulary(&self) -> Vocabulary {
        self.agents.vocabulary()
    }

    /// Returns the allocators and the robots' sides of the missions.
    #[must_use]
    pub fn agents(&self) -> &AgentRegistry {
        &self.agents
    }

    /// Returns the world sides of the missions.
    #[must_use]
    pub fn worlds(&self) -> &MissionRegistry {
        &self.worlds
    }
}
