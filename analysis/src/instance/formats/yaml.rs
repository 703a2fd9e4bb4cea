//! Tasks and robots as YAML, in the same layout as JSON.

use scenario::Problem;
use serde_saphyr::Spanned;

use super::super::model::{Robot, Task};
use super::super::source::{Loaded, Source};
use super::records::Document;

/// Reads a YAML file.
///
/// # Errors
/// Returns the first line that is not YAML or has a missing, unknown or unsuitable key.
pub(super) fn read(source: Source<'_>) -> Result<Loaded, Problem> {
    type Placed = Document<Spanned<Task>, Spanned<Robot>>;
    let content = source.text.lines().map(str::trim_start);
    let mut content = content.filter(|line| !line.is_empty() && !line.starts_with(['#', '%']));
    let is_list = content
        .find(|line| *line != "---")
        .is_some_and(|line| line.starts_with("- ") || line == "-" || line.starts_with('['));
    let parsed = if is_list {
        serde_saphyr::from_str(source.text).map(Placed::from_tasks)
    } else {
        serde_saphyr::from_str::<Placed>(source.text)
    };
    parsed
        .map_err(|error| refused(source, &error))?
        .load(|task| Ok(placed(task)), |robot| Ok(placed(robot)))
}

fn placed<T>(record: Spanned<T>) -> (T, usize) {
    let line = record.referenced.line();
    (record.value, usize::try_from(line).unwrap_or(1).max(1))
}

/// The largest part of a line that an error quotes, characters.
const MOST_QUOTED: usize = 60;

/// Returns the error of a YAML text with its line. The message of an invalid value names neither the key nor the value,
/// so that it quotes the line.
pub(in super::super) fn refused(source: Source<'_>, error: &serde_saphyr::Error) -> Problem {
    let line = error.location().map_or(1, |location| location.line());
    let text = error.without_snippet().to_string();
    let first = text.lines().next().unwrap_or_default();
    let what = first.trim_start_matches("error: ");
    // The message ends with its place, such as "… at line 3, column 7".
    let what = what.split(" at line ").next().unwrap_or(what);
    let line = usize::try_from(line).unwrap_or(1).max(1);
    let what = if what.starts_with("invalid") {
        let text = source.text.lines().nth(line - 1).unwrap_or_default();
        let quoted: String = text.trim().chars().take(MOST_QUOTED).collect();
        format!("{what} in '{quoted}'")
    } else {
        what.to_owned()
    };
    source.error(line, what, "docs/book/instances.md lists the keys")
}
