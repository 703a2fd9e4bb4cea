//! What came from outside and changed the run. Scenario + seed + inputs = the run (DESIGN §5).

use crate::fault::Order;
use crate::ids::{Incarnation, Tick};
use crate::process::ProcessAct;
use serde::{Deserialize, Serialize};

/// One line of inputs.jsonl.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct InputLine {
    /// The tick whose course it changed.
    pub tick: Tick,
    /// What happened.
    pub input: Input,
}

/// An event from outside; robots by name. What is `scripted` happened because a fault asked for it: a replay makes it happen
/// again by itself.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Input {
    /// A new agent of the robot takes part from this tick on.
    Join {
        /// The robot.
        robot: String,
        /// Its new incarnation.
        incarnation: Incarnation,
        /// At which moment of the tick; `None`: from its beginning on.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        moment: Option<u32>,
        /// Whether a fault asked for it.
        #[serde(default, skip_serializing_if = "is_false")]
        scripted: bool,
    },
    /// The robot's agent is dead; noticed while this tick's reports were gathered.
    Gone {
        /// The robot.
        robot: String,
        /// The incarnation that ended; 0: the run began without the robot, whose process had ended, or was stopped, before it joined.
        incarnation: Incarnation,
        /// Latest tick in which it counted.
        last_counted: Option<Tick>,
        /// Whether that tick's broadcasts were listed in the team's manifests.
        listed: bool,
        /// At which moment of the tick; `None`: while reports were gathered.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        moment: Option<u32>,
        /// Whether a fault asked for it.
        #[serde(default, skip_serializing_if = "is_false")]
        scripted: bool,
    },
    /// The agent did not answer this tick and is out of the barrier.
    StallBegin {
        /// The robot.
        robot: String,
        /// Whether a fault asked for it.
        #[serde(default, skip_serializing_if = "is_false")]
        scripted: bool,
    },
    /// The agent spoke again and takes part from this tick on.
    StallEnd {
        /// The robot.
        robot: String,
        /// At which moment of the tick; `None`: from its beginning on.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        moment: Option<u32>,
        /// Whether a fault asked for it.
        #[serde(default, skip_serializing_if = "is_false")]
        scripted: bool,
    },
    /// A listed broadcast never arrived, though nobody asked for its loss.
    Lost {
        /// Who did not hear it.
        receiver: String,
        /// Who sent it.
        sender: String,
        /// When.
        sent_tick: Tick,
        /// Which of its sender's broadcasts of that tick.
        index: u16,
    },
    /// An operator ordered a fault; it is armed from the beginning of this tick on.
    Order {
        /// The order, with its id.
        order: Order,
        /// At which moment of the tick; `None`: at its beginning.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        moment: Option<u32>,
    },
    /// An operator cleared faults, before this tick began.
    Clear {
        /// Their ids.
        ids: Vec<String>,
        /// At which moment of the tick; `None`: at its beginning.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        moment: Option<u32>,
    },
    /// What a fault asked for could not be done to a process.
    Failed {
        /// Whose.
        robot: String,
        /// What.
        act: ProcessAct,
        /// How many acts had been asked for in this tick before it.
        #[serde(default)]
        number: Option<u32>,
        /// Why, as told in the log.
        #[serde(default)]
        reason: String,
    },
}

impl Input {
    /// Whether a fault asked for it, so that it happens by itself in a replay.
    #[must_use]
    pub fn is_scripted(&self) -> bool {
        match self {
            Self::Join { scripted, .. }
            | Self::Gone { scripted, .. }
            | Self::StallBegin { scripted, .. }
            | Self::StallEnd { scripted, .. } => *scripted,
            Self::Lost { .. } | Self::Order { .. } | Self::Clear { .. } | Self::Failed { .. } => {
                false
            }
        }
    }

    /// Whether it is what an operator asked for.
    #[must_use]
    pub fn is_command(&self) -> bool {
        matches!(self, Self::Order { .. } | Self::Clear { .. })
    }

    /// At which moment of its tick it happened; `None` where that does not matter.
    #[must_use]
    pub fn moment(&self) -> Option<u32> {
        match self {
            Self::Join { moment, .. }
            | Self::Gone { moment, .. }
            | Self::StallEnd { moment, .. }
            | Self::Order { moment, .. }
            | Self::Clear { moment, .. } => *moment,
            Self::StallBegin { .. } | Self::Lost { .. } | Self::Failed { .. } => None,
        }
    }

    /// The robot it is about, if it is about one.
    #[must_use]
    pub fn robot(&self) -> Option<&str> {
        match self {
            Self::Join { robot, .. }
            | Self::Gone { robot, .. }
            | Self::StallBegin { robot, .. }
            | Self::StallEnd { robot, .. }
            | Self::Failed { robot, .. } => Some(robot),
            Self::Lost { receiver, .. } => Some(receiver),
            Self::Order { .. } | Self::Clear { .. } => None,
        }
    }
}

fn is_false(value: &bool) -> bool {
    !value
}
