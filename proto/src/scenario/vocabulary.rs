//! What a scenario may speak of beyond the frame.

use super::AllocatorSpec;

/// The allocators that there are: handed in by whoever reads scenarios, as they come from other crates.
#[derive(Clone, Debug, PartialEq)]
pub struct Vocabulary {
    /// In the order in which they are listed to people.
    pub allocators: Vec<AllocatorSpec>,
}

/// Without any but ALLIANCE.
impl Default for Vocabulary {
    fn default() -> Self {
        Self {
            allocators: vec![AllocatorSpec::alliance()],
        }
    }
}
