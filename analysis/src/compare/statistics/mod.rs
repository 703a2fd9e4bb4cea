//! Statistical tests and intervals. All p values are two-sided.
//!
//! The crate `statrs` provides the distributions.
//! `tests/missions/statistics.rs` compares all tests with SciPy.

pub mod bootstrap;
pub mod friedman;
pub mod holm;
pub mod mcnemar;
pub mod nemenyi;
pub mod ranks;
pub mod wilcoxon;

use statrs::distribution::{ContinuousCDF, Normal};

/// The level of all intervals.
pub const LEVEL: f64 = 0.95;

/// The p value below which a difference is significant.
pub const SIGNIFICANT: f64 = 0.05;

/// Returns the half-width, in standard deviations, of the central part of a normal distribution that has the probability `level`.
#[must_use]
pub fn normal_reach(level: f64) -> f64 {
    Normal::standard().inverse_cdf(f64::midpoint(1.0, level))
}
