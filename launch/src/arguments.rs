//! The arguments of this process. A mistake in them is answered in one line, like every other mistake.

use std::ffi::OsString;
use std::process::ExitCode;

use alliance_proto::scenario::Vocabulary;
use alliance_proto::tell;
use clap::Parser;
use clap::error::ErrorKind;
use world_server::size::with_size_words;

/// What the arguments say. Beside `--size` there are the words of the missions.
///
/// # Errors
/// The exit status, when everything has been said that there is to say.
pub fn parse<C: Parser>(vocabulary: &Vocabulary) -> Result<C, ExitCode> {
    read(vocabulary, std::env::args_os()).map_err(|error| match error.kind() {
        // Whoever gave no argument at all wants to know what there is.
        ErrorKind::DisplayHelp
        | ErrorKind::DisplayVersion
        | ErrorKind::DisplayHelpOnMissingArgumentOrSubcommand => error.exit(),
        _ => {
            tell!("alliance: {}; try --help", one_line(&error.to_string()));
            ExitCode::from(2)
        }
    })
}

/// The same of words that are no arguments of this process; the first is the command's name.
///
/// # Errors
/// One line.
pub fn parse_words<C: Parser>(vocabulary: &Vocabulary, words: &[String]) -> Result<C, String> {
    read(vocabulary, words.iter().map(OsString::from)).map_err(|error| one_line(&error.to_string()))
}

fn read<C: Parser>(
    vocabulary: &Vocabulary,
    words: impl Iterator<Item = OsString>,
) -> Result<C, clap::Error> {
    let command = with_size_words(C::command(), vocabulary);
    C::from_arg_matches_mut(&mut command.try_get_matches_from(words)?)
}

/// What clap says without the usage, which is for whoever asks for help.
fn one_line(text: &str) -> String {
    let mut line = String::new();
    let said = text
        .lines()
        .map(str::trim)
        .take_while(|said| !said.starts_with("Usage:") && !said.starts_with("For more information"))
        // "-5" where no such option is: that it could be passed on after "--" helps nobody.
        .filter(|said| !said.is_empty() && !said.starts_with("tip: to pass '-"));
    for said in said {
        if !line.is_empty() {
            line += if line.ends_with(':') { " " } else { "; " };
        }
        line += said.strip_prefix("error: ").unwrap_or(said);
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
    fn what_is_wrong_and_what_would_be_right_in_one_line() {
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
