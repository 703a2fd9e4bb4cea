//! Completion scripts with the names of scenarios, allocators, missions and robots of this program.

use std::collections::BTreeSet;

use clap::Command;
use clap::builder::PossibleValuesParser;
use clap_complete::{Shell, generate};
use missions::Registry;
use scenario::{Scenario, Vocabulary};

/// The value names of arguments that accept the name of a built-in scenario or a file.
const SCENARIO_OR_FILE: &str = "SCENARIO|FILE";

/// The function of the zsh script that completes scenarios and files.
const ZSH_SCENARIOS: &str = "_alliance_scenarios";

/// Returns the completion script of the complete `command`.
pub fn script(shell: Shell, command: Command) -> String {
    let vocabulary = Registry::current().vocabulary();
    let mut script = Vec::new();
    let name = command.get_name().to_owned();
    let mut command = with_names(command, &vocabulary);
    generate(shell, &mut command, name, &mut script);
    let script = String::from_utf8_lossy(&script).into_owned();
    match shell {
        Shell::Fish => script + &positional_names(&command, command.get_name(), &[]),
        Shell::Zsh => with_files(&script, &names("SCENARIO", &vocabulary)),
        _ => script,
    }
}

/// Attaches the known names to arguments, found by their value names. This is for completion only: parsing accepts other
/// values, such as files, and reports unknown names with a suggestion.
fn with_names(command: Command, vocabulary: &Vocabulary) -> Command {
    let command = command.mut_args(|argument| {
        let value = argument.get_value_names().and_then(|names| names.first());
        let names = value.map_or_else(Vec::new, |value| names(value, vocabulary));
        match names.is_empty() {
            true => argument,
            false => argument.value_parser(PossibleValuesParser::new(names)),
        }
    });
    command.mut_subcommands(|part| with_names(part, vocabulary))
}

/// Returns the known values of an argument with this value name, which may be several joined by `|`.
fn names(value: &str, vocabulary: &Vocabulary) -> Vec<String> {
    let names = |all: &mut dyn Iterator<Item = &'static str>| all.map(str::to_owned).collect();
    let parts = value.split('|').flat_map(|part| match part {
        "SCENARIO" => names(&mut vocabulary.builtins().map(|built_in| built_in.name)),
        "ALLOCATOR" => names(&mut vocabulary.allocators.iter().map(|spec| spec.name)),
        "MISSION" => names(&mut vocabulary.missions.iter().map(|mission| mission.name())),
        "ROBOT" => robots(vocabulary).into_iter().collect(),
        "all" => vec!["all".to_owned()],
        _ => Vec::new(),
    });
    parts.collect()
}

/// Returns the robots of all built-in scenarios.
fn robots(vocabulary: &Vocabulary) -> BTreeSet<String> {
    let scenarios = vocabulary.builtins();
    let scenarios = scenarios
        .filter_map(|built_in| Scenario::parse(built_in.name, built_in.text, vocabulary).ok());
    scenarios
        .flat_map(|scenario| scenario.robots.into_iter().map(|robot| robot.name))
        .collect()
}

/// Returns the lines of a fish script that complete positional arguments of a command and its subcommands. The
/// generator completes options only. `parents` are the commands before it, from the program's first.
fn positional_names(command: &Command, program: &str, parents: &[&str]) -> String {
    let condition = match parents {
        [] => String::new(),
        [first] => format!("__fish_{program}_using_subcommand {first}"),
        [first, .., last] => format!(
            "__fish_{program}_using_subcommand {first}; and __fish_seen_subcommand_from {last}"
        ),
    };
    let mut lines = String::new();
    for argument in command.get_positionals() {
        let values = argument.get_possible_values();
        let names: Vec<&str> = values.iter().map(|value| value.get_name()).collect();
        if !names.is_empty() {
            let value = argument.get_value_names().and_then(|names| names.first());
            let is_file = value.is_some_and(|name| name.as_str() == SCENARIO_OR_FILE);
            let without_files = if is_file { "" } else { " -f" };
            let names = names.join(" ");
            lines += &format!(
                "complete -c {program} -n \"{condition}\"{without_files} -a \"{names}\"\n"
            );
        }
    }
    for part in command.get_subcommands() {
        let path: Vec<&str> = parents.iter().copied().chain([part.get_name()]).collect();
        lines += &positional_names(part, program, &path);
    }
    lines
}

/// Extends a zsh script: arguments that accept a scenario also complete files. Bash does so by itself.
fn with_files(script: &str, scenarios: &[String]) -> String {
    let names = format!("({})", scenarios.join(" "));
    let function = format!(
        "{ZSH_SCENARIOS}() {{\n    _alternative 'scenarios:scenario:{names}' 'files:file:_files'\n}}\n\n"
    );
    let script = script.replace(&format!(":{names}'"), &format!(":{ZSH_SCENARIOS}'"));
    script.replacen("_alliance() {", &format!("{function}_alliance() {{"), 1)
}
