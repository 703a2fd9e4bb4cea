//! Every fault as a command, in the words in which [`Order`] is printed.

use std::convert::Infallible;

use alliance_proto::fault::{
    ActuatorFault, Chance, Delay, Device, Fault, Link, Loss, MoveRobot, Order, Partition,
    RadioQuality, RangeFault, SensorFault, SkillFault, Who,
};
use alliance_proto::scenario::Obstacle;
use alliance_proto::time::seconds;
use clap::builder::{PossibleValuesParser, TypedValueParser};
use clap::{Args, Subcommand};
use missions::Registry;

use super::modes::{ACTUATOR_MODES, SENSOR_MODES, actuator_mode, sensor_mode};
use super::own::OwnFault;
use super::timing::Timing;

/// A fault with its trigger and duration.
#[derive(Subcommand, Clone, Debug)]
pub enum OrderArgs {
    /// SIGKILL to a robot's process; healed by a restart in a new incarnation
    Kill(Timed<OneRobot>),
    /// SIGTERM to a robot's process; healed by a restart in a new incarnation
    Terminate(Timed<OneRobot>),
    /// SIGSTOP to a robot's process; healed by SIGCONT
    Pause(Timed<OneRobot>),
    /// SIGCONT to a robot's process: ends a pause before its time
    Continue(Timed<OneRobot>),
    /// Start a robot's process in a new incarnation; one that still lives is killed first
    Restart(Timed<OneRobot>),
    /// Bring a robot that the scenario calls absent into the mission
    Add(Timed<OneRobot>),
    /// Take a robot out of the mission: its process and its body
    Remove(Timed<OneRobot>),
    /// Lose messages
    Drop(Timed<LossArgs>),
    /// Let messages come late
    Delay(Timed<DelayArgs>),
    /// Let messages come twice
    Duplicate(Timed<ChanceArgs>),
    /// Let messages be overtaken by the next one of their sender
    Reorder(Timed<ChanceArgs>),
    /// Hold messages back until the fault heals; they then come all at once
    Hold(Timed<Ends>),
    /// Let groups of robots not hear each other
    Partition(Timed<PartitionArgs>),
    /// Let nobody hear a robot
    Mute(Timed<OneRobot>),
    /// Let a robot hear nobody
    Deaf(Timed<OneRobot>),
    /// Let robots that are far apart not hear each other
    Range(Timed<RangeArgs>),
    /// Give all links a named quality
    Radio(Timed<RadioArgs>),
    /// All links: 1 % loss, 20 to 50 ms late
    GoodRadio(Timed<Nothing>),
    /// All links: 15 % loss in bursts, 0.1 to 0.4 s late, 1 % twice
    PoorRadio(Timed<Nothing>),
    /// All links: 40 % loss in long bursts, 0.3 to 1.5 s late, 5 % twice, 5 % overtaken
    SevereRadio(Timed<Nothing>),
    /// Let a sensor fail or lie
    Sensor(Timed<SensorArgs>),
    /// Let a motor or the gripper fail
    Actuator(Timed<ActuatorArgs>),
    /// Let a robot get worse at a skill, without knowing
    Skill(Timed<SkillArgs>),
    /// Take a robot's power: its body obeys nothing
    Power(Timed<OneRobot>),
    /// Let a robot tell its team that it works, and do nothing
    Babble(Timed<OneRobot>),
    /// Put an obstacle, or a patch of slow or fast ground, on the floor
    Obstacle(Timed<ObstacleArgs>),
    /// Put a robot elsewhere
    MoveRobot(Timed<MoveRobotArgs>),
    /// A fault that only a mission knows.
    #[command(flatten)]
    Own(OwnFault),
}

/// A fault's own arguments, with trigger and duration.
#[derive(Args, Clone, Debug)]
pub struct Timed<F: Args> {
    #[command(flatten)]
    fault: F,
    #[command(flatten)]
    timing: Timing,
}

/// Nothing to say.
#[derive(Args, Clone, Copy, Debug)]
pub struct Nothing;

