//! The faults of every mission, each declared in a file of its own. A new one is registered here: its module, its
//! variant and its place in the list.

mod actuator;
mod add;
mod babble;
mod continue_process;
mod corrupt;
mod deaf;
mod delay;
mod drop;
mod duplicate;
mod hold;
mod kill;
mod move_robot;
mod mute;
mod obstacle;
mod partition;
mod pause;
mod power;
mod radio;
mod range;
mod remove;
mod reorder;
mod restart;
mod sensor;
mod skill;
mod terminate;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::spec::FaultKind;
use super::{LinkChance, LinkSelection, MissionFault};
use crate::Obstacle;

pub use actuator::{ActuatorFault, ActuatorMode, Side};
pub use corrupt::Corruption;
pub use delay::Delay;
pub use drop::Loss;
pub use move_robot::MoveRobot;
pub use partition::Partition;
pub use radio::{LinkQuality, RadioQuality};
pub use range::RangeFault;
pub use sensor::{SensorError, SensorFault, SensorMode};
pub use skill::SkillFault;

/// A failure and its target. Robots are identified by name.
// `form` implements the serialization in files. The binary form contains the position of the variant, so a new one
// comes last.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case", remote = "Self")]
pub enum Fault {
    Kill(String),
    Terminate(String),
    Pause(String),
    Continue(String),
    Restart(String),
    Add(String),
    Remove(String),
    Drop(Loss),
    Delay(Delay),
    Duplicate(LinkChance),
    Reorder(LinkChance),
    Hold(LinkSelection),
    Partition(Partition),
    Mute(String),
    Deaf(String),
    Range(RangeFault),
    Radio(RadioQuality),
    Sensor(SensorFault),
    Actuator(ActuatorFault),
    Power(String),
    Babble(String),
    Obstacle(Obstacle),
    MoveRobot(MoveRobot),
    #[schemars(skip)]
    Mission(MissionFault),
    Skill(SkillFault),
    Corrupt(Corruption),
}

/// The target robot in the content of a fault.
pub(super) trait Target {
    /// Returns the target robot if there is a single one.
    fn robot(&self) -> Option<&str> {
        None
    }

    /// Replaces the target robot. Only faults that take a role need this function.
    fn set_robot(&mut self, _name: &str) {}
}

impl Target for String {
    fn robot(&self) -> Option<&str> {
        Some(self)
    }

    fn set_robot(&mut self, name: &str) {
        name.clone_into(self);
    }
}

impl Target for LinkChance {}
impl Target for LinkSelection {}

macro_rules! kinds {
    ($($variant:ident => $module:ident,)*) => {
        impl Fault {
            /// The declarations of the faults of every mission, in display order.
            pub const KINDS: [&FaultKind; [$(stringify!($variant)),*].len()] =
                [$(&$module::KIND),*];

            /// The names of the faults of every mission.
            pub const COMMON_NAMES: [&str; Self::KINDS.len()] = [$($module::KIND.spec.name),*];

            /// Returns the declaration of the fault; `None` if a mission defines it.
            #[must_use]
            pub fn kind(&self) -> Option<&'static FaultKind> {
                match self {
                    $(Self::$variant(_) => Some(&$module::KIND),)*
                    Self::Mission(_) => None,
                }
            }

            /// Returns the robot that the fault targets, if it is a single one.
            #[must_use]
            pub fn robot(&self) -> Option<&str> {
                match self {
                    $(Self::$variant(content) => content.robot(),)*
                    Self::Mission(_) => None,
                }
            }

            /// Returns the same fault with this robot as its target.
            #[must_use]
            pub fn with_target(&self, name: &str) -> Self {
                let mut fault = self.clone();
                match &mut fault {
                    $(Self::$variant(content) => content.set_robot(name),)*
                    Self::Mission(_) => {}
                }
                fault
            }
        }
    };
}

kinds! {
    Kill => kill,
    Terminate => terminate,
    Pause => pause,
    Continue => continue_process,
    Restart => restart,
    Add => add,
    Remove => remove,
    Drop => drop,
    Delay => delay,
    Duplicate => duplicate,
    Reorder => reorder,
    Corrupt => corrupt,
    Hold => hold,
    Partition => partition,
    Mute => mute,
    Deaf => deaf,
    Range => range,
    Radio => radio,
    Sensor => sensor,
    Actuator => actuator,
    Skill => skill,
    Power => power,
    Babble => babble,
    Obstacle => obstacle,
    MoveRobot => move_robot,
}
