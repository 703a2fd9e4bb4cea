//! The statistics of each cell, of each pair of allocators in a block, and of all allocators over all blocks.

use std::num::NonZeroUsize;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::thread;

use super::data::{Block, ComparisonData, mean};
use super::metrics::Metric;
use super::statistics::bootstrap::{means, median_differences};
use super::statistics::friedman::{Friedman, friedman};
use super::statistics::holm::holm;
use super::statistics::mcnemar::mcnemar;
use super::statistics::nemenyi::{critical_difference, nemenyi};
use super::statistics::wilcoxon::wilcoxon;
use crate::sweep::statistics::{Interval, quantile, wilson};

pub const LEVEL: f64 = 0.95;

pub const SIGNIFICANT: f64 = 0.05;

/// The metrics of the paired comparisons within a block.
pub const PAIRED: [Metric; 3] = [Metric::Completion, Metric::Par2, Metric::Makespan];

/// The metrics of the rankings over all blocks.
pub const RANKED: [Metric; 5] = [
    Metric::Par2,
    Metric::Completion,
    Metric::Observed,
    Metric::Bytes,
    Metric::Distance,
];

pub struct Analysis {
    pub blocks: Vec<BlockAnalysis>,
    /// One entry per metric of [`RANKED`] for which enough blocks have data.
    pub rankings: Vec<Ranking>,
}

#[derive(Clone, Debug, Default)]
pub struct BlockAnalysis {
    /// Summaries by allocator and metric; `None` without data.
    pub summaries: Vec<Vec<Option<Summary>>>,
    /// All pairs of allocators, by metric of [`PAIRED`].
    pub pairs: Vec<Vec<Pair>>,
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Summary {
    pub n: usize,
    pub mean: f64,
    /// The interval of the mean; Wilson's for completion.
    pub interval: Interval,
    /// The quantiles 0 (minimum), 5, 25, 50, 75, 95 and 100 % (maximum).
    pub quantiles: [f64; 7],
}

/// The comparison of two allocators in a block, over the seeds that both have.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pair {
    pub first: usize,
    pub second: usize,
    pub n: usize,
    /// The mean difference, second less first, with its interval.
    pub mean: Option<(f64, Interval)>,
    pub median: Option<(f64, Interval)>,
    /// The rank-biserial correlation from -1 (the second is always less) to 1; for completion the difference of shares.
    pub effect: f64,
    /// The p value of Wilcoxon's test; for completion that of McNemar's test.
    pub p: f64,
    /// The p value after Holm's correction over all pairs of the block.
    pub adjusted: f64,
}

impl Pair {
    #[must_use]
    pub fn is_significant(&self) -> bool {
        self.adjusted < SIGNIFICANT
    }
}

/// The ranking of all allocators over the blocks in which each of them has data.
#[derive(Clone, Debug, PartialEq)]
pub struct Ranking {
    pub metric: Metric,
    pub friedman: Friedman,
    /// The critical difference of mean ranks.
    pub critical: f64,
    /// The indices of the omitted blocks: an allocator has no data or all allocators are equal.
    pub omitted_blocks: Vec<usize>,
}

impl Ranking {
    /// Returns the indices of the allocators, best first.
    #[must_use]
    pub fn order(&self) -> Vec<usize> {
        let ranks = &self.friedman.mean_ranks;
        let mut order: Vec<usize> = (0..ranks.len()).collect();
        order.sort_by(|a, b| ranks[*a].total_cmp(&ranks[*b]));
        order
    }

    /// Returns the p value of two allocators by Nemenyi's test.
    #[must_use]
    pub fn p(&self, first: usize, second: usize) -> f64 {
        let ranks = &self.friedman.mean_ranks;
        nemenyi(
            ranks[first] - ranks[second],
            ranks.len(),
            self.friedman.blocks,
        )
    }
}

impl Analysis {
    /// Computes all statistics on `jobs` threads.
    #[must_use]
    pub fn new(data: &ComparisonData, jobs: NonZeroUsize) -> Self {
        let next = AtomicUsize::new(0);
        let mut blocks = vec![BlockAnalysis::default(); data.blocks.len()];
        thread::scope(|scope| {
            let workers: Vec<_> = (0..jobs.get().min(blocks.len()))
                .map(|_| {
                    scope.spawn(|| {
                        let mut done = Vec::new();
                        while let number = next.fetch_add(1, Ordering::Relaxed)
                            && let Some(block) = data.blocks.get(number)
                        {
                            done.push((number, analyse(data, block)));
                        }
                        done
                    })
                })
                .collect();
            for worker in workers {
                match worker.join() {
                    Ok(done) => done
                        .into_iter()
                        .for_each(|(number, block)| blocks[number] = block),
                    Err(panic) => std::panic::resume_unwind(panic),
                }
            }
        });
        Self {
            blocks,
            rankings: RANKED
                .iter()
                .filter_map(|metric| ranking(data, metric))
                .collect(),
        }
    }

