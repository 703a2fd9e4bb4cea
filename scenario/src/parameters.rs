//! Parameters of allocators and missions, for documentation and checks.

use std::collections::BTreeMap;
use std::fmt;

use serde_json::Value;

use super::Room;
use super::error::Problem;
use super::limits::{NumberRange, above, check_known, check_name, closed, whole};
use super::path::KeyPath;

/// A parameter of an allocator or of a mission's section.
#[derive(Clone, Debug, PartialEq)]
pub struct ParameterSpec {
    /// The key. A dot leads into a table of the section, as in `box.length_m`.
    pub key: &'static str,
    /// The unit; empty if there is none.
    pub unit: &'static str,
    /// The value of a parameter that is not stated.
    pub default: ParameterDefault,
    /// The meaning in one line.
    pub about: &'static str,
    /// The range of allowed values.
    pub range: ParameterRange,
}

/// The value of a parameter that is not stated.
#[derive(Clone, Debug, PartialEq)]
pub enum ParameterDefault {
    /// A number, whole or not.
    Number(f64),
    /// A whole number with a sign.
    Whole(i64),
    /// A flag, true or false.
    Flag(bool),
    /// A choice or a text.
    Text(&'static str),
    /// No default: the value must be stated.
    Required,
    /// A description of a default that is not a single value.
    Words(&'static str),
}

impl From<f64> for ParameterDefault {
    fn from(number: f64) -> Self {
        Self::Number(number)
    }
}

impl From<usize> for ParameterDefault {
    fn from(whole: usize) -> Self {
        Self::Whole(whole as i64)
    }
}

impl From<bool> for ParameterDefault {
    fn from(flag: bool) -> Self {
        Self::Flag(flag)
    }
}

/// The values that a parameter may have.
#[derive(Clone, Debug, PartialEq)]
pub enum ParameterRange {
    /// Numbers above the first and up to the second.
    Above(f64, f64),
    /// Numbers from the first to the second, both included.
    Within(f64, f64),
    /// Whole numbers from the first to the second, both included.
    Whole(i64, i64),
    /// An x coordinate inside the room, m.
    X,
    /// A y coordinate inside the room, m.
    Y,
    /// A name, unique in a list of tables.
    Name,
    /// A list of tables with the least and the greatest length.
    List(usize, usize),
    /// The values `true` and `false`.
    Flag,
    /// A choice of these words.
    Choice(&'static [&'static str]),
    /// A text, a list or a table, which its owner checks.
    Other(&'static str),
}

impl fmt::Display for ParameterDefault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Number(number) => write!(f, "{number}"),
            Self::Whole(number) => write!(f, "{number}"),
            Self::Flag(flag) => write!(f, "{flag}"),
            Self::Text(text) => write!(f, "\"{text}\""),
            Self::Required => f.write_str("required"),
            Self::Words(words) => f.write_str(words),
        }
    }
}

/// Formats the range for a text such as "it must be …".
impl fmt::Display for ParameterRange {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Above(from, to) => write!(f, "{}", above(*from, *to, "")),
            Self::Within(from, to) => write!(f, "{}", closed(*from, *to, "")),
            Self::Whole(from, to) => write!(f, "{}", whole(*from, *to, "")),
            Self::X => f.write_str("an x coordinate in the room"),
            Self::Y => f.write_str("a y coordinate in the room"),
            Self::Name => f.write_str("a unique name"),
            Self::List(least, most) => write!(f, "a list of {least} to {most} tables"),
            Self::Flag => f.write_str("true or false"),
            Self::Choice(words) => write!(f, "one of {}", words.join(", ")),
            Self::Other(words) => f.write_str(words),
        }
    }
}

impl ParameterSpec {
    /// Creates a parameter from all its fields.
    #[must_use]
    pub const fn new(
        key: &'static str,
        unit: &'static str,
        default: ParameterDefault,
        about: &'static str,
        range: ParameterRange,
    ) -> Self {
        Self {
            key,
            unit,
            default,
            about,
            range,
        }
    }

    /// Rejects values that are not allowed, at every place of the parameter in a section.
    pub(super) fn check_in(
        &self,
        section: &Value,
        at: &KeyPath,
        room: &Room,
    ) -> Result<(), Problem> {
        let keys: Vec<&str> = self.key.split('.').collect();
        let mut first = BTreeMap::new();
        each(section, &keys, at.clone(), &mut |value, at| {
            // An absent value is missing or null. NaN is null, too, but only where a number is required.
            let may_be_absent = matches!(self.default, ParameterDefault::Words(_));
            if value.is_null() && may_be_absent {
                return Ok(());
            }
            self.check(value, &at, room)?;
            let text = value
                .as_str()
                .filter(|_| self.range == ParameterRange::Name);
            match text.and_then(|text| first.insert(text.to_owned(), at.clone())) {
                None => Ok(()),
                Some(first) => {
                    let what = format!("{value} is already at {first}");
                    Err(Problem::at(at, what, "give each its own name"))
                }
            }
        })
    }

