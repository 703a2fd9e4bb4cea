//! A snapshot of the run for eyes: the progress line, and later the live page (DESIGN §3, key `view`).

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::ids::{Incarnation, SetId, Tick};
use crate::readings::Pose;
use crate::time::SimTime;

/// What an observer sees.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct View {
    /// Latest finished tick.
    pub tick: Tick,
    /// Its simulated time.
    pub now: SimTime,
    /// Where the items are.
    pub items: ItemCounts,
    /// One entry per robot, by rank.
    pub robots: Vec<RobotView>,
}

/// How many items are where (mission.csv).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct ItemCounts {
    /// Inside an initial spill.
    pub in_spills: u32,
    /// In a gripper.
    pub carried: u32,
    /// Elsewhere on the floor.
    pub on_floor: u32,
    /// In the deposit.
    pub delivered: u32,
}

impl ItemCounts {
    /// All items: none is ever lost or doubled, and only the fault `waste` adds any.
    #[must_use]
    pub fn total(&self) -> u32 {
        self.in_spills + self.carried + self.on_floor + self.delivered
    }
}

/// One robot.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RobotView {
    /// Where it is.
    pub pose: Pose,
    /// Active behavior set.
    pub active: Option<SetId>,
    /// Whether it carries an item.
    pub carrying: bool,
    /// Life of its agent, if it has one that is alive.
    pub incarnation: Option<Incarnation>,
    /// Whether its agent takes part in the barrier now.
    pub in_barrier: bool,
}
