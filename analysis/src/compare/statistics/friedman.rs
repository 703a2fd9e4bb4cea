//! Friedman's test (Friedman 1937), corrected for ties: checks whether the ranks of treatments within blocks differ.

use statrs::distribution::{ChiSquared, ContinuousCDF};

use super::ranks::{ranks, ties};

#[derive(Clone, Debug, PartialEq)]
pub struct Friedman {
    pub blocks: usize,
    /// The ranks of the treatments in each block.
    pub ranks: Vec<Vec<f64>>,
    /// The mean rank of each treatment; the least value has rank 1.
    pub mean_ranks: Vec<f64>,
    /// χ², with one degree of freedom less than the number of treatments.
    pub statistic: f64,
    pub p: f64,
}

/// Computes the test. Each block has one value per treatment. Returns `None` with fewer than two blocks or treatments.
#[must_use]
pub fn friedman(blocks: &[Vec<f64>]) -> Option<Friedman> {
    let (n, k) = (blocks.len() as f64, blocks.first()?.len());
    if blocks.len() < 2 || k < 2 {
        return None;
    }
    let mut sums = vec![0.0; k];
    let ranked: Vec<Vec<f64>> = blocks.iter().map(|block| ranks(block)).collect();
    for block in &ranked {
        for (sum, rank) in sums.iter_mut().zip(block) {
            *sum += rank;
        }
    }
    let count = k as f64;
    let tied: f64 = blocks.iter().map(|block| ties(block)).sum();
    let untied = 1.0 - tied / (count * (count * count - 1.0) * n);
    let squares: f64 = sums.iter().map(|sum| sum * sum).sum();
    let plain = 12.0 / (n * count * (count + 1.0)) * squares - 3.0 * n * (count + 1.0);
    // If all values are equal in every block, there is no evidence of a difference.
    let statistic = if untied > 0.0 {
        (plain / untied).max(0.0)
    } else {
        0.0
    };
    Some(Friedman {
        blocks: blocks.len(),
        ranks: ranked,
        mean_ranks: sums.into_iter().map(|sum| sum / n).collect(),
        statistic,
        p: ChiSquared::new(count - 1.0).ok()?.sf(statistic),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Data: rounding first base by three methods (Hollander & Wolfe, table 7.1): χ² = 11.14 with ties, p = 0.0038.
    #[test]
    fn rounding_first_base() {
        let times = [
            [5.40, 5.50, 5.55],
            [5.85, 5.70, 5.75],
            [5.20, 5.60, 5.50],
            [5.55, 5.50, 5.40],
            [5.90, 5.85, 5.70],
            [5.45, 5.55, 5.60],
            [5.40, 5.40, 5.35],
            [5.45, 5.50, 5.35],
            [5.25, 5.15, 5.00],
            [5.85, 5.80, 5.70],
            [5.25, 5.20, 5.10],
            [5.65, 5.55, 5.45],
            [5.60, 5.35, 5.45],
            [5.05, 5.00, 4.95],
            [5.50, 5.50, 5.40],
            [5.45, 5.55, 5.50],
            [5.55, 5.55, 5.35],
            [5.45, 5.50, 5.55],
            [5.50, 5.45, 5.25],
            [5.65, 5.60, 5.40],
            [5.70, 5.65, 5.55],
            [6.30, 6.30, 6.25],
        ];
        let found = friedman(&times.map(|row| row.to_vec())).unwrap();
        assert_eq!(found.blocks, 22);
        assert!(
            (found.statistic - 11.1429).abs() < 1e-4,
            "{}",
            found.statistic
        );
        assert!((found.p - 0.003805).abs() < 1e-6, "{}", found.p);
    }

    #[test]
    fn equal_values_and_too_few_values() {
        let alike = friedman(&[vec![1.0, 1.0], vec![2.0, 2.0]]).unwrap();
        assert_eq!((alike.statistic, alike.p), (0.0, 1.0));
        assert_eq!(alike.mean_ranks, [1.5, 1.5]);
        assert_eq!(friedman(&[]), None);
        assert_eq!(friedman(&[vec![1.0, 2.0]]), None);
    }
}