/// A robot and no more.
#[derive(Args, Clone, Debug)]
pub struct OneRobot {
    /// Name of the robot
    robot: String,
}

/// Both ends of links.
#[derive(Args, Clone, Debug)]
pub struct Ends {
    /// Who speaks: a robot, or all
    #[arg(long, value_name = "ROBOT|all", default_value = "all", value_parser = who)]
    from: Who,
    /// Who hears it: a robot, or all
    #[arg(long, value_name = "ROBOT|all", default_value = "all", value_parser = who)]
    to: Who,
}

/// Loss.
#[derive(Args, Clone, Debug)]
pub struct LossArgs {
    #[command(flatten)]
    ends: Ends,
    /// Share of messages that get lost, 0 to 1
    #[arg(long, value_name = "SHARE", allow_negative_numbers = true)]
    p: f64,
    /// Mean length of a burst of losses; 0: each message has its own draws
    #[arg(long = "burst", value_name = "TIME", default_value = "0", value_parser = seconds)]
    burst_s: f64,
}

/// Delay.
#[derive(Args, Clone, Debug)]
pub struct DelayArgs {
    #[command(flatten)]
    ends: Ends,
    /// How late every message comes
    #[arg(long = "by", value_name = "TIME", value_parser = seconds)]
    delay_s: f64,
    /// Up to this much more
    #[arg(long = "jitter", value_name = "TIME", default_value = "0", value_parser = seconds)]
    jitter_s: f64,
}

/// Share of messages.
#[derive(Args, Clone, Debug)]
pub struct ChanceArgs {
    #[command(flatten)]
    ends: Ends,
    /// Share of messages that it befalls, 0 to 1
    #[arg(long, value_name = "SHARE", allow_negative_numbers = true)]
    p: f64,
}

/// Partition.
#[derive(Args, Clone, Debug)]
pub struct PartitionArgs {
    /// Groups with a slash between them, as in: blue,gold / green
    #[arg(required = true, value_name = "ROBOT,ROBOT / ROBOT")]
    groups: Vec<String>,
    /// Later groups still hear earlier ones
    #[arg(long)]
    one_way: bool,
}

/// Radio range.
#[derive(Args, Clone, Copy, Debug)]
pub struct RangeArgs {
    /// Greatest distance, center to center, m
    #[arg(value_name = "METERS", allow_negative_numbers = true)]
    range_m: f32,
}

/// Quality.
#[derive(Args, Clone, Copy, Debug)]
pub struct RadioArgs {
    /// Which one
    #[arg(value_parser = with_shared(RadioQuality::ALL, RadioQuality::as_str))]
    quality: RadioQuality,
}

/// Sensor.
#[derive(Args, Clone, Debug)]
pub struct SensorArgs {
    /// Name of the robot
    robot: String,
    /// Which sensor
    #[arg(value_parser = device())]
    device: Device,
    /// How it fails
    #[arg(value_parser = SENSOR_MODES)]
    mode: String,
    /// Of noise (its standard deviation) and bias: m; of dropout: the share of steps, 0 to 1
    #[arg(value_name = "SIZE", allow_negative_numbers = true)]
    size: Option<String>,
    /// Of noise and bias of the position sensor: the error of the heading, degrees
    #[arg(long, value_name = "DEGREES", allow_negative_numbers = true)]
    deg: Option<f32>,
}

/// Actuator.
#[derive(Args, Clone, Debug)]
pub struct ActuatorArgs {
    /// Name of the robot
    robot: String,
    /// How it fails
    #[arg(value_parser = ACTUATOR_MODES)]
    mode: String,
    /// Of slowed: the share of its speed that is left; of turn-bias: degrees/s; of one-wheel: left or right
    #[arg(value_name = "SIZE", allow_negative_numbers = true)]
    size: Option<String>,
}

/// Skill.
#[derive(Args, Clone, Debug)]
pub struct SkillArgs {
    /// Name of the robot
    robot: String,
    /// What it gets worse at, as the scenario names it
    skill: String,
    /// Share of the skill that is left, 0 to 1
    #[arg(value_name = "SHARE", allow_negative_numbers = true)]
    share: f64,
}

