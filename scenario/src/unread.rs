//! A part of a file whose type is chosen later.

use serde::de::DeserializeOwned;
use toml::de::{DeTable, DeValue};

use super::error::Problem;
use super::parameters::{ParameterDefault, ParameterSpec};
use super::toml_value::TomlValue;

/// A table under a key of a file, or a missing one.
#[derive(Clone, Copy, Debug)]
pub struct UntypedTable<'a> {
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

impl<'a> UntypedTable<'a> {
    pub(super) fn toml(key: &'a str, value: &'a DeValue<'a>) -> Self {
        Self::of(key, Source::Toml(value))
    }

    pub(super) fn json(key: &'a str, value: &'a serde_json::Value) -> Self {
        Self::of(key, Source::Json(value))
    }

    /// Creates a table with this key and no values.
    #[must_use]
    pub fn missing(key: &'a str) -> Self {
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
    pub(crate) fn with_defaults(self, declared: &'a [ParameterSpec]) -> Self {
        Self { declared, ..self }
    }

    /// Returns the table as a value of type `T`.
    pub fn deserialize<T: DeserializeOwned>(self) -> Result<T, Problem> {
        let read = match self.source {
            Source::Toml(DeValue::Table(stated)) => self.table(stated),
            Source::Toml(value) => T::deserialize(TomlValue(value)),
            // The JSON form contains every value.
            Source::Json(value) => T::deserialize(value).map_err(|error| {
                let remedy = "see the mission's parameters";
                Problem::of_value(error.to_string(), remedy)
            }),
            Source::Absent => self.table(&DeTable::new()),
        };
        read.map_err(|problem| problem.under([self.key]))
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
            Problem::of_value(error.message(), remedy)
        })?;
        let mut complete = defaults.into_inner();
        complete.extend(stated.clone());
        T::deserialize(TomlValue(&DeValue::Table(complete)))
    }
}
