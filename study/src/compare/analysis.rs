//! Every cell by itself, every two allocators of a block, and all allocators over all blocks.

use std::num::NonZeroUsize;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::thread;

use super::data::{Block, Data, mean};
use super::metrics::Metric;
use super::statistics::bootstrap::{means, median_differences};
use super::statistics::friedman::{Friedman, friedman};
use super::statistics::holm::holm;
use super::statistics::mcnemar::mcnemar;
use super::statistics::nemenyi::{critical_difference, nemenyi};
use super::statistics::wilcoxon::wilcoxon;
use crate::sweep::statistics::{Interval, quantile, wilson};

/// Of all intervals.
pub const LEVEL: f64 = 0.95;

/// A p value below it counts.
pub const SIGNIFICANT: f64 = 0.05;

/// What two allocators are compared by within a block.
pub const PAIRED: [Metric; 3] = [Metric::Completion, Metric::Par2, Metric::Makespan];

/// What all are ranked by over all blocks.
pub const RANKED: [Metric; 5] = [
    Metric::Par2,
    Metric::Completion,
    Metric::Observed,
    Metric::Bytes,
    Metric::Distance,
];

/// Everything that is computed.
pub struct Analysis {
    /// By block.
    pub blocks: Vec<BlockAnalysis>,
    /// By [`RANKED`]; without those that too few blocks have.
    pub rankings: Vec<Ranking>,
}

/// A block.
#[derive(Clone, Debug, Default)]
pub struct BlockAnalysis {
    /// By allocator and metric; `None` without data.
    pub summaries: Vec<Vec<Option<Summary>>>,
    /// By [`PAIRED`], and all pairs of allocators.
    pub pairs: Vec<Vec<Pair>>,
}

/// Values of a cell.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Summary {
    /// How many.
    pub n: usize,
    /// Their mean.
    pub mean: f64,
    /// Of the mean; for completion Wilson's.
    pub interval: Interval,
    /// Least, 5 %, 25 %, 50 %, 75 %, 95 %, greatest.
    pub quantiles: [f64; 7],
}

/// Two allocators in a block, by the seeds that both have.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pair {
    /// Place of the first allocator.
    pub first: usize,
    /// Place of the second one.
    pub second: usize,
    /// Seeds.
    pub n: usize,
    /// The mean of the second less the first, with its interval.
    pub mean: Option<(f64, Interval)>,
    /// The median of the second less that of the first, with its interval.
    pub median: Option<(f64, Interval)>,
    /// From -1, the second always less, to 1: the rank-biserial correlation; of completion the difference of shares.
    pub effect: f64,
    /// By Wilcoxon's test; of completion by McNemar's.
    pub p: f64,
    /// Among all pairs of the block, by Holm's correction.
    pub adjusted: f64,
}

impl Pair {
    /// Whether the difference is no accident.
    #[must_use]
    pub fn is_real(&self) -> bool {
        self.adjusted < SIGNIFICANT
    }
}

/// All allocators over all blocks that have data of each.
#[derive(Clone, Debug, PartialEq)]
pub struct Ranking {
    /// By what.
    pub metric: Metric,
    /// The test.
    pub friedman: Friedman,
    /// How far mean ranks must lie apart.
    pub critical: f64,
    /// Blocks in which an allocator has no data.
    pub left_out: Vec<usize>,
}

impl Ranking {
    /// Places of the allocators, the best one first.
    #[must_use]
    pub fn order(&self) -> Vec<usize> {
        let ranks = &self.friedman.mean_ranks;
        let mut order: Vec<usize> = (0..ranks.len()).collect();
        order.sort_by(|a, b| ranks[*a].total_cmp(&ranks[*b]));
        order
    }

