//! ALLIANCE as an allocator that scenarios name; its parameters stand in `[alliance]`.

use std::sync::Arc;

use alliance_proto::scenario::Setup;

use super::{Engine, Parameters};
use crate::allocator::{ConfigError, Kind, Me, Mind, Prepared};
use crate::roster::Roster;

/// ALLIANCE.
#[derive(Clone, Copy, Debug)]
pub struct Alliance;

impl Kind for Alliance {
    fn name(&self) -> &str {
        "alliance"
    }

    fn about(&self) -> &str {
        "motivational behaviors: impatience with others, acquiescence with oneself (Parker 1998)"
    }

    fn prepare(&self, setup: &Setup) -> Result<Arc<dyn Prepared>, ConfigError> {
        let roster = Roster::of(&setup.scenario);
        let parameters = Parameters::of(setup, &roster);
        Ok(Arc::new(Shared { roster, parameters }))
    }
}

/// What all robots of a run share.
#[derive(Debug)]
struct Shared {
    roster: Roster,
    parameters: Parameters,
}

impl Prepared for Shared {
    fn mind(&self, me: Me, setup: &Setup) -> Box<dyn Mind> {
        let engine = Engine::with_shared(me.robot, setup, &self.roster, &self.parameters);
        Box::new(engine)
    }
}
