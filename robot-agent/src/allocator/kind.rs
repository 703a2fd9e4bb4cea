//! Allocators by name.

use std::fmt::Debug;
use std::marker::PhantomData;
use std::sync::Arc;

use scenario::ids::RobotId;
use scenario::{AllocatorSpec, Setup};
use serde::de::DeserializeOwned;

use super::{Allocator, AllocatorRunner, RunningAllocator, SelfState};
use crate::mission::AgentMission;

/// An allocator that a scenario can select by name.
pub trait AllocatorKind: Debug + Send + Sync {
    /// Returns the name in scenarios and for `--allocator`, a summary of one line, and the parameters.
    fn spec(&self) -> AllocatorSpec;

    /// Reads the parameters of a run, once for all robots of a process.
    ///
    /// # Errors
    /// Fails if a parameter is invalid.
    fn prepare(&self, setup: &Setup) -> Result<Arc<dyn ConfiguredAllocator>, ConfigError>;
}

/// An allocator with the parameters of a run.
pub trait ConfiguredAllocator: Debug + Send + Sync {
    /// Returns whether the algorithm uses the tasks assigned before the start, see [`Allocator::uses_assignment`].
    fn uses_assignment(&self) -> bool {
        false
    }

    /// Creates a robot's allocator at the start of an incarnation.
    fn start(&self, me: SelfState, setup: &Setup) -> Box<dyn RunningAllocator>;

    /// Returns a replacement for the mission's controller, which perceives and acts; `None` for a plain allocator.
    fn mission(&self, robot: RobotId, setup: &Setup) -> Option<Box<dyn AgentMission>> {
        let _ = (robot, setup);
        None
    }
}

/// A part of a run that the program does not support: an unknown allocator or mission, or an invalid parameter.
#[derive(Debug, thiserror::Error)]
#[error("{subject}: {why}")]
pub struct ConfigError {
    /// The subject, in the terms of scenarios.
    pub subject: String,
    /// The description of the problem.
    pub why: String,
}

/// The `Kind` of a type that implements `Allocator`.
pub struct TypedAllocatorKind<A> {
    name: &'static str,
    about: &'static str,
    allocator: PhantomData<fn() -> A>,
}

impl<A> Debug for TypedAllocatorKind<A> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_tuple("Typed").field(&self.name).finish()
    }
}

impl<A: Allocator> TypedAllocatorKind<A> {
    /// Registers the type under a name, with a summary of one line.
    #[must_use]
    pub fn new(name: &'static str, about: &'static str) -> Self {
        Self {
            name,
            about,
            allocator: PhantomData,
        }
    }
}

impl<A: Allocator> AllocatorKind for TypedAllocatorKind<A>
where
    A::Config: DeserializeOwned,
{
    fn spec(&self) -> AllocatorSpec {
        AllocatorSpec {
            name: self.name,
            about: self.about,
            parameters: A::parameters(),
            needs_ground_truth: A::uses_ground_truth(),
            learns_times: false,
        }
    }

    fn prepare(&self, setup: &Setup) -> Result<Arc<dyn ConfiguredAllocator>, ConfigError> {
        let config: A::Config = read_config(setup, self.name)?;
        Ok(Arc::new(Parameters::<A>(config)))
    }
}

/// Reads `[allocators.NAME]` of the run's scenario.
pub(crate) fn read_config<C: DeserializeOwned>(
    setup: &Setup,
    name: &str,
) -> Result<C, ConfigError> {
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

impl<A: Allocator> ConfiguredAllocator for Parameters<A> {
    fn uses_assignment(&self) -> bool {
        A::uses_assignment()
    }

    fn start(&self, me: SelfState, _: &Setup) -> Box<dyn RunningAllocator> {
        Box::new(AllocatorRunner::<A>::new(me, &self.0))
    }
}
