//! The command that started a run, for the record in its folder.

/// The environment variable in which a launcher passes its own command to its processes.
pub const COMMAND: &str = "ALLIANCE_COMMAND";

/// Returns the command that started this process, or that started its launcher.
#[must_use]
pub fn command() -> String {
    std::env::var(COMMAND).unwrap_or_else(|_| in_words(std::env::args()))
}

fn in_words(mut arguments: impl Iterator<Item = String>) -> String {
    let program = arguments.next().unwrap_or_default();
    let name = program.rsplit('/').next().unwrap_or_default().to_owned();
    let plain = |word: &str| {
        let is_plain = |letter: char| letter.is_alphanumeric() || "-_=.,:/+%@".contains(letter);
        !word.is_empty() && word.chars().all(is_plain)
    };
    let quoted = arguments.map(|word| match plain(&word) {
        true => word,
        false => format!("'{}'", word.replace('\'', r"'\''")),
    });
    std::iter::once(name)
        .chain(quoted)
        .collect::<Vec<_>>()
        .join(" ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_command_can_be_pasted_into_a_shell() {
        let words = [
            "/usr/bin/alliance",
            "run",
            "--out=a b",
            "it's",
            "",
            "x-1.toml",
        ];
        let line = in_words(words.into_iter().map(str::to_owned));
        assert_eq!(line, r"alliance run '--out=a b' 'it'\''s' '' x-1.toml");
    }
}
