//! The fault subcommands. Their syntax is the text form of [`Order`].

use std::convert::Infallible;

use clap::builder::{PossibleValuesParser, TypedValueParser};
use clap::{Args, Subcommand};
use missions::Registry;
use scenario::Obstacle;
use scenario::fault::{
    ActuatorFault, Delay, Device, Fault, LinkChance, LinkEnd, LinkSelection, Loss, MoveRobot,
    Order, Partition, RadioQuality, RangeFault, SensorFault, SkillFault,
};
use scenario::time::seconds;

use super::mission_fault::OwnFault;
use super::modes::{ACTUATOR_MODES, SENSOR_MODES, actuator_mode, sensor_mode};
use super::timing::Timing;

#[derive(Subcommand, Clone, Debug)]
pub enum FaultCommand {
    /// Send SIGKILL to a robot's process; cleared by a restart in a new incarnation
    Kill(Timed<OneRobot>),
    /// Send SIGTERM to a robot's process; cleared by a restart in a new incarnation
    Terminate(Timed<OneRobot>),
    /// Send SIGSTOP to a robot's process; cleared by SIGCONT
    Pause(Timed<OneRobot>),
    /// Send SIGCONT to a robot's process, to end a pause early
    Continue(Timed<OneRobot>),
    /// Start a robot's process in a new incarnation; a running process is killed first
    Restart(Timed<OneRobot>),
    /// Add a robot that is absent in the scenario to the mission
    Add(Timed<OneRobot>),
    /// Remove a robot's process and body from the mission
    Remove(Timed<OneRobot>),
    /// Drop a share of messages
    Drop(Timed<LossArgs>),
    /// Delay the messages of a link
    Delay(Timed<DelayArgs>),
    /// Deliver a share of messages twice
    Duplicate(Timed<ChanceArgs>),
    /// Deliver a share of messages after the next message of the same sender
    Reorder(Timed<ChanceArgs>),
    /// Hold messages back until the fault ends, then deliver them all at once
    Hold(Timed<LinkEnds>),
    /// Block messages between groups of robots
    Partition(Timed<PartitionArgs>),
    /// Drop all messages from a robot
    Mute(Timed<OneRobot>),
    /// Drop all messages to a robot
    Deaf(Timed<OneRobot>),
    /// Limit the radio range
    Range(Timed<RangeArgs>),
    /// Set the quality of all links by name
    Radio(Timed<RadioArgs>),
    /// Set all links to 1 % loss and 20 to 50 ms delay
    GoodRadio(Timed<NoArguments>),
    /// Set all links to 15 % loss in bursts, 0.1 to 0.4 s delay, 1 % duplicates
    PoorRadio(Timed<NoArguments>),
    /// Set all links to 40 % loss in long bursts, 0.3 to 1.5 s delay, 5 % duplicates, 5 % reordered
    SevereRadio(Timed<NoArguments>),
    /// Make a sensor fail or return wrong readings
    Sensor(Timed<SensorArgs>),
    /// Make a motor or the gripper fail
    Actuator(Timed<ActuatorArgs>),
    /// Reduce a skill of a robot without informing its controller
    Skill(Timed<SkillArgs>),
    /// Turn off the power of a robot's body, which then ignores all commands
    Power(Timed<OneRobot>),
    /// Make a robot broadcast that it works while it does nothing
    Babble(Timed<OneRobot>),
    /// Place an obstacle, or an area of slow or fast ground
    Obstacle(Timed<ObstacleArgs>),
    /// Move a robot to another position
    MoveRobot(Timed<MoveRobotArgs>),
    /// A fault that a mission declares.
    #[command(flatten)]
    Own(OwnFault),
}

#[derive(Args, Clone, Debug)]
pub struct Timed<F: Args> {
    #[command(flatten)]
    fault: F,
    #[command(flatten)]
    timing: Timing,
}

#[derive(Args, Clone, Copy, Debug)]
pub struct NoArguments;

