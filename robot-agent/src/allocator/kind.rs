//! An allocator by name.

use std::fmt::Debug;
use std::marker::PhantomData;
use std::sync::Arc;

use alliance_proto::ids::RobotId;
use alliance_proto::scenario::{AllocatorSpec, Setup};
use serde::de::DeserializeOwned;

use super::{Allocator, Framed, Me, Mind};
use crate::mission::AgentMission;

/// An allocator that scenarios can name.
pub trait Kind: Debug + Send + Sync {
    /// Its name, as scenarios and `--allocator` state it, what it does in one line, and its parameters.
    fn spec(&self) -> AllocatorSpec;

    /// Reads the run's parameters for it, once for all robots of a process.
    ///
    /// # Errors
    /// When the parameters are not such as it takes.
    fn prepare(&self, setup: &Setup) -> Result<Arc<dyn Prepared>, ConfigError>;
}

/// An allocator with the parameters of a run.
pub trait Prepared: Debug + Send + Sync {
    /// See [`Allocator::wants_assignment`].
    fn wants_assignment(&self) -> bool {
        false
    }

    /// A robot's allocator at the start of an incarnation.
    fn mind(&self, me: Me, setup: &Setup) -> Box<dyn Mind>;

    /// What perceives and acts for the robot in the place of the mission's own mind, if it is more than an allocator.
    fn mission(&self, robot: RobotId, setup: &Setup) -> Option<Box<dyn AgentMission>> {
        let _ = (robot, setup);
        None
    }
}

/// What a program cannot make of a run: an allocator or a mission that it does not know, or not with these parameters.
#[derive(Debug, thiserror::Error)]
#[error("{subject}: {why}")]
pub struct ConfigError {
    /// What it is about, as scenarios call it.
    pub subject: String,
    /// What is wrong.
    pub why: String,
}

/// The kind of a type that implements [`Allocator`].
pub struct Typed<A> {
    name: &'static str,
    about: &'static str,
    of: PhantomData<fn() -> A>,
}

impl<A> Debug for Typed<A> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_tuple("Typed").field(&self.name).finish()
    }
}

impl<A: Allocator> Typed<A> {
    /// That type under a name.
    #[must_use]
    pub fn new(name: &'static str, about: &'static str) -> Self {
        Self {
            name,
            about,
            of: PhantomData,
        }
    }
}

impl<A: Allocator> Kind for Typed<A>
where
    A::Config: DeserializeOwned,
{
    fn spec(&self) -> AllocatorSpec {
        AllocatorSpec {
            name: self.name,
            about: self.about,
            parameters: A::parameters(),
            wants_truth: A::wants_truth(),
            learns: false,
        }
    }

    fn prepare(&self, setup: &Setup) -> Result<Arc<dyn Prepared>, ConfigError> {
        let config: A::Config = config(setup, self.name)?;
        Ok(Arc::new(Parameters::<A>(config)))
    }
}

/// `[allocators.NAME]` of the run's scenario.
pub(crate) fn config<C: DeserializeOwned>(setup: &Setup, name: &str) -> Result<C, ConfigError> {
    C::deserialize(setup.scenario.allocator_values(name)).map_err(|error| ConfigError {
        subject: format!("allocators.{name}"),
        why: error.to_string(),
    })
}

struct Parameters<A: Allocator>(A::Config);

impl<A: Allocator> Debug for Parameters<A> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("Parameters")
    }
}

impl<A: Allocator> Prepared for Parameters<A> {
    fn wants_assignment(&self) -> bool {
        A::wants_assignment()
    }

    fn mind(&self, me: Me, _: &Setup) -> Box<dyn Mind> {
        Box::new(Framed::<A>::new(me, &self.0))
    }
}
