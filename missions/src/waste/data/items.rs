//! Items, counted.

/// How many items are where (mission.csv).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
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
