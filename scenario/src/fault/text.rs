//! Text form of faults, as on the command line.

use std::fmt::{self, Display, Formatter};

use super::{
    ActuatorMode, Fault, LinkChance, LinkEnd, LinkSelection, Order, SensorError, SensorMode, Side,
};

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
    /// The faults that can target a role.
    pub const ROLE_TARGETED: [&str; 8] = [
        "kill",
        "terminate",
        "pause",
        "remove",
        "mute",
        "deaf",
        "power",
        "babble",
    ];

    /// The names of the faults of every mission.
    pub const COMMON_NAMES: [&str; 24] = [
        "kill",
        "terminate",
        "pause",
        "continue",
        "restart",
        "add",
        "remove",
        "drop",
        "delay",
        "duplicate",
        "reorder",
        "hold",
        "partition",
        "mute",
        "deaf",
        "range",
        "radio",
        "sensor",
        "actuator",
        "skill",
        "power",
        "babble",
        "obstacle",
        "move-robot",
    ];

    /// Returns the name: the command, and the key in JSON and TOML.
    #[must_use]
    pub fn name(&self) -> &str {
        match self {
            Self::Kill(_) => "kill",
            Self::Terminate(_) => "terminate",
            Self::Pause(_) => "pause",
            Self::Continue(_) => "continue",
            Self::Restart(_) => "restart",
            Self::Add(_) => "add",
            Self::Remove(_) => "remove",
            Self::Drop(_) => "drop",
            Self::Delay(_) => "delay",
            Self::Duplicate(_) => "duplicate",
            Self::Reorder(_) => "reorder",
            Self::Hold(_) => "hold",
            Self::Partition(_) => "partition",
            Self::Mute(_) => "mute",
            Self::Deaf(_) => "deaf",
            Self::Range(_) => "range",
            Self::Radio(_) => "radio",
            Self::Sensor(_) => "sensor",
            Self::Actuator(_) => "actuator",
            Self::Skill(_) => "skill",
            Self::Power(_) => "power",
            Self::Babble(_) => "babble",
            Self::Obstacle(_) => "obstacle",
            Self::MoveRobot(_) => "move-robot",
            Self::Mission(fault) => &fault.name,
        }
    }

    /// Returns the robot that the fault targets, if it is a single one.
    #[must_use]
    pub fn robot(&self) -> Option<&str> {
        match self {
            Self::Kill(robot)
            | Self::Terminate(robot)
            | Self::Pause(robot)
            | Self::Continue(robot)
            | Self::Restart(robot)
            | Self::Add(robot)
            | Self::Remove(robot)
            | Self::Mute(robot)
            | Self::Deaf(robot)
            | Self::Power(robot)
            | Self::Babble(robot) => Some(robot),
            Self::Sensor(fault) => Some(&fault.robot),
            Self::Actuator(fault) => Some(&fault.robot),
            Self::Skill(fault) => Some(&fault.robot),
            Self::MoveRobot(fault) => Some(&fault.robot),
            _ => None,
        }
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

    /// Returns the same fault with this robot as its target.
    #[must_use]
    pub fn with_target(&self, name: &str) -> Self {
        let name = name.to_owned();
        match self {
            Self::Kill(_) => Self::Kill(name),
            Self::Terminate(_) => Self::Terminate(name),
            Self::Pause(_) => Self::Pause(name),
            Self::Remove(_) => Self::Remove(name),
            Self::Mute(_) => Self::Mute(name),
            Self::Deaf(_) => Self::Deaf(name),
            Self::Power(_) => Self::Power(name),
            Self::Babble(_) => Self::Babble(name),
            // `check` rejects a role for every other fault.
            other => other.clone(),
        }
    }

    /// Returns true if the fault is instantaneous, so that it has no duration and cannot heal.
    #[must_use]
    pub fn is_instantaneous(&self) -> bool {
        Self::is_instantaneous_name(self.name())
    }

    /// Returns true for the name of an instantaneous fault: a few common ones, and all that a mission defines.
    #[must_use]
    pub fn is_instantaneous_name(name: &str) -> bool {
        matches!(name, "continue" | "restart" | "move-robot") || !Self::COMMON_NAMES.contains(&name)
    }

    /// Returns true if the fault acts on the process of an agent, which only the launcher that started it can do.
    #[must_use]
    pub fn affects_process(&self) -> bool {
        matches!(
            self,
            Self::Kill(_)
                | Self::Terminate(_)
                | Self::Pause(_)
                | Self::Continue(_)
                | Self::Restart(_)
                | Self::Add(_)
                | Self::Remove(_)
        )
    }
}

