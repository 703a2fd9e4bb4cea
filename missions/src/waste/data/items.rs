//! Item counts by kind of place.

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ItemCounts {
    /// Items inside an initial spill.
    pub in_spills: u32,
    pub carried: u32,
    pub on_floor: u32,
    pub delivered: u32,
}

impl ItemCounts {
    /// Returns the number of all items. It is constant, except that the fault `waste` adds items.
    #[must_use]
    pub fn total(&self) -> u32 {
        self.in_spills + self.carried + self.on_floor + self.delivered
    }
}
