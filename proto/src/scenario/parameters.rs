//! What may be stated of an allocator or a mission: its parameters, for people and for checks.

use std::collections::BTreeMap;
use std::fmt;

use serde_json::Value;

use super::Room;
use super::error::{Problem, instead};
use super::limits::{closed, name};
use super::path::Path;

/// One parameter of an allocator or of a mission's section.
#[derive(Clone, Debug, PartialEq)]
pub struct ParameterSpec {
    /// Its key; below a table of the section with a dot, as in `box.length_m`.
    pub key: &'static str,
    /// Its unit; empty for what has none.
    pub unit: &'static str,
    /// What holds where nothing is stated.
    pub default: ParameterDefault,
    /// What it means, in a line.
    pub about: &'static str,
    /// What may be stated.
    pub range: ParameterRange,
}

/// The value of a parameter that is not stated.
#[derive(Clone, Debug, PartialEq)]
pub enum ParameterDefault {
    /// A number.
    Number(f64),
    /// A whole number.
    Whole(i64),
    /// Yes or no.
    Flag(bool),
    /// A choice or a text.
    Text(&'static str),
    /// It has to be stated.
    Required,
    /// What cannot be said in one value, in words.
    Words(&'static str),
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
    /// A coordinate inside the room, m.
    X,
    /// The same of the other one.
    Y,
    /// A name; in a list of tables each has its own.
    Name,
    /// A list of tables, that many: the least and the most.
    List(usize, usize),
    /// `true` or `false`.
    Flag,
    /// One of these words.
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

/// As in "it must be …".
impl fmt::Display for ParameterRange {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Above(from, to) => write!(f, "above {from} and at most {to}"),
            Self::Within(from, to) => write!(f, "at least {from} and at most {to}"),
            Self::Whole(from, to) => write!(f, "a whole number from {from} to {to}"),
            Self::X => f.write_str("from 0 to the room's width"),
            Self::Y => f.write_str("from 0 to the room's height"),
            Self::Name => f.write_str("a name of its own"),
            Self::List(least, most) => write!(f, "a list of {least} to {most} tables"),
            Self::Flag => f.write_str("true or false"),
            Self::Choice(words) => write!(f, "one of {}", words.join(", ")),
            Self::Other(words) => f.write_str(words),
        }
    }
}

impl ParameterSpec {
    /// All of it.
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

