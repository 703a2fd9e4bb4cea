//! The missions and allocators that a program knows.

use std::sync::{Arc, OnceLock};

use alliance_proto::mission::known::Mission;
use alliance_proto::scenario::Vocabulary;
use robot_agent::allocator::{AgentRegistry, Allocator, Kind};
use robot_agent::mission::{MissionMind, TypedMind};
use serde::de::DeserializeOwned;
use world_server::mission::{MissionWorld, TypedMission, Worlds};

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

impl MissionParts {
    /// Both sides of a mission in types of its own: they mean the same by what is sensed and done.
    #[must_use]
    pub const fn of<W, M>(data: Mission) -> Self
    where
        W: TypedMission,
        M: TypedMind<Sensed = W::Sensed, Deed = W::Deed>,
    {
        Self {
            world: MissionWorld::of::<W>(data),
            mind: MissionMind::of::<M>(data),
        }
    }
}

/// The missions and the allocators that a program knows, by name.
///
/// ```
/// use alliance_proto::scenario::Scenario;
/// use missions::Registry;
/// use robot_agent::allocators::nearest::Nearest;
///
/// let registry = Registry::built_in().allocator::<Nearest>("mine", "a rule of one's own");
/// let read = |text| Scenario::parse("mine.toml", text, &registry.vocabulary());
/// assert!(read("allocator = 'mine'").is_ok());
/// let error = read("allocator = 'yours'").unwrap_err().to_string();
/// assert!(error.starts_with("mine.toml:1: allocator: there is no allocator 'yours'"));
/// ```
/// A `main` hands it on: `launch::main(registry)`.
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
            .mission(crate::service::PARTS)
            .mission(crate::push::PARTS)
            .mission(crate::observe::PARTS)
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
    pub fn allocator<A: Allocator>(mut self, name: &'static str, about: &'static str) -> Self
    where
        A::Config: DeserializeOwned,
    {
        self.agents = self.agents.allocator::<A>(name, about);
        self
    }

    /// The same of one that is no type of its own, such as a rule in another language.
    #[must_use]
    pub fn kind(mut self, kind: Arc<dyn Kind>) -> Self {
        self.agents = self.agents.kind(kind);
        self
    }

    /// With a mind that scenarios otherwise take for a program of its own, or another one under that name.
    #[must_use]
    pub fn mind(mut self, kind: Arc<dyn Kind>) -> Self {
        self.agents = self.agents.mind(kind);
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
