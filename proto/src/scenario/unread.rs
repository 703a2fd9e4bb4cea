//! A part of a file whose type is known later.

use serde::de::DeserializeOwned;
use toml::de::DeValue;

use super::error::Problem;
use super::path::Path;
use super::toml_value::Value;

/// A table that stands in a file under a key, or does not stand there.
#[derive(Clone, Copy, Debug)]
pub struct Unread<'a> {
    key: &'a str,
    source: Source<'a>,
}

#[derive(Clone, Copy, Debug)]
enum Source<'a> {
    Toml(&'a DeValue<'a>),
    Json(&'a serde_json::Value),
    /// As if it were empty.
    Absent,
}

impl<'a> Unread<'a> {
    pub(super) fn toml(key: &'a str, value: &'a DeValue<'a>) -> Self {
        let source = Source::Toml(value);
        Self { key, source }
    }

    pub(super) fn json(key: &'a str, value: &'a serde_json::Value) -> Self {
        let source = Source::Json(value);
        Self { key, source }
    }

    /// A table of that key in which nothing is stated.
    #[must_use]
    pub fn absent(key: &'a str) -> Self {
        let source = Source::Absent;
        Self { key, source }
    }

    /// What it says as a value of that type.
    ///
    /// # Errors
    /// The first key or value that does not fit.
    pub fn to<T: DeserializeOwned>(self) -> Result<T, Problem> {
        let json = |value: &serde_json::Value| {
            T::deserialize(value).map_err(|error| {
                let remedy = "see the mission's parameters";
                Problem::at(Path::default(), error.to_string(), remedy)
            })
        };
        let read = match self.source {
            Source::Toml(value) => T::deserialize(Value(value)).map_err(Problem::from),
            Source::Json(value) => json(value),
            Source::Absent => json(&serde_json::Value::Object(serde_json::Map::new())),
        };
        read.map_err(|problem| problem.below(self.key))
    }
}
