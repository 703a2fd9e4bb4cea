//! The fault subcommands, generated from the declarations of the faults of every mission and of the missions in this
//! program.

use std::borrow::Cow;

use clap::builder::PossibleValuesParser;
use clap::error::ErrorKind;
use clap::{Arg, ArgAction, ArgMatches, Args, Command, Error, FromArgMatches, Subcommand};
use missions::Registry;
use scenario::Problem;
use scenario::fault::{
    ArgumentForm, Device, Fault, FaultArgument, FaultRange, FaultSpec, Order, ValueKind,
};
use scenario::names::ALL;
use scenario::time::seconds;
use toml::{Table, Value};

use super::timing::Timing;

/// A fault with its trigger and duration.
#[derive(Clone, Debug)]
pub struct FaultCommand {
    fault: Result<Fault, Problem>,
    timing: Timing,
}

impl FaultCommand {
    /// Converts the arguments to an order. The world checks names and ranges.
    ///
    /// # Errors
    /// If the size does not fit the mode of a sensor or actuator.
    pub fn into_order(self) -> Result<Order, Problem> {
        Ok(self.timing.order(self.fault?))
    }
}

/// A subcommand of a fault: the fault itself, or one choice of its only argument.
struct FaultForm {
    spec: FaultSpec,
    name: &'static str,
    about: &'static str,
    /// False if the name states the only argument.
    takes_arguments: bool,
}

/// Returns the faults of every mission, with a command for each choice, and then the faults of all missions. Of two
/// faults with the same name only the first is listed; the world selects the right one.
fn forms() -> Vec<FaultForm> {
    let missions = Registry::current().vocabulary().missions;
    let common = Fault::KINDS.into_iter().map(|kind| kind.spec);
    let own = missions
        .iter()
        .flat_map(|mission| mission.vocabulary().faults);
    let mut forms: Vec<FaultForm> = Vec::new();
    for spec in common.chain(own.copied()) {
        if forms.iter().any(|other| other.name == spec.name) {
            continue;
        }
        forms.push(FaultForm {
            spec,
            name: spec.name,
            about: spec.about,
            takes_arguments: true,
        });
        if let [
            FaultArgument {
                range: FaultRange::Choice(choices),
                ..
            },
        ] = spec.arguments
        {
            forms.extend(choices.iter().map(|(name, about)| FaultForm {
                spec,
                name,
                about,
                takes_arguments: false,
            }));
        }
    }
    forms
}

impl Subcommand for FaultCommand {
    fn augment_subcommands(command: Command) -> Command {
        forms().iter().fold(command, |command, form| {
            let mut subcommand = Command::new(form.name).about(sentence(form.about));
            if form.takes_arguments {
                let arguments = form.spec.arguments.iter();
                subcommand = arguments.fold(subcommand, with_argument);
            }
            command.subcommand(Timing::augment_args(subcommand))
        })
    }

    fn augment_subcommands_for_update(command: Command) -> Command {
        Self::augment_subcommands(command)
    }

    fn has_subcommand(name: &str) -> bool {
        forms().iter().any(|form| form.name == name)
    }
}

