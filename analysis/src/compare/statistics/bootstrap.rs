//! The percentile bootstrap (Efron 1979).
//!
//! Seeds are resampled with all values that belong to them, so pairs stay paired. The draws use a separate random stream and
//! depend only on the number of seeds, so equal values always give equal intervals.

use std::collections::BTreeMap;

use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;

use crate::sweep::statistics::{Interval, quantile};

/// The number of resamples.
pub const RESAMPLES: usize = 10_000;

/// The random stream of seed 0; `sweep` uses stream 0.
const STREAM: u64 = 1;

/// A statistic of each resample, in ascending order.
#[derive(Clone, Debug, PartialEq)]
pub struct Resampled(Vec<f64>);

impl Resampled {
    /// Returns the central part of the statistics that contains the share `level`, or `None` without values.
    #[must_use]
    pub fn interval(&self, level: f64) -> Option<Interval> {
        let tail = (1.0 - level) / 2.0;
        (!self.0.is_empty()).then(|| (quantile(&self.0, tail), quantile(&self.0, 1.0 - tail)))
    }
}

/// Returns the means of the resamples of each column.
#[must_use]
pub fn means<C: AsRef<[f64]>>(columns: &[C]) -> Vec<Resampled> {
    let columns: Vec<&[f64]> = columns.iter().map(AsRef::as_ref).collect();
    let lengths = columns.iter().map(|column| column.len());
    resampled(lengths, |member, draws| {
        let column = columns[member];
        let sum: f64 = draws.iter().map(|place| column[*place as usize]).sum();
        sum / column.len() as f64
    })
}

/// Returns the differences of medians, second less first, of the resamples of each pair of columns of equal length.
#[must_use]
pub fn median_differences<C: AsRef<[f64]>>(pairs: &[(C, C)]) -> Vec<Resampled> {
    let ranked = pairs.iter();
    let ranked: Vec<(Ranked, Ranked)> = ranked
        .map(|(first, second)| (Ranked::of(first.as_ref()), Ranked::of(second.as_ref())))
        .collect();
    let mut counts = Vec::new();
    let lengths = ranked.iter().map(|(first, _)| first.values.len());
    resampled(lengths, |member, draws| {
        let (first, second) = &ranked[member];
        second.median(draws, &mut counts) - first.median(draws, &mut counts)
    })
}

/// Returns the statistic of the resamples of each column, given the lengths of the columns. Columns of equal length have
/// equal draws.
fn resampled(
    lengths: impl Iterator<Item = usize>,
    mut statistic: impl FnMut(usize, &[u32]) -> f64,
) -> Vec<Resampled> {
    let mut by_length: BTreeMap<usize, Vec<usize>> = BTreeMap::new();
    let mut found = Vec::new();
    for (member, length) in lengths.enumerate() {
        by_length.entry(length).or_default().push(member);
        found.push(Resampled(Vec::new()));
    }
    for (length, members) in by_length.into_iter().filter(|(length, _)| *length > 0) {
        let mut rng = ChaCha8Rng::seed_from_u64(0);
        rng.set_stream(STREAM);
        let mut draws = vec![0; length];
        for _ in 0..RESAMPLES {
            // There are at most a million seeds.
            draws.fill_with(|| rng.random_range(0..length as u32));
            for &member in &members {
                found[member].0.push(statistic(member, &draws));
            }
        }
    }
    for Resampled(values) in &mut found {
        values.sort_by(f64::total_cmp);
    }
    found
}

/// Values with their positions in sorted order, so that medians of resamples need no sorting.
struct Ranked {
    values: Vec<f64>,
    /// The position of each original value in `values`.
    places: Vec<u32>,
}

impl Ranked {
    fn of(values: &[f64]) -> Self {
        let mut order: Vec<u32> = (0..values.len() as u32).collect();
        order.sort_by(|a, b| values[*a as usize].total_cmp(&values[*b as usize]));
        let mut places = vec![0; values.len()];
        for (place, member) in order.iter().enumerate() {
            places[*member as usize] = place as u32;
        }
        Self {
            values: order
                .iter()
                .map(|member| values[*member as usize])
                .collect(),
            places,
        }
    }

    fn median(&self, draws: &[u32], counts: &mut Vec<u32>) -> f64 {
        counts.clear();
        counts.resize(self.values.len(), 0);
        for draw in draws {
            counts[self.places[*draw as usize] as usize] += 1;
        }
        let (below, above) = ((draws.len() - 1) / 2, draws.len() / 2);
        let mut seen = 0;
        let mut low = None;
        for (value, count) in self.values.iter().zip(counts) {
            seen += *count as usize;
            if seen > below {
                let low = *low.get_or_insert(*value);
                if seen > above {
                    return (low + value) / 2.0;
                }
            }
        }
        f64::NAN
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_interval_of_a_mean_matches_the_normal_distribution() {
        // For 0 to 99, the mean's standard error is 28.87 / √100 = 2.887; 49.5 ± 1.96 · 2.887.
        let values: Vec<f64> = (0..100).map(f64::from).collect();
        let resampled = means(&[&values]).remove(0);
        let (from, to) = resampled.interval(0.95).unwrap();
        assert!(
            (from - 43.84).abs() < 0.25 && (to - 55.16).abs() < 0.25,
            "{from} {to}"
        );
        let (wider, _) = resampled.interval(0.99).unwrap();
        assert!(wider < from);
        assert_eq!(means(&[[]])[0].interval(0.95), None);
        assert_eq!(means(&[[3.0, 3.0]])[0].interval(0.95), Some((3.0, 3.0)));
    }

    #[test]
    fn pairs_stay_paired() {
        let first: Vec<f64> = (0..40).map(|seed| f64::from(seed * seed % 37)).collect();
        let second: Vec<f64> = first.iter().map(|value| value + 5.0).collect();
        let found = median_differences(&[(&first, &second)]).remove(0);
        assert_eq!(found.interval(0.95), Some((5.0, 5.0)));
        // The draws of a column do not depend on other columns.
        let apart = means(&[&first[..], &second[..7], &second]);
        assert_eq!(apart[0], means(&[&first])[0]);
        assert_eq!(apart[1], means(&[&second[..7]])[0]);
    }

    #[test]
    fn medians_without_sorting() {
        let mut counts = Vec::new();
        let values = Ranked::of(&[5.0, 1.0, 3.0, 3.0]);
        for (draws, expected) in [
            ([0, 1, 2, 3], 3.0),
            ([1, 1, 0, 0], 3.0),
            ([1, 1, 1, 0], 1.0),
            ([0, 0, 0, 2], 5.0),
            ([1, 1, 2, 3], 2.0),
        ] {
            assert_eq!(values.median(&draws, &mut counts), expected, "{draws:?}");
        }
        assert_eq!(Ranked::of(&[2.0]).median(&[0], &mut counts), 2.0);
    }
}
