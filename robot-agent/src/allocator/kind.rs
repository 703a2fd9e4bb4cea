//! Allocators by name.

use std::fmt::{self, Debug};
use std::sync::Arc;

use scenario::ids::RobotId;
use scenario::{AllocatorSpec, Setup};
use serde::de::DeserializeOwned;

use super::{Allocator, AllocatorRunner, AnyConfig, RunningAllocator, SelfState};
use crate::mission::{ControllerConstructor, MissionController};

/// Reads the parameters of an allocator from the setup of a run.
type Prepare = dyn Fn(&Setup) -> Result<ConfiguredAllocator, ConfigError> + Send + Sync;

/// Creates the allocator of a robot.
type Start = dyn Fn(SelfState, &Setup) -> Box<dyn RunningAllocator> + Send + Sync;

/// A registered allocator, which scenarios select by name.
#[derive(Clone)]
pub struct AllocatorKind {
    spec: AllocatorSpec,
    /// See [`Allocator::uses_assignment`].
    pub(crate) uses_assignment: bool,
    /// See [`Allocator::plans_sequences`].
    pub(crate) plans_sequences: bool,
    prepare: Arc<Prepare>,
}

/// An allocator with the parameters of a run.
#[derive(Clone)]
pub(crate) struct ConfiguredAllocator {
    /// Creates a robot's allocator at the start of an incarnation.
    pub start: Arc<Start>,
    /// Creates the controllers that replace those of the mission; `None` for a plain allocator.
    pub controller: Option<ControllerConstructor>,
    /// The parameters, for robots that adopt them in the middle of a run; `None` if they are in the setup.
    pub config: Option<Arc<AnyConfig>>,
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

impl Debug for AllocatorKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_tuple("AllocatorKind").field(&self.spec).finish()
    }
}

impl Debug for ConfiguredAllocator {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("ConfiguredAllocator")
    }
}

impl AllocatorKind {
    /// Registers an allocator type under a name, with a summary of one line. Its parameters are in the section
    /// `[allocators.NAME]` of a scenario.
    #[must_use]
    pub fn new<A: Allocator>(name: &'static str, about: &'static str) -> Self
    where
        A::Config: DeserializeOwned,
    {
        let spec = AllocatorSpec {
            name,
            about,
            parameters: A::parameters().into(),
            needs_ground_truth: A::uses_ground_truth(),
            learns_times: false,
        };
        Self::with_config::<A>(spec, move |setup| read_config(setup, name))
    }

    /// Registers an allocator type whose parameters come from elsewhere, such as from another language. `config` creates
    /// them once per run and process, and its error ends the run before it starts.
    #[must_use]
    pub fn with_config<A: Allocator>(
        spec: AllocatorSpec,
        config: impl Fn(&Setup) -> Result<A::Config, ConfigError> + Send + Sync + 'static,
    ) -> Self {
        Self::typed::<A>(spec, config, |_| None)
    }

    /// Registers an allocator together with a controller, which replaces that of the mission: it perceives and acts.
    /// `config` creates the data that both share, once per run and process.
    #[must_use]
    pub fn with_controller<A: Allocator, C: MissionController>(
        spec: AllocatorSpec,
        config: impl Fn(&Setup) -> Result<A::Config, ConfigError> + Send + Sync + 'static,
        controller: impl Fn(&A::Config, RobotId, &Setup) -> C + Clone + Send + Sync + 'static,
    ) -> Self {
        Self::typed::<A>(spec, config, move |config| {
            let (config, controller) = (Arc::clone(config), controller.clone());
            Some(ControllerConstructor::new(move |robot, setup| {
                controller(&config, robot, setup)
            }))
        })
    }

    fn typed<A: Allocator>(
        spec: AllocatorSpec,
        config: impl Fn(&Setup) -> Result<A::Config, ConfigError> + Send + Sync + 'static,
        controller: impl Fn(&Arc<A::Config>) -> Option<ControllerConstructor> + Send + Sync + 'static,
    ) -> Self {
        let kind = Self::from_parts(spec, move |setup| {
            let config = Arc::new(config(setup)?);
            Ok(ConfiguredAllocator {
                controller: controller(&config),
                config: Some(Arc::clone(&config) as Arc<AnyConfig>),
                start: Arc::new(move |me, _| Box::new(AllocatorRunner::<A>::new(me, &config))),
            })
        });
        Self {
            uses_assignment: A::uses_assignment(),
            plans_sequences: A::plans_sequences(),
            ..kind
        }
    }

    /// Registers an allocator with states and heartbeats of its own.
    pub(crate) fn from_parts(
        spec: AllocatorSpec,
        prepare: impl Fn(&Setup) -> Result<ConfiguredAllocator, ConfigError> + Send + Sync + 'static,
    ) -> Self {
        Self {
            spec,
            uses_assignment: false,
            plans_sequences: false,
            prepare: Arc::new(prepare),
        }
    }

    /// Returns the name in scenarios and for `--allocator`, the summary and the parameters.
    #[must_use]
    pub fn spec(&self) -> &AllocatorSpec {
        &self.spec
    }

    pub(crate) fn prepare(&self, setup: &Setup) -> Result<ConfiguredAllocator, ConfigError> {
        (self.prepare)(setup)
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
