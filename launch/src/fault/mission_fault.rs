//! Fault subcommands of missions, generated from the declarations of the missions in this program.

use clap::error::ErrorKind;
use clap::{Arg, ArgMatches, Args, Command, Error, FromArgMatches, Subcommand};
use missions::Registry;
use scenario::fault::{FaultArgument, FaultSpec, MissionFault};

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

impl FromArgMatches for OwnFault {
    fn from_arg_matches(matches: &ArgMatches) -> Result<Self, Error> {
        let missing = || Error::new(ErrorKind::MissingSubcommand);
        let (name, matches) = matches.subcommand().ok_or_else(missing)?;
        let specs = specs();
        let spec = specs.iter().find(|spec| spec.name == name);
        let spec = spec.ok_or_else(missing)?;
        let stated = spec.arguments.iter().filter_map(|argument| {
            let by_place = matches.get_one::<f64>(argument.key);
            let by_name = || matches.try_get_one::<f64>(&named(argument)).ok().flatten();
            let value = by_place.or_else(by_name).copied();
            Some((argument.key.to_owned(), value.or(argument.default)?))
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

/// Adds an argument to a fault command. A required argument is positional, and also an option as in the text form of the fault. An
/// argument with a default is an option only.
fn with_argument(command: Command, argument: &FaultArgument) -> Command {
    let (stem, _) = argument.stem_and_unit();
    let number = |id: String| {
        Arg::new(id)
            .value_name(stem.to_uppercase())
            .value_parser(clap::value_parser!(f64))
            .allow_negative_numbers(true)
    };
    let help = sentence(argument.about);
    match argument.default {
        Some(default) => {
            let help = format!("{help} [default: {default}]");
            command.arg(
                number(argument.key.to_owned())
                    .long(long(argument))
                    .help(help),
            )
        }
        None => {
            let by_name = named(argument);
            let by_place = number(argument.key.to_owned());
            command
                .arg(by_place.required_unless_present(&by_name).help(help))
                .arg(number(by_name).long(long(argument)).hide(true))
        }
    }
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
