//! Claims that a plan states before its first run.

use serde::{Deserialize, Serialize};

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Hypothesis {
    pub name: String,
    #[serde(skip)]
    pub line: usize,
    pub claim: Claim,
}

/// The claim of a hypothesis about each mission and each class of faults that it names. Exactly one of `order`, `at_most` and
/// `at_least` is set.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Claim {
    pub says: String,
    pub metric: Option<String>,
    /// The missions; empty for all.
    pub missions: Vec<String>,
    /// The classes of faults; empty for all.
    pub faults: Vec<String>,
    /// Allocators in ascending order of the metric.
    pub order: Vec<String>,
    /// The allocators that keep the bound; empty for all.
    pub allocators: Vec<String>,
    /// The upper bound of the mean.
    pub at_most: Option<f64>,
    /// The lower bound of the mean.
    pub at_least: Option<f64>,
    /// The class of faults of the baseline. If set, the bound applies to the difference to the same allocator under that class.
    pub more_than_under: Option<String>,
}
