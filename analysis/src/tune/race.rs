//! Races (Birattari et al. 2002): a candidate that is significantly worse than the best is dropped before it has all its runs.

use crate::compare::statistics::SIGNIFICANT;
use crate::compare::statistics::friedman::friedman;
use crate::compare::statistics::nemenyi::critical_difference;

/// The number of instances that every candidate runs before the first one may be dropped.
const LEAST: usize = 4;

/// Returns for each candidate whether it stays. If Friedman's test finds a difference, candidates stay whose mean rank is
/// within Nemenyi's critical difference of the best. `values` contains each candidate's values on the same instances; less is
/// better. The best candidate always stays.
#[must_use]
pub fn survivors(values: &[&[f64]]) -> Vec<bool> {
    let instances = values.first().map_or(0, |values| values.len());
    let blocks: Vec<Vec<f64>> = (0..instances)
        .map(|instance| values.iter().map(|values| values[instance]).collect())
        .collect();
    let all = vec![true; values.len()];
    let Some(found) = friedman(&blocks).filter(|_| instances >= LEAST) else {
        return all;
    };
    if found.p >= SIGNIFICANT {
        return all;
    }
    let critical = critical_difference(SIGNIFICANT, values.len(), instances);
    let best = found
        .mean_ranks
        .iter()
        .copied()
        .fold(f64::INFINITY, f64::min);
    let ranks = found.mean_ranks.iter();
    ranks.map(|rank| rank - best <= critical).collect()
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn race(values: &[Vec<f64>]) -> Vec<bool> {
        let borrowed: Vec<&[f64]> = values.iter().map(Vec::as_slice).collect();
        survivors(&borrowed)
    }

    #[test]
    fn a_clearly_worse_candidate_is_dropped_and_the_best_stays() {
        // With four candidates in the same order ten times, ranks 1 to 4 are compared with the critical difference 2.569
        // √(20/60) = 1.48.
        let values = |offset: i32| (0..10).map(move |at| f64::from(at * 7 % 5 + offset));
        let values: Vec<Vec<f64>> = (0..4).map(|offset| values(offset).collect()).collect();
        assert_eq!(race(&values), [true, true, false, false]);
        // Three instances are too few.
        let few: Vec<Vec<f64>> = values.iter().map(|values| values[..3].to_vec()).collect();
        assert_eq!(race(&few), [true; 4]);
        assert_eq!(race(&vec![vec![1.0; 10]; 3]), [true; 3]);
        assert_eq!(race(&[vec![1.0; 10]]), [true]);
    }

    proptest! {
        #[test]
        fn the_best_always_stays(
            mut values in prop::collection::vec(prop::collection::vec(0.0..1.0_f64, 12), 2..9),
            best in 0_usize..9,
        ) {
            let best = best % values.len();
            // The best is better than all others each time by a small amount.
            for instance in 0..12 {
                let least = values.iter().map(|values| values[instance]).fold(f64::INFINITY, f64::min);
                values[best][instance] = least - 1e-9;
            }
            prop_assert!(race(&values)[best]);
        }
    }
}