    /// Returns the range of a number in a room; `None` for other values.
    fn numbers(&self, room: &Room) -> Option<NumberRange> {
        Some(match self.range {
            ParameterRange::Above(from, to) => above(from, to, self.unit),
            ParameterRange::Within(from, to) => closed(from, to, self.unit),
            ParameterRange::Whole(from, to) => whole(from, to, self.unit),
            ParameterRange::X => room.range_x(),
            ParameterRange::Y => room.range_y(),
            _ => return None,
        })
    }

    /// Rejects a value that is not allowed.
    pub(super) fn check(&self, value: &Value, at: &KeyPath, room: &Room) -> Result<(), Problem> {
        if let Some(range) = self.numbers(room) {
            let number = value.as_f64().ok_or_else(|| self.unfit(value, at))?;
            return range.check(at, number);
        }
        match (&self.range, value) {
            (ParameterRange::Name, Value::String(text)) => check_name(at, text),
            (ParameterRange::List(least, most), Value::Array(list)) => {
                let length = list.len();
                if (*least..=*most).contains(&length) {
                    return Ok(());
                }
                let entries = if length == 1 { "entry" } else { "entries" };
                let what = format!("{length} {entries}");
                Err(Problem::at(at, what, format!("give {least} to {most}")))
            }
            (ParameterRange::Choice(words), Value::String(word)) => {
                check_known(at, "there is no choice", word, words.iter().copied())
            }
            (ParameterRange::Flag, Value::Bool(_)) | (ParameterRange::Other(_), _) => Ok(()),
            _ => Err(self.unfit(value, at)),
        }
    }

    fn unfit(&self, value: &Value, at: &KeyPath) -> Problem {
        let found = match value {
            Value::String(text) => format!("the string '{text}'"),
            Value::Array(_) => "an array".to_owned(),
            Value::Object(_) => "a table".to_owned(),
            // JSON represents NaN and infinity as null.
            Value::Null => "NaN or a number that is too large".to_owned(),
            other => other.to_string(),
        };
        let wanted = match self.range {
            ParameterRange::Above(..)
            | ParameterRange::Within(..)
            | ParameterRange::X
            | ParameterRange::Y => "a number".to_owned(),
            _ => self.range.to_string(),
        };
        Problem::at(
            at,
            format!("{found} does not fit"),
            format!("write {wanted}"),
        )
    }
}

/// Calls `act` for each value under these keys, in every element of the lists on the way.
fn each(
    value: &Value,
    keys: &[&str],
    at: KeyPath,
    act: &mut impl FnMut(&Value, KeyPath) -> Result<(), Problem>,
) -> Result<(), Problem> {
    let Some((key, below)) = keys.split_first() else {
        return act(value, at);
    };
    if let Value::Array(elements) = value {
        let mut elements = elements.iter().enumerate();
        return elements.try_for_each(|(index, element)| each(element, keys, at.index(index), act));
    }
    match value.get(key) {
        Some(value) => each(value, below, at.key(key), act),
        None => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::ParameterDefault::{Number, Required, Words};
    use super::ParameterRange::{Above, List, Name, X};
    use super::*;
    use crate::testkit::entry;

    #[test]
    fn declared_parameters_are_checked_at_every_place() {
        let declared = [
            ParameterSpec::new("places", "", Required, "", List(1, 3)),
            ParameterSpec::new("places.name", "", Required, "", Name),
            ParameterSpec::new("places.x_m", "m", Required, "", X),
            ParameterSpec::new("reach_m", "m", Number(0.3), "", Above(0.0, 1e3)),
            ParameterSpec::new("limit_m", "m", Words("none"), "", Above(0.0, 1.0)),
        ];
        let check = |section: &Value| {
            let at = KeyPath::new(["visit"]);
            let mut declared = declared.iter();
            declared.try_for_each(|each| each.check_in(section, &at, &Room::default()))
        };
        let places = |places: &[(&str, f32)]| {
            let place = |(name, x_m): &(&str, f32)| json!({ "name": name, "x_m": x_m });
            let places: Vec<Value> = places.iter().map(place).collect();
            json!({ "places": places, "reach_m": 0.3_f32, "limit_m": null })
        };
        assert_eq!(check(&places(&[("a", 0.0), ("b", 12.0)])), Ok(()));
        let refusals = [
            places(&[]),
            places(&[("a", 1.0), ("a", 2.0)]),
            places(&[("a", 12.1)]),
            places(&[("a", f32::NAN)]),
            json!({ "reach_m": -0.1_f32 }),
            json!({ "reach_m": null }),
        ]
        .map(|section| {
            let problem = check(&section).unwrap_err();
            entry(&section.to_string(), &problem.to_string())
        });
        insta::assert_snapshot!(refusals.concat());
    }
}
