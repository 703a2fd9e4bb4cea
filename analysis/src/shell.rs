//! Words of commands that a person pastes into a shell.

use std::path::Path;

/// Quotes a path for a shell. A path that begins with `-` would be read as an option.
#[must_use]
pub fn shell_quoted(path: &Path) -> String {
    let here = if path.to_string_lossy().starts_with('-') {
        "./"
    } else {
        ""
    };
    let text = format!("{here}{}", path.display());
    let plain = |c: char| c.is_alphanumeric() || "/._-+,=:@".contains(c);
    if !text.is_empty() && text.chars().all(plain) {
        text
    } else {
        format!("'{}'", text.replace('\'', r"'\''"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn paths_are_quoted_for_a_shell() {
        assert_eq!(
            shell_quoted(Path::new("sweeps/a-1.toml")),
            "sweeps/a-1.toml"
        );
        assert_eq!(shell_quoted(Path::new("my $weep")), "'my $weep'");
        assert_eq!(shell_quoted(Path::new("it's")), r"'it'\''s'");
        assert_eq!(shell_quoted(Path::new("-x y")), "'./-x y'");
    }
}
