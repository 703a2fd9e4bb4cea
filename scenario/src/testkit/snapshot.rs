//! Text for snapshot tests.

use std::fmt::Display;

/// Returns an input and the answer to it, as a paragraph of a snapshot.
pub fn entry(input: &str, answer: &str) -> String {
    let input = match input.trim_end_matches('\n') {
        "" => "(empty)",
        input => input,
    };
    let lines: String = input.chars().map(visible).collect();
    // Empty lines stay empty, because editors remove spaces at the end of a line.
    let answer = answer.trim_end_matches('\n').replace('\n', "\n     ");
    let answer = answer.replace("\n     \n", "\n\n");
    format!("{lines}\n  => {answer}\n\n")
}

/// Returns each text with the error of `read`, for a snapshot.
///
/// # Panics
///
/// If a text has no error, or if an error is not one line that starts with `file`, a colon and a line number.
#[track_caller]
pub fn refusals<T, E: Display>(
    file: &str,
    texts: impl IntoIterator<Item: AsRef<str>>,
    read: impl Fn(&str) -> Result<T, E>,
) -> String {
    let mut entries = String::new();
    for text in texts {
        let text = text.as_ref();
        let Err(error) = read(text) else {
            panic!("accepted: {text}");
        };
        let error = error.to_string();
        let position = error
            .strip_prefix(file)
            .and_then(|rest| rest.strip_prefix(':'));
        let starts_with_position = position.is_some_and(|rest| {
            let rest = rest.trim_start_matches(|c: char| c.is_ascii_digit());
            rest.starts_with(": ")
        });
        assert!(
            starts_with_position && !error.contains(char::is_control),
            "for {text}: {error}"
        );
        entries += &entry(text, &error);
    }
    entries
}

/// Returns a character as itself, or escaped if it is invisible.
fn visible(c: char) -> String {
    if c != '\n' && (c.is_control() || c == '\u{feff}') {
        c.escape_debug().to_string()
    } else {
        c.to_string()
    }
}
