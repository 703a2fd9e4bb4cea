//! The error of every input of a user: one line with place, problem and remedy.
//!
//! Files, orders, command lines and Python arguments are checked into a [`Problem`]. A check creates it with the key of
//! the value ([`Problem::at`]); the reader of a file adds the file's name and the line.

use std::borrow::Cow;
use std::fmt;

use super::path::{KeyPath, PathStep};

/// A problem with an input. It displays as one line, `SOURCE:LINE: KEY: problem; remedy`. Absent parts are omitted.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Problem {
    pub(super) place: Place,
    pub(super) problem: String,
    pub(super) remedy: String,
}

/// The place of a value in the inputs.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(super) struct Place {
    /// The name of the file or of the option that contains the value.
    pub source: Option<String>,
    /// The line in the file, from 1.
    pub line: Option<usize>,
    pub key: KeyPath,
}

impl From<KeyPath> for Place {
    fn from(key: KeyPath) -> Self {
        Self {
            key,
            ..Self::default()
        }
    }
}

impl std::error::Error for Problem {}

impl Problem {
    /// Creates a problem with the value under a key. An empty remedy is omitted.
    #[must_use]
    pub fn at(
        key: impl Into<KeyPath>,
        problem: impl Into<String>,
        remedy: impl Into<String>,
    ) -> Self {
        Self::new(Place::from(key.into()), problem, remedy)
    }

    /// Adds another way to remove the problem.
    #[must_use]
    pub fn or_remedy(mut self, other: &str) -> Self {
        self.remedy += ", or ";
        self.remedy += other;
        self
    }

    /// Creates a problem with a value whose place its reader adds.
    #[must_use]
    pub fn of_value(problem: impl Into<String>, remedy: impl Into<String>) -> Self {
        Self::new(Place::default(), problem, remedy)
    }

    /// Creates a problem with a whole source: a file, or an option of the command line.
    #[must_use]
    pub fn with_source(
        source: impl Into<String>,
        problem: impl Into<String>,
        remedy: impl Into<String>,
    ) -> Self {
        let mut new = Self::of_value(problem, remedy);
        new.place.source = Some(source.into());
        new
    }

    pub(super) fn new(place: Place, problem: impl Into<String>, remedy: impl Into<String>) -> Self {
        Self {
            place,
            problem: problem.into(),
            remedy: remedy.into(),
        }
    }

    /// Returns the problem of a part, as a problem of the whole that contains the part under a key.
    #[must_use]
    pub fn under(mut self, key: impl Into<KeyPath>) -> Self {
        self.place.key = key.into().join(self.place.key);
        self
    }

    /// Returns the index of the entry of a list that contains the value, such as 3 for `service.points[3].kind` and the
    /// list `service.points`.
    #[must_use]
    pub fn index_in(&self, list: &KeyPath) -> Option<usize> {
        match self.place.key.0.strip_prefix(list.0.as_slice())? {
            [PathStep::Index(index), ..] => Some(*index),
            _ => None,
        }
    }

    /// Returns the problem and the remedy without the place.
    #[must_use]
    pub fn without_place(self) -> Self {
        Self {
            place: Place::default(),
            ..self
        }
    }

    /// Returns the line in the file, from 1.
    #[must_use]
    pub fn line(&self) -> Option<usize> {
        self.place.line
    }

    /// Returns the problem with its line, from 1.
    #[must_use]
    pub fn on_line(mut self, line: usize) -> Self {
        self.place.line = Some(line);
        self
    }
}

/// Returns the contents of a file as text; `name` is for the error message.
///
/// # Errors
/// Returns the line of the first byte that is not UTF-8.
pub fn decode_text(name: &str, bytes: Vec<u8>) -> Result<String, Problem> {
    String::from_utf8(bytes).map_err(|error| {
        let whole = &error.as_bytes()[..error.utf8_error().valid_up_to()];
        let line = whole.iter().filter(|byte| **byte == b'\n').count() + 1;
        Problem::with_source(
            name,
            "the bytes are not UTF-8 text",
            "save the file as UTF-8",
        )
        .on_line(line)
    })
}

impl fmt::Display for Problem {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Place { source, line, key } = &self.place;
        let mut text = match (source, line) {
            (Some(source), Some(line)) => format!("{source}:{line}: "),
            (Some(source), None) => format!("{source}: "),
            (None, Some(line)) => format!("line {line}: "),
            (None, None) => String::new(),
        };
        if *key != KeyPath::default() {
            text += &format!("{key}: ");
        }
        text += &self.problem;
        if !self.remedy.is_empty() {
            text += &format!("; {}", self.remedy);
        }
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
#[must_use]
pub fn shortened(text: &str) -> Cow<'_, str> {
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

/// Returns the first names, and the number of the others.
#[must_use]
pub fn listed(names: &[impl AsRef<str>], most: usize) -> String {
    let shown = names.iter().take(most).map(AsRef::as_ref);
    let shown = shown.collect::<Vec<&str>>().join(", ");
    match names.len().saturating_sub(most) {
        0 => shown,
        others => format!("{shown} and {others} more"),
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
    const SHOWN: usize = 3;
    let known: Vec<&str> = known.into_iter().collect();
    let list = match known.len() {
        0 => "there are none".to_owned(),
        1 => format!("there is only '{}'", known[0]),
        2..=FEW => format!("there are {}", known.join(", ")),
        _ => format!("there are {}", listed(&known, SHOWN)),
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
        let problem = Problem::with_source("my.toml", what, "there is only 'blue'").on_line(7);
        let line = problem.to_string();
        assert_eq!(line.chars().count(), 383);
        assert!(line.starts_with("my.toml:7: unknown robot 'üüü"), "{line}");
        assert!(line.ends_with("üüü'; there is only 'blue'"), "{line}");
        let short = "x".repeat(380);
        assert_eq!(shortened(&short), short);
    }

    #[test]
    fn a_list_has_its_first_names_and_the_number_of_the_others() {
        let names = ["red", "green", "blue"];
        assert_eq!(listed(&names, 3), "red, green, blue");
        assert_eq!(listed(&names, 1), "red and 2 more");
    }

    #[test]
    fn many_known_names_are_counted() {
        let robots: Vec<String> = (1..=300).map(|number| format!("r{number}")).collect();
        let remedy = name_remedy("gold", robots.iter().map(String::as_str));
        assert_eq!(remedy, "there are r1, r2, r3 and 297 more");
        let remedy = name_remedy("r12x", robots.iter().map(String::as_str));
        assert_eq!(
            remedy,
            "did you mean 'r12'? (there are r1, r2, r3 and 297 more)"
        );
    }
}
