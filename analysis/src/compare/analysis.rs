//! The statistics of each cell, of each pair of allocators in a block, and of all allocators over all blocks.

#[cfg(test)]
mod tests;

use std::collections::BTreeSet;
use std::num::NonZeroUsize;

use super::data::{Block, ComparisonData};
use super::metrics::Metric;
use super::power::least_p;
use super::statistics::bootstrap::{means, median_differences};
use super::statistics::friedman::{Friedman, friedman};
use super::statistics::holm::holm;
use super::statistics::mcnemar::mcnemar;
use super::statistics::nemenyi::{critical_difference, nemenyi};
use super::statistics::wilcoxon::wilcoxon;
use super::statistics::{LEVEL, SIGNIFICANT};
use crate::distinct;
use crate::sweep::statistics::{Interval, mean, quantile, wilson};
use crate::workers::run_parallel;

/// The further metrics of the rankings over all blocks.
const RANKED: [Metric; 3] = [Metric::Completion, Metric::Bytes, Metric::Distance];

/// The name of the ranking by the deciding metrics, if they differ between blocks.
pub const PRIMARY: &str = "primary";

pub struct Analysis {
    pub blocks: Vec<BlockAnalysis>,
    /// One entry per ranking for which enough blocks have data; the ranking by the primary metrics is the first.
    pub rankings: Vec<Ranking>,
}

#[derive(Clone, Debug, Default)]
pub struct BlockAnalysis {
    /// Summaries by allocator and metric; `None` without data.
    pub summaries: Vec<Vec<Option<Summary>>>,
    /// All pairs of allocators, by metric.
    pub pairs: Vec<(Metric, Vec<Pair>)>,
}

/// Returns the metrics of the paired comparisons within a block.
fn paired(data: &ComparisonData, block: usize) -> Vec<Metric> {
    let common = [Metric::Completion, Metric::Par2, Metric::Makespan];
    let primary = data.blocks[block].primary.clone();
    let deciding = data.deciding(block).cloned();
    distinct(common.into_iter().chain([primary]).chain(deciding))
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
    /// The p value of Wilcoxon's test; for completion that of McNemar's test. `None` without a common seed, and if the
    /// seed has no effect on either allocator: their difference is then exact.
    pub p: Option<f64>,
    /// The p value after Holm's correction over all tested pairs of the block.
    pub adjusted: Option<f64>,
}

impl Pair {
    /// Checks whether both allocators have the same value with each seed.
    #[must_use]
    pub fn is_equal(&self) -> bool {
        self.mean == Some((0.0, (0.0, 0.0)))
    }

    /// Checks whether the difference is exact, because the seed has no effect on either allocator. No test applies.
    #[must_use]
    pub fn is_exact(&self) -> bool {
        self.n > 0 && self.p.is_none()
    }

    /// Checks whether the difference is exact or significant.
    #[must_use]
    pub fn is_significant(&self) -> bool {
        match self.adjusted {
            Some(p) => p < SIGNIFICANT,
            None => self.effect != 0.0,
        }
    }
}

impl BlockAnalysis {
    /// Checks whether the seed has no effect on any pair of allocators with data.
    #[must_use]
    pub fn has_no_chance(&self) -> bool {
        let pairs = self.pairs.iter().flat_map(|(_, pairs)| pairs);
        let mut pairs = pairs.filter(|pair| pair.n > 0).peekable();
        pairs.peek().is_some() && pairs.all(Pair::is_exact)
    }

    /// Checks whether the number of pairs of runs suffices for a significant difference by a metric.
    #[must_use]
    pub fn can_differ(&self, metric: &Metric) -> bool {
        let of_metric = self.pairs.iter().filter(|(paired, _)| paired == metric);
        let tested = of_metric.flat_map(|(_, pairs)| pairs);
        let tested = tested.filter(|pair| pair.p.is_some());
        let most = tested.clone().map(|pair| pair.n).max();
        most.is_none_or(|most| least_p(most, tested.count()) < SIGNIFICANT)
    }
}

/// The ranking of all allocators over the blocks in which each of them has data.
#[derive(Clone, Debug, PartialEq)]
pub struct Ranking {
    /// The name of the metric, or "primary" for the primary metric of each block's mission.
    pub name: String,
    pub is_primary: bool,
    /// The meaning of rank 1: best, most or least.
    pub first: &'static str,
    pub friedman: Friedman,
    /// The interval of each mean rank, from resamples of the blocks.
    pub intervals: Vec<Interval>,
    /// The critical difference of mean ranks.
    pub critical: f64,
    /// The indices of the ranked blocks.
    pub blocks: Vec<usize>,
    /// The indices of the omitted blocks: an allocator has no data, or all allocators are equal.
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

