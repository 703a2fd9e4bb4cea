//! The statistics of each cell, of each pair of allocators in a block, and of all allocators over all blocks.

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
    let both: Vec<(Vec<f64>, Vec<f64>)> = both
        .map(|&(first, second)| block.cells[first].paired(&block.cells[second], place))
        .collect();
    let differences = both
        .iter()
        .map(|(first, second)| metric.differences(second, first));
    let differences: Vec<Vec<f64>> = differences.collect();
    let scale = metric.steps_per_unit();
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
            mean: mean.zip(interval.map(|(from, to)| (from / scale, to / scale))),
            median: of_medians.get(number).and_then(|resampled| {
                let (first, second) = &both[number];
                Some((median(second)? - median(first)?, resampled.interval(LEVEL)?))
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

#[cfg(test)]
mod tests {
    use super::super::answer::{answer, best, ties};
    use super::super::data::tests::{data, data_with, far_by, own};
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
        // All runs of the oracle are equal.
        assert_eq!(
            (summary.n, summary.mean, summary.interval),
            (1, 30.0, (30.0, 30.0))
        );
        let completion = data.metric_index(&Metric::Completion);
        let completion = analysis.blocks[0].summaries[0][completion].unwrap();
        assert_eq!(completion.interval, wilson(12, 12));

        let pair = analysis.pair(0, &Metric::Par2, 0, 2).unwrap();
        let five = Some((5.0, (5.0, 5.0)));
        assert_eq!((pair.n, pair.mean, pair.median), (12, five, five));
        assert_eq!(pair.effect, 1.0);
        assert!(pair.is_significant() && pair.adjusted >= pair.p);
        let turned = analysis.pair(0, &Metric::Par2, 2, 0).unwrap();
        assert_eq!(
            (turned.mean, turned.p),
            (Some((-5.0, (-5.0, -5.0))), pair.p)
        );
        assert_eq!(turned.effect, -1.0);
        let nothing = analysis.pair(3, &Metric::Par2, 0, 2).unwrap();
        assert_eq!((nothing.n, nothing.mean), (0, None));
        assert!(!nothing.is_significant());

        let ranking = &analysis.rankings[0];
        assert_eq!(
            (ranking.friedman.blocks, &*ranking.omitted_blocks),
            (3, &[3][..])
        );
        assert_eq!(ranking.friedman.mean_ranks, [2.0, 1.0, 3.0]);
        assert_eq!(ranking.order(), [1, 0, 2]);
    }

    #[test]
    fn the_number_of_workers_does_not_change_the_result() {
        let data = sample();
        let pairs = |jobs| {
            let blocks = Analysis::new(&data, jobs).blocks.into_iter();
            blocks.map(|block| block.pairs).collect::<Vec<_>>()
        };
        assert_eq!(pairs(JOBS), pairs(NonZeroUsize::MIN));
    }

    /// Eight pairs whose differences have the same size in whole milliseconds. As seconds, they differ in the last digits:
    /// 0.05000000000001137 and 0.049999999999954525.
    #[test]
    fn equal_differences_are_ties() {
        let signs = [-1.0, -1.0, -1.0, 1.0, 1.0, 1.0, -1.0, -1.0];
        let starts = [338.05, 211.2, 512.35, 127.85, 301.7, 64.1, 255.9, 409.15];
        let data = data(
            |_, rival, seed| Some(starts[seed] + if rival == 2 { signs[seed] * 0.05 } else { 0.0 }),
            8,
        );
        let analysis = Analysis::new(&data, JOBS);
        let pair = analysis.pair(0, &Metric::Par2, 0, 2).unwrap();
        // Eight ranks of 4.5: W⁺ = 13.5 of 36. At most 3 of 8 signs are positive in 1 + 8 + 28 + 56 of 256 cases.
        assert_eq!(pair.effect, -0.25);
        assert_eq!(pair.p, Some(2.0 * 93.0 / 256.0));
        let (mean, _) = pair.mean.unwrap();
        assert!((mean + 0.0125).abs() < 1e-12, "{mean}");
    }

    /// Two allocators whose runs are all equal have an exact difference; the number of seeds is no evidence.
    #[test]
    fn equal_runs_have_an_exact_difference() {
        let data = data(|_, rival, _| Some(30.0 + rival as f64), 8);
        let analysis = Analysis::new(&data, JOBS);
        let pair = analysis.pair(0, &Metric::Par2, 0, 2).unwrap();
        assert_eq!((pair.n, pair.effect, pair.p), (1, 1.0, None));
        assert!(pair.is_significant() && pair.adjusted.is_none());
        let completed = analysis.pair(0, &Metric::Completion, 0, 2).unwrap();
        assert!(!completed.is_significant());
        let completion = data.metric_index(&Metric::Completion);
        let summary = analysis.blocks[0].summaries[0][completion].unwrap();
        assert_eq!((summary.n, summary.interval), (1, (1.0, 1.0)));
        let found = answer(&data, &analysis, &[]);
        let details = found.details.join("\n");
        let text = "All seeds give the same run, which counts once: near, none; near, dead; far, none; far, dead.";
        assert!(details.contains(text), "{details}");
        assert_eq!(
            [&*found.sentences[0], &found.sentences[2]],
            [
                "Over 4 blocks (a block is a mission under a class of faults) alliance has the best mean rank, 1.0 of 3; \
                 all seeds give the same run, so each block is one run of each (n = 1).",
                "In 4 of 4 blocks some allocator is worse than the best, by an exact difference without a test, \
                 because all seeds give the same run (n = 1).",
            ]
        );
        assert!(!details.contains("significant"), "{details}");
    }

    /// With chance in one mission only, the tests concern that mission only.
    #[test]
    fn exact_and_tested_differences_are_told_apart() {
        let data = data(
            |block, rival, seed| {
                let varied = if block < 2 {
                    (seed * seed % 7) as f64
                } else {
                    0.0
                };
                Some(40.0 + varied + 2.5 * rival as f64)
            },
            8,
        );
        let analysis = Analysis::new(&data, JOBS);
        assert_eq!(
            answer(&data, &analysis, &[]).sentences[2],
            "In 2 of 2 blocks some allocator is significantly worse than the best; in 2 of 2 more some allocator is \
             worse than the best, by an exact difference without a test, because all seeds give the same run (n = 1)."
        );
    }

    #[test]
    fn too_few_seeds_are_named_and_not_shown_as_equality() {
        // Each pair differs in all 4 runs, but 3 pairs of allocators need 7 seeds: 2 · 3 / 2⁷ = 0.047.
        let runs = |seeds| {
            data(
                |_, rival, seed| Some(40.0 + 3.0 * rival as f64 + (seed * seed % 5) as f64 / 4.0),
                seeds,
            )
        };
        let (few, enough) = (runs(4), runs(7));
        let (of_few, of_enough) = (Analysis::new(&few, JOBS), Analysis::new(&enough, JOBS));
        assert!(!of_few.blocks[0].can_differ(&Metric::Par2));
        let found = answer(&few, &of_few, &[]);
        assert_eq!(
            found.sentences[2],
            "4 seeds are too few to show any difference within a block: with 3 allocators at least 7 are needed, so the page shows none and claims no equality."
        );
        let details = found.details.join("\n");
        assert!(
            details.contains("in near alliance (41 s; too few seeds for a difference)"),
            "{details}"
        );
        assert!(!details.contains("no significant difference"), "{details}");
        assert!(of_enough.blocks[0].can_differ(&Metric::Par2));
        assert_eq!(
            answer(&enough, &of_enough, &[]).sentences[2],
            "In 4 of 4 blocks some allocator is significantly worse than the best."
        );
    }

    #[test]
    fn allocators_are_equal_only_if_no_measure_of_the_outcome_differs() {
        let data = data(|_, _, _| Some(30.0), 4);
        let found = answer(&data, &Analysis::new(&data, JOBS), &[]);
        assert_eq!(
            found.sentences,
            [
                "All allocators with data have the same outcome by every measure.",
                "All counted runs of a block lasted the same time, so completion and time show no difference.",
                "In no block do the allocators differ by any measure of the outcome.",
            ]
        );
    }

    /// A mission that ranks its runs by another figure is judged by it, not by the equal times.
    #[test]
    fn a_mission_is_judged_by_its_own_figure() {
        let own = own("seen", "seen");
        let comparison = far_by(&own);
        let data = data_with(
            |block, rival, seed| {
                let varied = 40.0 + (seed * seed % 7) as f64 + 2.5 * rival as f64;
                Some(if block < 2 { varied } else { 60.0 })
            },
            12,
            &comparison,
        );
        let analysis = Analysis::new(&data, JOBS);
        let metric = Metric::Own(own);
        assert!(data.are_equal(2, &Metric::Par2) && !data.are_equal(2, &metric));
        // Alliance sees more in `far`, nearest is faster in no mission.
        assert_eq!([best(&data, 0), best(&data, 2)], [Some(0), Some(0)]);
        let ranking = analysis.primary().unwrap();
        assert_eq!(
            (ranking.name.as_str(), ranking.friedman.blocks),
            ("primary", 4)
        );
        let details = answer(&data, &analysis, &[]).details.join("\n");
        assert!(
            details.contains("in far alliance (seen 0.90; all others are worse)"),
            "{details}"
        );
    }

    #[test]
    fn the_answer_names_the_best_ties_and_missing_data() {
        let data = sample();
        let analysis = Analysis::new(&data, JOBS);
        assert_eq!(best(&data, 0), Some(0), "the oracle does not compete");
        assert!(ties(&analysis, &data, 0, 0).is_empty());
        let found = answer(&data, &analysis, &[]);
        assert_eq!(
            found.sentences,
            [
                "Over 3 blocks (a block is a mission under a class of faults) alliance has the best mean rank, 2.0 of 3; \
                 no other is significantly worse.",
                "Every counted run completed its mission; no data in 1 of 12 cells.",
                "In 3 of 4 blocks some allocator is significantly worse than the best.",
            ]
        );
        let details = found.details.join("\n");
        for part in [
            "Best under none: in near alliance (42 s; all others are worse); in far alliance",
            "No data, because the fault never hit or every run failed: nearest in far, dead.",
        ] {
            assert!(details.contains(part), "no '{part}' in {details}");
        }
    }
}