#[derive(Args, Clone, Debug)]
pub struct OneRobot {
    /// Name of the robot
    #[arg(value_name = "ROBOT")]
    robot: String,
}

#[derive(Args, Clone, Debug)]
pub struct LinkEnds {
    /// Sender: a robot or all
    #[arg(long, value_name = "ROBOT|all", default_value = "all", value_parser = parse_end)]
    from: LinkEnd,
    /// Receiver: a robot or all
    #[arg(long, value_name = "ROBOT|all", default_value = "all", value_parser = parse_end)]
    to: LinkEnd,
}

#[derive(Args, Clone, Debug)]
pub struct LossArgs {
    #[command(flatten)]
    ends: LinkEnds,
    /// Share of messages that are lost, 0 to 1
    #[arg(long, value_name = "SHARE", allow_negative_numbers = true)]
    p: f64,
    /// Mean length of a burst of losses; 0 for independent losses
    #[arg(long = "burst", value_name = "TIME", default_value = "0", value_parser = seconds)]
    burst_s: f64,
}

#[derive(Args, Clone, Debug)]
pub struct DelayArgs {
    #[command(flatten)]
    ends: LinkEnds,
    /// Delay of every message
    #[arg(long = "by", value_name = "TIME", value_parser = seconds)]
    delay_s: f64,
    /// Maximum additional random delay
    #[arg(long = "jitter", value_name = "TIME", default_value = "0", value_parser = seconds)]
    jitter_s: f64,
}

#[derive(Args, Clone, Debug)]
pub struct ChanceArgs {
    #[command(flatten)]
    ends: LinkEnds,
    /// Share of messages that are affected, 0 to 1
    #[arg(long, value_name = "SHARE", allow_negative_numbers = true)]
    p: f64,
}

#[derive(Args, Clone, Debug)]
pub struct PartitionArgs {
    /// Groups separated by a slash, as in: blue,gold / green
    #[arg(required = true, value_name = "ROBOT,ROBOT / ROBOT")]
    groups: Vec<String>,
    /// Let later groups still receive messages of earlier groups
    #[arg(long)]
    one_way: bool,
}

#[derive(Args, Clone, Copy, Debug)]
pub struct RangeArgs {
    /// Maximum distance between the robots' centers, m
    #[arg(value_name = "METERS", allow_negative_numbers = true)]
    range_m: f32,
}

#[derive(Args, Clone, Copy, Debug)]
pub struct RadioArgs {
    /// Name of the quality
    #[arg(value_parser = with_shared(RadioQuality::ALL, RadioQuality::as_str))]
    quality: RadioQuality,
}

#[derive(Args, Clone, Debug)]
pub struct SensorArgs {
    /// Name of the robot
    #[arg(value_name = "ROBOT")]
    robot: String,
    /// Name of the sensor
    #[arg(value_parser = device())]
    device: Device,
    /// Failure mode, such as dead or stuck
    #[arg(value_parser = SENSOR_MODES)]
    mode: String,
    /// Size: for noise (standard deviation) and bias in m; for dropout the share of steps, 0 to 1
    #[arg(value_name = "SIZE", allow_negative_numbers = true)]
    size: Option<String>,
    /// Heading error for noise and bias of the position sensor, degrees
    #[arg(long, value_name = "DEGREES", allow_negative_numbers = true)]
    deg: Option<f32>,
}

#[derive(Args, Clone, Debug)]
pub struct ActuatorArgs {
    /// Name of the robot
    #[arg(value_name = "ROBOT")]
    robot: String,
    /// Failure mode, such as dead or slowed
    #[arg(value_parser = ACTUATOR_MODES)]
    mode: String,
    /// Size: slowed: remaining share of the speed; turn-bias: degrees/s; one-wheel: left or right
    #[arg(value_name = "SIZE", allow_negative_numbers = true)]
    size: Option<String>,
}

#[derive(Args, Clone, Debug)]
pub struct SkillArgs {
    /// Name of the robot
    #[arg(value_name = "ROBOT")]
    robot: String,
    /// Name of the skill in the scenario
    skill: String,
    /// Remaining share of the skill, 0 to 1
    #[arg(value_name = "SHARE", allow_negative_numbers = true)]
    share: f64,
}

