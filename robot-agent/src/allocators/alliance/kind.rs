//! The registration of ALLIANCE as an allocator. Its parameters are in the scenario section `[alliance]`.

use std::sync::Arc;

use scenario::AllocatorSpec;

use super::{Engine, Parameters};
use crate::allocator::{AllocatorKind, ConfiguredAllocator};

/// Returns ALLIANCE for a registry.
#[must_use]
pub fn kind() -> AllocatorKind {
    AllocatorKind::from_parts(AllocatorSpec::alliance(), |setup| {
        let parameters = Parameters::from_setup(setup);
        Ok(ConfiguredAllocator {
            start: Arc::new(move |me, setup| Box::new(Engine::new(me.robot, setup, &parameters))),
            controller: None,
            config: None,
        })
    })
}
