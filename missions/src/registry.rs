//! The missions and allocators that a program knows.

use std::sync::OnceLock;

use alliance_proto::scenario::Vocabulary;
use robot_agent::allocator::{AgentRegistry, Allocator};
use robot_agent::mission::MissionMind;
use world_server::mission::{MissionWorld, Worlds};

/// What the program at hand knows: written once, by its `main`, before anything reads it.
static OF_THIS_PROGRAM: OnceLock<Registry> = OnceLock::new();

/// Both sides of a mission.
#[derive(Clone, Copy, Debug)]
pub struct MissionParts {
    /// In the world.
    pub world: MissionWorld,
    /// In a robot. Its data are the world's.
    pub mind: MissionMind,
}

/// The missions and the allocators that a program knows, by name.
#[derive(Clone, Debug)]
pub struct Registry {
    worlds: Worlds,
    agents: AgentRegistry,
}

impl Registry {
    /// Those that come with the simulator.
    #[must_use]
    pub fn built_in() -> Self {
        let none = Self {
            worlds: Worlds::default(),
            agents: AgentRegistry::built_in(),
        };
        none.mission(crate::waste::PARTS)
    }

    /// Makes this the registry of the program: its commands and all that they start know these missions and allocators.
    ///
    /// # Panics
    /// If the program has one already: two would be two answers to what a scenario means.
    pub fn install(self) {
        let installed = OF_THIS_PROGRAM.set(self);
        assert!(installed.is_ok(), "a program has one registry");
    }

    /// The registry of the program; the built-in one where its `main` installed none.
    #[must_use]
    pub fn of_this_program() -> &'static Self {
        OF_THIS_PROGRAM.get_or_init(Self::built_in)
    }

    /// With one more allocator, or another one under that name.
    #[must_use]
    pub fn allocator<A: Allocator>(mut self, name: &'static str, about: &'static str) -> Self {
        self.agents = self.agents.allocator::<A>(name, about);
        self
    }

    /// With one more mission, or another one under that name.
    #[must_use]
    pub fn mission(mut self, parts: MissionParts) -> Self {
        self.worlds.add(parts.world);
        self.agents = self.agents.mission(parts.mind);
        self
    }

    /// What scenarios may say of them: all, in the order in which they were added.
    #[must_use]
    pub fn vocabulary(&self) -> Vocabulary {
        self.agents.vocabulary()
    }

    /// The robots' side.
    #[must_use]
    pub fn agents(&self) -> &AgentRegistry {
        &self.agents
    }

    /// The worlds' side.
    #[must_use]
    pub fn worlds(&self) -> &Worlds {
        &self.worlds
    }
}
