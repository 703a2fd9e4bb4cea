//! The result of a search for one allocator, as the page and the tables use it.

use super::task::Allocator;
use super::tuning::Tuned;
use super::verdict::TestComparison;

/// The file name of the scenario with the best parameters.
pub const TUNED: &str = "tuned.toml";

pub struct AllocatorResult<'r> {
    pub allocator: &'r Allocator,
    pub tuned: &'r Tuned,
    pub chosen: usize,
    pub verdicts: [Vec<TestComparison>; 2],
}

impl AllocatorResult<'_> {
    /// Checks whether the tuned values are significantly better than the defaults on the test seeds. Otherwise the defaults are
    /// kept.
    #[must_use]
    pub fn is_better(&self) -> bool {
        self.verdicts[self.chosen][0].is_better()
    }
}
