//! What a scenario may speak of beyond the frame.

use super::AllocatorSpec;
use crate::mission::data::Mission;
use crate::mission::waste_data::WASTE;

/// The missions and allocators that there are: handed in by whoever reads scenarios, as they come from other crates.
#[derive(Clone, Debug, PartialEq)]
pub struct Vocabulary {
    /// In the order in which they are listed to people; a scenario without a mission's section is one of the first.
    pub missions: Vec<Mission>,
    /// In the order in which they are listed to people.
    pub allocators: Vec<AllocatorSpec>,
}

/// The waste clean-up and ALLIANCE.
impl Default for Vocabulary {
    fn default() -> Self {
        Self {
            missions: vec![WASTE],
            allocators: vec![AllocatorSpec::alliance()],
        }
    }
}