/// A rectangle on the floor.
#[derive(Args, Clone, Copy, Debug)]
pub struct ObstacleArgs {
    /// Lower left corner, m
    #[arg(value_name = "X", allow_negative_numbers = true)]
    x_m: f32,
    /// Lower left corner, m
    #[arg(value_name = "Y", allow_negative_numbers = true)]
    y_m: f32,
    /// Extent in x, m
    #[arg(value_name = "WIDTH", allow_negative_numbers = true)]
    width_m: f32,
    /// Extent in y, m
    #[arg(value_name = "HEIGHT", allow_negative_numbers = true)]
    height_m: f32,
    /// At most 0.1: solid; below 1: slows by that factor; above 1: speeds up
    #[arg(long, default_value_t = 0.0, allow_negative_numbers = true)]
    penetrability: f32,
}

/// A robot elsewhere.
#[derive(Args, Clone, Debug)]
pub struct MoveRobotArgs {
    /// Name of the robot
    robot: String,
    /// Center, m
    #[arg(value_name = "X", allow_negative_numbers = true)]
    x_m: f32,
    /// Center, m
    #[arg(value_name = "Y", allow_negative_numbers = true)]
    y_m: f32,
    /// New heading, degrees counter-clockwise from x [default: as it is]
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

impl OrderArgs {
    /// The order that they stand for; names and ranges are for the world to check.
    ///
    /// # Errors
    /// When a sensor's or actuator's mode and its size do not go together.
    pub fn into_order(self) -> Result<Order, String> {
        let robot = |timed: Timed<OneRobot>, fault: fn(String) -> Fault| {
            timed.order(|one| fault(one.robot))
        };
        let chance = |timed: Timed<ChanceArgs>, fault: fn(Chance) -> Fault| {
            timed.order(|ChanceArgs { ends, p }| {
                let Ends { from, to } = ends;
                fault(Chance { from, to, p })
            })
        };
        let radio = |timed: Timed<Nothing>, quality| timed.order(|_| Fault::Radio(quality));
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
            Self::Hold(timed) => timed.order(|Ends { from, to }| Fault::Hold(Link { from, to })),
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
            Self::Skill(timed) => timed.order(|worse| {
                Fault::Skill(SkillFault {
                    robot: worse.robot,
                    skill: worse.skill,
                    share: worse.share,
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
            Self::Own(own) => own.timing.order(Fault::Mission(own.fault)),
        })
    }
}

/// A robot, or all of them.
fn who(text: &str) -> Result<Who, Infallible> {
    Ok(Who::from(text.to_owned()))
}

/// `blue,gold / green`, in one argument or several.
fn groups(arguments: &[String]) -> Vec<Vec<String>> {
    let text = arguments.join(" ");
    let names = |group: &str| {
        let names = group.split([',', ' ']).filter(|name| !name.is_empty());
        names.map(str::to_owned).collect()
    };
    text.split('/').map(names).collect()
}

/// A device of robots of any mission of this program.
fn device() -> impl TypedValueParser<Value = Device> {
    let missions = Registry::of_this_program().vocabulary().missions;
    let mut names: Vec<&str> = Vec::new();
    for name in missions.into_iter().flat_map(Device::of) {
        if !names.contains(&name) {
            names.push(name);
        }
    }
    PossibleValuesParser::new(names).map(|name| Device::named(&name))
}

/// One of these, by its name.
fn with_shared<T, const N: usize>(
    all: [T; N],
    name: fn(T) -> &'static str,
) -> impl TypedValueParser<Value = T>
where
    T: Copy + Send + Sync + 'static,
{
    PossibleValuesParser::new(all.map(name)).try_map(move |chosen| {
        let found = all.into_iter().find(|each| name(*each) == chosen);
        // Nothing else gets past the possible values.
        found.ok_or("no such value")
    })
}
