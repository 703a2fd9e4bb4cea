//! The commands of the program: their number, their examples, manual pages and completions.

use std::collections::BTreeMap;
use std::process::Command as Process;

use clap::{Command, FromArgMatches};
use clap_complete::Shell;

use crate::commands::{self, HEADINGS};
use crate::generate::{completions, man};
use crate::{AllianceCli, full_command};

/// Returns all visible commands below `command` with their words.
fn all<'c>(command: &'c Command, words: &str) -> Vec<(String, &'c Command)> {
    let parts = command.get_subcommands().filter(|part| !part.is_hide_set());
    let below = parts.flat_map(|part| {
        let words = format!("{words} {}", part.get_name());
        all(part, words.trim_start())
    });
    std::iter::once((words.to_owned(), command))
        .chain(below)
        .collect()
}

/// Splits a command line like a shell, up to a redirection.
fn words(line: &str) -> Vec<String> {
    let line = line.split(" > ").next().unwrap();
    let mut words = vec![String::new()];
    let mut quote = None;
    for letter in line.chars() {
        match (letter, quote) {
            ('"' | '\'', None) => quote = Some(letter),
            (_, Some(open)) if letter == open => quote = None,
            (' ', None) => words.push(String::new()),
            _ => words.last_mut().unwrap().push(letter),
        }
    }
    words
}

#[test]
fn there_are_at_most_19_commands_each_below_one_heading() {
    let command = full_command();
    let parts = command.get_subcommands().filter(|part| !part.is_hide_set());
    let names: Vec<&str> = parts.map(Command::get_name).collect();
    terminal::stderr_line!("{}", names.join("\n"));
    let listed: Vec<&str> = HEADINGS
        .iter()
        .flat_map(|(_, names)| *names)
        .copied()
        .collect();
    assert_eq!(names, listed);
    // Problems of other programs come in by `import`: its result is a scenario, so no other command can have it as an option.
    assert!(names.len() <= 19, "{names:?}");
    let help = full_command().render_help().to_string();
    for (heading, names) in HEADINGS {
        let below = help.split(&format!("\n{heading}:\n")).nth(1).unwrap();
        let below = below.split("\n\n").next().unwrap();
        let first: Vec<&str> = below
            .lines()
            .map(|line| line.split_whitespace().next().unwrap())
            .collect();
        assert_eq!(first, *names, "{help}");
    }
    let widest = help.lines().map(|line| line.chars().count()).max();
    assert!(widest <= Some(80), "{help}");
}

#[test]
fn each_help_text_ends_with_examples_that_the_command_accepts() {
    for (name, command) in all(&full_command(), "") {
        let help = command.clone().render_help().to_string();
        let examples = help.split("Examples:\n").nth(1);
        let examples = examples.unwrap_or_else(|| panic!("{name} has no example:\n{help}"));
        let lines: Vec<&str> = examples.lines().map(str::trim).collect();
        assert!((2..=6).contains(&lines.len()), "{name}: {examples}");
        for pair in lines.chunks(2) {
            let [purpose, line] = pair else {
                panic!("{name}: {examples}");
            };
            assert!(purpose.starts_with("# "), "{name}: {purpose}");
            assert!(line.chars().count() <= 78, "{name}: {line}");
            if !name.is_empty() {
                assert!(
                    format!("{line} ").starts_with(&format!("alliance {name} ")),
                    "{name}: {line}"
                );
            }
            let parsed = full_command().try_get_matches_from(words(line));
            let parsed = parsed.and_then(|matches| AllianceCli::from_arg_matches(&matches));
            assert!(parsed.is_ok(), "{line}: {}", parsed.err().unwrap());
        }
    }
}

/// Returns the help text of the command with these words.
fn help(words: &str) -> String {
    let command = full_command();
    let found = all(&command, "")
        .into_iter()
        .find(|(name, _)| name == words);
    found.unwrap().1.clone().render_help().to_string()
}

#[test]
fn help_texts_name_only_formats_that_the_program_contains() {
    for (words, option, is_built_in) in [
        ("export", "--mcap", cfg!(feature = "mcap")),
        ("export", "--rosbag", cfg!(feature = "rosbag")),
        ("run", "--mcap", cfg!(feature = "mcap")),
        ("run", "--ros", cfg!(feature = "ros")),
        ("run", "--foxglove", cfg!(feature = "foxglove")),
    ] {
        let help = help(words);
        assert_eq!(help.contains(option), is_built_in, "{words}:\n{help}");
    }
}

#[test]
fn each_fault_of_a_mission_has_its_own_description() {
    for (name, about) in [
        ("waste", "waste"),
        ("move-waste", "item"),
        ("point", "point"),
        ("bar-stuck", "bar"),
    ] {
        let help = help(&format!("fault {name}"));
        let first = help.lines().next().unwrap();
        assert!(first.to_lowercase().contains(about), "{name}: {first}");
    }
}

#[test]
fn no_two_commands_have_the_same_description() {
    let command = full_command();
    let commands = all(&command, "");
    let mut abouts = BTreeMap::new();
    for (name, command) in commands.iter().skip(1) {
        let about = command.get_about().map(ToString::to_string);
        if let Some(other) = abouts.insert(about.unwrap(), name) {
            panic!("{name} and {other} have the same description");
        }
    }
    assert!(commands.len() > 40, "{}", commands.len());
}

