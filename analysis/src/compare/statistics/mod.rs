//! Statistical tests and intervals. All p values are two-sided.
//!
//! The crate `puruspe` provides the incomplete gamma and beta functions, `libm` the error function.
//! `tests/missions/statistics.rs` compares all tests with SciPy.

pub mod bootstrap;
pub mod friedman;
pub mod holm;
pub mod mcnemar;
pub mod nemenyi;
pub mod ranks;
pub mod wilcoxon;

/// Returns Φ, the distribution function of the standard normal distribution.
fn normal_cdf(x: f64) -> f64 {
    libm::erfc(-x / std::f64::consts::SQRT_2) / 2.0
}

/// Returns the half-width, in standard deviations, of the central part of a normal distribution that has the probability `level`.
#[must_use]
pub fn normal_reach(level: f64) -> f64 {
    root(0.0, 40.0, |x| 2.0 * normal_cdf(-x) > 1.0 - level)
}

/// Finds the point at which a condition changes that holds at `low` and not at `high`.
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
