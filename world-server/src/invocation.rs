//! By which command a run was started, for whoever reads its folder later.

/// A launcher tells the processes that it starts how it was started itself.
pub const COMMAND: &str = "ALLIANCE_COMMAND";

/// The command by which somebody started this process, or the one that has started it.
#[must_use]
pub fn command() -> String {
    std::env::var(COMMAND).unwrap_or_else(|_| in_words(std::env::args()))
}

/// As one writes it in a shell; of the program its name only.
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
