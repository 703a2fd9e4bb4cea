//! Declarations of faults. Checks, the text form, the command line, the page and the documents follow from them.

use super::Fault;
use super::checker::{Checked, Checker};
use crate::Room;
use crate::limits::{NumberRange, TIME_OR_ZERO, above_zero, closed, whole};

/// The declaration of a fault: its name, its effect and its arguments.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FaultSpec {
    /// The name, unique among all faults.
    pub name: &'static str,
    /// The effect in one line.
    pub about: &'static str,
    /// The arguments: required ones first, then optional ones.
    pub arguments: &'static [FaultArgument],
}

impl FaultSpec {
    /// Returns the keys of the fault's place on the floor, x and y, if it has one.
    #[must_use]
    pub fn place(&self) -> Option<[&'static str; 2]> {
        Some([self.key_of(FaultRange::X)?, self.key_of(FaultRange::Y)?])
    }

    /// Returns the key of the fault's item, if it has one.
    #[must_use]
    pub fn item(&self) -> Option<&'static str> {
        self.key_of(FaultRange::Item)
    }

    fn key_of(&self, range: FaultRange) -> Option<&'static str> {
        let mut arguments = self.arguments.iter();
        Some(arguments.find(|argument| argument.range == range)?.key)
    }
}

/// The declaration of a fault of every mission.
#[derive(Clone, Copy, Debug)]
pub struct FaultKind {
    /// The name, the effect and the arguments.
    pub spec: FaultSpec,
    /// The part of the system that the fault affects.
    pub group: FaultGroup,
    /// The effect of healing; `None` if the fault is instantaneous.
    pub healing: Option<&'static str>,
    /// True if a role can replace the name of the target robot.
    pub takes_role: bool,
    /// The checks beyond the ranges of the arguments.
    pub(super) check: fn(&Fault, &Checker<'_>) -> Checked,
    /// Examples in JSON with their effects, for the documents and the tests. They are valid in every mission with the
    /// robots blue, gold, green and the absent robot red.
    pub examples: &'static [(&'static str, &'static str)],
    /// Examples of the command after `alliance fault`, with their effects.
    pub commands: &'static [(&'static str, &'static str)],
}

/// The healing of a fault whose effect ends without a trace.
pub(super) const ENDS: Option<&str> = Some("its effect ends");

impl FaultKind {
    /// A fault of the target robot `robot` as its only argument, with a duration and without further checks.
    pub(super) const OF_ROBOT: Self = Self {
        spec: FaultSpec {
            name: "",
            about: "",
            arguments: &[FaultArgument::ROBOT],
        },
        group: FaultGroup::Process,
        healing: ENDS,
        takes_role: true,
        check: |_, _| Ok(()),
        examples: &[],
        commands: &[],
    };

    /// Returns true if files contain the only argument in place of a table: `{"kill": "gold"}`.
    #[must_use]
    pub(super) fn is_bare(&self) -> bool {
        let names = |range| matches!(range, FaultRange::Robot | FaultRange::Choice(_));
        matches!(self.spec.arguments, [only] if names(only.range))
    }
}

/// The part of the system that a fault affects.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FaultGroup {
    /// The process of an agent. Only the launcher that started it can apply the fault.
    Process,
    /// The delivery of messages between robots.
    Radio,
    /// Sensors, actuators and other properties of a robot.
    Robot,
    /// The bodies and obstacles of the world.
    World,
}

/// An argument of a fault.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FaultArgument {
    /// The key, which ends with the unit.
    pub key: &'static str,
    /// The meaning in one line.
    pub about: &'static str,
    /// The range of allowed values.
    pub range: FaultRange,
    /// The default value; `None` makes the argument required. Of a [name](FaultRange::Name), it is the index of the
    /// default.
    pub default: Option<f64>,
    /// The form on the command line.
    pub form: ArgumentForm,
}

