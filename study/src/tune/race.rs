//! Races (Birattari et al. 2002): a candidate that is clearly worse than the best is dropped before it has had all of its runs.

use crate::compare::statistics::friedman::friedman;
use crate::compare::statistics::nemenyi::critical_difference;

/// Level of significance of the tests.
const LEVEL: f64 = 0.05;

/// Instances that every candidate has before one may be dropped.
const LEAST: usize = 4;

/// The candidates that stay: those whose mean rank does not lie farther from the best one than Nemenyi's critical difference, once
/// Friedman's test says that they differ at all. `values` are those of each candidate, all on the same instances; less is better. The best
/// mean rank is always among them.
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
    if found.p >= LEVEL {
        return all;
    }
    let critical = critical_difference(LEVEL, values.len(), instances);
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
    fn who_is_always_last_goes_and_who_is_always_first_stays() {
        // Of four in the same order ten times, ranks 1 to 4 lie a critical difference of 2.569 √(20/60) = 1.48 apart.
        let values: Vec<Vec<f64>> = (0..4)
            .map(|own| (0..10).map(|it| f64::from(it * 7 % 5 + own)).collect())
            .collect();
        assert_eq!(race(&values), [true, true, false, false]);
        // Three times prove nothing.
        let few: Vec<Vec<f64>> = values.iter().map(|it| it[..3].to_vec()).collect();
        assert_eq!(race(&few), [true; 4]);
        assert_eq!(race(&vec![vec![1.0; 10]; 3]), [true; 3]);
        assert_eq!(race(&[vec![1.0; 10]]), [true]);
    }

    proptest! {
        #[test]
        fn the_best_never_goes(
            mut values in prop::collection::vec(prop::collection::vec(0.0..1.0_f64, 12), 2..9),
            best in 0_usize..9,
        ) {
            let best = best % values.len();
            // Better than all others each time, by however little.
            for instance in 0..12 {
                let least = values.iter().map(|it| it[instance]).fold(f64::INFINITY, f64::min);
                values[best][instance] = least - 1e-9;
            }
            prop_assert!(race(&values)[best]);
        }
    }
}
