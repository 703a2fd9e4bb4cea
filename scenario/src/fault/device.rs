//! The sensing devices of a robot, which faults can break.

use std::fmt;

use arrayvec::ArrayString;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::mission::registry::Mission;

/// The name of a sensing device: one of [`Device::COMMON`] or one of the mission's own.
#[derive(
    Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize, JsonSchema,
)]
#[serde(transparent)]
pub struct Device(#[schemars(with = "String")] ArrayString<32>);

impl Device {
    /// The sensor of position and heading.
    pub const POSITION: &str = "position";
    /// The sensor of the distance to the border ahead.
    pub const FRONT_BORDER: &str = "front-border";
    /// The sensor of the distance to the border at the left side.
    pub const SIDE_BORDER: &str = "side-border";
    /// The sensor for collision avoidance.
    pub const AVOIDANCE: &str = "avoidance";
    /// The sensor of the ground's penetrability.
    pub const GROUND: &str = "ground";

    /// The devices of every mission.
    pub const COMMON: [&str; 5] = [
        Self::POSITION,
        Self::FRONT_BORDER,
        Self::SIDE_BORDER,
        Self::AVOIDANCE,
        Self::GROUND,
    ];

    /// Creates the device with this name.
    ///
    /// # Panics
    /// Panics if the name has more than 32 bytes.
    #[must_use]
    pub fn new(name: &str) -> Self {
        // Device names are constants of missions, so a longer name is a programming error.
        Self(ArrayString::from(name).expect("at most 32 bytes"))
    }

    /// Returns all devices of a mission's robots, in display order.
    pub fn names_for(mission: Mission) -> impl Iterator<Item = &'static str> {
        let [first @ .., last] = Self::COMMON;
        let mission_devices = mission.vocabulary().devices.iter().copied();
        first.into_iter().chain(mission_devices).chain([last])
    }

    /// Returns the display name of a device.
    #[must_use]
    pub fn display_name(name: &str) -> String {
        match name {
            Self::AVOIDANCE => "collision avoidance".to_owned(),
            _ => name.replace('-', " "),
        }
    }

    /// Returns true if robots may lack the device.
    #[must_use]
    pub fn is_optional(name: &str, mission: Mission) -> bool {
        name == Self::SIDE_BORDER || mission.vocabulary().optional_devices.contains(&name)
    }

    #[must_use]
    pub fn as_str(&self) -> &str {
        &self.0
    }

    /// Returns true if the device measures lengths, so that faults can make it noisy or biased.
    #[must_use]
    pub fn measures_lengths(&self, mission: Mission) -> bool {
        let name = self.as_str();
        let common = [
            Self::POSITION,
            Self::FRONT_BORDER,
            Self::SIDE_BORDER,
            Self::AVOIDANCE,
        ];
        common.contains(&name) || mission.vocabulary().measuring_devices.contains(&name)
    }
}

impl PartialEq<str> for Device {
    fn eq(&self, name: &str) -> bool {
        self.as_str() == name
    }
}

impl fmt::Display for Device {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.as_str())
    }
}