/// The form of an argument on the command line and in texts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ArgumentForm {
    /// A position, or an option named like the key. Texts contain the option.
    Either,
    /// A position after the fault's name.
    Position,
    /// An option with this name. Texts omit the default value.
    Option(&'static str),
    /// An option with this name that may be absent without a default.
    Optional(&'static str),
}

impl FaultArgument {
    /// The name of the target robot.
    pub(super) const ROBOT: Self = Self::at("robot", "Name of the robot", FaultRange::Robot);
    /// The sender of the affected messages.
    pub(super) const FROM: Self =
        Self::at("from", "Sender: a robot or all", FaultRange::From).option("from");
    /// The receiver of the affected messages.
    pub(super) const TO: Self =
        Self::at("to", "Receiver: a robot or all", FaultRange::To).option("to");

    /// Creates an argument from all its fields, with either form.
    #[must_use]
    pub const fn new(
        key: &'static str,
        about: &'static str,
        range: FaultRange,
        default: Option<f64>,
    ) -> Self {
        Self {
            key,
            about,
            range,
            default,
            form: ArgumentForm::Either,
        }
    }

    /// Creates a required argument with a position.
    pub(super) const fn at(key: &'static str, about: &'static str, range: FaultRange) -> Self {
        Self {
            form: ArgumentForm::Position,
            ..Self::new(key, about, range, None)
        }
    }

    /// Returns the argument as an option with this name.
    pub(super) const fn option(self, name: &'static str) -> Self {
        Self {
            form: ArgumentForm::Option(name),
            ..self
        }
    }

    /// Returns the argument with a default value.
    pub(super) const fn default(self, value: f64) -> Self {
        Self {
            default: Some(value),
            ..self
        }
    }

    /// Returns the value of a flag without its option: true if the default value is 1.
    #[must_use]
    pub fn default_flag(&self) -> bool {
        self.default == Some(1.0)
    }

    /// Returns true if the command line requires the argument.
    #[must_use]
    pub fn is_required(&self) -> bool {
        let has_default = matches!(
            self.range,
            FaultRange::From | FaultRange::To | FaultRange::Flag
        );
        let is_optional = matches!(self.form, ArgumentForm::Optional(_));
        self.default.is_none() && !has_default && !is_optional
    }

    /// Returns the range of a number in a room; `None` for other arguments.
    #[must_use]
    pub fn numbers(&self, room: Room) -> Option<NumberRange> {
        let (_, unit) = self.stem_and_unit();
        Some(match self.range {
            FaultRange::X => room.range_x(),
            FaultRange::Y => room.range_y(),
            FaultRange::Item => whole(0, u32::MAX.into(), unit),
            FaultRange::Whole(from, to) => whole(from.into(), to.into(), unit),
            FaultRange::Within(from, to) => closed(from, to, unit),
            FaultRange::Above(to) => above_zero(to, unit),
            FaultRange::Time => TIME_OR_ZERO,
            _ => return None,
        })
    }

    /// The suffixes of keys and their units. A suffix stands before any suffix that it ends with.
    const UNITS: [(&str, &str); 10] = [
        ("_deg_s", "degrees/s"),
        ("_m_s", "m/s"),
        ("_m", "m"),
        ("_ms", "ms"),
        ("_s", "s"),
        ("_deg", "degrees"),
        ("_hz", "Hz"),
        ("_kg", "kg"),
        ("_j", "J"),
        ("_w", "W"),
    ];

    /// Returns the key without its unit, and the unit for display, empty if there is none.
    #[must_use]
    pub fn stem_and_unit(&self) -> (&'static str, &'static str) {
        let mut units = Self::UNITS.iter();
        let found = units.find_map(|(end, unit)| Some((self.key.strip_suffix(end)?, *unit)));
        found.unwrap_or((self.key, ""))
    }
}

/// The allowed range of a fault's argument.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum FaultRange {
    /// An x coordinate inside the border, m.
    X,
    /// A y coordinate inside the border, m.
    Y,
    /// The number of an item: 7 for `item-7` of events.csv.
    Item,
    /// A whole number from the first to the second.
    Whole(u32, u32),
    /// A number from the first to the second.
    Within(f64, f64),
    /// A number above 0, up to this one.
    Above(f64),
    /// A time with a unit on the command line, s.
    Time,
    /// A name of [`MissionData::fault_names`](crate::mission::data::MissionData::fault_names).
    Name,
    /// The name of a robot.
    Robot,
    /// The sender of messages: a robot or all.
    From,
    /// The receiver of messages: a robot or all, but not the sender.
    To,
    /// Groups of robots: `blue,gold / green`.
    Groups,
    /// True or false. Its [option](ArgumentForm::Option) changes the [default](FaultArgument::default_flag).
    Flag,
    /// One of these names, each with its effect. Each name is a command, too.
    Choice(&'static [(&'static str, &'static str)]),
    /// The name of a sensing device.
    Device,
    /// The name of a skill.
    Skill,
    /// A mode of failure with its size.
    Mode(ModeForm),
}

/// The kind of value that an argument has in files, on the command line and on the page.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ValueKind {
    Name,
    Number,
    Groups,
    Flag,
    Mode(ModeForm),
}

impl FaultRange {
    /// The range of a share.
    pub const SHARE: Self = Self::Within(0.0, 1.0);

    /// Returns the kind of the values in the range.
    #[must_use]
    pub const fn value_kind(self) -> ValueKind {
        match self {
            Self::X
            | Self::Y
            | Self::Item
            | Self::Whole(..)
            | Self::Within(..)
            | Self::Above(_)
            | Self::Time => ValueKind::Number,
            Self::Name
            | Self::Robot
            | Self::From
            | Self::To
            | Self::Choice(_)
            | Self::Device
            | Self::Skill => ValueKind::Name,
            Self::Groups => ValueKind::Groups,
            Self::Flag => ValueKind::Flag,
            Self::Mode(form) => ValueKind::Mode(form),
        }
    }
}

/// The modes of failure of a device: a name, possibly a size, and possibly the option `--deg`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ModeForm {
    pub modes: &'static [Mode],
    /// The meaning of the size.
    pub size: &'static str,
    /// The meaning of the option `--deg`, if there is one.
    pub deg: Option<&'static str>,
}

/// A mode of failure.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Mode {
    pub name: &'static str,
    pub size: ModeSize,
    /// The required size in words; empty if there is none.
    pub needs: &'static str,
}

impl Mode {
    /// Creates a mode without a size.
    pub(super) const fn alone(name: &'static str) -> Self {
        Self::new(name, ModeSize::None, "")
    }

    pub(super) const fn new(name: &'static str, size: ModeSize, needs: &'static str) -> Self {
        Self { name, size, needs }
    }
}

/// The size of a mode of failure.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ModeSize {
    None,
    Number(NumberRange),
    /// The error of lengths, and that of a heading after `--deg`. In files it is a table of `m` and `deg`.
    Error {
        m: NumberRange,
        deg: NumberRange,
    },
    /// One of these words.
    Word(&'static [&'static str]),
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn keys_end_with_their_units() {
        let of = |key| FaultArgument::new(key, "", FaultRange::Item, None).stem_and_unit();
        assert_eq!(of("x_m"), ("x", "m"));
        assert_eq!(of("top_speed_m_s"), ("top_speed", "m/s"));
        assert_eq!(of("turn_deg_s"), ("turn", "degrees/s"));
        assert_eq!(of("late_ms"), ("late", "ms"));
        assert_eq!(of("for_s"), ("for", "s"));
        assert_eq!(of("max_robots"), ("max_robots", ""));
    }
}
