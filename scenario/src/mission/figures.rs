//! Numbers that a mission reports: a row of mission.csv, and named figures.

use std::fmt;

use glam::Vec2;
use schemars::JsonSchema;
use serde::de::{MapAccess, Visitor};
use serde::ser::SerializeMap;
use serde::{Deserialize, Deserializer, Serialize, Serializer};

/// A target that moves on its own and is to be observed: a row of targets.csv.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Target {
    /// The position of the target, m.
    pub at: Vec2,
    /// The number of robots that see the target.
    pub observers: u32,
}

/// A number or none. A file contains just the number or null.
#[derive(Clone, Copy, Debug, PartialEq, JsonSchema)]
#[schemars(untagged)]
pub enum FigureValue {
    /// A count, or a time in ms.
    Count(u64),
    /// A number that is not a count.
    Real(f64),
    /// No number at this time.
    None,
}

/// The form on the bus, where a tag distinguishes the variants.
#[derive(Serialize, Deserialize)]
#[serde(remote = "FigureValue")]
enum Tagged {
    Count(u64),
    Real(f64),
    None,
}

/// The form in a file, where the number distinguishes the variants.
#[derive(Serialize, Deserialize)]
#[serde(remote = "FigureValue", untagged)]
enum Bare {
    Count(u64),
    Real(f64),
    None,
}

impl Serialize for FigureValue {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        if serializer.is_human_readable() {
            Bare::serialize(self, serializer)
        } else {
            Tagged::serialize(self, serializer)
        }
    }
}

impl<'de> Deserialize<'de> for FigureValue {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        if deserializer.is_human_readable() {
            Bare::deserialize(deserializer)
        } else {
            Tagged::deserialize(deserializer)
        }
    }
}

impl FigureValue {
    /// Returns the count, or 0 for any other value.
    #[must_use]
    pub fn count(self) -> u64 {
        match self {
            Self::Count(count) => count,
            Self::Real(_) | Self::None => 0,
        }
    }

    /// Returns the number of either kind. Counts are exact up to 2^53.
    #[must_use]
    pub fn number(self) -> Option<f64> {
        match self {
            Self::Count(count) => Some(count as f64),
            Self::Real(number) => Some(number),
            Self::None => None,
        }
    }
}

impl From<u32> for FigureValue {
    #[inline]
    fn from(count: u32) -> Self {
        Self::Count(count.into())
    }
}

impl From<u64> for FigureValue {
    #[inline]
    fn from(count: u64) -> Self {
        Self::Count(count)
    }
}

impl From<f64> for FigureValue {
    #[inline]
    fn from(number: f64) -> Self {
        Self::Real(number)
    }
}

impl<T: Into<Self>> From<Option<T>> for FigureValue {
    fn from(value: Option<T>) -> Self {
        value.map_or(Self::None, T::into)
    }
}

/// Named figures of a mission, in order. In a file, `items.delivered` becomes `delivered` in the object `items`.
/// Figures of one group must be adjacent.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct MissionFigures(Vec<(String, FigureValue)>);

impl MissionFigures {
    /// Adds a figure after the existing ones.
    pub fn add(&mut self, name: &str, value: impl Into<FigureValue>) {
        self.0.push((name.to_owned(), value.into()));
    }

    /// Returns the figure with this name, or [`FigureValue::None`] if there is none.
    #[must_use]
    pub fn get(&self, name: &str) -> FigureValue {
        let mut figures = self.0.iter();
        let found = figures.find(|(known, _)| known == name);
        found.map_or(FigureValue::None, |(_, value)| *value)
    }

    /// Returns the figure of a column of mission.csv. An underscore in the column's name can stand for the dot after a
    /// group.
    #[must_use]
    pub fn column(&self, name: &str) -> Option<FigureValue> {
        let mut figures = self.0.iter();
        let found = figures.find(|(known, _)| known.replace('.', "_") == name);
        found.map(|(_, value)| *value)
    }

    /// Returns the count with this name, or 0 if there is none.
    #[must_use]
    pub fn count(&self, name: &str) -> u64 {
        self.get(name).count()
    }

    /// Returns true if there are no figures.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// Returns the figures in order.
    pub fn iter(&self) -> impl Iterator<Item = (&str, FigureValue)> {
        self.0.iter().map(|(name, value)| (name.as_str(), *value))
    }
}

/// The figures of a mission for a whole run.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct TeamFigures {
    /// The figures of the mission.
    pub mission: MissionFigures,
    /// The figures of each robot, by rank.
    pub robots: Vec<MissionFigures>,
}

impl TeamFigures {
    /// Creates empty figures for a team of this size.
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
            let in_group = |(name, value): &(String, FigureValue)| {
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
            Value(FigureValue),
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
        let values = [
            FigureValue::Count(3),
            FigureValue::Real(3.0),
            FigureValue::None,
        ];
        let json = serde_json::to_string(&values).unwrap();
        assert_eq!(json, "[3,3.0,null]");
        assert_eq!(
            serde_json::from_str::<[FigureValue; 3]>(&json).unwrap(),
            values
        );
        assert_eq!(crate::testkit::bincode_round_trip(&values), values);
    }

    #[test]
    fn groups_are_objects_in_a_file_and_are_read_back() {
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
        assert_eq!(figures.get("mean_ms"), FigureValue::Real(12.0));
        assert_eq!(figures.get("other"), FigureValue::None);
    }
}
