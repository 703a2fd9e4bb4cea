//! The hazardous waste clean-up (thesis §4.1).

use crate::MissionParts;

/// Both sides of it.
pub const PARTS: MissionParts = MissionParts {
    world: world_server::missions::waste::WASTE,
    mind: robot_agent::missions::waste::MIND,
};