    /// Refuses values that it may not have, wherever it stands in a section.
    pub(super) fn check_in(&self, section: &Value, at: &Path, room: &Room) -> Result<(), Problem> {
        let keys: Vec<&str> = self.key.split('.').collect();
        let mut first = BTreeMap::new();
        each(section, &keys, at.clone(), &mut |value, at| {
            // What is absent is not there, or null: so is what is no number, where one must be.
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

    /// Refuses a value that it may not have.
    pub(super) fn check(&self, value: &Value, at: &Path, room: &Room) -> Result<(), Problem> {
        let number = value.as_f64();
        let fits = match &self.range {
            ParameterRange::X | ParameterRange::Y => {
                let Some(number) = number else {
                    return Err(self.unfit(value, at));
                };
                let size_m = match self.range {
                    ParameterRange::X => room.width_m,
                    _ => room.height_m,
                };
                return closed(0.0, size_m.into(), "m").check(at.clone(), number as f32);
            }
            ParameterRange::Name => match value.as_str() {
                Some(text) => return name(at.clone(), text),
                None => None,
            },
            ParameterRange::List(least, most) => match value.as_array().map(Vec::len) {
                Some(length) if !(*least..=*most).contains(&length) => {
                    let what = format!("{length} entries");
                    let remedy = format!("give {least} to {most}");
                    return Err(Problem::at(at.clone(), what, remedy));
                }
                length => length.map(|_| true),
            },
            ParameterRange::Above(from, to) => number.map(|it| it > *from && it <= *to),
            ParameterRange::Within(from, to) => number.map(|it| it >= *from && it <= *to),
            ParameterRange::Whole(from, to) => value.as_i64().map(|it| it >= *from && it <= *to),
            ParameterRange::Flag => value.as_bool().map(|_| true),
            ParameterRange::Choice(words) => {
                let Some(word) = value.as_str() else {
                    return Err(self.unfit(value, at));
                };
                if words.contains(&word) {
                    return Ok(());
                }
                let what = format!("there is no choice '{word}'");
                return Err(Problem::at(
                    at.clone(),
                    what,
                    instead(word, words.iter().copied()),
                ));
            }
            ParameterRange::Other(_) => return Ok(()),
        };
        match fits {
            Some(true) => Ok(()),
            Some(false) => {
                let remedy = format!("it must be {} {}", self.range, self.unit);
                // Of single precision if it may be, as it was written.
                let single = number.filter(|_| value.is_f64()).map(|it| it as f32);
                let what = match single.filter(|it| Some(f64::from(*it)) == number) {
                    Some(single) => format!("{single:?} is out of range"),
                    None => format!("{value} is out of range"),
                };
                Err(Problem::at(at.clone(), what, remedy.trim_end()))
            }
            None => Err(self.unfit(value, at)),
        }
    }

    fn unfit(&self, value: &Value, at: &Path) -> Problem {
        let found = match value {
            Value::String(text) => format!("the string '{text}'"),
            Value::Array(_) => "an array".to_owned(),
            Value::Object(_) => "a table".to_owned(),
            // JSON has no other word for what is no number.
            Value::Null => "nan".to_owned(),
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
            at.clone(),
            format!("{found} does not fit"),
            format!("write {wanted}"),
        )
    }
}

/// Does something with each value under these keys, in every element of the lists on the way.
fn each(
    value: &Value,
    keys: &[&str],
    at: Path,
    act: &mut impl FnMut(&Value, Path) -> Result<(), Problem>,
) -> Result<(), Problem> {
    let Some((key, below)) = keys.split_first() else {
        return act(value, at);
    };
    if let Value::Array(elements) = value {
        let mut elements = elements.iter().enumerate();
        return elements.try_for_each(|(index, it)| each(it, keys, at.index(index), act));
    }
    match value.get(key) {
        Some(value) => each(value, below, at.key(key), act),
        None => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::ParameterDefault::{Number, Required, Words};
    use super::ParameterRange::{Above, List, Name, X};
    use super::*;

    #[test]
    fn what_is_declared_of_a_section_is_checked_wherever_it_stands() {
        let declared = [
            ParameterSpec::new("places", "", Required, "", List(1, 3)),
            ParameterSpec::new("places.name", "", Required, "", Name),
            ParameterSpec::new("places.x_m", "m", Required, "", X),
            ParameterSpec::new("reach_m", "m", Number(0.3), "", Above(0.0, 1e3)),
            ParameterSpec::new("limit_m", "m", Words("none"), "", Above(0.0, 1.0)),
        ];
        let refusal = |section: Value| {
            let at = Path::of(["visit"]);
            let mut declared = declared.iter();
            let checked = declared.try_for_each(|it| it.check_in(&section, &at, &Room::default()));
            checked.map_err(|problem| problem.located(None).to_string())
        };
        let place = |name: &str, x_m: f32| serde_json::json!({ "name": name, "x_m": x_m });
        let places = |places: &[Value]| {
            refusal(serde_json::json!({ "places": places, "reach_m": 0.3_f32, "limit_m": null }))
        };
        assert_eq!(places(&[place("a", 0.0), place("b", 12.0)]), Ok(()));
        for (refused, told) in [
            (places(&[]), "visit.places: 0 entries; give 1 to 3"),
            (
                places(&[place("a", 1.0), place("a", 2.0)]),
                "visit.places[1].name: \"a\" is already at visit.places[0].name; give each its own name",
            ),
            (
                places(&[place("a", 12.1)]),
                "visit.places[0].x_m: 12.1 is out of range; it must be at least 0 and at most 12 m",
            ),
            (
                places(&[place("a", f32::NAN)]),
                "visit.places[0].x_m: nan does not fit; write a number",
            ),
            (
                refusal(serde_json::json!({ "reach_m": -0.1_f32 })),
                "visit.reach_m: -0.1 is out of range; it must be above 0 and at most 1000 m",
            ),
            (
                refusal(serde_json::json!({ "reach_m": null })),
                "visit.reach_m: nan does not fit; write a number",
            ),
        ] {
            assert_eq!(refused, Err(told.to_owned()));
        }
    }
}
