//! Delta debugging: the algorithm ddmin of Zeller and Hildebrandt, Simplifying and Isolating Failure-Inducing Input,
//! IEEE Transactions on Software Engineering 28(2), 2002, fig. 5.
//!
//! The lists of one step are tested together, so that a parallel executor can run them at the same time. The first
//! failing list counts, so the result does not depend on the executor.

/// Returns a sublist of `items` that still fails and is 1-minimal: it passes without any single one of its items, if the
/// test is deterministic. `items` must fail. `test` receives several lists and returns the place of the first that fails.
/// Unlike in the paper, the empty list is tested first.
///
/// # Errors
/// Returns the error of `test`.
pub fn ddmin<T: Clone, E>(
    items: Vec<T>,
    mut test: impl FnMut(&[Vec<T>]) -> Result<Option<usize>, E>,
) -> Result<Vec<T>, E> {
    if items.is_empty() || test(&[Vec::new()])?.is_some() {
        return Ok(Vec::new());
    }
    let mut items = items;
    let mut parts = 2.min(items.len());
    while items.len() > 1 {
        let ranges = split(items.len(), parts);
        let subsets: Vec<Vec<T>> = ranges
            .iter()
            .map(|&(from, to)| items[from..to].to_vec())
            .collect();
        if let Some(place) = test(&subsets)? {
            items = subsets.into_iter().nth(place).unwrap_or_default();
            parts = 2.min(items.len());
            continue;
        }
        // The complements of two parts are the parts themselves.
        if parts > 2 {
            let complements: Vec<Vec<T>> = ranges
                .iter()
                .map(|&(from, to)| [&items[..from], &items[to..]].concat())
                .collect();
            if let Some(place) = test(&complements)? {
                items = complements.into_iter().nth(place).unwrap_or_default();
                parts = (parts - 1).max(2);
                continue;
            }
        }
        if parts == items.len() {
            break;
        }
        parts = (2 * parts).min(items.len());
    }
    Ok(items)
}

/// Splits `length` places into `parts` ranges of nearly equal length. No range is empty if `parts` is at most `length`.
fn split(length: usize, parts: usize) -> Vec<(usize, usize)> {
    let bound = |part: usize| part * length / parts;
    (0..parts)
        .map(|part| (bound(part), bound(part + 1)))
        .collect()
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;
    use std::convert::Infallible;

    use proptest::prelude::*;

    use super::*;

    /// Runs ddmin with a test of single lists. Returns the result and the number of tested lists.
    fn least(items: Vec<u32>, fails: impl Fn(&[u32]) -> bool) -> (Vec<u32>, usize) {
        let mut tested = 0;
        let found = ddmin(items, |lists| {
            tested += lists.len();
            Ok::<_, Infallible>(lists.iter().position(|list| fails(list)))
        });
        (found.unwrap(), tested)
    }

    /// Returns whether the list fails, and passes without any one of its items.
    fn is_one_minimal(list: &[u32], fails: impl Fn(&[u32]) -> bool) -> bool {
        let without = |place: usize| [&list[..place], &list[place + 1..]].concat();
        fails(list) && (0..list.len()).all(|place| !fails(&without(place)))
    }

    #[test]
    fn the_example_of_the_paper() {
        // Fig. 2 of the paper: of eight changes, 1, 7 and 8 fail together.
        let fails = |list: &[u32]| [1, 7, 8].iter().all(|item| list.contains(item));
        let (found, tested) = least((1..=8).collect(), fails);
        assert_eq!(found, [1, 7, 8]);
        assert!(tested < 64, "{tested}");
    }

    #[test]
    fn a_failure_without_items_gives_an_empty_list_and_one_item_stays() {
        assert_eq!(least(vec![3, 4], |_| true), (Vec::new(), 1));
        assert_eq!(least(vec![3], |list| list == [3]), (vec![3], 1));
        assert_eq!(least(Vec::new(), |_| true), (Vec::new(), 0));
    }

    #[test]
    fn an_error_of_the_test_ends_the_work() {
        assert_eq!(
            ddmin(vec![1, 2], |_| Err::<Option<usize>, _>("full")),
            Err("full")
        );
    }

    proptest! {
        /// A failure that needs a set of items: ddmin finds exactly this set, in order.
        #[test]
        fn a_monotone_failure_is_reduced_to_its_cause(
            length in 1..40_u32,
            cause in proptest::collection::btree_set(0..40_u32, 1..6),
        ) {
            let cause: BTreeSet<u32> = cause.into_iter().map(|item| item % length).collect();
            let fails = |list: &[u32]| cause.iter().all(|item| list.contains(item));
            let (found, _) = least((0..length).collect(), fails);
            prop_assert_eq!(found, Vec::from_iter(cause));
        }

        /// Any failure, monotone or not: the result fails, is a sublist, and is 1-minimal.
        #[test]
        fn the_result_of_any_failure_is_one_minimal(length in 1..14_u32, table in any::<u64>()) {
            let all: Vec<u32> = (0..length).collect();
            // A pseudo-random set of failing lists, which contains the whole one.
            let fails = |list: &[u32]| {
                let bits = list.iter().fold(0_u64, |bits, item| bits | 1 << item);
                let mixed = (bits ^ table).wrapping_mul(0x9e37_79b9_7f4a_7c15);
                list.len() == all.len() || (!list.is_empty() && mixed >> 61 == 0)
            };
            let (found, _) = least(all.clone(), fails);
            prop_assert!(found.windows(2).all(|two| two[0] < two[1]));
            prop_assert!(is_one_minimal(&found, fails), "{:?}", found);
        }

        /// The worst case of the paper: at most n² + 3n tests, and one for the empty list.
        #[test]
        fn the_number_of_tests_is_bounded(length in 1..30_u32, table in any::<u64>()) {
            let fails = |list: &[u32]| {
                list.len() == length as usize || (table >> (list.len() % 64)) & 1 == 1 && list.len() > 1
            };
            let (_, tested) = least((0..length).collect(), fails);
            let n = length as usize;
            prop_assert!(tested <= n * n + 3 * n + 1, "{tested} tests of {n} items");
        }
    }
}
