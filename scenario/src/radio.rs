//! The radio section of a scenario.

use serde::{Deserialize, Serialize};

use crate::Problem;
use crate::limits::{FARTHEST_M, LENGTH, above_zero, closed};

/// Properties of the radio of all robots.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Radio {
    /// The maximum distance between the centers of robots that receive each other, m; absent is unlimited.
    pub range_m: Option<f32>,
    /// The random loss by distance; absent disables it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub fading: Option<Fading>,
    /// The effect of obstacles between sender and receiver.
    #[serde(skip_serializing_if = "Walls::is_pass")]
    pub walls: Walls,
}

/// Rayleigh fading: each message is received with the probability exp(−(d/d0)^α) at the distance d.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Fading {
    /// The distance d0 at which a share 1/e of the messages is received, m. A larger value means a stronger radio.
    pub d0_m: f32,
    /// The path loss exponent α, 2 (free space) to 4 (ground reflection). A larger value makes the limit sharper.
    pub path_loss_exponent: f32,
}

/// The effect of a solid obstacle on the straight line between sender and receiver.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Walls {
    /// Messages pass through obstacles.
    #[default]
    Pass,
    /// Solid obstacles between two robots block their messages.
    Block,
}

impl Walls {
    fn is_pass(&self) -> bool {
        *self == Self::Pass
    }
}

impl Radio {
    /// Returns true if each robot receives all messages of all others.
    #[must_use]
    pub fn is_unlimited(&self) -> bool {
        *self == Self::default()
    }

    /// Rejects numbers out of range.
    pub(super) fn check(&self) -> Result<(), Problem> {
        if let Some(range_m) = self.range_m {
            above_zero(2.0 * FARTHEST_M, "m").check(["radio", "range_m"], range_m)?;
        }
        let Some(fading) = &self.fading else {
            return Ok(());
        };
        let exponents = closed(2.0, 4.0, "");
        LENGTH.check(["radio", "fading", "d0_m"], fading.d0_m)?;
        exponents.check(
            ["radio", "fading", "path_loss_exponent"],
            fading.path_loss_exponent,
        )
    }
}
