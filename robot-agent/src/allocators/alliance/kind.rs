//! The registration of ALLIANCE as an allocator. Its parameters are in the scenario section `[alliance]`.

use std::sync::Arc;

use scenario::{AllocatorSpec, Setup};

use super::{Engine, Parameters};
use crate::allocator::{ConfigError, Kind, Me, Mind, Prepared};

#[derive(Clone, Copy, Debug)]
pub struct Alliance;

impl Kind for Alliance {
    fn spec(&self) -> AllocatorSpec {
        AllocatorSpec::alliance()
    }

    fn prepare(&self, setup: &Setup) -> Result<Arc<dyn Prepared>, ConfigError> {
        Ok(Arc::new(Shared(Parameters::of(setup))))
    }
}

#[derive(Debug)]
struct Shared(Parameters);

impl Prepared for Shared {
    fn mind(&self, me: Me, setup: &Setup) -> Box<dyn Mind> {
        Box::new(Engine::with_shared(me.robot, setup, &self.0))
    }
}