    /// Returns the comparison of two allocators by a metric of [`PAIRED`], with the signs as seen from `first`.
    #[must_use]
    pub fn pair(&self, block: usize, metric: &Metric, first: usize, second: usize) -> Option<Pair> {
        let place = PAIRED.iter().position(|paired| paired == metric)?;
        let found = self.blocks[block].pairs[place].iter().find(|pair| {
            (pair.first.min(pair.second), pair.first.max(pair.second))
                == (first.min(second), first.max(second))
        })?;
        Some(if found.first == first {
            *found
        } else {
            found.turned()
        })
    }
}

impl Pair {
    fn turned(&self) -> Self {
        let turn = |found: Option<(f64, Interval)>| {
            found.map(|(value, (from, to))| (-value, (-to, -from)))
        };
        Self {
            first: self.second,
            second: self.first,
            mean: turn(self.mean),
            median: turn(self.median),
            effect: -self.effect,
            ..*self
        }
    }
}

fn analyse(data: &ComparisonData, block: &Block) -> BlockAnalysis {
    BlockAnalysis {
        summaries: summaries(data, block),
        pairs: PAIRED
            .iter()
            .map(|metric| pairs(data, block, metric))
            .collect(),
    }
}

fn summaries(data: &ComparisonData, block: &Block) -> Vec<Vec<Option<Summary>>> {
    let columns: Vec<Vec<f64>> = block
        .cells
        .iter()
        .flat_map(|cell| (0..data.metrics.len()).map(|metric| cell.values_of(metric)))
        .collect();
    let borrowed: Vec<&[f64]> = columns.iter().map(Vec::as_slice).collect();
    let resampled = means(&borrowed);
    let all: Vec<Option<Summary>> = columns
        .into_iter()
        .zip(resampled)
        .enumerate()
        .map(|(place, (mut values, resampled))| {
            let mean = mean(&values)?;
            let n = values.len();
            let interval = if data.metrics[place % data.metrics.len()] == Metric::Completion {
                // The values are 1 and 0, so their sum is the number of completed runs.
                wilson(values.iter().sum::<f64>() as usize, n)
            } else {
                resampled.interval(LEVEL)?
            };
            values.sort_by(f64::total_cmp);
            let shares = [0.0, 0.05, 0.25, 0.5, 0.75, 0.95, 1.0];
            Some(Summary {
                n,
                mean,
                interval,
                quantiles: shares.map(|share| quantile(&values, share)),
            })
        })
        .collect();
    all.chunks(data.metrics.len()).map(<[_]>::to_vec).collect()
}

fn pairs(data: &ComparisonData, block: &Block, metric: &Metric) -> Vec<Pair> {
    let place = data.metric_index(metric);
    let count = block.cells.len();
    let members: Vec<(usize, usize)> = (0..count)
        .flat_map(|first| (first + 1..count).map(move |second| (first, second)))
        .collect();
    let both: Vec<(Vec<f64>, Vec<f64>)> = members
        .iter()
        .map(|&(first, second)| block.cells[first].paired(&block.cells[second], place))
        .collect();
    let differences: Vec<Vec<f64>> = both
        .iter()
        .map(|(first, second)| {
            second
                .iter()
                .zip(first)
                .map(|(second, first)| second - first)
                .collect()
        })
        .collect();
    let columns: Vec<&[f64]> = differences.iter().map(Vec::as_slice).collect();
    let slices: Vec<(&[f64], &[f64])> = both
        .iter()
        .map(|(first, second)| (first.as_slice(), second.as_slice()))
        .collect();
    let of_means = means(&columns);
    let is_share = *metric == Metric::Completion;
    // Medians of zeros and ones are not informative.
    let of_medians = if is_share {
        Vec::new()
    } else {
        median_differences(&slices)
    };
    let mut pairs: Vec<Pair> = members
        .iter()
        .enumerate()
        .map(|(number, &(first, second))| {
            let differences = &differences[number];
            let mean = mean(differences);
            let (effect, p) = if is_share {
                let count = |sign: f64| {
                    differences
                        .iter()
                        .filter(|difference| **difference == sign)
                        .count() as u64
                };
                (mean.unwrap_or(0.0), mcnemar(count(-1.0), count(1.0)))
            } else {
                let found = wilcoxon(differences);
                (found.effect, found.p)
            };
            Pair {
                first,
                second,
                n: differences.len(),
                mean: mean.zip(of_means[number].interval(LEVEL)),
                median: of_medians.get(number).and_then(|resampled| {
                    let (first, second) = slices[number];
                    Some((median(second)? - median(first)?, resampled.interval(LEVEL)?))
                }),
                effect,
                p,
                adjusted: 1.0,
            }
        })
        .collect();
    // Pairs without a common seed are not tested.
    let tested: Vec<usize> = (0..pairs.len()).filter(|pair| pairs[*pair].n > 0).collect();
    let p: Vec<f64> = tested.iter().map(|pair| pairs[*pair].p).collect();
    for (pair, adjusted) in tested.into_iter().zip(holm(&p)) {
        pairs[pair].adjusted = adjusted;
    }
    pairs
}

