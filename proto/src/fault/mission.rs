//! Faults that only a mission knows. They change its world in a moment, and do not heal.

use std::collections::BTreeMap;
use std::fmt;

use serde::{Deserialize, Serialize};

use crate::scenario::Room;

/// A fault of a mission's own, by the name that the mission gives it. In JSON and TOML it reads like any other:
/// `{"NAME": {"KEY": NUMBER, …}}`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct MissionFault {
    /// Its name.
    pub name: String,
    /// What is stated of it, by key.
    pub values: BTreeMap<String, f64>,
}

impl MissionFault {
    /// The fault of that name with those values.
    #[must_use]
    pub fn new(name: &str, values: &[(&str, f64)]) -> Self {
        let values = values
            .iter()
            .map(|(key, value)| ((*key).to_owned(), *value));
        Self {
            name: name.to_owned(),
            values: values.collect(),
        }
    }

    /// What is stated under that key.
    #[must_use]
    pub fn get(&self, key: &str) -> Option<f64> {
        self.values.get(key).copied()
    }
}

/// As the command line takes it.
impl fmt::Display for MissionFault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.values
            .iter()
            .try_for_each(|(key, value)| write!(f, " --{} {value}", key.replace('_', "-")))
    }
}

/// What can be stated of a fault of a mission.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FaultSpec {
    /// Its name: a word of its own among all faults.
    pub name: &'static str,
    /// What it does, in a line.
    pub about: &'static str,
    /// What is to be stated of it, and after that what may be left out.
    pub arguments: &'static [FaultArgument],
}

impl FaultSpec {
    /// The keys of the place on the floor that it is about, x and y, if there is one.
    #[must_use]
    pub fn place(&self) -> Option<[&'static str; 2]> {
        Some([self.key_of(FaultRange::X)?, self.key_of(FaultRange::Y)?])
    }

    /// The key of the item that it is about, if there is one.
    #[must_use]
    pub fn item(&self) -> Option<&'static str> {
        self.key_of(FaultRange::Item)
    }

    fn key_of(&self, range: FaultRange) -> Option<&'static str> {
        let mut arguments = self.arguments.iter();
        Some(arguments.find(|argument| argument.range == range)?.key)
    }
}

/// A number that is stated of a fault.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FaultArgument {
    /// Its key, which ends with its unit.
    pub key: &'static str,
    /// What it means, in a line.
    pub about: &'static str,
    /// What it may be.
    pub range: FaultRange,
    /// What it is if it is left out; `None`: it must be stated.
    pub default: Option<f64>,
}

impl FaultArgument {
    /// All of it.
    #[must_use]
    pub const fn new(
        key: &'static str,
        about: &'static str,
        range: FaultRange,
        default: Option<f64>,
    ) -> Self {
        Self {
            key,
            about,
            range,
            default,
        }
    }

    /// What keys end with, and the unit that it stands for; one that ends with another comes before it.
    const UNITS: [(&str, &str); 10] = [
        ("_deg_s", "degrees/s"),
        ("_m_s", "m/s"),
        ("_m", "m"),
        ("_ms", "ms"),
        ("_s", "s"),
        ("_deg", "degrees"),
        ("_hz", "Hz"),
        ("_kg", "kg"),
        ("_j", "J"),
        ("_w", "W"),
    ];

    /// Its key without the unit, and the unit as people write it, empty if there is none.
    #[must_use]
    pub fn stem_and_unit(&self) -> (&'static str, &'static str) {
        let mut units = Self::UNITS.iter();
        let found = units.find_map(|(end, unit)| Some((self.key.strip_suffix(end)?, *unit)));
        found.unwrap_or((self.key, ""))
    }
}

/// What a number of a fault may be.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum FaultRange {
    /// A place inside the border along x, m.
    X,
    /// A place inside the border along y, m.
    Y,
    /// Number of an item: 7 for the item-7 of events.csv.
    Item,
    /// A whole number from the first to the second.
    Whole(u32, u32),
    /// A number from the first to the second.
    Within(f64, f64),
}

impl FaultRange {
    /// The least and the greatest, in that room.
    #[must_use]
    pub fn bounds(&self, room: Room) -> (f64, f64) {
        match *self {
            Self::X => (0.0, room.width_m.into()),
            Self::Y => (0.0, room.height_m.into()),
            Self::Item => (0.0, u32::MAX.into()),
            Self::Whole(from, to) => (from.into(), to.into()),
            Self::Within(from, to) => (from, to),
        }
    }

    /// Whether only whole numbers will do.
    #[must_use]
    pub fn is_whole(&self) -> bool {
        matches!(self, Self::Item | Self::Whole(..))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn keys_end_with_their_units() {
        let of = |key| {
            let argument = FaultArgument {
                key,
                about: "",
                range: FaultRange::Item,
                default: None,
            };
            argument.stem_and_unit()
        };
        assert_eq!(of("x_m"), ("x", "m"));
        assert_eq!(of("top_speed_m_s"), ("top_speed", "m/s"));
        assert_eq!(of("turn_deg_s"), ("turn", "degrees/s"));
        assert_eq!(of("late_ms"), ("late", "ms"));
        assert_eq!(of("for_s"), ("for", "s"));
        assert_eq!(of("max_robots"), ("max_robots", ""));
    }
}
