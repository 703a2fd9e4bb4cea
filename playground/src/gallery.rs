//! The gallery: runs worth watching, from `gallery.toml`. The page and the book list them, and a test checks what each
//! promises.

use missions::Registry;
use scenario::Scenario;
use serde::{Deserialize, Serialize};
use serde_json::{Value, json};

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

/// Returns the built-in scenarios, with the number of their robots, the allocators, and the gallery.
#[must_use]
pub fn choices() -> Value {
    let vocabulary = Registry::current().vocabulary();
    let scenarios = vocabulary.builtins().filter_map(|builtin| {
        // A test reads all of them.
        let scenario = Scenario::parse(builtin.name, builtin.text, &vocabulary).ok()?;
        Some(json!({
            "name": builtin.name,
            "about": scenario.description,
            "robots": scenario.robots.len(),
        }))
    });
    let allocators = vocabulary.allocators.iter();
    let allocators = allocators.map(|spec| json!({"name": spec.name, "about": spec.about}));
    json!({
        "scenarios": scenarios.collect::<Vec<_>>(),
        "allocators": allocators.collect::<Vec<_>>(),
        "gallery": gallery(),
    })
}

#[cfg(test)]
mod tests;
