//! Names of robots, runs, hosts and tasks.

/// Returns whether a name is valid in key expressions, file names and CSV columns: letters, digits, `-` and `_`, at
/// most 32, starting with a letter or digit.
#[must_use]
pub fn is_name(name: &str) -> bool {
    name.len() <= 32
        && name.starts_with(|c: char| c.is_ascii_alphanumeric())
        && name
            .chars()
            .all(|c| c.is_ascii_alphanumeric() || c == '-' || c == '_')
}