#[derive(Args, Clone, Copy, Debug)]
pub struct ObstacleArgs {
    /// Lower left corner: x, m
    #[arg(value_name = "X", allow_negative_numbers = true)]
    x_m: f32,
    /// Lower left corner: y, m
    #[arg(value_name = "Y", allow_negative_numbers = true)]
    y_m: f32,
    /// Extent in x, m
    #[arg(value_name = "WIDTH", allow_negative_numbers = true)]
    width_m: f32,
    /// Extent in y, m
    #[arg(value_name = "HEIGHT", allow_negative_numbers = true)]
    height_m: f32,
    /// Speed factor on the rectangle: solid up to 0.1, slower below 1, faster above 1
    #[arg(long, default_value_t = 0.0, allow_negative_numbers = true)]
    penetrability: f32,
}

#[derive(Args, Clone, Debug)]
pub struct MoveRobotArgs {
    /// Name of the robot
    #[arg(value_name = "ROBOT")]
    robot: String,
    /// New center: x, m
    #[arg(value_name = "X", allow_negative_numbers = true)]
    x_m: f32,
    /// New center: y, m
    #[arg(value_name = "Y", allow_negative_numbers = true)]
    y_m: f32,
    /// New heading, degrees counter-clockwise from the x axis [default: unchanged]
    #[arg(
        long = "heading",
        value_name = "DEGREES",
        allow_negative_numbers = true
    )]
    heading_deg: Option<f32>,
}

impl<F: Args> Timed<F> {
    fn order(self, fault: impl FnOnce(F) -> Fault) -> Order {
        self.timing.order(fault(self.fault))
    }

    fn try_order(self, fault: impl FnOnce(&F) -> Result<Fault, String>) -> Result<Order, String> {
        let fault = fault(&self.fault)?;
        Ok(self.order(|_| fault))
    }
}

