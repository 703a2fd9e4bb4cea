//! Tasks and robots as JSON: a list of tasks, or the form of `alliance export --instance`.

use scenario::Problem;
use serde::de::DeserializeOwned;
use serde_json::value::RawValue;

use super::super::source::{Loaded, Source};
use super::records::Document;

/// Reads a JSON file.
///
/// # Errors
/// Returns the first line that is not JSON or has a missing, unknown or unsuitable key.
pub(super) fn read(source: Source<'_>) -> Result<Loaded, Problem> {
    type Raw<'a> = Document<&'a RawValue, &'a RawValue>;
    let parsed = if source.text.trim_start().starts_with('[') {
        serde_json::from_str(source.text).map(Raw::from_tasks)
    } else {
        serde_json::from_str::<Raw<'_>>(source.text)
    };
    let document = parsed.map_err(|error| refused(source, &error, 1))?;
    document.load(|task| record(source, task), |robot| record(source, robot))
}

/// Reads a record and returns it with its line.
fn record<T: DeserializeOwned>(source: Source<'_>, raw: &RawValue) -> Result<(T, usize), Problem> {
    // The record is a part of the text, so the difference of the addresses is its place.
    let place = raw.get().as_ptr().addr() - source.text.as_ptr().addr();
    let line = source.line_at(place);
    let record = serde_json::from_str(raw.get());
    record
        .map(|record| (record, line))
        .map_err(|error| refused(source, &error, line))
}

/// Returns the error of a text that begins on line `first`.
pub(super) fn refused(source: Source<'_>, error: &serde_json::Error, first: usize) -> Problem {
    let text = error.to_string();
    // The place has the form "… at line 3 column 7".
    let (what, _) = text.rsplit_once(" at line ").unwrap_or((&text, ""));
    let line = first + error.line().max(1) - 1;
    source.error(line, what, "docs/book/instances.md lists the keys")
}