#[test]
fn each_option_has_one_line_of_help() {
    for (name, command) in all(&full_command(), "") {
        assert!(
            command.get_long_about().is_none(),
            "{name}: a description of one line"
        );
        for argument in command
            .get_arguments()
            .filter(|argument| !argument.is_hide_set())
        {
            let id = argument.get_id();
            let help = argument
                .get_help()
                .map(ToString::to_string)
                .unwrap_or_default();
            assert!(
                (5..=100).contains(&help.chars().count()),
                "{name}, {id}: {help}"
            );
            assert!(argument.get_long_help().is_none(), "{name}, {id}");
        }
    }
}

#[test]
fn each_command_has_a_manual_page_with_examples_and_exit_statuses() {
    let folder = tempfile::tempdir().unwrap();
    man::write(full_command(), folder.path()).unwrap();
    let commands = full_command();
    let commands = all(&commands, "");
    for (words, _) in &commands {
        let page = format!("alliance {words}").trim_end().replace(' ', "-");
        let text = std::fs::read_to_string(folder.path().join(format!("{page}.1"))).unwrap();
        for section in [
            "NAME",
            "SYNOPSIS",
            "DESCRIPTION",
            "EXAMPLES",
            "\"EXIT STATUS\"",
            "\"SEE ALSO\"",
        ] {
            assert!(
                text.contains(&format!(".SH {section}\n")),
                "{page} has no {section}:\n{text}"
            );
        }
        assert!(!commands::exit_statuses(words).is_empty(), "{page}");
    }
    assert_eq!(
        std::fs::read_dir(folder.path()).unwrap().count(),
        commands.len()
    );
    let run = std::fs::read_to_string(folder.path().join("alliance-run.1")).unwrap();
    let (_, synopsis) = run.split_once("SYNOPSIS\n").unwrap();
    let synopsis = synopsis.lines().next().unwrap();
    assert!(synopsis.contains("[OPTIONS] [SCENARIO|FILE]"), "{synopsis}");
}

/// Returns what bash offers for the last word.
fn offered(script: &str, words: &[&str]) -> Vec<String> {
    let last = words.len() - 1;
    let previous = words[last.saturating_sub(1)];
    let script = format!(
        "{script}\nCOMP_WORDS=({}) COMP_CWORD={last}\n_alliance alliance '{}' '{previous}'\nprintf '%s\\n' \"${{COMPREPLY[@]}}\"",
        words
            .iter()
            .map(|word| format!("'{word}' "))
            .collect::<String>(),
        words[last]
    );
    // A file, because the script is longer than an argument can be.
    let file = tempfile::NamedTempFile::new().unwrap();
    std::fs::write(file.path(), script).unwrap();
    let output = Process::new("bash")
        .arg("--norc")
        .arg(file.path())
        .output()
        .unwrap();
    let text = String::from_utf8(output.stdout).unwrap();
    text.lines().map(str::to_owned).collect()
}

#[test]
fn bash_completes_commands_and_names() {
    let script = completions::script(Shell::Bash, full_command());
    for (line, expected) in [
        ("wa", "watch"),
        ("run --allocator cb", "cbaa cbba"),
        ("run parker-b", "parker-box"),
        ("fault kill gol", "gold"),
        ("fault drop --from al", "all"),
        ("list missions serv", "service"),
        ("list parker-b", "parker-box"),
        ("cluster agent --robot gree", "green"),
    ] {
        let words: Vec<&str> = ["alliance"].into_iter().chain(line.split(' ')).collect();
        assert_eq!(offered(&script, &words).join(" "), expected, "{line}");
    }
}

#[test]
fn fish_completes_positional_names() {
    let script = completions::script(Shell::Fish, full_command());
    let line = |condition: &str| {
        let start =
            format!("complete -c alliance -n \"__fish_alliance_using_subcommand {condition}\"");
        let mut lines = script.lines().filter_map(|line| line.strip_prefix(&start));
        lines
            .find(|rest| !rest.contains(" -d ") && !rest.contains(" -l "))
            .unwrap_or_default()
            .to_owned()
    };
    let run = line("run");
    assert!(
        run.starts_with(" -a \"waste-cleanup "),
        "files are completed, too: {run}"
    );
    assert!(run.contains(" parker-box "), "{run}");
    let kill = line("fault; and __fish_seen_subcommand_from kill");
    assert!(
        kill.starts_with(" -f -a \"") && kill.contains("gold"),
        "{kill}"
    );
    let missions = line("list; and __fish_seen_subcommand_from missions");
    assert!(missions.contains("service"), "{missions}");
}

#[test]
fn zsh_completes_scenarios_and_files() {
    let script = completions::script(Shell::Zsh, full_command());
    let (_, function) = script.split_once("_alliance_scenarios() {").unwrap();
    let (function, _) = function.split_once('}').unwrap();
    assert!(function.contains("files:file:_files"), "{function}");
    assert!(script.contains(":_alliance_scenarios'"));
}
