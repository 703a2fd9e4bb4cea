//! The number of seeds that a comparison needs.

use terminal::counted;

use super::metrics::Metric;
use super::statistics::SIGNIFICANT;
use crate::sweep::plan::hypothesis::Hypothesis;
use crate::sweep::statistics::wilson;

/// The largest number of seeds that a remark recommends.
const MOST_SEEDS: usize = 10_000;

/// Returns the number of pairs of allocators in a block.
#[must_use]
pub fn pairs_of(allocators: usize) -> usize {
    allocators * allocators.saturating_sub(1) / 2
}

/// Returns the least p value that Holm's correction leaves to one of `tests` exact paired tests with `seeds` pairs of runs.
#[must_use]
pub fn least_p(seeds: usize, tests: usize) -> f64 {
    let exponent = i32::try_from(seeds).unwrap_or(i32::MAX);
    (2.0 * tests as f64 * 0.5_f64.powi(exponent)).min(1.0)
}

/// Returns the least number of seeds with which a difference between two of these allocators can be significant.
#[must_use]
pub fn seeds_needed(allocators: usize) -> usize {
    let tests = pairs_of(allocators);
    (1..)
        .find(|seeds| least_p(*seeds, tests) < SIGNIFICANT)
        .unwrap_or(usize::MAX)
}

/// Returns what a plan cannot find with its number of seeds, with the number that suffices.
#[must_use]
pub fn remarks(allocators: usize, seeds: usize, hypotheses: &[Hypothesis]) -> Vec<String> {
    let mut remarks = Vec::new();
    let needed = seeds_needed(allocators);
    if seeds < needed {
        let pairs = pairs_of(allocators);
        remarks.push(format!(
            "with {} no difference between {} can be significant: the least p value of {} per block is {:.2}; use {needed} seeds or more",
            counted(seeds, "seed"),
            counted(allocators, "allocator"),
            counted(pairs, "pair"),
            least_p(seeds, pairs),
        ));
    }
    for Hypothesis { name, claim, .. } in hypotheses {
        let is_share = claim.metric.as_deref() == Some(Metric::Completion.name().as_str());
        if !is_share || claim.more_than_under.is_some() {
            continue;
        }
        // The clearest result: no complete run, or only complete runs.
        let can_hold = |seeds: usize| match (claim.at_most, claim.at_least) {
            (Some(bound), _) => wilson(0, seeds).1 <= bound,
            (None, bound) => bound.is_none_or(|bound| bound <= wilson(seeds, seeds).0),
        };
        if can_hold(seeds) {
            continue;
        }
        let remedy = match (1..MOST_SEEDS).find(|seeds| can_hold(*seeds)) {
            Some(needed) => format!("use {needed} seeds or more, or another bound"),
            None => "no number of seeds suffices; use another bound".to_owned(),
        };
        remarks.push(format!(
            "with {} the hypothesis {name} cannot hold in a mission with chance: even equal runs leave an interval beyond its bound; {remedy}",
            counted(seeds, "seed")
        ));
    }
    remarks
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sweep::plan::hypothesis::Claim;

    #[test]
    fn the_number_of_seeds_follows_from_the_number_of_pairs() {
        // 2 · 21 / 2⁸ = 0.164, 2 · 21 / 2⁹ = 0.082, 2 · 21 / 2¹⁰ = 0.041.
        assert_eq!(least_p(8, 21), 42.0 / 256.0);
        assert_eq!(seeds_needed(7), 10);
        // 1 pair: 2 / 2⁶ = 0.031.
        assert_eq!(seeds_needed(2), 6);
        assert_eq!(least_p(1, 21), 1.0);
        assert_eq!(remarks(7, 10, &[]), [""; 0]);
        assert_eq!(
            remarks(7, 8, &[]),
            [
                "with 8 seeds no difference between 7 allocators can be significant: the least p value of 21 pairs per block is 0.16; use 10 seeds or more"
            ]
        );
    }

    #[test]
    fn a_bound_that_no_result_can_confirm_is_named() {
        let hypothesis = |at_most, at_least| Hypothesis {
            name: "h".to_owned(),
            line: 1,
            claim: Claim {
                metric: Some("completion".to_owned()),
                at_most,
                at_least,
                ..Claim::default()
            },
        };
        // Wilson's upper bound of 0 of 10 is 0.278, and of 0 of 9 it is 0.299.
        assert_eq!(remarks(2, 10, &[hypothesis(Some(0.3), None)]), [""; 0]);
        let found = remarks(2, 8, &[hypothesis(Some(0.3), None)]);
        assert_eq!(found.len(), 1);
        assert!(
            found[0].ends_with("use 9 seeds or more, or another bound"),
            "{found:?}"
        );
        let found = remarks(2, 8, &[hypothesis(None, Some(1.0))]);
        assert!(
            found[0].ends_with("no number of seeds suffices; use another bound"),
            "{found:?}"
        );
    }
}
