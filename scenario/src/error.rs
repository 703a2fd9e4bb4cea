//! Errors in scenarios and parameter files: one line with place, problem and remedy.

use std::borrow::Cow;
use std::fmt;

use super::path::{KeyPath, PathStep};

/// A scenario or parameter file that cannot be used. It displays as one line, `FILE:LINE: KEY: problem; remedy`. File
/// and line are missing for a scenario without a file.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub struct ScenarioError {
    pub(super) file: Option<String>,
    pub(super) line: Option<usize>,
    pub(super) key: String,
    pub(super) problem: String,
    pub(super) remedy: String,
}

impl ScenarioError {
    /// Creates an error on a line of a file, without a key.
    pub(super) fn in_file(file: &str, line: usize, what: String, remedy: String) -> Self {
        Self {
            file: Some(file.to_owned()),
            line: Some(line),
            key: String::new(),
            problem: what,
            remedy,
        }
    }
}

/// Returns the contents of a file as text; `name` is for the error message.
///
/// # Errors
/// Returns the line of the first byte that is not UTF-8.
pub fn decode_text(name: &str, bytes: Vec<u8>) -> Result<String, ScenarioError> {
    String::from_utf8(bytes).map_err(|error| {
        let whole = &error.as_bytes()[..error.utf8_error().valid_up_to()];
        let line = whole.iter().filter(|byte| **byte == b'\n').count() + 1;
        let what = "the bytes are not UTF-8 text".to_owned();
        ScenarioError::in_file(name, line, what, "save the file as UTF-8".to_owned())
    })
}

impl fmt::Display for ScenarioError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mut text = String::new();
        if let Some(file) = &self.file {
            text += file;
            if let Some(line) = self.line {
                text += &format!(":{line}");
            }
            text += ": ";
        }
        if !self.key.is_empty() {
            text += &format!("{}: ", self.key);
        }
        text += &format!("{}; {}", self.problem, self.remedy);
        // Names come from the file and may contain any character. Escapes keep them from breaking the line or
        // controlling a terminal.
        for c in shortened(&text).chars() {
            if c.is_control() {
                write!(f, "{}", c.escape_default())?;
            } else {
                write!(f, "{c}")?;
            }
        }
        Ok(())
    }
}

/// Returns a text without its middle if it is longer than a person reads. Names and values come from the file and have any
/// length.
fn shortened(text: &str) -> Cow<'_, str> {
    const HEAD: usize = 280;
    const TAIL: usize = 100;
    let length = text.chars().count();
    if length <= HEAD + TAIL {
        return Cow::Borrowed(text);
    }
    let head = text.chars().take(HEAD);
    let tail = text.chars().skip(length - TAIL);
    Cow::Owned(head.chain(" … ".chars()).chain(tail).collect())
}

/// The place where a value was stated.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum Location {
    /// A path in the scenario, with or without a file.
    Scenario(KeyPath),
    /// A line of a parameter file.
    Parameters {
        file: String,
        line: usize,
        key: String,
    },
}

/// A problem and its path, before the line in the scenario's file is known.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Problem {
    pub(super) place: Location,
    pub(super) problem: String,
    pub(super) remedy: String,
}

/// Formats the problem as `KEY: problem; remedy`.
impl fmt::Display for Problem {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.clone().located(None).fmt(f)
    }
}

impl Problem {
    /// Creates a problem at a path of the scenario.
    #[must_use]
    pub fn at(path: KeyPath, what: impl Into<String>, remedy: impl Into<String>) -> Self {
        Self {
            place: Location::Scenario(path),
            problem: what.into(),
            remedy: remedy.into(),
        }
    }

    /// Returns the problem for a scenario that is nested under a key.
    pub(super) fn under_key(mut self, key: &str) -> Self {
        if let Location::Scenario(path) = &mut self.place {
            path.0.insert(0, PathStep::Key(key.to_owned()));
        }
        self
    }
}

/// Returns the known name that is most similar to a misspelled one.
pub(crate) fn nearest<'a>(
    wrong: &str,
    known: impl IntoIterator<Item = &'a str>,
) -> Option<&'a str> {
    known
        .into_iter()
        .map(|name| (strsim::damerau_levenshtein(wrong, name), name))
        .min_by_key(|(distance, _)| *distance)
        .filter(|(distance, name)| *distance <= (name.chars().count() / 3).max(1))
        .map(|(_, name)| name)
}

/// Returns a remedy for an unknown name: the most similar known name, and all known names if they are few.
#[must_use]
pub fn name_remedy<'a>(wrong: &str, known: impl IntoIterator<Item = &'a str>) -> String {
    const FEW: usize = 30;
    let known: Vec<&str> = known.into_iter().collect();
    let list = match known.len() {
        0 => "there are none".to_owned(),
        1 => format!("there is only '{}'", known[0]),
        2..=FEW => format!("there are {}", known.join(", ")),
        more => format!("there are {more}, from {} to {}", known[0], known[more - 1]),
    };
    match nearest(wrong, known) {
        Some(name) => format!("did you mean '{name}'? ({list})"),
        None => list,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_about_a_long_name_keeps_its_place_and_its_remedy() {
        let what = format!("unknown robot '{}'", "ü".repeat(5000));
        let remedy = "there is only 'blue'".to_owned();
        let line = ScenarioError::in_file("my.toml", 7, what, remedy).to_string();
        assert_eq!(line.chars().count(), 383);
        assert!(line.starts_with("my.toml:7: unknown robot 'üüü"), "{line}");
        assert!(line.ends_with("üüü'; there is only 'blue'"), "{line}");
        let short = "x".repeat(380);
        assert_eq!(shortened(&short), short);
    }
}
