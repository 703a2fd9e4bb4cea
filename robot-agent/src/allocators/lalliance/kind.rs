//! L-ALLIANCE as an allocator that scenarios name.

use std::sync::Arc;

use alliance_proto::scenario::{AllocatorSpec, Setup};

use super::{Config, Learner};
use crate::allocator::{ConfigError, Kind, Me, Mind, Prepared, config};

/// L-ALLIANCE.
#[derive(Clone, Copy, Debug)]
pub struct LAlliance;

impl LAlliance {
    const NAME: &str = "l-alliance";
}

impl Kind for LAlliance {
    fn spec(&self) -> AllocatorSpec {
        AllocatorSpec {
            name: Self::NAME,
            about: "ALLIANCE with learned times: motivations and patience by how long each robot needs (Parker 1995)",
            parameters: Config::parameters(),
        }
    }

    fn prepare(&self, setup: &Setup) -> Result<Arc<dyn Prepared>, ConfigError> {
        let config: Config = config(setup, Self::NAME)?;
        if config.min_delay_s > config.max_delay_s {
            return Err(ConfigError {
                subject: format!("allocators.{}", Self::NAME),
                why: format!(
                    "min_delay_s is {}, but must be at most max_delay_s, {}",
                    config.min_delay_s, config.max_delay_s
                ),
            });
        }
        Ok(Arc::new(config))
    }
}

impl Prepared for Config {
    fn mind(&self, me: Me, setup: &Setup) -> Box<dyn Mind> {
        let alliance = &setup.alliance;
        Box::new(Learner::new(&me, self, alliance.threshold, alliance.switches))
    }
}
