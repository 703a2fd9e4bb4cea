//! The table of commands: heading, examples and exit statuses. The arguments are clap types beside the code of each command.
//! Help, manual pages and completion scripts are generated from both.

mod table;
#[cfg(test)]
mod tests;

use std::borrow::Cow;
use std::fmt::Write;

use clap::Command;
use clap::builder::Styles;

use crate::fault;

pub use table::HEADINGS;
use table::{ENTRIES, Entry};

/// Returns the entry of a command; `words` are the words after `alliance`.
fn find(words: &str) -> Option<&'static Entry> {
    ENTRIES.iter().find(|entry| entry.words == words)
}

/// Returns the examples of a command: those of its entry, or those of a fault.
pub fn examples_of(words: &str) -> Vec<(Cow<'static, str>, &'static str)> {
    if let Some(entry) = find(words) {
        let examples = entry.examples.iter();
        return examples
            .filter_map(|example| example.split_once(" # "))
            .map(|(line, purpose)| (Cow::Borrowed(line), purpose))
            .collect();
    }
    words
        .strip_prefix("fault ")
        .map(fault::examples_of)
        .unwrap_or_default()
}

/// Returns the exit statuses of a command, each with its meaning: its own ones, or else those of its parent.
pub fn exit_statuses(words: &str) -> Vec<(&'static str, &'static str)> {
    match (find(words), words.rsplit_once(' ')) {
        (Some(entry), _) if !entry.exit.is_empty() => {
            let lines = entry.exit.iter();
            lines.filter_map(|line| line.split_once(' ')).collect()
        }
        (_, Some((parent, _))) => exit_statuses(parent),
        _ => Vec::new(),
    }
}

/// Completes the help of all commands: headings in the list of commands, and examples.
#[must_use]
pub fn complete(command: Command) -> Command {
    let template = with_headings(&command);
    with_examples(command, "").help_template(template)
}

fn with_examples(command: Command, words: &str) -> Command {
    let examples = examples_of(words);
    let command = match examples.is_empty() {
        true => command,
        false => command.after_help(section(&examples)),
    };
    command.mut_subcommands(|part| {
        let words = format!("{words} {}", part.get_name());
        with_examples(part, words.trim_start())
    })
}

/// Returns the section of a help text with these examples, each below its purpose. A shell ignores the line of the purpose.
fn section(examples: &[(Cow<'_, str>, &str)]) -> String {
    let header = *Styles::default().get_header();
    let mut text = format!("{header}Examples:{header:#}");
    for (line, purpose) in examples {
        // Writing to a String cannot fail.
        let _ = write!(text, "\n  # {purpose}\n  {line}");
    }
    text
}

/// Returns a template for the help of `alliance` that lists the commands below their headings.
fn with_headings(command: &Command) -> String {
    let styles = Styles::default();
    let (header, literal) = (*styles.get_header(), *styles.get_literal());
    let names = HEADINGS.iter().flat_map(|(_, names)| *names);
    let width = names.map(|name| name.len()).max().unwrap_or(0);
    let mut text = "{about-with-newline}\n{usage-heading} {usage}\n".to_owned();
    for (heading, names) in HEADINGS {
        let _ = write!(text, "\n{header}{heading}:{header:#}\n");
        for name in names {
            let found = command.find_subcommand(name).and_then(Command::get_about);
            let about = found.map(ToString::to_string).unwrap_or_default();
            let _ = writeln!(text, "  {literal}{name:width$}{literal:#}  {about}");
        }
    }
    text + &format!("\n{header}Options:{header:#}\n{{options}}{{after-help}}")
}