impl FaultCommand {
    /// Converts the arguments to an order. The world checks names and ranges.
    ///
    /// # Errors
    /// If the size does not fit the mode of a sensor or actuator.
    pub fn into_order(self) -> Result<Order, String> {
        let robot = |timed: Timed<OneRobot>, fault: fn(String) -> Fault| {
            timed.order(|one| fault(one.robot))
        };
        let chance = |timed: Timed<ChanceArgs>, fault: fn(LinkChance) -> Fault| {
            timed.order(|ChanceArgs { ends, p }| {
                let LinkEnds { from, to } = ends;
                fault(LinkChance { from, to, p })
            })
        };
        let radio = |timed: Timed<NoArguments>, quality| timed.order(|_| Fault::Radio(quality));
        Ok(match self {
            Self::Kill(timed) => robot(timed, Fault::Kill),
            Self::Terminate(timed) => robot(timed, Fault::Terminate),
            Self::Pause(timed) => robot(timed, Fault::Pause),
            Self::Continue(timed) => robot(timed, Fault::Continue),
            Self::Restart(timed) => robot(timed, Fault::Restart),
            Self::Add(timed) => robot(timed, Fault::Add),
            Self::Remove(timed) => robot(timed, Fault::Remove),
            Self::Mute(timed) => robot(timed, Fault::Mute),
            Self::Deaf(timed) => robot(timed, Fault::Deaf),
            Self::Power(timed) => robot(timed, Fault::Power),
            Self::Babble(timed) => robot(timed, Fault::Babble),
            Self::Drop(timed) => timed.order(|loss| {
                Fault::Drop(Loss {
                    from: loss.ends.from,
                    to: loss.ends.to,
                    p: loss.p,
                    burst_s: loss.burst_s,
                })
            }),
            Self::Delay(timed) => timed.order(|delay| {
                Fault::Delay(Delay {
                    from: delay.ends.from,
                    to: delay.ends.to,
                    delay_s: delay.delay_s,
                    jitter_s: delay.jitter_s,
                })
            }),
            Self::Duplicate(timed) => chance(timed, Fault::Duplicate),
            Self::Reorder(timed) => chance(timed, Fault::Reorder),
            Self::Hold(timed) => {
                timed.order(|LinkEnds { from, to }| Fault::Hold(LinkSelection { from, to }))
            }
            Self::Partition(timed) => timed.order(|partition| {
                Fault::Partition(Partition {
                    groups: groups(&partition.groups),
                    one_way: partition.one_way,
                })
            }),
            Self::Range(timed) => timed.order(|range| {
                Fault::Range(RangeFault {
                    range_m: range.range_m,
                })
            }),
            Self::Radio(timed) => timed.order(|radio| Fault::Radio(radio.quality)),
            Self::GoodRadio(timed) => radio(timed, RadioQuality::GoodRadio),
            Self::PoorRadio(timed) => radio(timed, RadioQuality::PoorRadio),
            Self::SevereRadio(timed) => radio(timed, RadioQuality::SevereRadio),
            Self::Sensor(timed) => timed.try_order(|sensor| {
                Ok(Fault::Sensor(SensorFault {
                    robot: sensor.robot.clone(),
                    device: sensor.device,
                    mode: sensor_mode(&sensor.mode, sensor.size.as_deref(), sensor.deg)?,
                }))
            })?,
            Self::Actuator(timed) => timed.try_order(|actuator| {
                Ok(Fault::Actuator(ActuatorFault {
                    robot: actuator.robot.clone(),
                    mode: actuator_mode(&actuator.mode, actuator.size.as_deref())?,
                }))
            })?,
            Self::Skill(timed) => timed.order(|skill| {
                Fault::Skill(SkillFault {
                    robot: skill.robot,
                    skill: skill.skill,
                    share: skill.share,
                })
            }),
            Self::Obstacle(timed) => timed.order(|rectangle| {
                Fault::Obstacle(Obstacle {
                    x_m: rectangle.x_m,
                    y_m: rectangle.y_m,
                    width_m: rectangle.width_m,
                    height_m: rectangle.height_m,
                    penetrability: rectangle.penetrability,
                })
            }),
            Self::MoveRobot(timed) => timed.order(|moved| {
                Fault::MoveRobot(MoveRobot {
                    robot: moved.robot,
                    x_m: moved.x_m,
                    y_m: moved.y_m,
                    heading_deg: moved.heading_deg,
                })
            }),
            Self::Own(command) => command.timing.order(Fault::Mission(command.fault)),
        })
    }
}

/// Parses the name of a robot, or `all`.
fn parse_end(text: &str) -> Result<LinkEnd, Infallible> {
    Ok(LinkEnd::from(text.to_owned()))
}

/// Parses groups such as `blue,gold / green` from one or several arguments.
fn groups(arguments: &[String]) -> Vec<Vec<String>> {
    let text = arguments.join(" ");
    let names = |group: &str| {
        let names = group.split([',', ' ']).filter(|name| !name.is_empty());
        names.map(str::to_owned).collect()
    };
    text.split('/').map(names).collect()
}

/// Returns a parser for the devices of all missions of this program.
fn device() -> impl TypedValueParser<Value = Device> {
    let missions = Registry::current().vocabulary().missions;
    let mut names: Vec<&str> = Vec::new();
    for name in missions.into_iter().flat_map(Device::names_for) {
        if !names.contains(&name) {
            names.push(name);
        }
    }
    PossibleValuesParser::new(names).map(|name| Device::new(&name))
}

/// Returns a parser for one of these values by name.
fn with_shared<T, const N: usize>(
    all: [T; N],
    name: fn(T) -> &'static str,
) -> impl TypedValueParser<Value = T>
where
    T: Copy + Send + Sync + 'static,
{
    PossibleValuesParser::new(all.map(name)).try_map(move |chosen| {
        let found = all.into_iter().find(|each| name(*each) == chosen);
        // Other names have been refused by the possible values.
        found.ok_or("no such value")
    })
}
