//! Fault subcommands of missions, generated from the declarations of the missions in this program.

use clap::error::ErrorKind;
use clap::{Arg, ArgMatches, Args, Command, Error, FromArgMatches, Subcommand};
use missions::Registry;
use scenario::fault::{FaultArgument, FaultRange, FaultSpec, FaultValue, MissionFault};

use super::timing::Timing;

/// A fault of a mission, with its trigger and duration.
#[derive(Clone, Debug)]
pub struct OwnFault {
    pub fault: MissionFault,
    pub timing: Timing,
}

/// Returns the faults of all missions. Of two faults with the same name only the first is listed; the world selects the right one.
fn specs() -> Vec<FaultSpec> {
    let missions = Registry::current().vocabulary().missions;
    let mut specs: Vec<FaultSpec> = Vec::new();
    for spec in missions.iter().flat_map(|mission| mission.faults()) {
        if specs.iter().all(|other| other.name != spec.name) {
            specs.push(*spec);
        }
    }
    specs
}

impl Subcommand for OwnFault {
    fn augment_subcommands(command: Command) -> Command {
        specs().iter().fold(command, |command, spec| {
            let subcommand = Command::new(spec.name).about(sentence(spec.about));
            let subcommand = spec.arguments.iter().fold(subcommand, with_argument);
            command.subcommand(Timing::augment_args(subcommand))
        })
    }

    fn augment_subcommands_for_update(command: Command) -> Command {
        Self::augment_subcommands(command)
    }

    fn has_subcommand(name: &str) -> bool {
        specs().iter().any(|spec| spec.name == name)
    }
}

/// Returns the example of a mission's fault; `None` if no mission has a fault with this name.
pub fn example_of(name: &str) -> Option<String> {
    specs().iter().find(|spec| spec.name == name).map(example)
}

/// Returns a command line with the required arguments of a fault, all of which accept the number.
fn example(spec: &FaultSpec) -> String {
    let required = spec
        .arguments
        .iter()
        .filter(|argument| argument.default.is_none());
    format!(
        "alliance fault {}{}",
        spec.name,
        " 2".repeat(required.count())
    )
}

impl FromArgMatches for OwnFault {
    fn from_arg_matches(matches: &ArgMatches) -> Result<Self, Error> {
        let missing = || Error::new(ErrorKind::MissingSubcommand);
        let (name, matches) = matches.subcommand().ok_or_else(missing)?;
        let specs = specs();
        let spec = specs.iter().find(|spec| spec.name == name);
        let spec = spec.ok_or_else(missing)?;
        let stated = spec.arguments.iter().filter_map(|argument| {
            let value = match argument.range {
                FaultRange::Name => value_of::<String>(matches, argument).map(FaultValue::Name),
                _ => value_of(matches, argument)
                    .or(argument.default)
                    .map(FaultValue::Number),
            };
            Some((argument.key.to_owned(), value?))
        });
        Ok(Self {
            fault: MissionFault {
                name: name.to_owned(),
                values: stated.collect(),
            },
            timing: Timing::from_arg_matches(matches)?,
        })
    }

    fn update_from_arg_matches(&mut self, matches: &ArgMatches) -> Result<(), Error> {
        *self = Self::from_arg_matches(matches)?;
        Ok(())
    }
}

/// Returns the value of an argument that was given by place or by name.
fn value_of<T: Clone + Send + Sync + 'static>(
    matches: &ArgMatches,
    argument: &FaultArgument,
) -> Option<T> {
    let by_place = matches.get_one::<T>(argument.key);
    by_place
        .or_else(|| matches.get_one(&named(argument)))
        .cloned()
}

/// Adds an argument to a fault command. It is positional, and also an option as in the text form of the fault.
fn with_argument(command: Command, argument: &FaultArgument) -> Command {
    let (stem, _) = argument.stem_and_unit();
    let is_name = argument.range == FaultRange::Name;
    let with_id = |id: String| {
        let value = Arg::new(id).value_name(stem.to_uppercase());
        if is_name {
            value.value_parser(clap::value_parser!(String))
        } else {
            value
                .value_parser(clap::value_parser!(f64))
                .allow_negative_numbers(true)
        }
    };
    let help = sentence(argument.about);
    let by_name = named(argument);
    let by_place = with_id(argument.key.to_owned());
    let by_place = match argument.default {
        Some(_) if is_name => by_place.help(format!("{help} [default: the first]")),
        Some(default) => by_place.help(format!("{help} [default: {default}]")),
        None => by_place.required_unless_present(&by_name).help(help),
    };
    command
        .arg(by_place.conflicts_with(&by_name))
        .arg(with_id(by_name).long(long(argument)).hide(true))
}

fn named(argument: &FaultArgument) -> String {
    format!("{} by name", argument.key)
}

fn long(argument: &FaultArgument) -> String {
    argument.key.replace('_', "-")
}

/// Returns the text with a capital letter at its start, as in other help texts.
fn sentence(about: &str) -> String {
    let mut letters = about.chars();
    letters.next().map_or_else(String::new, |first| {
        first.to_uppercase().chain(letters).collect()
    })
}
