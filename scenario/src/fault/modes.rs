//! Functions for modes of failure in text form, such as `noise 0.5` or `one-wheel left`.

use std::fmt::Display;
use std::str::FromStr;

use serde::Serialize;
use serde::de::DeserializeOwned;

/// Returns a mode that has no size.
pub(super) fn alone<M>(name: &str, size: Option<&str>, mode: M) -> Result<M, String> {
    match size {
        None => Ok(mode),
        Some(size) => Err(format!("'{name}' takes no size; leave '{size}' out")),
    }
}

/// Parses the size of a mode that has one.
pub(super) fn number<T: FromStr>(mode: &str, size: Option<&str>, what: &str) -> Result<T, String> {
    let given = size.map_or_else(String::new, |size| format!(", not '{size}'"));
    size.and_then(|size| size.parse().ok())
        .ok_or_else(|| format!("'{mode}' needs {what}{given}"))
}

/// Returns the error of an unknown mode.
pub(super) fn unknown(mode: &str, known: &[&str]) -> String {
    format!("'{mode}' is not a mode; there are {}", known.join(", "))
}

/// Returns the form of a mode in files.
pub(super) fn in_file(mode: impl Serialize) -> Result<toml::Value, String> {
    toml::Value::try_from(mode).map_err(|error| error.to_string())
}

/// Formats a mode from its form in files.
pub(super) fn format<M: DeserializeOwned + Display>(mode: toml::Value) -> Option<String> {
    Some(M::deserialize(mode).ok()?.to_string())
}