    /// Returns the mean ranks over the blocks that `counts` selects, or `None` if it selects none.
    #[must_use]
    pub fn mean_ranks_over(&self, counts: impl Fn(usize) -> bool) -> Option<Vec<f64>> {
        let blocks = self.blocks.iter().zip(&self.friedman.ranks);
        let ranks: Vec<&Vec<f64>> = blocks
            .filter_map(|(block, ranks)| counts(*block).then_some(ranks))
            .collect();
        let places = 0..self.friedman.mean_ranks.len();
        let means = places.map(|place| {
            let column: Vec<f64> = ranks.iter().map(|ranks| ranks[place]).collect();
            mean(&column)
        });
        means.collect()
    }

    /// Returns the p value of two allocators by Nemenyi's test.
    #[must_use]
    pub fn p(&self, first: usize, second: usize) -> f64 {
        let ranks = &self.friedman.mean_ranks;
        let difference = ranks[first] - ranks[second];
        nemenyi(difference, ranks.len(), self.friedman.blocks)
    }
}

impl Analysis {
    /// Computes all statistics on `jobs` threads.
    #[must_use]
    pub fn new(data: &ComparisonData, jobs: NonZeroUsize) -> Self {
        let mut blocks = vec![BlockAnalysis::default(); data.blocks.len()];
        let numbers: Vec<usize> = (0..blocks.len()).collect();
        let analyse = |number: usize, _: &dyn Fn() -> bool| Some((number, analyse(data, number)));
        let done = run_parallel(&numbers, jobs, &|| false, analyse, |(number, block)| {
            blocks[number] = block;
            Ok(())
        });
        debug_assert!(done.is_ok(), "storing a block cannot fail");
        Self {
            blocks,
            rankings: rankings(data),
        }
    }

    /// Returns the ranking by the primary metrics, if enough blocks have data.
    #[must_use]
    pub fn primary(&self) -> Option<&Ranking> {
        self.rankings.iter().find(|ranking| ranking.is_primary)
    }

