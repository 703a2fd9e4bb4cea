//! The allocators that a program knows.

use std::sync::{Arc, OnceLock};

use alliance_proto::scenario::Setup;

use super::{Allocator, ConfigError, Kind, Prepared, Typed};
use crate::allocators::alliance::Alliance;
use crate::allocators::first_come::FirstCome;
use crate::allocators::fixed::Fixed;
use crate::allocators::nearest::Nearest;
use crate::allocators::random::Random;

/// What the program at hand knows: written once, by its `main`, before anything reads it.
static OF_THIS_PROGRAM: OnceLock<Registry> = OnceLock::new();

/// The allocators that a program knows, by name.
#[derive(Clone, Debug)]
pub struct Registry {
    kinds: Vec<Arc<dyn Kind>>,
}

impl Registry {
    /// Those that come with the simulator.
    #[must_use]
    pub fn built_in() -> Self {
        Self {
            kinds: vec![Arc::new(Alliance)],
        }
        .with::<Nearest>(
            "nearest",
            "the applicable task of highest utility, whatever the others do",
        )
        .with::<FirstCome>(
            "first-come",
            "the best task that nobody is heard to execute; kept until a unit of it is done",
        )
        .with::<Random>(
            "random",
            "any applicable task, drawn anew from time to time",
        )
        .with::<Fixed>(
            "static",
            "the tasks that an assignment before the start gave to the robot",
        )
    }

    /// Makes this the registry of the program: its commands and all that they start know these allocators.
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

    /// With one more, or another one under that name.
    #[must_use]
    pub fn with<A: Allocator>(mut self, name: &str, about: &str) -> Self {
        self.kinds.retain(|kind| kind.name() != name);
        self.kinds.push(Arc::new(Typed::<A>::new(name, about)));
        self
    }

    /// All of them, in the order in which they were added.
    pub fn kinds(&self) -> impl Iterator<Item = &dyn Kind> {
        self.kinds.iter().map(AsRef::as_ref)
    }

    /// The one of that name, with the parameters of a run.
    ///
    /// # Errors
    /// When there is none, or the parameters are not such as it takes.
    pub fn prepare(&self, name: &str, setup: &Setup) -> Result<Arc<dyn Prepared>, ConfigError> {
        let kind = self.kinds().find(|kind| kind.name() == name);
        let unknown = || ConfigError {
            allocator: name.to_owned(),
            why: format!(
                "there is no such allocator; there are {}",
                self.kinds().map(Kind::name).collect::<Vec<_>>().join(", ")
            ),
        };
        kind.ok_or_else(unknown)?.prepare(setup)
    }
}
