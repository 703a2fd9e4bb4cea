//! Text form of faults, as on the command line.

use std::fmt::{self, Display, Formatter};

use super::spec::{ArgumentForm, FaultArgument, FaultGroup, FaultKind, FaultRange};
use super::{Fault, Order, modes};
use crate::limits::readable;

/// A role that selects the target of a fault in place of a robot's name. The fault applies to the robot that holds the
/// role when it takes effect.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Role<'a> {
    /// `executing:TASK`: the robot executes this task.
    Executing(&'a str),
    /// `idle`: the robot executes no task.
    Idle,
}

impl Role<'_> {
    /// The prefix of a task's name in the place of a robot.
    const EXECUTING: &'static str = "executing:";

    /// The word for an idle robot.
    pub const IDLE: &'static str = crate::names::IDLE;
}

impl Fault {
    /// Returns the declaration of the fault of every mission with this name.
    #[must_use]
    pub fn kind_named(name: &str) -> Option<&'static FaultKind> {
        Self::KINDS.into_iter().find(|kind| kind.spec.name == name)
    }

    /// Returns the names of the faults that can target a role.
    pub(super) fn role_targeted() -> impl Iterator<Item = &'static str> {
        let kinds = Self::KINDS.into_iter().filter(|kind| kind.takes_role);
        kinds.map(|kind| kind.spec.name)
    }

    /// Returns the name: the command, and the key in JSON and TOML.
    #[must_use]
    pub fn name(&self) -> &str {
        match self {
            Self::Mission(fault) => &fault.name,
            _ => self.kind().map_or("", |kind| kind.spec.name),
        }
    }

    /// Returns the name of the mode of failure, if the fault has one.
    #[must_use]
    pub fn mode(&self) -> Option<String> {
        let is_mode = |argument: &&FaultArgument| matches!(argument.range, FaultRange::Mode(_));
        let argument = self.kind()?.spec.arguments.iter().find(is_mode)?;
        let mode = modes::format(self.values().get(argument.key)?);
        mode.split(' ').next().map(str::to_owned)
    }

    /// Returns the role that the fault targets, if any.
    #[must_use]
    pub fn role(&self) -> Option<Role<'_>> {
        let robot = self.robot()?;
        if robot == Role::IDLE {
            return Some(Role::Idle);
        }
        robot.strip_prefix(Role::EXECUTING).map(Role::Executing)
    }

    /// Returns true if the fault is instantaneous, so that it has no duration and cannot heal.
    #[must_use]
    pub fn is_instantaneous(&self) -> bool {
        self.kind().is_none_or(|kind| kind.healing.is_none())
    }

    /// Returns true for the name of an instantaneous fault: a few common ones, and all that a mission defines.
    #[must_use]
    pub fn is_instantaneous_name(name: &str) -> bool {
        Self::kind_named(name).is_none_or(|kind| kind.healing.is_none())
    }

    /// Returns the part of the system that the fault affects. Faults of missions affect the world.
    #[must_use]
    pub fn group(&self) -> FaultGroup {
        self.kind().map_or(FaultGroup::World, |kind| kind.group)
    }

    /// Returns true if the fault acts on the process of an agent, which only the launcher that started it can do.
    #[must_use]
    pub fn affects_process(&self) -> bool {
        self.group() == FaultGroup::Process
    }

    /// Creates a fault from its name and the values of its arguments, as in a file.
    ///
    /// # Errors
    /// If a value is missing or has a wrong type.
    pub fn from_values(name: &str, mut values: toml::Table) -> Result<Self, toml::de::Error> {
        let bare = Self::kind_named(name)
            .filter(|kind| kind.is_bare())
            .and_then(|kind| values.remove(kind.spec.arguments[0].key));
        let content = bare.unwrap_or(toml::Value::Table(values));
        let fault = toml::Table::from_iter([(name.to_owned(), content)]);
        fault.try_into()
    }

    /// Returns the values of the arguments as in a file, by key.
    #[must_use]
    pub fn values(&self) -> toml::Table {
        let table = toml::Table::try_from(self);
        // A fault is a table with its name as the only key.
        let content = table.ok().and_then(|mut table| table.remove(self.name()));
        match (content, self.kind()) {
            (Some(toml::Value::Table(values)), _) => values,
            (Some(bare), Some(kind)) => {
                toml::Table::from_iter([(kind.spec.arguments[0].key.to_owned(), bare)])
            }
            _ => toml::Table::new(),
        }
    }
}

impl Display for Fault {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())?;
        match self {
            Self::Mission(fault) => write!(f, "{fault}"),
            _ => {
                let mut values = self.values();
                let arguments = self.kind().map_or(&[][..], |kind| kind.spec.arguments);
                arguments
                    .iter()
                    .try_for_each(|argument| match values.remove(argument.key) {
                        Some(value) => argument.write(f, value),
                        None => Ok(()),
                    })
            }
        }
    }
}

impl FaultArgument {
    /// Writes a value as on the command line, unless it is an option with its default value.
    fn write(&self, f: &mut Formatter<'_>, value: toml::Value) -> fmt::Result {
        let number = value.as_float();
        match self.form {
            ArgumentForm::Option(name) if self.range == FaultRange::Flag => {
                let is_set = value == toml::Value::Boolean(!self.default_flag());
                return if is_set {
                    write!(f, " --{name}")
                } else {
                    Ok(())
                };
            }
            ArgumentForm::Option(_) if number.is_some() && number == self.default => return Ok(()),
            ArgumentForm::Option(name) | ArgumentForm::Optional(name) => write!(f, " --{name} ")?,
            ArgumentForm::Either | ArgumentForm::Position => f.write_str(" ")?,
        }
        match (self.range, value) {
            (FaultRange::Time, toml::Value::Float(time_s)) => write!(f, "{}s", readable(time_s)),
            (FaultRange::Mode(_), mode) => f.write_str(&modes::format(&mode)),
            (_, toml::Value::Float(number)) => f.write_str(&readable(number)),
            (_, toml::Value::Array(groups)) => {
                let robots = |group: &toml::Value| {
                    let robots = group.as_array().into_iter().flatten();
                    let robots: Vec<&str> = robots.filter_map(toml::Value::as_str).collect();
                    robots.join(",")
                };
                let groups: Vec<String> = groups.iter().map(robots).collect();
                f.write_str(&groups.join(" / "))
            }
            (_, toml::Value::String(name)) => f.write_str(&name),
            (_, other) => write!(f, "{other}"),
        }
    }
}

/// Formats the order as on the command line, with trigger and duration.
impl Display for Order {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.fault)?;
        let seconds = [
            ("at", self.at_s),
            ("every", self.every_s),
            ("for", self.for_s),
        ];
        for (name, seconds) in seconds {
            if let Some(seconds) = seconds {
                write!(f, " --{name} {seconds}s")?;
            }
        }
        match &self.when {
            Some(when) => write!(f, " --when \"{when}\""),
            None => Ok(()),
        }
    }
}
