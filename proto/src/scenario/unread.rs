//! A part of a file whose type is known later.

use serde::de::DeserializeOwned;
use toml::de::{DeTable, DeValue};

use super::error::Problem;
use super::parameters::{ParameterDefault, ParameterSpec};
use super::path::Path;
use super::toml_value::Value;

/// A table that stands in a file under a key, or does not stand there.
#[derive(Clone, Copy, Debug)]
pub struct Unread<'a> {
    key: &'a str,
    source: Source<'a>,
    /// What is declared of it.
    declared: &'a [ParameterSpec],
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
        Self::of(key, Source::Toml(value))
    }

    pub(super) fn json(key: &'a str, value: &'a serde_json::Value) -> Self {
        Self::of(key, Source::Json(value))
    }

    /// A table of that key in which nothing is stated.
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

    /// With the declared default of each key of its own that it does not state.
    pub(crate) fn completed(self, declared: &'a [ParameterSpec]) -> Self {
        Self { declared, ..self }
    }

    /// What it says as a value of that type.
    ///
    /// # Errors
    /// The first key or value that does not fit.
    pub fn to<T: DeserializeOwned>(self) -> Result<T, Problem> {
        let read = match self.source {
            Source::Toml(DeValue::Table(stated)) => self.table(stated),
            Source::Toml(value) => T::deserialize(Value(value)).map_err(Problem::from),
            // It was written with all that it has.
            Source::Json(value) => T::deserialize(value).map_err(|error| {
                let remedy = "see the mission's parameters";
                Problem::at(Path::default(), error.to_string(), remedy)
            }),
            Source::Absent => self.table(&DeTable::new()),
        };
        read.map_err(|problem| problem.below(self.key))
    }

    fn table<T: DeserializeOwned>(&self, stated: &DeTable<'_>) -> Result<T, Problem> {
        let has_default = |it: &&ParameterSpec| {
            let is_value = !matches!(
                it.default,
                ParameterDefault::Required | ParameterDefault::Words(_)
            );
            is_value && !it.key.contains('.') && !stated.contains_key(it.key)
        };
        let defaults = self.declared.iter().filter(has_default);
        let defaults: String = defaults
            .map(|it| format!("{} = {}\n", it.key, it.default))
            .collect();
        let defaults = DeTable::parse(&defaults).map_err(|error| {
            let remedy = "declare defaults that can stand in a file";
            Problem::at(Path::default(), error.message(), remedy)
        })?;
        let mut complete = defaults.into_inner();
        complete.extend(stated.clone());
        T::deserialize(Value(&DeValue::Table(complete))).map_err(Problem::from)
    }
}
