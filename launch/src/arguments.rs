//! The arguments of this process. A mistake results in a one-line message.

use std::ffi::OsString;
use std::process::ExitCode;

use clap::error::{ContextKind, ContextValue, ErrorKind};
use clap::{Command, Error, FromArgMatches, Parser};
use scenario::{Vocabulary, name_remedy};
use terminal::stderr_line;
use world_server::size::with_size_options;

/// Parses the arguments of this process by the complete `command`.
///
/// # Errors
/// The exit status, after the message or the help has been printed.
pub fn parse<C: FromArgMatches>(command: &Command) -> Result<C, ExitCode> {
    let words: Vec<OsString> = std::env::args_os().collect();
    parse_words(command, &words)
}

/// Parses arguments like [`parse`]; the first is the name of the program.
///
/// # Errors
/// The exit status, after the message or the help has been printed.
pub fn parse_words<C: FromArgMatches>(
    command: &Command,
    words: &[OsString],
) -> Result<C, ExitCode> {
    read(command.clone(), words).map_err(|error| match error.kind() {
        // Without any argument the help is printed.
        ErrorKind::DisplayHelp
        | ErrorKind::DisplayVersion
        | ErrorKind::DisplayHelpOnMissingArgumentOrSubcommand => error.exit(),
        _ => {
            let line = unknown_command(command, words, &error);
            let line = line.unwrap_or_else(|| one_line(&error.to_string()));
            stderr_line!("alliance: {line}; try --help");
            ExitCode::from(2)
        }
    })
}

/// Parses arguments from a list; the first is the name of the command. The size options of the missions are accepted like `--size`.
pub fn parse_list<C: Parser>(vocabulary: &Vocabulary, words: &[String]) -> Result<C, String> {
    read(with_size_options(C::command(), vocabulary), words)
        .map_err(|error| one_line(&error.to_string()))
}

fn read<C: FromArgMatches>(
    command: Command,
    words: impl IntoIterator<Item = impl Into<OsString> + Clone>,
) -> Result<C, clap::Error> {
    C::from_arg_matches_mut(&mut command.try_get_matches_from(words)?)
}

/// Returns the message for an unknown command with the most similar one; clap finds none for short names such as "rn".
fn unknown_command(command: &Command, words: &[OsString], error: &Error) -> Option<String> {
    let Some(ContextValue::String(unknown)) = error.get(ContextKind::InvalidSubcommand) else {
        return None;
    };
    let before = words.iter().take_while(|word| *word != unknown.as_str());
    let parent = before.fold(command, |at, word| at.find_subcommand(word).unwrap_or(at));
    let known = parent.get_subcommands().filter(|part| !part.is_hide_set());
    let remedy = name_remedy(unknown, known.map(Command::get_name));
    Some(format!("there is no command '{unknown}'; {remedy}"))
}

/// Converts a message of clap to one line without the usage.
fn one_line(text: &str) -> String {
    let mut line = String::new();
    let parts = text
        .lines()
        .map(str::trim)
        .take_while(|part| !part.starts_with("Usage:") && !part.starts_with("For more information"))
        // The tip to pass an unknown option such as "-5" after "--" is misleading.
        .filter(|part| !part.is_empty() && !part.starts_with("tip: to pass '-"));
    for part in parts {
        if !line.is_empty() {
            line += if line.ends_with(':') { " " } else { "; " };
        }
        line += part.strip_prefix("error: ").unwrap_or(part);
    }
    // The texts of the standard library name no remedy.
    let line = line
        .replace("invalid float literal", "write a number")
        .replace("invalid digit found in string", "write a whole number");
    range_in_words(&line).unwrap_or(line)
}

/// Replaces a range in the notation of Rust. Returns `None` if the line has none.
fn range_in_words(line: &str) -> Option<String> {
    let (before, to) = line.split_once("..=")?;
    let (problem, from) = before.rsplit_once(" is not in ")?;
    Some(format!("{problem} is not from {from} to {to}"))
}

#[cfg(test)]
mod tests {
    use clap::Arg;

    use super::*;

    #[test]
    fn an_unknown_command_has_a_suggestion() {
        let command = Command::new("alliance")
            .subcommand(Command::new("run"))
            .subcommand(Command::new("shell").hide(true))
            .subcommand(Command::new("list").subcommand(Command::new("runs")))
            .subcommand_required(true);
        let message = |words: &[&str]| {
            let words: Vec<OsString> = words.iter().map(OsString::from).collect();
            let error = command.clone().try_get_matches_from(&words).unwrap_err();
            unknown_command(&command, &words, &error)
        };
        assert_eq!(
            message(&["alliance", "rn"]).unwrap(),
            "there is no command 'rn'; did you mean 'run'? (there are run, list)"
        );
        let nested = message(&["alliance", "list", "rns"]).unwrap();
        assert!(
            nested.contains("'rns'; there is only 'runs'")
                || nested.contains("did you mean 'runs'"),
            "{nested}"
        );
        assert_eq!(message(&["alliance", "run", "--x"]), None);
    }

    #[test]
    fn problem_and_remedy_are_in_one_line() {
        let long = |name: &'static str| Arg::new(name).long(name);
        let command = Command::new("alliance").args([
            long("robot").value_name("NAME").required(true),
            long("log").value_parser(["full", "off"]),
            long("limit").value_parser(clap::value_parser!(f64)),
            long("port").value_parser(clap::value_parser!(u16)),
        ]);
        for (arguments, expected) in [
            (
                "",
                "the following required arguments were not provided: --robot <NAME>",
            ),
            (
                "--robto=blue",
                "unexpected argument '--robto' found; tip: a similar argument exists: '--robot'",
            ),
            ("-5", "unexpected argument '-5' found"),
            (
                "--robot=blue --log=loud",
                "invalid value 'loud' for '--log <log>'; [possible values: full, off]",
            ),
            (
                "--robot=blue --limit=gold",
                "invalid value 'gold' for '--limit <limit>': write a number",
            ),
            (
                "--robot=blue --port=70000",
                "invalid value '70000' for '--port <port>': 70000 is not from 0 to 65535",
            ),
            (
                "--robot=blue --port=gold",
                "invalid value 'gold' for '--port <port>': write a whole number",
            ),
        ] {
            let words = format!("alliance {arguments}");
            let words = words.split_whitespace();
            let error = command.clone().try_get_matches_from(words).unwrap_err();
            assert_eq!(one_line(&error.to_string()), expected);
        }
    }
}
