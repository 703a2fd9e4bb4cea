//! A part of a file whose type is chosen later.

use serde::de::DeserializeOwned;
use toml::de::{DeTable, DeValue};

use super::error::Problem;
use super::parameters::{ParameterDefault, ParameterSpec};
use super::path::Path;
use super::toml_value::Value;

/// A table under a key of a file, or a missing one.
#[derive(Clone, Copy, Debug)]
pub struct Unread<'a> {
    key: &'a str,
    source: Source<'a>,
    declared: &'a [ParameterSpec],
}

#[derive(Clone, Copy, Debug)]
enum Source<'a> {
    Toml(&'a DeValue<'a>),
    Json(&'a serde_json::Value),
    /// A missing table, which reads as an empty one.
    Absent,
}

impl<'a> Unread<'a> {
    pub(super) fn toml(key: &'a str, value: &'a DeValue<'a>) -> Self {
        Self::of(key, Source::Toml(value))
    }

    pub(super) fn json(key: &'a str, value: &'a serde_json::Value) -> Self {
        Self::of(key, Source::Json(value))
    }

    /// Creates a table with this key and no values.
    #[must_use]
    pub fn absent(key: &'a str) -> Self {
        Self::of(key, Source::Absent)
    }

    fn of(key: &'a str, source: Source<'a>) -> Self {
        let declared = &[];
        Self {
            key,
            source,
            declared,
        }
    }

    /// Returns the table with the declared default of each missing top-level key.
    pub(crate) fn completed(self, declared: &'a [ParameterSpec]) -> Self {
        Self { declared, ..self }
    }

    /// Returns the table as a value of type `T`.
    pub fn to<T: DeserializeOwned>(self) -> Result<T, Problem> {
        let read = match self.source {
            Source::Toml(DeValue::Table(stated)) => self.table(stated),
            Source::Toml(value) => T::deserialize(Value(value)).map_err(Problem::from),
            // The JSON form contains every value.
            Source::Json(value) => T::deserialize(value).map_err(|error| {
                let remedy = "see the mission's parameters";
                Problem::at(Path::default(), error.to_string(), remedy)
            }),
            Source::Absent => self.table(&DeTable::new()),
        };
        read.map_err(|problem| problem.below(self.key))
    }

    fn table<T: DeserializeOwned>(&self, stated: &DeTable<'_>) -> Result<T, Problem> {
        let has_default = |parameter: &&ParameterSpec| {
            let is_value = !matches!(
                parameter.default,
                ParameterDefault::Required | ParameterDefault::Words(_)
            );
            is_value && !parameter.key.contains('.') && !stated.contains_key(parameter.key)
        };
        let defaults = self.declared.iter().filter(has_default);
        let defaults: String = defaults
            .map(|parameter| format!("{} = {}\n", parameter.key, parameter.default))
            .collect();
        let defaults = DeTable::parse(&defaults).map_err(|error| {
            let remedy = "declare defaults that are valid TOML values";
            Problem::at(Path::default(), error.message(), remedy)
        })?;
        let mut complete = defaults.into_inner();
        complete.extend(stated.clone());
        T::deserialize(Value(&DeValue::Table(complete))).map_err(Problem::from)
    }
}