    /// Returns the comparison of two allocators by the deciding metric of a block, or by PAR2 if all their runs are equal
    /// by it. The signs are as seen from `first`.
    #[must_use]
    pub fn decided<'d>(
        &self,
        data: &'d ComparisonData,
        block: usize,
        (first, second): (usize, usize),
    ) -> Option<(&'d Metric, Pair)> {
        let primary = &data.blocks[block].primary;
        let deciding = data.deciding(block).unwrap_or(primary);
        let pair = self.pair(block, deciding, first, second)?;
        if !pair.is_equal() {
            return Some((deciding, pair));
        }
        Some((
            &Metric::Par2,
            self.pair(block, &Metric::Par2, first, second)?,
        ))
    }

    /// Returns the comparison of two allocators by a paired metric, with the signs as seen from `first`.
    #[must_use]
    pub fn pair(&self, block: usize, metric: &Metric, first: usize, second: usize) -> Option<Pair> {
        let mut by_metric = self.blocks[block].pairs.iter();
        let (_, pairs) = by_metric.find(|(paired, _)| paired == metric)?;
        pairs
            .iter()
            .find_map(|pair| match (pair.first, pair.second) {
                both if both == (first, second) => Some(*pair),
                both if both == (second, first) => Some(pair.turned()),
                _ => None,
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

fn analyse(data: &ComparisonData, number: usize) -> BlockAnalysis {
    let block = &data.blocks[number];
    let metrics = paired(data, number).into_iter();
    let pairs = metrics.map(|metric| (metric.clone(), pairs(data, block, &metric)));
    BlockAnalysis {
        summaries: summaries(data, block),
        pairs: pairs.collect(),
    }
}

fn summaries(data: &ComparisonData, block: &Block) -> Vec<Vec<Option<Summary>>> {
    let cells = block.cells.iter();
    let columns =
        cells.flat_map(|cell| (0..data.metrics.len()).map(|metric| cell.values_of(metric)));
    let columns: Vec<Vec<f64>> = columns.collect();
    let resampled = means(&columns);
    let all = columns.into_iter().zip(resampled).enumerate();
    let all = all.map(|(place, (mut values, resampled))| {
        let mean = mean(&values)?;
        let n = values.len();
        let cell = &block.cells[place / data.metrics.len()];
        let is_share = data.metrics[place % data.metrics.len()] == Metric::Completion;
        let interval = if is_share && !cell.is_constant {
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
    });
    let all: Vec<Option<Summary>> = all.collect();
    all.chunks(data.metrics.len()).map(<[_]>::to_vec).collect()
}

fn pairs(data: &ComparisonData, block: &Block, metric: &Metric) -> Vec<Pair> {
    let place = data.metric_index(metric);
    let count = block.cells.len();
    let members =
        (0..count).flat_map(|first| (first + 1..count).map(move |second| (first, second)));
    let members: Vec<(usize, usize)> = members.collect();
    let both = members.iter();
    // In steps of the metric's grid, differences are exact.
    let steps = |values: Vec<f64>| -> Vec<f64> {
        values.iter().map(|value| metric.steps(*value)).collect()
    };
    let both: Vec<(Vec<f64>, Vec<f64>)> = both
        .map(|&(first, second)| block.cells[first].paired(&block.cells[second], place))
        .map(|(first, second)| (steps(first), steps(second)))
        .collect();
    let differences = both
        .iter()
        .map(|(first, second)| second.iter().zip(first).map(|(b, a)| b - a).collect());
    let differences: Vec<Vec<f64>> = differences.collect();
    let scale = metric.steps_per_unit();
    let scaled = |(from, to): Interval| (from / scale, to / scale);
    let of_means = means(&differences);
    let is_share = *metric == Metric::Completion;
    // Medians of zeros and ones are not informative.
    let of_medians = if is_share {
        Vec::new()
    } else {
        median_differences(&both)
    };
    let pairs = members.iter().enumerate();
    let pairs = pairs.map(|(number, &(first, second))| {
        let differences = &differences[number];
        let mean = mean(differences).map(|mean| mean / scale);
        let is_exact = block.cells[first].is_constant && block.cells[second].is_constant;
        let interval = of_means[number].interval(LEVEL);
        let (effect, p) = if is_share {
            let count =
                |sign: f64| differences.iter().filter(|found| **found == sign).count() as u64;
            (mean.unwrap_or(0.0), mcnemar(count(-1.0), count(1.0)))
        } else {
            let found = wilcoxon(differences);
            (found.effect, found.p)
        };
        Pair {
            first,
            second,
            n: differences.len(),
            mean: mean.zip(interval.map(scaled)),
            median: of_medians.get(number).and_then(|resampled| {
                let (first, second) = &both[number];
                let difference = (median(second)? - median(first)?) / scale;
                Some((difference, scaled(resampled.interval(LEVEL)?)))
            }),
            effect,
            p: Some(p).filter(|_| !differences.is_empty() && !is_exact),
            adjusted: None,
        }
    });
    let mut pairs: Vec<Pair> = pairs.collect();
    let p: Vec<f64> = pairs.iter().filter_map(|pair| pair.p).collect();
    let tested = pairs.iter_mut().filter(|pair| pair.p.is_some());
    for (pair, adjusted) in tested.zip(holm(&p)) {
        pair.adjusted = Some(adjusted);
    }
    pairs
}

fn median(values: &[f64]) -> Option<f64> {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    (!sorted.is_empty()).then(|| quantile(&sorted, 0.5))
}

fn rankings(data: &ComparisonData) -> Vec<Ranking> {
    let blocks = 0..data.blocks.len();
    let deciding: BTreeSet<&Metric> = blocks
        .map(|block| data.deciding(block).unwrap_or(&data.blocks[block].primary))
        .collect();
    let name = match deciding.first() {
        Some(only) if deciding.len() == 1 => only.name(),
        _ => PRIMARY.to_owned(),
    };
    let primary = ranking(data, |block| {
        data.deciding(block)?;
        data.order(block)
            .into_iter()
            .map(|place| Some(place? as f64))
            .collect()
    });
    let primary = primary.map(|ranking| Ranking {
        name,
        is_primary: true,
        first: "best",
        ..ranking
    });
    let further = RANKED.iter().filter_map(|metric| {
        let ranking = ranking(data, |block| {
            let rivals = 0..data.allocators.len();
            let means = rivals.map(|rival| Some(metric.sign() * data.mean(block, rival, metric)?));
            means
                .collect::<Option<Vec<f64>>>()
                .filter(|_| !data.are_equal(block, metric))
        })?;
        let more = usize::from(metric.more_is_better());
        Some(Ranking {
            name: metric.name(),
            first: ["least", "most"][more],
            ..ranking
        })
    });
    primary.into_iter().chain(further).collect()
}

/// Ranks the allocators in each block. `values` returns their values, less is better, or `None` if an allocator has no data
/// or all are equal.
fn ranking(data: &ComparisonData, values: impl Fn(usize) -> Option<Vec<f64>>) -> Option<Ranking> {
    let (mut blocks, mut omitted_blocks, mut ranked) = (Vec::new(), Vec::new(), Vec::new());
    for number in 0..data.blocks.len() {
        match values(number) {
            Some(values) => {
                blocks.push(number);
                ranked.push(values);
            }
            None => omitted_blocks.push(number),
        }
    }
    let friedman = friedman(&ranked)?;
    let places = 0..data.allocators.len();
    let columns = places.map(|place| friedman.ranks.iter().map(|ranks| ranks[place]).collect());
    let columns: Vec<Vec<f64>> = columns.collect();
    let intervals = means(&columns).into_iter();
    Some(Ranking {
        name: String::new(),
        is_primary: false,
        first: "",
        critical: critical_difference(SIGNIFICANT, data.allocators.len(), friedman.blocks),
        intervals: intervals
            .filter_map(|resampled| resampled.interval(LEVEL))
            .collect(),
        friedman,
        blocks,
        omitted_blocks,
    })
}