fn median(values: &[f64]) -> Option<f64> {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    (!sorted.is_empty()).then(|| quantile(&sorted, 0.5))
}

fn ranking(data: &ComparisonData, metric: &Metric) -> Option<Ranking> {
    let place = data.metric_index(metric);
    let sign = if metric.more_is_better() { -1.0 } else { 1.0 };
    let mut left_out = Vec::new();
    let mut blocks = Vec::new();
    for (number, block) in data.blocks.iter().enumerate() {
        let means = block
            .cells
            .iter()
            .map(|cell| Some(sign * cell.mean(place)?));
        let means: Option<Vec<f64>> = means.collect();
        // A block in which all means are equal, such as a mission with a fixed duration, has no ranking.
        let differ = |means: &Vec<f64>| means.iter().any(|mean| *mean != means[0]);
        match means.filter(differ) {
            Some(means) => blocks.push(means),
            None => left_out.push(number),
        }
    }
    let friedman = friedman(&blocks)?;
    Some(Ranking {
        metric: metric.clone(),
        critical: critical_difference(SIGNIFICANT, data.allocators.len(), friedman.blocks),
        friedman,
        omitted_blocks: left_out,
    })
}

#[cfg(test)]
mod tests {
    use super::super::answer::{answer, best, ties};
    use super::super::data::tests::data;
    use super::*;

    const JOBS: NonZeroUsize = NonZeroUsize::new(3).unwrap();

    /// Creates data in which nearest needs 5 s more than alliance and has no data in the last block.
    fn sample() -> ComparisonData {
        data(
            |block, rival, seed| match (block, rival) {
                (3, 2) => None,
                (_, 1) => Some(30.0),
                (_, rival) => Some(40.0 + (seed * seed % 7) as f64 + 2.5 * rival as f64),
            },
            12,
        )
    }

    #[test]
    fn pairs_means_and_ranks() {
        let data = sample();
        let analysis = Analysis::new(&data, JOBS);
        let par2 = data.metric_index(&Metric::Par2);
        let summary = analysis.blocks[0].summaries[1][par2].unwrap();
        assert_eq!(
            (summary.n, summary.mean, summary.interval),
            (12, 30.0, (30.0, 30.0))
        );
        let completion =
            analysis.blocks[0].summaries[0][data.metric_index(&Metric::Completion)].unwrap();
        assert_eq!(completion.interval, wilson(12, 12));

        let pair = analysis.pair(0, &Metric::Par2, 0, 2).unwrap();
        assert_eq!(
            (pair.n, pair.mean, pair.median),
            (12, Some((5.0, (5.0, 5.0))), Some((5.0, (5.0, 5.0))))
        );
        assert_eq!(pair.effect, 1.0);
        assert!(pair.is_significant() && pair.adjusted >= pair.p);
        let turned = analysis.pair(0, &Metric::Par2, 2, 0).unwrap();
        assert_eq!(
            (turned.mean, turned.effect, turned.p),
            (Some((-5.0, (-5.0, -5.0))), -1.0, pair.p)
        );
        let nothing = analysis.pair(3, &Metric::Par2, 0, 2).unwrap();
        assert_eq!(
            (nothing.n, nothing.mean, nothing.is_significant()),
            (0, None, false)
        );

        let ranking = &analysis.rankings[0];
        assert_eq!(
            (ranking.friedman.blocks, &ranking.omitted_blocks[..]),
            (3, &[3][..])
        );
        assert_eq!(ranking.friedman.mean_ranks, [2.0, 1.0, 3.0]);
        assert_eq!(ranking.order(), [1, 0, 2]);
    }

    #[test]
    fn the_number_of_workers_does_not_change_the_result() {
        let data = sample();
        let pairs = |jobs| {
            Analysis::new(&data, jobs)
                .blocks
                .into_iter()
                .map(|block| block.pairs)
                .collect::<Vec<_>>()
        };
        assert_eq!(pairs(JOBS), pairs(NonZeroUsize::MIN));
    }

    #[test]
    fn the_answer_names_the_best_ties_and_missing_data() {
        let data = sample();
        let analysis = Analysis::new(&data, JOBS);
        assert_eq!(best(&data, 0), Some(0), "the oracle does not compete");
        assert!(ties(&analysis, &data, 0, 0).is_empty());
        let text = answer(&data, &analysis, &[]).join("\n");
        for part in [
            "alliance has the best mean rank by mean PAR2: 2.0 of 3",
            "1 more block is omitted",
            "Best under none: in near alliance (42 s; all others are worse); in far alliance",
            "Every counted run completed its mission.",
            "No data, because the fault never hit or every run failed: nearest in far, dead.",
        ] {
            assert!(text.contains(part), "no '{part}' in {text}");
        }
    }
}
