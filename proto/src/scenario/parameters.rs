//! What may be stated of an allocator or a mission: its parameters, for people and for checks.

use std::fmt;

use serde_json::Value;

use super::error::{Problem, instead};
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
            Self::Flag => f.write_str("true or false"),
            Self::Choice(words) => write!(f, "one of {}", words.join(", ")),
            Self::Other(words) => f.write_str(words),
        }
    }
}

impl ParameterSpec {
    /// Refuses a value that it may not have.
    pub(super) fn check(&self, value: &Value, at: &Path) -> Result<(), Problem> {
        let number = value.as_f64();
        let fits = match &self.range {
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
                let what = format!("{value} is out of range");
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
            ParameterRange::Above(..) | ParameterRange::Within(..) => "a number".to_owned(),
            _ => self.range.to_string(),
        };
        Problem::at(
            at.clone(),
            format!("{found} does not fit"),
            format!("write {wanted}"),
        )
    }
}
