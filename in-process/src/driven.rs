//! Bodies that somebody else drives than the robots' agents.

use alliance_proto::mission::Deed;
use alliance_proto::readings::Actuation;

/// What somebody else makes of a robot's body in the place of its agent.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Command {
    /// As [`Actuation::speed_m_s`]; finite.
    pub speed_m_s: f32,
    /// As [`Actuation::turn_rad_s`]; finite.
    pub turn_rad_s: f32,
    /// What it does beside driving; `None`: what its agent wants.
    pub deed: Option<Deed>,
}

impl Command {
    /// In the place of what its agent wants.
    pub(super) fn take_over(&self, actuation: &mut Actuation) {
        actuation.speed_m_s = self.speed_m_s;
        actuation.turn_rad_s = self.turn_rad_s;
        if let Some(deed) = self.deed {
            actuation.deed = deed;
        }
    }
}