/// Returns the examples of a fault's command with their effects; none if there is no such command.
pub fn examples_of(name: &str) -> Vec<(Cow<'static, str>, &'static str)> {
    let declared = Fault::KINDS.into_iter().flat_map(|kind| kind.commands);
    let declared = declared.filter(|(line, _)| line.split(' ').next() == Some(name));
    let mut examples: Vec<(Cow<'_, str>, &str)> = declared
        .map(|(line, effect)| (Cow::Owned(format!("alliance fault {line}")), *effect))
        .collect();
    if examples.is_empty() {
        let forms = forms();
        let form = forms.iter().find(|form| form.name == name);
        examples.extend(form.map(|form| (Cow::Owned(example(&form.spec)), "now")));
    }
    examples
}

/// Returns a command line with the required arguments of a mission's fault, all of which accept the number.
fn example(spec: &FaultSpec) -> String {
    let arguments = spec.arguments.iter();
    let required = arguments.filter(|argument| argument.is_required());
    format!(
        "alliance fault {}{}",
        spec.name,
        " 2".repeat(required.count())
    )
}

impl FromArgMatches for FaultCommand {
    fn from_arg_matches(matches: &ArgMatches) -> Result<Self, Error> {
        let missing = || Error::new(ErrorKind::MissingSubcommand);
        let (name, matches) = matches.subcommand().ok_or_else(missing)?;
        let forms = forms();
        let form = forms.iter().find(|form| form.name == name);
        let form = form.ok_or_else(missing)?;
        let values = if form.takes_arguments {
            values(&form.spec, matches)
        } else {
            let key = form.spec.arguments[0].key.to_owned();
            Ok(Table::from_iter([(key, Value::String(name.to_owned()))]))
        };
        let fault = values.and_then(|values| {
            Fault::from_values(form.spec.name, values)
                .map_err(|error| Problem::of_value(error.to_string(), ""))
        });
        Ok(Self {
            fault,
            timing: Timing::from_arg_matches(matches)?,
        })
    }

    fn update_from_arg_matches(&mut self, matches: &ArgMatches) -> Result<(), Error> {
        *self = Self::from_arg_matches(matches)?;
        Ok(())
    }
}

/// Returns the values of the stated arguments and the defaults of numbers.
fn values(spec: &FaultSpec, matches: &ArgMatches) -> Result<Table, Problem> {
    let mut values = Table::new();
    for argument in spec.arguments {
        let text = || value_of::<String>(matches, argument);
        let value = match argument.range.value_kind() {
            ValueKind::Name => text().map(Value::String),
            ValueKind::Number => value_of(matches, argument)
                .or(argument.default)
                .map(Value::Float),
            ValueKind::Groups => {
                let words = matches.get_many::<String>(argument.key);
                Some(groups(words.into_iter().flatten()))
            }
            ValueKind::Flag => {
                let is_stated = matches.get_flag(argument.key);
                Some(Value::Boolean(is_stated != argument.default_flag()))
            }
            ValueKind::Mode(mode) => {
                let size = matches.get_one::<String>(SIZE).map(String::as_str);
                let deg = mode.deg.and_then(|_| matches.get_one::<f64>(DEG).copied());
                Some(mode.parse(&text().unwrap_or_default(), size, deg)?)
            }
        };
        values.extend(value.map(|value| (argument.key.to_owned(), value)));
    }
    Ok(values)
}

/// Parses groups such as `blue,gold / green` from one or several arguments.
fn groups<'a>(arguments: impl Iterator<Item = &'a String>) -> Value {
    let text = arguments.map(String::as_str).collect::<Vec<_>>().join(" ");
    let names = |group: &str| {
        let names = group.split([',', ' ']).filter(|name| !name.is_empty());
        Value::Array(names.map(Value::from).collect())
    };
    Value::Array(text.split('/').map(names).collect())
}

/// Returns the value of an argument that was given by place or by name.
fn value_of<T: Clone + Send + Sync + 'static>(
    matches: &ArgMatches,
    argument: &FaultArgument,
) -> Option<T> {
    let by_place = matches.get_one::<T>(argument.key);
    let by_name = || {
        let id = (argument.form == ArgumentForm::Either).then(|| named(argument))?;
        matches.get_one(&id)
    };
    by_place.or_else(by_name).cloned()
}

/// The id of the size of a mode.
const SIZE: &str = "size";

/// The id of the option for the degrees of a mode.
const DEG: &str = "deg";