    /// p of two of them, by Nemenyi's test.
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
    /// Computes all of it, several blocks side by side.
    #[must_use]
    pub fn of(data: &Data, jobs: NonZeroUsize) -> Self {
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
                        .for_each(|(number, it)| blocks[number] = it),
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

    /// A pair of a block by a metric of [`PAIRED`], as seen by the first: turned round where that is needed.
    #[must_use]
    pub fn pair(&self, block: usize, metric: &Metric, first: usize, second: usize) -> Option<Pair> {
        let place = PAIRED.iter().position(|it| it == metric)?;
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
        let turn =
            |found: Option<(f64, Interval)>| found.map(|(it, (from, to))| (-it, (-to, -from)));
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

fn analyse(data: &Data, block: &Block) -> BlockAnalysis {
    BlockAnalysis {
        summaries: summaries(data, block),
        pairs: PAIRED
            .iter()
            .map(|metric| pairs(data, block, metric))
            .collect(),
    }
}

fn summaries(data: &Data, block: &Block) -> Vec<Vec<Option<Summary>>> {
    let columns: Vec<Vec<f64>> = block
        .cells
        .iter()
        .flat_map(|cell| (0..data.metrics.len()).map(|metric| cell.present(metric)))
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
                // Of ones and zeros the sum counts the ones.
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

fn pairs(data: &Data, block: &Block, metric: &Metric) -> Vec<Pair> {
    let place = data.place(metric);
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
                .map(|(it, other)| it - other)
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
    // Medians of zeros and ones say little.
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
                let count = |sign: f64| differences.iter().filter(|it| **it == sign).count() as u64;
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
    // Those without a common seed are no tests.
    let tested: Vec<usize> = (0..pairs.len()).filter(|it| pairs[*it].n > 0).collect();
    let p: Vec<f64> = tested.iter().map(|it| pairs[*it].p).collect();
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

fn ranking(data: &Data, metric: &Metric) -> Option<Ranking> {
    let place = data.place(metric);
    let sign = if metric.more_is_better() { -1.0 } else { 1.0 };
    let mut left_out = Vec::new();
    let mut blocks = Vec::new();
    for (number, block) in data.blocks.iter().enumerate() {
        let means = block
            .cells
            .iter()
            .map(|cell| Some(sign * cell.mean(place)?));
        let means: Option<Vec<f64>> = means.collect();
        // Where all are alike, such as in a mission that ends when its time is up, there is nothing to be ranked.
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
        left_out,
    })
}

#[cfg(test)]
mod tests {
    use super::super::answer::{answer, best, ties};
    use super::super::data::tests::data;
    use super::*;

    const JOBS: NonZeroUsize = NonZeroUsize::new(3).unwrap();

    /// nearest needs 5 s more than alliance; in the last block it has no data.
    fn some() -> Data {
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
        let data = some();
        let analysis = Analysis::of(&data, JOBS);
        let par2 = data.place(&Metric::Par2);
        let summary = analysis.blocks[0].summaries[1][par2].unwrap();
        assert_eq!(
            (summary.n, summary.mean, summary.interval),
            (12, 30.0, (30.0, 30.0))
        );
        let completion = analysis.blocks[0].summaries[0][data.place(&Metric::Completion)].unwrap();
        assert_eq!(completion.interval, wilson(12, 12));

        let pair = analysis.pair(0, &Metric::Par2, 0, 2).unwrap();
        assert_eq!(
            (pair.n, pair.mean, pair.median),
            (12, Some((5.0, (5.0, 5.0))), Some((5.0, (5.0, 5.0))))
        );
        assert_eq!(pair.effect, 1.0);
        assert!(pair.is_real() && pair.adjusted >= pair.p);
        let turned = analysis.pair(0, &Metric::Par2, 2, 0).unwrap();
        assert_eq!(
            (turned.mean, turned.effect, turned.p),
            (Some((-5.0, (-5.0, -5.0))), -1.0, pair.p)
        );
        let nothing = analysis.pair(3, &Metric::Par2, 0, 2).unwrap();
        assert_eq!(
            (nothing.n, nothing.mean, nothing.is_real()),
            (0, None, false)
        );

        let ranking = &analysis.rankings[0];
        assert_eq!(
            (ranking.friedman.blocks, &ranking.left_out[..]),
            (3, &[3][..])
        );
        assert_eq!(ranking.friedman.mean_ranks, [2.0, 1.0, 3.0]);
        assert_eq!(ranking.order(), [1, 0, 2]);
    }

    #[test]
    fn as_many_workers_as_you_like() {
        let data = some();
        let pairs = |jobs| {
            Analysis::of(&data, jobs)
                .blocks
                .into_iter()
                .map(|it| it.pairs)
                .collect::<Vec<_>>()
        };
        assert_eq!(pairs(JOBS), pairs(NonZeroUsize::MIN));
    }

    #[test]
    fn the_answer_names_the_best_those_that_are_like_it_and_what_is_no_data() {
        let data = some();
        let analysis = Analysis::of(&data, JOBS);
        assert_eq!(best(&data, 0), Some(0), "the oracle is no rival");
        assert!(ties(&analysis, &data, 0, 0).is_empty());
        let said = answer(&data, &analysis, &[]).join("\n");
        for part in [
            "alliance copes best: mean rank 2.0 of 3 by mean PAR2",
            "1 more block is left out",
            "Best under none: in near alliance (42 s; all others are worse); in far alliance",
            "Every run that counts completed its mission.",
            "No data, for the fault never hit or every run failed: nearest in far, dead.",
        ] {
            assert!(said.contains(part), "no '{part}' in {said}");
        }
    }
}
