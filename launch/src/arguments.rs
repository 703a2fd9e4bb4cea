//! The arguments of this process. A mistake results in a one-line message.

use std::ffi::OsString;
use std::process::ExitCode;

use clap::Parser;
use clap::error::ErrorKind;
use scenario::Vocabulary;
use terminal::stderr_line;
use world_server::size::with_size_options;

/// Parses the arguments of this process. The size options of the missions are accepted like `--size`.
///
/// # Errors
/// The exit status, after the message or the help has been printed.
pub fn parse<C: Parser>(vocabulary: &Vocabulary) -> Result<C, ExitCode> {
    read(vocabulary, std::env::args_os()).map_err(|error| match error.kind() {
        // Without any argument the help is printed.
        ErrorKind::DisplayHelp
        | ErrorKind::DisplayVersion
        | ErrorKind::DisplayHelpOnMissingArgumentOrSubcommand => error.exit(),
        _ => {
            stderr_line!("alliance: {}; try --help", one_line(&error.to_string()));
            ExitCode::from(2)
        }
    })
}

/// Parses arguments from a list; the first is the name of the command.
pub fn parse_list<C: Parser>(vocabulary: &Vocabulary, words: &[String]) -> Result<C, String> {
    read(vocabulary, words.iter().map(OsString::from)).map_err(|error| one_line(&error.to_string()))
}

fn read<C: Parser>(
    vocabulary: &Vocabulary,
    words: impl Iterator<Item = OsString>,
) -> Result<C, clap::Error> {
    let command = with_size_options(C::command(), vocabulary);
    C::from_arg_matches_mut(&mut command.try_get_matches_from(words)?)
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
    line
}

#[cfg(test)]
mod tests {
    use clap::{Arg, Command};

    use super::*;

    #[track_caller]
    fn check(arguments: &[&str], expected: &str) {
        let command = Command::new("alliance")
            .arg(
                Arg::new("robot")
                    .long("robot")
                    .value_name("NAME")
                    .required(true),
            )
            .arg(Arg::new("log").long("log").value_parser(["full", "off"]));
        let all = std::iter::once(&"alliance").chain(arguments);
        let error = command.try_get_matches_from(all).unwrap_err();
        assert_eq!(one_line(&error.to_string()), expected);
    }

    #[test]
    fn problem_and_remedy_are_in_one_line() {
        check(
            &[],
            "the following required arguments were not provided: --robot <NAME>",
        );
        check(
            &["--robto=blue"],
            "unexpected argument '--robto' found; tip: a similar argument exists: '--robot'",
        );
        check(&["-5"], "unexpected argument '-5' found");
        check(
            &["--robot=blue", "--log=loud"],
            "invalid value 'loud' for '--log <log>'; [possible values: full, off]",
        );
    }
}
