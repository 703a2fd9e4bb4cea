//! Wilcoxon's signed-rank test (Wilcoxon 1945) of paired differences. Its effect size is the matched-pairs rank-biserial
//! correlation (Kerby 2014).
//!
//! Differences of 0 are dropped. The p value is exact for at most 50 differences, also with ties. For more it uses the normal
//! approximation with correction for ties and without continuity correction.

use statrs::distribution::{ContinuousCDF, Normal};

use super::ranks::{ranks, ties};

/// The largest number of differences for the exact p value.
const EXACT: usize = 50;

#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Wilcoxon {
    /// The number of differences that are not 0.
    pub n: usize,
    /// W⁺, the sum of the ranks of positive differences.
    pub positive: f64,
    /// (W⁺ - W⁻) / (W⁺ + W⁻), from -1 (all negative) to 1 (all positive); 0 without differences.
    pub effect: f64,
    pub p: f64,
}

#[must_use]
pub fn wilcoxon(differences: &[f64]) -> Wilcoxon {
    let kept: Vec<f64> = differences
        .iter()
        .copied()
        .filter(|difference| *difference != 0.0)
        .collect();
    let n = kept.len();
    if n == 0 {
        return Wilcoxon {
            n,
            positive: 0.0,
            effect: 0.0,
            p: 1.0,
        };
    }
    let sizes: Vec<f64> = kept.iter().map(|difference| difference.abs()).collect();
    let ranked = ranks(&sizes);
    let signed = kept.iter().zip(&ranked);
    let positive = signed
        .filter(|(difference, _)| **difference > 0.0)
        .map(|(_, rank)| rank)
        .sum();
    let count = n as f64;
    let all = count * (count + 1.0) / 2.0;
    let p = if n <= EXACT {
        exact(&ranked, positive)
    } else {
        let variance = count * (count + 1.0) * (2.0 * count + 1.0) / 24.0 - ties(&sizes) / 48.0;
        2.0 * Normal::standard().sf((positive - all / 2.0).abs() / variance.sqrt())
    };
    Wilcoxon {
        n,
        positive,
        effect: (2.0 * positive - all) / all,
        p,
    }
}

/// Returns twice the smaller tail, at most 1.
fn exact(ranks: &[f64], positive: f64) -> f64 {
    // Shared ranks are multiples of 0.5; doubling makes them whole numbers.
    let doubled: Vec<usize> = ranks.iter().map(|rank| (2.0 * rank) as usize).collect();
    let (sum, found) = (doubled.iter().sum::<usize>(), (2.0 * positive) as usize);
    // The number of sign combinations for each sum of positive ranks; exact because it is below 2⁵³.
    let mut ways = vec![0.0; sum + 1];
    ways[0] = 1.0;
    for rank in doubled {
        for at in (rank..=sum).rev() {
            ways[at] += ways[at - rank];
        }
    }
    let tail: f64 = ways[..=found.min(sum - found)].iter().sum();
    (2.0 * tail / 2_f64.powi(ranks.len() as i32)).min(1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Data: Darwin's maize, height differences of 15 pairs of plants, crossed less self-fertilized, in eighths of an inch
    /// (Fisher 1935). The sum of negative ranks is 24, and the exact p value 0.04126.
    #[test]
    fn darwins_maize() {
        let differences = [
            49.0, -67.0, 8.0, 16.0, 6.0, 23.0, 28.0, 41.0, 14.0, 29.0, 56.0, 24.0, 75.0, 60.0,
            -48.0,
        ];
        let found = wilcoxon(&differences);
        assert_eq!((found.n, found.positive), (15, 96.0));
        assert!((found.p - 0.041_259_765_625).abs() < 1e-12, "{}", found.p);
        assert!((found.effect - (96.0 - 24.0) / 120.0).abs() < 1e-12);
    }

    #[test]
    fn signs_match_hand_calculation() {
        // All three positive: 1 of 8 combinations on either side.
        assert_eq!(wilcoxon(&[1.0, 2.0, 3.0]).p, 0.25);
        assert_eq!(wilcoxon(&[-1.0, -2.0, -3.0]).effect, -1.0);
        // W⁺ = 3 of 6, the center.
        assert_eq!(wilcoxon(&[-1.0, -2.0, 3.0]).p, 1.0);
        assert_eq!(wilcoxon(&[0.0, 0.0]).p, 1.0);
        assert_eq!(wilcoxon(&[0.0, 0.0, 1.0]).n, 1);
    }

    #[test]
    fn equal_differences_match_hand_calculation() {
        // Ranks 2, 2, 2, 4; W⁺ = 8 of 10. The sum is at most 2 in 1 + 3 + 0 of 16 combinations: none, or one of the three.
        let found = wilcoxon(&[1.0, -1.0, 1.0, 2.0]);
        assert_eq!((found.positive, found.p), (8.0, 0.5));
    }

    #[test]
    fn many_differences_use_the_normal_approximation() {
        // 60 equal differences, 40 of them positive: ranks 30.5, variance 60 · 30.5² / 4, z = 10 · 30.5 / (30.5 · √15).
        let differences: Vec<f64> = (0..60)
            .map(|number| if number < 40 { 1.0 } else { -1.0 })
            .collect();
        let found = wilcoxon(&differences);
        assert!((found.p - 2.0 * Normal::standard().sf(10.0 / 15_f64.sqrt())).abs() < 1e-12);
    }
}
