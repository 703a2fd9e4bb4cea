//! Ranks of values: the least value has rank 1, and equal values share their mean rank.

use statrs::statistics::{Data, OrderStatistics, RankTieBreaker};

#[must_use]
pub fn ranks(values: &[f64]) -> Vec<f64> {
    Data::new(values.to_vec()).ranks(RankTieBreaker::Average)
}

/// Returns Σ t³ - t over the groups of t equal values.
#[must_use]
pub fn ties(values: &[f64]) -> f64 {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    let groups = sorted.chunk_by(|a, b| a == b);
    let sizes = groups.map(|group| group.len() as f64);
    sizes.map(|t| t * t * t - t).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn equal_values_share_their_ranks() {
        assert_eq!(ranks(&[30.0, 10.0, 20.0, 10.0]), [4.0, 1.5, 3.0, 1.5]);
        assert_eq!(ranks(&[]), [0.0; 0]);
        // One group of two values: 8 - 2; one of three: 27 - 3.
        assert_eq!(ties(&[1.0, 1.0, 2.0, 3.0, 3.0, 3.0]), 30.0);
        assert_eq!(ties(&[1.0, 2.0]), 0.0);
    }
}
