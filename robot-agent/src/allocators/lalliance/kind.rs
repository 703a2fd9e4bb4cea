//! The registration of L-ALLIANCE as an allocator.

use std::sync::Arc;

use scenario::{AllocatorSpec, Setup};

use super::{Config, Learner};
use crate::allocator::{
    AllocatorKind, ConfigError, ConfiguredAllocator, RunningAllocator, SelfState, read_config,
};

#[derive(Clone, Copy, Debug)]
pub struct LAlliance;

impl LAlliance {
    const NAME: &str = "l-alliance";
}

impl AllocatorKind for LAlliance {
    fn spec(&self) -> AllocatorSpec {
        AllocatorSpec {
            name: Self::NAME,
            about: "ALLIANCE with learned times: motivation and patience follow each robot's measured task times (Parker 1995)",
            parameters: Config::parameters(),
            needs_ground_truth: false,
            learns_times: true,
        }
    }

    fn prepare(&self, setup: &Setup) -> Result<Arc<dyn ConfiguredAllocator>, ConfigError> {
        let config: Config = read_config(setup, Self::NAME)?;
        Ok(Arc::new(config))
    }
}

impl ConfiguredAllocator for Config {
    fn start(&self, me: SelfState, setup: &Setup) -> Box<dyn RunningAllocator> {
        let alliance = &setup.alliance;
        let mut learner = Learner::new(&me, self, alliance.threshold, alliance.switches);
        learner.load(setup);
        Box::new(learner)
    }
}
