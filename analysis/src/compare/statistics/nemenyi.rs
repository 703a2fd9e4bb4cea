//! Nemenyi's test (Nemenyi 1963) of pairwise differences of mean ranks after Friedman's test (Demšar 2006). It uses the
//! studentized range of k normal variables with infinitely many degrees of freedom.

use std::f64::consts::SQRT_2;

use statrs::distribution::{Continuous, ContinuousCDF, Normal};

/// The number of steps of Simpson's rule. The integrand is smooth; more steps change only digits after the twelfth.
const STEPS: usize = 600;

/// The integration limit in standard deviations. The density beyond it is negligible.
const FAR: f64 = 9.0;

/// Returns the critical difference of two mean ranks of k treatments over n blocks: CD = q √(k(k+1) / 6n).
#[must_use]
pub fn critical_difference(level: f64, treatments: usize, blocks: usize) -> f64 {
    quantile(level, treatments) * unit(treatments, blocks)
}

/// Returns the p value of a difference of two mean ranks.
#[must_use]
pub fn nemenyi(difference: f64, treatments: usize, blocks: usize) -> f64 {
    let range = difference.abs() / unit(treatments, blocks) * SQRT_2;
    (1.0 - range_cdf(range, treatments)).clamp(0.0, 1.0)
}

/// Returns q: the upper quantile of the range, divided by √2. It halves the interval from 0 to 100 until its ends meet.
#[must_use]
pub fn quantile(level: f64, treatments: usize) -> f64 {
    let (mut low, mut high) = (0.0, 100.0);
    for _ in 0..60 {
        let middle = f64::midpoint(low, high);
        if 1.0 - range_cdf(middle, treatments) > level {
            low = middle;
        } else {
            high = middle;
        }
    }
    high / SQRT_2
}

fn unit(treatments: usize, blocks: usize) -> f64 {
    let (k, n) = (treatments as f64, blocks as f64);
    (k * (k + 1.0) / (6.0 * n)).sqrt()
}

/// Returns the probability that k standard normal variables lie within a range: k ∫ φ(z) (Φ(z) - Φ(z - range))^(k-1) dz with z
/// as the largest.
fn range_cdf(range: f64, k: usize) -> f64 {
    if range <= 0.0 {
        return 0.0;
    }
    let normal = Normal::standard();
    let at = |z: f64| {
        let within = normal.cdf(z) - normal.cdf(z - range);
        normal.pdf(z) * within.powi(k as i32 - 1)
    };
    let (from, to) = (-FAR, FAR);
    let step = (to - from) / STEPS as f64;
    let sum: f64 = (0..=STEPS)
        .map(|place| {
            let weight = match place {
                0 | STEPS => 1.0,
                odd if odd % 2 == 1 => 4.0,
                _ => 2.0,
            };
            weight * at(from + place as f64 * step)
        })
        .sum();
    (k as f64 * sum * step / 3.0).min(1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Values: Demšar (2006), table 5, which truncates the digits.
    #[test]
    fn quantiles_match_published_values() {
        for (k, q) in [
            (2, 1.960),
            (3, 2.343),
            (4, 2.569),
            (5, 2.728),
            (8, 3.031),
            (10, 3.164),
        ] {
            let found = quantile(0.05, k);
            assert!((found - q).abs() < 1e-3, "{k}: {found}");
        }
        for (k, q) in [(2, 1.645), (5, 2.459), (10, 2.920)] {
            let found = quantile(0.10, k);
            assert!((found - q).abs() < 1e-3, "{k}: {found}");
        }
    }

    /// Values: Demšar's example with 4 classifiers on 14 data sets, CD = 1.25.
    #[test]
    fn the_published_example() {
        assert!((critical_difference(0.05, 4, 14) - 1.25).abs() < 5e-3);
    }

    #[test]
    fn p_equals_the_level_at_the_critical_difference() {
        for k in [2, 5, 12] {
            let p = nemenyi(critical_difference(0.05, k, 30), k, 30);
            assert!((p - 0.05).abs() < 1e-9, "{k}: {p}");
        }
        assert_eq!(nemenyi(0.0, 4, 10), 1.0);
    }
}
