//! The registration of L-ALLIANCE as an allocator.

use std::sync::Arc;

use scenario::AllocatorSpec;

use super::{Config, Learner};
use crate::allocator::{AllocatorKind, ConfiguredAllocator, read_config};

const NAME: &str = "l-alliance";

/// Returns L-ALLIANCE for a registry.
#[must_use]
pub fn kind() -> AllocatorKind {
    let spec = AllocatorSpec {
        name: NAME,
        about: "ALLIANCE with learned times: motivation and patience follow each robot's measured task times (Parker 1995)",
        parameters: Config::parameters().into(),
        needs_ground_truth: false,
        learns_times: true,
    };
    AllocatorKind::from_parts(spec, |setup| {
        let config: Config = read_config(setup, NAME)?;
        Ok(ConfiguredAllocator {
            start: Arc::new(move |me, setup| {
                let alliance = &setup.alliance;
                let mut learner = Learner::new(&me, &config, alliance.threshold, alliance.switches);
                learner.load(setup);
                Box::new(learner)
            }),
            controller: None,
            config: None,
        })
    })
}
