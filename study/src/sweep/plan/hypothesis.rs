//! What is claimed before anything runs.

use serde::{Deserialize, Serialize};

/// A hypothesis of a plan.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Hypothesis {
    /// Its name.
    pub name: String,
    /// Where the file has it. Only whoever checks it needs that.
    #[serde(skip)]
    pub line: usize,
    /// What it claims.
    pub claim: Claim,
}

/// What a hypothesis claims, of each mission and each class of faults that it names. One of `order`, `at_most` and `at_least` is
/// there.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Claim {
    /// The same in words.
    pub says: String,
    /// What is compared.
    pub metric: Option<String>,
    /// In which missions; empty: in all.
    pub missions: Vec<String>,
    /// Under which faults; empty: under all.
    pub faults: Vec<String>,
    /// Allocators, each with less than the next.
    pub order: Vec<String>,
    /// Allocators that each keep a bound; empty: all.
    pub allocators: Vec<String>,
    /// The mean is at most so much.
    pub at_most: Option<f64>,
    /// The mean is at least so much.
    pub at_least: Option<f64>,
    /// The bound is one of the difference to the same allocator under these faults.
    pub more_than_under: Option<String>,
}