/// Adds an argument to a fault command, in its form. An argument with either form has a hidden option, as in the text
/// form of the fault.
fn with_argument(command: Command, argument: &FaultArgument) -> Command {
    let help = sentence(argument.about);
    let value = value(argument, argument.key.to_owned());
    match argument.form {
        ArgumentForm::Either => {
            let by_name = named(argument);
            let by_place = match argument.default {
                Some(_) if argument.range == FaultRange::Name => {
                    value.help(format!("{help} [default: the first]"))
                }
                Some(default) => value.help(format!("{help} [default: {default}]")),
                None => value.required_unless_present(&by_name).help(help),
            };
            let long = argument.key.replace('_', "-");
            command
                .arg(by_place.conflicts_with(&by_name))
                .arg(self::value(argument, by_name).long(long).hide(true))
        }
        ArgumentForm::Position | ArgumentForm::Option(_) | ArgumentForm::Optional(_) => {
            let mut value = value.help(help).required(argument.is_required());
            if let ArgumentForm::Option(name) | ArgumentForm::Optional(name) = argument.form {
                value = value.long(name);
            }
            match (argument.range, argument.default) {
                (FaultRange::From | FaultRange::To, _) => value = value.default_value(ALL),
                (FaultRange::Flag, _) | (_, None) => {}
                (_, Some(default)) => value = value.default_value(default.to_string()),
            }
            let command = command.arg(value);
            match argument.range {
                FaultRange::Mode(mode) => {
                    let size = Arg::new(SIZE).value_name("SIZE").help(mode.size);
                    let command = command.arg(size.allow_negative_numbers(true));
                    match mode.deg {
                        Some(help) => command.arg(
                            Arg::new(DEG)
                                .long(DEG)
                                .value_name("DEGREES")
                                .help(help)
                                .value_parser(clap::value_parser!(f64))
                                .allow_negative_numbers(true),
                        ),
                        None => command,
                    }
                }
                _ => command,
            }
        }
    }
}

/// Returns an argument of the command line with this id that reads the values of a fault's argument.
fn value(argument: &FaultArgument, id: String) -> Arg {
    let (stem, unit) = argument.stem_and_unit();
    let stem = stem.to_uppercase();
    let value = Arg::new(id);
    match argument.range {
        FaultRange::Name | FaultRange::Robot | FaultRange::Skill => value.value_name(stem),
        FaultRange::From | FaultRange::To => value.value_name("ROBOT|all"),
        FaultRange::Groups => value.value_name("ROBOT,ROBOT / ROBOT").num_args(1..),
        FaultRange::Flag => value.action(ArgAction::SetTrue),
        FaultRange::Choice(choices) => {
            let names = choices.iter().map(|(name, _)| *name);
            value
                .value_name(stem)
                .value_parser(PossibleValuesParser::new(names))
        }
        FaultRange::Device => value
            .value_name(stem)
            .value_parser(PossibleValuesParser::new(devices())),
        FaultRange::Mode(mode) => value
            .value_name(stem)
            .value_parser(PossibleValuesParser::new(
                mode.modes.iter().map(|mode| mode.name),
            )),
        FaultRange::Time => value.value_name("TIME").value_parser(seconds),
        FaultRange::X
        | FaultRange::Y
        | FaultRange::Item
        | FaultRange::Whole(..)
        | FaultRange::Within(..)
        | FaultRange::Above(_) => {
            let name = match argument.form {
                ArgumentForm::Option(_) | ArgumentForm::Optional(_) if unit == "degrees" => {
                    "DEGREES".to_owned()
                }
                _ if argument.range == FaultRange::Within(0.0, 1.0) => "SHARE".to_owned(),
                _ => stem,
            };
            value
                .value_name(name)
                .value_parser(clap::value_parser!(f64))
                .allow_negative_numbers(true)
        }
    }
}

/// Returns the devices of all missions of this program.
fn devices() -> Vec<&'static str> {
    let missions = Registry::current().vocabulary().missions;
    let mut names: Vec<&str> = Vec::new();
    for name in missions.into_iter().flat_map(Device::names_for) {
        if !names.contains(&name) {
            names.push(name);
        }
    }
    names
}

fn named(argument: &FaultArgument) -> String {
    format!("{} by name", argument.key)
}

/// Returns the text with a capital letter at its start, as in other help texts.
fn sentence(about: &str) -> String {
    let mut letters = about.chars();
    letters.next().map_or_else(String::new, |first| {
        first.to_uppercase().chain(letters).collect()
    })
}
