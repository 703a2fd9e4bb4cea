//! The gallery: runs worth watching, from `gallery.toml`. The page and the book list them, and a test checks what each
//! promises.

use serde::{Deserialize, Serialize};

use crate::choice::Choice;

const FILE: &str = include_str!("../gallery.toml");

/// The contents of the file.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Gallery {
    run: Vec<Entry>,
}

/// A run of the gallery.
#[derive(Clone, Debug, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Entry {
    pub title: String,
    /// The sentence that says what there is to see.
    pub see: String,
    /// The publications of the effect or of the rules.
    pub source: String,
    pub choice: Choice,
    /// What the sentence promises of the run, and of the second run if there is one.
    #[serde(skip_serializing)]
    pub expect: Vec<Expectation>,
    /// The run that is ahead at the end: 1, 2, or 0 for neither.
    #[serde(default, skip_serializing)]
    pub ahead: Option<usize>,
}

/// The expected end of a run. Missing values are not checked.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Expectation {
    pub outcome: String,
    pub done: Option<f64>,
    pub left: Option<f64>,
    pub expired: Option<f64>,
    /// The beginnings of events, which occur in this order: robot, kind and subject.
    #[serde(default)]
    pub events: Vec<String>,
}

/// Returns the runs of the gallery.
#[must_use]
pub fn gallery() -> Vec<Entry> {
    // A test reads the file.
    toml::from_str::<Gallery>(FILE).map_or_else(|_| Vec::new(), |gallery| gallery.run)
}

#[cfg(test)]
mod tests;
