//! The motion that the drive can make within one step.

use proto::readings::Actuation;
use scenario::{Robot, Scenario};

/// The largest bearing at which the robot moves, rad. Beyond it the robot turns on the spot, because its sensors
/// point along the old heading.
pub const FACING_RAD: f32 = 0.18;

/// A disc that turns on the spot and moves only forward, with a fixed step length.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Chassis {
    pub radius_m: f32,
    pub speed_m_s: f32,
    pub turn_rad_s: f32,
    pub step_s: f32,
}

impl Chassis {
    #[must_use]
    pub fn new(scenario: &Scenario, robot: &Robot) -> Self {
        let body = scenario.body_of(robot);
        Self {
            radius_m: body.radius_m,
            speed_m_s: body.speed_m_s,
            turn_rad_s: body.turn_deg_s.to_radians(),
            step_s: scenario.step_ms as f32 / 1000.0,
        }
    }

    /// Returns the actuation that turns toward `bearing` (robot's frame, rad), and moves up to `way` m once the robot
    /// faces it. The step ends exactly on the bearing and never beyond `way`, for any step length.
    #[must_use]
    pub fn drive(&self, bearing: f32, way: f32) -> Actuation {
        let turn = (bearing / self.step_s).clamp(-self.turn_rad_s, self.turn_rad_s);
        let speed = if bearing.abs() > FACING_RAD {
            0.0
        } else {
            (way / self.step_s).clamp(0.0, self.speed_m_s)
        };
        Actuation {
            speed_m_s: speed,
            turn_rad_s: turn,
            ..Actuation::default()
        }
    }
}
