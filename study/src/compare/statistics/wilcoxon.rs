//! Wilcoxon's signed-rank test (Wilcoxon 1945) of paired differences, with the matched-pairs rank-biserial correlation as its
//! effect (Kerby 2014).
//!
//! Differences of 0 are dropped. Of at most 50 the p value is exact, also where some are equal; of more it is that of the normal
//! approximation, corrected for ties and not for continuity.

use super::normal_cdf;
use super::ranks::{ranks, ties};

/// Most differences for which all 2ⁿ signs are counted.
const EXACT: usize = 50;

/// What came of it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Wilcoxon {
    /// Differences that are not 0.
    pub n: usize,
    /// Sum of the ranks of positive differences, W⁺.
    pub positive: f64,
    /// (W⁺ - W⁻) / (W⁺ + W⁻), from -1 (all negative) to 1 (all positive); 0 without any.
    pub effect: f64,
    /// How likely a W⁺ so far from its mean is if the differences lie evenly around 0; 1 without any.
    pub p: f64,
}

/// Tests whether the differences lie evenly around 0.
#[must_use]
pub fn wilcoxon(differences: &[f64]) -> Wilcoxon {
    let kept: Vec<f64> = differences
        .iter()
        .copied()
        .filter(|it| *it != 0.0)
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
    let sizes: Vec<f64> = kept.iter().map(|it| it.abs()).collect();
    let ranked = ranks(&sizes);
    let signed = kept.iter().zip(&ranked);
    let positive = signed
        .filter(|(it, _)| **it > 0.0)
        .map(|(_, rank)| rank)
        .sum();
    let count = n as f64;
    let all = count * (count + 1.0) / 2.0;
    let p = if n <= EXACT {
        exact(&ranked, positive)
    } else {
        let variance = count * (count + 1.0) * (2.0 * count + 1.0) / 24.0 - ties(&sizes) / 48.0;
        2.0 * normal_cdf(-(positive - all / 2.0).abs() / variance.sqrt())
    };
    Wilcoxon {
        n,
        positive,
        effect: (2.0 * positive - all) / all,
        p,
    }
}

/// Twice the smaller tail, at most 1.
fn exact(ranks: &[f64], positive: f64) -> f64 {
    // Shared ranks are halves: twice them all is whole numbers.
    let doubled: Vec<usize> = ranks.iter().map(|rank| (2.0 * rank) as usize).collect();
    let (sum, own) = (doubled.iter().sum::<usize>(), (2.0 * positive) as usize);
    // In how many of the 2ⁿ ways the ranks of positive differences sum up to each number: below 2⁵³, so exact.
    let mut ways = vec![0.0; sum + 1];
    ways[0] = 1.0;
    for rank in doubled {
        for at in (rank..=sum).rev() {
            ways[at] += ways[at - rank];
        }
    }
    let tail: f64 = ways[..=own.min(sum - own)].iter().sum();
    (2.0 * tail / 2_f64.powi(ranks.len() as i32)).min(1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Darwin's maize: heights of 15 pairs of plants, crossed less self-fertilized, in eighths of an inch (Fisher 1935): sum of
    /// the negative ranks 24, and by exact counting p = 0.04126.
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
    fn signs_counted_by_hand() {
        // All three positive: 1 of 8 ways on either side.
        assert_eq!(wilcoxon(&[1.0, 2.0, 3.0]).p, 0.25);
        assert_eq!(wilcoxon(&[-1.0, -2.0, -3.0]).effect, -1.0);
        // W⁺ = 3 of 6, the middle.
        assert_eq!(wilcoxon(&[-1.0, -2.0, 3.0]).p, 1.0);
        assert_eq!(wilcoxon(&[0.0, 0.0]).p, 1.0);
        assert_eq!(wilcoxon(&[0.0, 0.0, 1.0]).n, 1);
    }

    #[test]
    fn equal_differences_counted_by_hand() {
        // Ranks 2, 2, 2, 4; W⁺ = 8 of 10. In 1 + 3 + 0 of 16 ways the sum is at most 2: none, or one of the three.
        let found = wilcoxon(&[1.0, -1.0, 1.0, 2.0]);
        assert_eq!((found.positive, found.p), (8.0, 0.5));
    }

    #[test]
    fn many_by_the_normal_approximation() {
        // 60 equal ones, 40 of them positive: ranks 30.5; the variance is 60 · 30.5² / 4, z = 10 · 30.5 / (30.5 · √15).
        let differences: Vec<f64> = (0..60).map(|it| if it < 40 { 1.0 } else { -1.0 }).collect();
        let found = wilcoxon(&differences);
        assert!((found.p - 2.0 * normal_cdf(-10.0 / 15_f64.sqrt())).abs() < 1e-12);
    }
}
