//! McNemar's exact test (McNemar 1947) of paired runs with different success.

use statrs::distribution::{Binomial, DiscreteCDF};

/// Returns the p value, given the numbers of pairs in which only the first and only the second run was successful.
#[must_use]
pub fn mcnemar(only_first: u64, only_second: u64) -> f64 {
    // A probability of 0.5 is valid for any number of trials.
    let tail = Binomial::new(0.5, only_first + only_second)
        .map_or(1.0, |coins| coins.cdf(only_first.min(only_second)));
    (2.0 * tail).min(1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn p_values_match_hand_calculation() {
        assert_eq!(mcnemar(0, 0), 1.0);
        assert_eq!(mcnemar(3, 3), 1.0);
        // 2 · 1/32.
        assert!((mcnemar(0, 5) - 0.0625).abs() < 1e-12);
        // 2 · (1 + 10) / 1024.
        assert!((mcnemar(9, 1) - 22.0 / 1024.0).abs() < 1e-12);
    }

    /// Data: Agresti, Categorical Data Analysis, table 10.1: 86 and 150 of 1,600 people changed their opinion; p = 3.7e-5.
    #[test]
    fn prime_minister() {
        let p = mcnemar(86, 150);
        assert!((p - 3.716e-5).abs() < 2e-7, "{p}");
    }
}
