//! Numbers that a mission tells: a row of mission.csv, and figures by name.

use std::fmt;

use glam::Vec2;
use schemars::JsonSchema;
use serde::de::{MapAccess, Visitor};
use serde::ser::SerializeMap;
use serde::{Deserialize, Deserializer, Serialize, Serializer};

/// Something that moves by itself and is to be watched: a row of targets.csv.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Target {
    /// Where it is, m.
    pub at: Vec2,
    /// How many robots see it.
    pub observers: u32,
}

/// A number, or none: in files just that.
#[derive(Clone, Copy, Debug, PartialEq, JsonSchema)]
#[schemars(untagged)]
pub enum Value {
    /// A count, or a time in ms.
    Count(u64),
    /// Any other number.
    Real(f64),
    /// There is none.
    None,
}

/// On the bus nothing but a tag tells one from the other.
#[derive(Serialize, Deserialize)]
#[serde(remote = "Value")]
enum Tagged {
    Count(u64),
    Real(f64),
    None,
}

/// In a file the number does.
#[derive(Serialize, Deserialize)]
#[serde(remote = "Value", untagged)]
enum Bare {
    Count(u64),
    Real(f64),
    None,
}

impl Serialize for Value {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        if serializer.is_human_readable() {
            Bare::serialize(self, serializer)
        } else {
            Tagged::serialize(self, serializer)
        }
    }
}

impl<'de> Deserialize<'de> for Value {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        if deserializer.is_human_readable() {
            Bare::deserialize(deserializer)
        } else {
            Tagged::deserialize(deserializer)
        }
    }
}

impl Value {
    /// The count; 0 where there is none.
    #[must_use]
    pub fn count(self) -> u64 {
        match self {
            Self::Count(count) => count,
            Self::Real(_) | Self::None => 0,
        }
    }

    /// The number, whatever it is. Counts are exact up to 2^53.
    #[must_use]
    pub fn number(self) -> Option<f64> {
        match self {
            Self::Count(count) => Some(count as f64),
            Self::Real(number) => Some(number),
            Self::None => None,
        }
    }
}

impl From<u32> for Value {
    #[inline]
    fn from(count: u32) -> Self {
        Self::Count(count.into())
    }
}

impl From<u64> for Value {
    #[inline]
    fn from(count: u64) -> Self {
        Self::Count(count)
    }
}

impl From<f64> for Value {
    #[inline]
    fn from(number: f64) -> Self {
        Self::Real(number)
    }
}

impl<T: Into<Self>> From<Option<T>> for Value {
    fn from(value: Option<T>) -> Self {
        value.map_or(Self::None, T::into)
    }
}

/// MissionFigures by name, in order. In a file `items.delivered` is `delivered` in `items`; those of one group follow each other.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct MissionFigures(Vec<(String, Value)>);

impl MissionFigures {
    /// Adds a figure.
    pub fn add(&mut self, name: &str, value: impl Into<Value>) {
        self.0.push((name.to_owned(), value.into()));
    }

    /// The figure of that name; [`Value::None`] where there is no such figure.
    #[must_use]
    pub fn get(&self, name: &str) -> Value {
        let mut figures = self.0.iter();
        let found = figures.find(|(known, _)| known == name);
        found.map_or(Value::None, |(_, value)| *value)
    }

    /// The figure of a column of mission.csv: the one of its name, where that of a group joins both by an underscore.
    #[must_use]
    pub fn column(&self, name: &str) -> Option<Value> {
        let mut figures = self.0.iter();
        let found = figures.find(|(known, _)| known.replace('.', "_") == name);
        found.map(|(_, value)| *value)
    }

    /// The count of that name; 0 where there is none.
    #[must_use]
    pub fn count(&self, name: &str) -> u64 {
        self.get(name).count()
    }

    /// Whether there are none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// All of them.
    pub fn iter(&self) -> impl Iterator<Item = (&str, Value)> {
        self.0.iter().map(|(name, value)| (name.as_str(), *value))
    }
}

/// A mission's figures of a whole run.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct TeamFigures {
    /// Of the mission.
    pub mission: MissionFigures,
    /// Of each robot, by rank.
    pub robots: Vec<MissionFigures>,
}

impl TeamFigures {
    /// None yet, of a team of that size.
    #[must_use]
    pub fn new(robots: usize) -> Self {
        Self {
            mission: MissionFigures::default(),
            robots: vec![MissionFigures::default(); robots],
        }
    }
}

impl Serialize for MissionFigures {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mut map = serializer.serialize_map(None)?;
        let mut left = self.0.as_slice();
        while let Some((name, value)) = left.first() {
            let Some((group, _)) = name.split_once('.') else {
                map.serialize_entry(name, value)?;
                left = &left[1..];
                continue;
            };
            let in_group = |(name, value): &(String, Value)| {
                let name = name.strip_prefix(group)?.strip_prefix('.')?;
                Some((name.to_owned(), *value))
            };
            let members: Vec<_> = left.iter().map_while(in_group).collect();
            left = &left[members.len()..];
            map.serialize_entry(group, &Self(members))?;
        }
        map.end()
    }
}

impl<'de> Deserialize<'de> for MissionFigures {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        #[derive(Deserialize)]
        #[serde(untagged)]
        enum Entry {
            Group(MissionFigures),
            Value(Value),
        }

        struct Entries;

        impl<'de> Visitor<'de> for Entries {
            type Value = MissionFigures;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("figures by name")
            }

            fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<MissionFigures, A::Error> {
                let mut figures = MissionFigures::default();
                while let Some((name, entry)) = map.next_entry::<String, Entry>()? {
                    match entry {
                        Entry::Value(value) => figures.add(&name, value),
                        Entry::Group(members) => {
                            for (member, value) in members.iter() {
                                figures.add(&format!("{name}.{member}"), value);
                            }
                        }
                    }
                }
                Ok(figures)
            }
        }

        deserializer.deserialize_map(Entries)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_value_is_a_bare_number_in_files_and_tagged_on_the_bus() {
        let values = [Value::Count(3), Value::Real(3.0), Value::None];
        let json = serde_json::to_string(&values).unwrap();
        assert_eq!(json, "[3,3.0,null]");
        assert_eq!(serde_json::from_str::<[Value; 3]>(&json).unwrap(), values);
        let bytes = crate::codec::encode(&values).unwrap();
        assert_eq!(crate::codec::decode::<[Value; 3]>(&bytes).unwrap(), values);
    }

    #[test]
    fn groups_are_objects_in_a_file_and_come_back() {
        let mut figures = MissionFigures::default();
        figures.add("strokes", 3_u32);
        figures.add("ends.left", 1_u32);
        figures.add("ends.right", 2_u32);
        figures.add("mean_ms", Some(12.0));
        figures.add("max_ms", None::<u64>);
        let json = serde_json::to_string(&figures).unwrap();
        assert_eq!(
            json,
            r#"{"strokes":3,"ends":{"left":1,"right":2},"mean_ms":12.0,"max_ms":null}"#
        );
        assert_eq!(
            serde_json::from_str::<MissionFigures>(&json).unwrap(),
            figures
        );
        assert_eq!(figures.count("ends.right"), 2);
        assert_eq!(figures.get("mean_ms"), Value::Real(12.0));
        assert_eq!(figures.get("other"), Value::None);
    }
}
