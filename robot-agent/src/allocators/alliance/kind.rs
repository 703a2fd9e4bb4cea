//! The registration of ALLIANCE as an allocator. Its parameters are in the scenario section `[alliance]`.

use std::sync::Arc;

use scenario::{AllocatorSpec, Setup};

use super::{Engine, Parameters};
use crate::allocator::{
    AllocatorKind, ConfigError, ConfiguredAllocator, RunningAllocator, SelfState,
};

#[derive(Clone, Copy, Debug)]
pub struct Alliance;

impl AllocatorKind for Alliance {
    fn spec(&self) -> AllocatorSpec {
        AllocatorSpec::alliance()
    }

    fn prepare(&self, setup: &Setup) -> Result<Arc<dyn ConfiguredAllocator>, ConfigError> {
        Ok(Arc::new(Shared(Parameters::from_setup(setup))))
    }
}

#[derive(Debug)]
struct Shared(Parameters);

impl ConfiguredAllocator for Shared {
    fn start(&self, me: SelfState, setup: &Setup) -> Box<dyn RunningAllocator> {
        Box::new(Engine::with_shared(me.robot, setup, &self.0))
    }
}