impl Display for Fault {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())?;
        if let Some(robot) = self.robot() {
            write!(f, " {robot}")?;
        }
        match self {
            Self::Drop(loss) => {
                ends(f, &loss.from, &loss.to)?;
                write!(f, " --p {}", loss.p)?;
                option(f, "burst", loss.burst_s, "s")
            }
            Self::Delay(delay) => {
                ends(f, &delay.from, &delay.to)?;
                write!(f, " --by {}s", delay.delay_s)?;
                option(f, "jitter", delay.jitter_s, "s")
            }
            Self::Duplicate(LinkChance { from, to, p })
            | Self::Reorder(LinkChance { from, to, p }) => {
                ends(f, from, to)?;
                write!(f, " --p {p}")
            }
            Self::Hold(LinkSelection { from, to }) => ends(f, from, to),
            Self::Partition(partition) => {
                for (index, group) in partition.groups.iter().enumerate() {
                    let slash = if index > 0 { "/ " } else { "" };
                    write!(f, " {slash}{}", group.join(","))?;
                }
                f.write_str(if partition.one_way { " --one-way" } else { "" })
            }
            Self::Range(range) => write!(f, " {}", range.range_m),
            Self::Radio(quality) => write!(f, " {}", quality.as_str()),
            Self::Sensor(fault) => write!(f, " {} {}", fault.device.as_str(), fault.mode),
            Self::Actuator(fault) => write!(f, " {}", fault.mode),
            Self::Skill(fault) => write!(f, " {} {}", fault.skill, fault.share),
            Self::Obstacle(rectangle) => {
                let (x, y, w, h) = (
                    rectangle.x_m,
                    rectangle.y_m,
                    rectangle.width_m,
                    rectangle.height_m,
                );
                write!(f, " {x} {y} {w} {h}")?;
                option(f, "penetrability", rectangle.penetrability, "")
            }
            Self::Mission(fault) => write!(f, "{fault}"),
            Self::MoveRobot(moved) => {
                write!(f, " {} {}", moved.x_m, moved.y_m)?;
                match moved.heading_deg {
                    Some(heading_deg) => write!(f, " --heading {heading_deg}"),
                    None => Ok(()),
                }
            }
            _ => Ok(()),
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

fn ends(f: &mut Formatter<'_>, from: &LinkEnd, to: &LinkEnd) -> fmt::Result {
    write!(f, " --from {} --to {}", from.as_str(), to.as_str())
}

/// Writes an option unless it has its default value.
fn option<T: Display + Default + PartialEq>(
    f: &mut Formatter<'_>,
    name: &str,
    value: T,
    unit: &str,
) -> fmt::Result {
    if value == T::default() {
        return Ok(());
    }
    write!(f, " --{name} {value}{unit}")
}

impl Display for SensorMode {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        let sized = |f: &mut Formatter<'_>, name, error: &SensorError| {
            write!(f, "{name} {}", error.m)?;
            option(f, "deg", error.deg, "")
        };
        match self {
            Self::Dead => f.write_str("dead"),
            Self::Stuck => f.write_str("stuck"),
            Self::Noise(error) => sized(f, "noise", error),
            Self::Bias(error) => sized(f, "bias", error),
            Self::Dropout(share) => write!(f, "dropout {share}"),
        }
    }
}

impl Display for ActuatorMode {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        match self {
            Self::Dead => f.write_str("dead"),
            Self::Slowed(share) => write!(f, "slowed {share}"),
            Self::TurnBias(deg_s) => write!(f, "turn-bias {deg_s}"),
            Self::OneWheel(Side::Left) => f.write_str("one-wheel left"),
            Self::OneWheel(Side::Right) => f.write_str("one-wheel right"),
            Self::Gripper => f.write_str("gripper"),
        }
    }
}
