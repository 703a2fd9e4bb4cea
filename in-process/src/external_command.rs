//! Commands of external agents for robots' bodies.

use proto::mission::Action;
use proto::readings::Actuation;

/// The motion command of an external agent for a robot's body. It replaces that of the robot's own agent.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BodyCommand {
    /// Speed as in [`Actuation::speed_m_s`]; finite.
    pub speed_m_s: f32,
    /// Turn rate as in [`Actuation::turn_rad_s`]; finite.
    pub turn_rad_s: f32,
    /// The action of the body; `None` keeps the action of the robot's own agent.
    pub action: Option<Action>,
}

impl BodyCommand {
    /// Replaces the motion, and the action if any, of a robot's own agent.
    pub(super) fn apply_to(&self, actuation: &mut Actuation) {
        actuation.speed_m_s = self.speed_m_s;
        actuation.turn_rad_s = self.turn_rad_s;
        if let Some(action) = self.action {
            actuation.action = action;
        }
    }
}
