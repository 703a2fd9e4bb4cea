//! What is computed of samples; each test in a file of its own. All p values are two-sided.
//!
//! The incomplete gamma and beta functions are those of the crate `puruspe`, the error function that of `libm`.
//! `tests/missions/statistics.rs` compares each with SciPy.

pub mod bootstrap;
pub mod friedman;
pub mod holm;
pub mod mcnemar;
pub mod nemenyi;
pub mod ranks;
pub mod wilcoxon;

/// Φ, the distribution function of the standard normal distribution.
fn normal_cdf(x: f64) -> f64 {
    libm::erfc(-x / std::f64::consts::SQRT_2) / 2.0
}

/// How many standard deviations the middle part of a normal distribution reaches to either side.
#[must_use]
pub fn normal_reach(level: f64) -> f64 {
    root(0.0, 40.0, |x| 2.0 * normal_cdf(-x) > 1.0 - level)
}

/// Where a condition ceases to hold that holds at `low` and not at `high`.
fn root(mut low: f64, mut high: f64, holds: impl Fn(f64) -> bool) -> f64 {
    for _ in 0..60 {
        let middle = f64::midpoint(low, high);
        if holds(middle) {
            low = middle;
        } else {
            high = middle;
        }
    }
    high
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_normal_distribution() {
        for (x, share) in [
            (0.0, 0.5),
            (1.0, 0.841_344_746_068_543),
            (-1.959_963_984_540_054, 0.025),
        ] {
            assert!((normal_cdf(x) - share).abs() < 1e-14);
        }
        assert!((normal_reach(0.95) - 1.959_963_984_540_054).abs() < 1e-12);
        assert!((normal_reach(0.99) - 2.575_829_303_548_901).abs() < 1e-12);
    }
}
