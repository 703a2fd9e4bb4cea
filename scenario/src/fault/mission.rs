//! Faults that a mission defines. They change its world instantly and do not heal.

use std::collections::BTreeMap;
use std::fmt;

use serde::{Deserialize, Serialize};

use crate::Room;

/// A fault that a mission defines. JSON and TOML write it like any other: `{"NAME": {"KEY": NUMBER, …}}`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct MissionFault {
    /// The name, unique among all faults.
    pub name: String,
    /// The stated arguments, by key.
    pub values: BTreeMap<String, FaultValue>,
}

/// The value of an argument.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum FaultValue {
    Number(f64),
    /// The name of something in the scenario.
    Name(String),
}

impl fmt::Display for FaultValue {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Number(number) => number.fmt(f),
            Self::Name(name) => name.fmt(f),
        }
    }
}

impl MissionFault {
    /// Creates a fault with this name and these values.
    #[must_use]
    pub fn new(name: &str, values: &[(&str, f64)]) -> Self {
        let values = values
            .iter()
            .map(|(key, value)| ((*key).to_owned(), FaultValue::Number(*value)));
        Self {
            name: name.to_owned(),
            values: values.collect(),
        }
    }

    /// Returns the fault with a name as an argument.
    #[must_use]
    pub fn with_name(mut self, key: &str, name: &str) -> Self {
        let value = FaultValue::Name(name.to_owned());
        self.values.insert(key.to_owned(), value);
        self
    }

    /// Returns the number of an argument if it is stated.
    #[must_use]
    pub fn get(&self, key: &str) -> Option<f64> {
        match self.values.get(key)? {
            FaultValue::Number(number) => Some(*number),
            FaultValue::Name(_) => None,
        }
    }

    /// Returns the name in an argument if it is stated.
    #[must_use]
    pub fn get_name(&self, key: &str) -> Option<&str> {
        match self.values.get(key)? {
            FaultValue::Number(_) => None,
            FaultValue::Name(name) => Some(name),
        }
    }
}

/// Formats the arguments as on the command line.
impl fmt::Display for MissionFault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.values
            .iter()
            .try_for_each(|(key, value)| write!(f, " --{} {value}", key.replace('_', "-")))
    }
}

/// The declaration of a mission's fault.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FaultSpec {
    /// The name, unique among all faults.
    pub name: &'static str,
    /// The effect in one line.
    pub about: &'static str,
    /// The arguments: required ones first, then optional ones.
    pub arguments: &'static [FaultArgument],
}

impl FaultSpec {
    /// Returns the keys of the fault's place on the floor, x and y, if it has one.
    #[must_use]
    pub fn place(&self) -> Option<[&'static str; 2]> {
        Some([self.key_of(FaultRange::X)?, self.key_of(FaultRange::Y)?])
    }

    /// Returns the key of the fault's item, if it has one.
    #[must_use]
    pub fn item(&self) -> Option<&'static str> {
        self.key_of(FaultRange::Item)
    }

    fn key_of(&self, range: FaultRange) -> Option<&'static str> {
        let mut arguments = self.arguments.iter();
        Some(arguments.find(|argument| argument.range == range)?.key)
    }
}

/// An argument of a fault.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FaultArgument {
    /// The key, which ends with the unit.
    pub key: &'static str,
    /// The meaning in one line.
    pub about: &'static str,
    /// The range of allowed values.
    pub range: FaultRange,
    /// The default value; `None` makes the argument required. Of a [name](FaultRange::Name), it is the index of the
    /// default.
    pub default: Option<f64>,
}

impl FaultArgument {
    /// Creates an argument from all its fields.
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

    /// The suffixes of keys and their units. A suffix stands before any suffix that it ends with.
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

    /// Returns the key without its unit, and the unit for display, empty if there is none.
    #[must_use]
    pub fn stem_and_unit(&self) -> (&'static str, &'static str) {
        let mut units = Self::UNITS.iter();
        let found = units.find_map(|(end, unit)| Some((self.key.strip_suffix(end)?, *unit)));
        found.unwrap_or((self.key, ""))
    }
}

/// The allowed range of a fault's argument.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum FaultRange {
    /// An x coordinate inside the border, m.
    X,
    /// A y coordinate inside the border, m.
    Y,
    /// The number of an item: 7 for `item-7` of events.csv.
    Item,
    /// A whole number from the first to the second.
    Whole(u32, u32),
    /// A number from the first to the second.
    Within(f64, f64),
    /// A name of [`MissionData::fault_names`](crate::mission::data::MissionData::fault_names).
    Name,
}

impl FaultRange {
    /// Returns the least and the greatest allowed value in a room.
    #[must_use]
    pub fn bounds(&self, room: Room) -> (f64, f64) {
        match *self {
            Self::X => (0.0, room.width_m.into()),
            Self::Y => (0.0, room.height_m.into()),
            Self::Item => (0.0, u32::MAX.into()),
            Self::Whole(from, to) => (from.into(), to.into()),
            Self::Within(from, to) => (from, to),
            Self::Name => (0.0, u32::MAX.into()),
        }
    }

    /// Returns true if the value must be a whole number.
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
