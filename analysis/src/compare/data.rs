//! The rows of all runs, by block, allocator, metric and seed.

use std::collections::BTreeSet;

use missions::service::data::{DEADLOCKS, VALUE_COLLECTED, VALUE_LOST};

use super::blocks::{allocators, block_of, blocks, first_run, names, settings};
use super::cell::AllocatorCell;
use super::metrics::Metric;
use crate::distinct;
use crate::sweep::best_known::BestKnown;
use crate::sweep::comparison::{Axes, Comparison, OwnFigure};
use crate::sweep::design::{Design, FAULTS, MISSION};
use crate::sweep::results::figures_of;
use crate::sweep::run::Row;
use crate::sweep::statistics::mean;

/// The allocator with access to the ground truth. It does not compete; regret is measured against it.
pub const REFERENCE: &str = "oracle";

#[derive(Clone, Debug, PartialEq)]
pub struct ComparisonData {
    pub allocators: Vec<String>,
    /// The index of the [`REFERENCE`] in `allocators`.
    pub reference: Option<usize>,
    pub metrics: Vec<Metric>,
    pub columns: Vec<String>,
    pub blocks: Vec<Block>,
}

/// The conditions that all allocators share: a mission under a class of faults.
#[derive(Clone, Debug, PartialEq)]
pub struct Block {
    pub settings: Vec<String>,
    /// The mission with all other varied settings; empty if there is only one.
    pub mission: String,
    /// The class of faults; empty if there is only one.
    pub faults: String,
    /// The metric that ranks the runs, as declared before the first run.
    pub primary: Metric,
    /// The x values of curves.
    pub axes: Axes,
    pub cells: Vec<AllocatorCell>,
}

impl Block {
    #[must_use]
    pub fn name(&self) -> String {
        match (self.mission.as_str(), self.faults.as_str()) {
            ("", "") => "all runs".to_owned(),
            ("", only) | (only, "") => only.to_owned(),
            (mission, faults) => format!("{mission}, {faults}"),
        }
    }
}

impl ComparisonData {
    #[must_use]
    pub fn metric_index(&self, metric: &Metric) -> usize {
        // Only kinds of broadcast without traffic are absent.
        let place = self.metrics.iter().position(|known| known == metric);
        place.unwrap_or_default()
    }

    /// Returns the mean of a metric in a cell, or `None` without values. The sum is exact on the metric's grid, so that
    /// equal means are equal numbers.
    #[must_use]
    pub fn mean(&self, block: usize, rival: usize, metric: &Metric) -> Option<f64> {
        let values = self.blocks[block].cells[rival].values_of(self.metric_index(metric));
        let steps: Vec<f64> = values.iter().map(|value| metric.steps(*value)).collect();
        Some(mean(&steps)? / metric.steps_per_unit())
    }

    /// Checks whether all allocators with data have the same mean of a metric in a block.
    #[must_use]
    pub fn are_equal(&self, block: usize, metric: &Metric) -> bool {
        let rivals = 0..self.allocators.len();
        let mut means = rivals.filter_map(|rival| self.mean(block, rival, metric));
        let first = means.next();
        means.all(|mean| Some(mean) == first)
    }

    /// Returns the metrics of the outcome of a block's runs. The primary metric is the first, the time the second.
    fn outcomes(&self, block: usize) -> Vec<&Metric> {
        const COMMON: [Metric; 4] = [
            Metric::Par2,
            Metric::Done,
            Metric::Expired,
            Metric::Completion,
        ];
        let primary = &self.blocks[block].primary;
        let own = self
            .metrics
            .iter()
            .filter(|metric| matches!(metric, Metric::Own(_)));
        distinct([primary].into_iter().chain(&COMMON).chain(own))
    }

    /// Returns the metric that decides between the allocators in a block: the primary metric, unless all allocators are
    /// equal by it. Then it is the first metric of the outcome in which they differ, or `None` without one.
    #[must_use]
    pub fn deciding(&self, block: usize) -> Option<&Metric> {
        let mut outcomes = self.outcomes(block).into_iter();
        outcomes.find(|metric| !self.are_equal(block, metric))
    }

    /// Returns the metric of a figure of several blocks of a mission: the primary metric, unless all allocators are equal
    /// by it in each block and differ by another metric of the outcome.
    #[must_use]
    pub fn drawn(&self, blocks: &[usize]) -> &Metric {
        let differ = |metric: &&Metric| blocks.iter().any(|block| !self.are_equal(*block, metric));
        let mut outcomes = self.outcomes(blocks[0]).into_iter();
        outcomes
            .find(differ)
            .unwrap_or(&self.blocks[blocks[0]].primary)
    }

    /// Returns the order of the allocators with data in a block: the number of better ones. Allocators with equal means
    /// of the deciding metric are ordered by PAR2.
    #[must_use]
    pub fn order(&self, block: usize) -> Vec<Option<usize>> {
        let deciding = self.deciding(block).unwrap_or(&Metric::Par2);
        let key = |rival| {
            let value = deciding.sign() * self.mean(block, rival, deciding)?;
            Some((value, self.mean(block, rival, &Metric::Par2)?))
        };
        let keys: Vec<Option<(f64, f64)>> = (0..self.allocators.len()).map(key).collect();
        let better = |own: &(f64, f64)| keys.iter().flatten().filter(|other| *other < own).count();
        keys.iter().map(|key| key.as_ref().map(better)).collect()
    }

    #[must_use]
    pub fn missions(&self) -> Vec<&str> {
        distinct(self.blocks.iter().map(|block| block.mission.as_str()))
    }

    #[must_use]
    pub fn classes(&self) -> Vec<&str> {
        distinct(self.blocks.iter().map(|block| block.faults.as_str()))
    }

    /// Sorts the rows of all runs into blocks and cells.
    #[must_use]
    pub fn of(design: &Design, comparison: &Comparison, rows: &[Row]) -> Self {
        let rivals = allocators(design);
        let rival = rivals.map(|rivals| &design.factors[rivals]);
        let names: Vec<String> = rival.map_or_else(Vec::new, names);
        let kinds: BTreeSet<&String> = rows
            .iter()
            .filter_map(|row| figures_of(row)?.measures.as_deref())
            .flat_map(|measures| measures.sent.keys())
            .collect();
        let mut metrics = Metric::ALL.to_vec();
        let own: BTreeSet<&OwnFigure> = comparison.objectives.iter().flatten().collect();
        let is_new = |figure: &OwnFigure| !own.iter().any(|own| own.name == figure.name);
        metrics.extend(own.iter().copied().cloned().map(Metric::Own));
        metrics.extend(further_figures(rows).filter(is_new).map(Metric::Own));
        if !comparison.best_known.is_empty() {
            metrics.push(Metric::Gap);
        }
        for kind in kinds {
            metrics.push(Metric::MessagesOf(kind.clone()));
            metrics.push(Metric::BytesOf(kind.clone()));
        }
        let mut data = Self {
            reference: names.iter().position(|name| name == REFERENCE),
            allocators: names,
            columns: settings(design)
                .flat_map(|(_, factor)| factor.columns.iter().cloned())
                .collect(),
            blocks: (0..blocks(design))
                .map(|number| block(design, number, comparison, &metrics))
                .collect(),
            metrics,
        };
        let seeds = design.seeds_per_condition();
        let empty = AllocatorCell {
            values: vec![vec![None; seeds]; data.metrics.len()],
            ..AllocatorCell::default()
        };
        for block in &mut data.blocks {
            block.cells = vec![empty.clone(); data.allocators.len()];
        }
        for row in rows {
            let places = design.level_indices(row.run);
            let rival = rivals.map_or(0, |rivals| places[rivals]);
            let cell = &mut data.blocks[block_of(design, &places)].cells[rival];
            cell.number = row.run / seeds;
            cell.add(&data.metrics, row, row.run % seeds);
        }
        let cells = data.blocks.iter_mut().flat_map(|block| &mut block.cells);
        cells.for_each(AllocatorCell::find_constant);
        data.find_regret();
        let seeds: Vec<u64> = (0..seeds).map(|run| design.seed(run)).collect();
        data.find_gaps(&comparison.best_known, &seeds);
        data
    }

    fn find_regret(&mut self) {
        let par2 = self.metric_index(&Metric::Par2);
        let regret = self.metric_index(&Metric::Regret);
        let Some(reference) = self.reference else {
            return;
        };
        for block in &mut self.blocks {
            let best = block.cells[reference].values[par2].clone();
            for cell in &mut block.cells {
                let pairs = cell.values[par2].iter().zip(&best);
                let regrets = pairs.map(|(value, best)| Some((*value)? - (*best)?));
                cell.values[regret] = regrets.collect();
            }
        }
    }

    /// Sets the gaps to the best known values, for these seeds.
    fn find_gaps(&mut self, best_known: &[BestKnown], seeds: &[u64]) {
        let Some(gap) = self.metrics.iter().position(|known| *known == Metric::Gap) else {
            return;
        };
        for block in &mut self.blocks {
            for (place, seed) in seeds.iter().enumerate() {
                let mut fitting = best_known.iter().filter(|row| {
                    row.seed.is_none_or(|stated| stated == *seed)
                        && row.fits(&self.columns, &block.settings)
                });
                let Some(row) = fitting.next() else {
                    continue;
                };
                let is_its = |metric: &Metric| match &row.metric {
                    Some(name) => metric.name() == *name,
                    None => *metric == block.primary,
                };
                let Some(of) = self.metrics.iter().position(is_its) else {
                    continue;
                };
                let sign = self.metrics[of].sign();
                for cell in &mut block.cells {
                    let value = cell.values[of][place];
                    cell.values[gap][place] =
                        value.map(|value| sign * (value - row.best) / row.best.abs());
                }
            }
        }
    }
}

/// Returns the further figures of missions with values and teams, if a run has them.
fn further_figures(rows: &[Row]) -> impl Iterator<Item = OwnFigure> {
    let figures = [
        (VALUE_COLLECTED, true, "Value of the work that was done."),
        (VALUE_LOST, false, "Value of the work that expired."),
        (
            DEADLOCKS,
            false,
            "Number of times that all robots only waited for each other.",
        ),
    ];
    let has = |name: &str| {
        let mut found = rows.iter().filter_map(figures_of);
        found.any(|figures| figures.mission.get(name).number().is_some())
    };
    let figures = figures.into_iter().filter(move |(name, ..)| has(name));
    figures.map(|(name, more_is_better, meaning)| OwnFigure {
        name: name.to_owned(),
        figure: name.to_owned(),
        more_is_better,
        meaning: meaning.to_owned(),
    })
}

fn block(design: &Design, number: usize, comparison: &Comparison, metrics: &[Metric]) -> Block {
    let places = design.level_indices(first_run(design, number));
    let (mut settings_of, mut mission, mut faults) = (Vec::new(), Vec::new(), String::new());
    for (place, factor) in settings(design) {
        let cells = &factor.levels[places[place]].cells;
        for (column, cell) in factor.columns.iter().zip(cells) {
            let cell = cell.to_string();
            match column.as_str() {
                FAULTS => faults.clone_from(&cell),
                MISSION => mission.push(cell.clone()),
                // Constant settings are not part of the name.
                _ if factor.levels.len() > 1 => mission.push(format!("{column} {cell}")),
                _ => {}
            }
            settings_of.push(cell);
        }
    }
    Block {
        settings: settings_of,
        mission: mission.join(", "),
        faults,
        primary: primary(number, comparison, metrics),
        axes: comparison.axes.get(number).copied().unwrap_or(Axes {
            robots: 0,
            loss: None,
        }),
        cells: Vec::new(),
    }
}

/// Returns the primary metric of a block. In journals of older versions it is the own figure of the mission, or PAR2.
fn primary(number: usize, comparison: &Comparison, metrics: &[Metric]) -> Metric {
    let name = comparison.primary.get(number);
    let named = name.and_then(|name| metrics.iter().find(|metric| metric.name() == *name));
    let own = comparison.objectives.get(number).cloned().flatten();
    let declared = || own.map_or(Metric::Par2, Metric::Own);
    named.cloned().unwrap_or_else(declared)
}

#[cfg(test)]
pub(super) mod tests {
    use proto::tick::Outcome;

    use super::*;
    use crate::sweep::measures::ComparisonMeasures;
    use crate::sweep::results::tests::{complete, design, failed};
    use crate::sweep::run::RunResult;

    /// Creates the data of two missions under two classes of faults with three allocators and `seeds` seeds. `rows` returns the
    /// makespan; a negative value is an incomplete run, `None` a run whose fault never hit.
    pub fn data(rows: impl Fn(usize, usize, usize) -> Option<f64>, seeds: usize) -> ComparisonData {
        data_with(rows, seeds, &comparison())
    }

    /// Creates the same data with objectives. The figure `seen` falls from allocator to allocator.
    pub fn data_with(
        rows: impl Fn(usize, usize, usize) -> Option<f64>,
        seeds: usize,
        comparison: &Comparison,
    ) -> ComparisonData {
        let text = format!(
            "seeds = {seeds}\n[grid]\nallocator = ['alliance', 'oracle', 'nearest']\n\
             [missions.near]\n[missions.far]\n[faults.none]\n[faults.dead]\ntimeline = [{{ fault.kill = 'gold' }}]\n"
        );
        let design = design(&text);
        let runs = design.runs().unwrap();
        let rows: Vec<Row> = (0..runs)
            .map(|run| {
                let (block, rival) = (run / seeds / 3, run / seeds % 3);
                let mut row = row(run, rows(block, rival, run % seeds));
                if let RunResult::Ended(figures) = &mut row.end {
                    let seen = 0.9 - 0.2 * rival as f64 + 0.001 * (run % seeds % 3) as f64;
                    figures.mission.add("seen", seen);
                }
                row
            })
            .collect();
        ComparisonData::of(&design, comparison, &rows)
    }

    pub fn comparison() -> Comparison {
        Comparison {
            question: None,
            hypotheses: Vec::new(),
            axes: Vec::new(),
            objectives: Vec::new(),
            best_known: Vec::new(),
            primary: Vec::new(),
        }
    }

    pub fn own(name: &str, figure: &str) -> OwnFigure {
        OwnFigure {
            name: name.to_owned(),
            figure: figure.to_owned(),
            more_is_better: true,
            meaning: String::new(),
        }
    }

    /// Ranks the runs of the second mission by a figure.
    pub fn far_by(own: &OwnFigure) -> Comparison {
        Comparison {
            objectives: vec![None, None, Some(own.clone()), Some(own.clone())],
            ..comparison()
        }
    }

    fn row(run: usize, seconds: Option<f64>) -> Row {
        let mut row = complete(run, (seconds.unwrap_or(1.0).abs() * 1000.0).round() as u64);
        if let RunResult::Ended(figures) = &mut row.end {
            figures.measures = Some(Box::new(ComparisonMeasures {
                limit_s: 100.0,
                ..ComparisonMeasures::default()
            }));
            if seconds.is_none() {
                figures.faults.retain(|kind, _| kind == "mute");
            }
            if seconds.is_some_and(|seconds| seconds < 0.0) {
                figures.outcome = Outcome::TimeLimit;
            }
        }
        row
    }

    #[test]
    fn rows_are_sorted_into_blocks_cells_and_pairs() {
        let data = data(
            |block, rival, seed| match (block, rival, seed) {
                (1, 2, 0) => None,
                (1, 0, 1) => Some(-1.0),
                _ => Some((100 * block + 10 * rival + seed) as f64),
            },
            3,
        );
        assert_eq!(data.allocators, ["alliance", "oracle", "nearest"]);
        assert_eq!(data.reference, Some(1));
        let names: Vec<String> = data.blocks.iter().map(Block::name).collect();
        assert_eq!(
            names.join("; "),
            "near, none; near, dead; far, none; far, dead"
        );
        assert_eq!(data.missions(), ["near", "far"]);
        assert_eq!(data.classes(), ["none", "dead"]);
        let cells = data.blocks.iter().flat_map(|block| &block.cells);
        assert!(cells.map(|cell| cell.number).eq(0..12));

        let par2 = data.metric_index(&Metric::Par2);
        let dead = &data.blocks[1].cells;
        // An incomplete run counts twice the limit.
        assert_eq!(dead[0].values_of(par2), [100.0, 200.0, 102.0]);
        let makespan = data.metric_index(&Metric::Makespan);
        assert_eq!(dead[0].values_of(makespan), [100.0, 102.0]);
        assert_eq!((dead[2].without_effect, dead[2].counted()), (1, 2));
        let pairs = (vec![200.0, 102.0], vec![121.0, 122.0]);
        assert_eq!(dead[0].paired(&dead[2], par2), pairs);
        let regret = data.metric_index(&Metric::Regret);
        assert_eq!(dead[0].values_of(regret), [-10.0, 89.0, -10.0]);
        assert_eq!(dead[1].values_of(regret), [0.0; 3]);
    }

    #[test]
    fn a_failed_run_does_not_count() {
        let design = design("seeds = 2\n[grid]\nallocator = ['alliance', 'nearest']\n");
        let rows = [row(0, Some(5.0)), failed(1), row(2, None), row(3, None)];
        let data = ComparisonData::of(&design, &comparison(), &rows);
        let [block] = &data.blocks[..] else {
            panic!("{:?}", data.blocks)
        };
        assert_eq!(block.name(), "all runs");
        assert_eq!((block.cells[0].failed, block.cells[0].counted()), (1, 1));
        assert_eq!(block.cells[1].counted(), 0);
        assert_eq!(data.mean(0, 1, &Metric::Par2), None);
    }

    #[test]
    fn equal_runs_count_once() {
        let data = data(
            |_, rival, seed| Some(if rival == 0 { 40.0 + seed as f64 } else { 30.0 }),
            8,
        );
        let par2 = data.metric_index(&Metric::Par2);
        let [alliance, oracle, nearest] = &data.blocks[0].cells[..] else {
            panic!("{:?}", data.blocks[0].cells)
        };
        let constant = [alliance, oracle, nearest].map(|cell| cell.is_constant);
        assert_eq!(constant, [false, true, true]);
        assert_eq!(nearest.counted(), 8);
        assert_eq!(nearest.values_of(par2), [30.0]);
        assert_eq!(oracle.paired(nearest, par2), (vec![30.0], vec![30.0]));
        assert_eq!(alliance.paired(nearest, par2).0.len(), 8);
    }

    #[test]
    fn equal_means_are_equal_numbers() {
        // As numbers of seconds, 0.1 + 0.2 + 0.6 and 0.3 + 0.3 + 0.3 differ.
        let runs = [[0.1, 0.2, 0.6], [0.3, 0.3, 0.3], [0.6, 0.2, 0.1]];
        let data = data(|_, rival, seed| Some(runs[rival][seed]), 3);
        assert!(data.are_equal(0, &Metric::Par2));
        assert_eq!(data.mean(0, 0, &Metric::Par2), Some(0.3));
    }

    #[test]
    fn a_mission_states_the_metric_that_ranks_its_runs() {
        let own = own("on_time", "reports_made");
        let comparison = far_by(&own);
        let data = data_with(|_, _, _| Some(40.0), 2, &comparison);
        assert_eq!(data.blocks[0].primary, Metric::Par2);
        assert_eq!(data.blocks[2].primary, Metric::Own(own));
        assert_eq!(data.mean(2, 0, &data.blocks[2].primary), Some(2.0));
    }

    /// Finished work goes first, and the time decides between equal amounts of it.
    #[test]
    fn finished_work_is_ranked_before_time() {
        let design = design("seeds = 2\n[grid]\nallocator = ['alliance', 'nearest', 'static']\n");
        let rows = |done: [u64; 3]| -> Vec<Row> {
            let row = |run: usize| {
                let mut row = row(run, Some([50.0, 40.0, 30.0][run / 2]));
                if let RunResult::Ended(figures) = &mut row.end {
                    figures.done = Some(done[run / 2]);
                }
                row
            };
            (0..6).map(row).collect()
        };
        let comparison = Comparison {
            primary: vec!["done".to_owned()],
            ..comparison()
        };
        let order = |done| {
            let data = ComparisonData::of(&design, &comparison, &rows(done));
            assert_eq!(data.blocks[0].primary, Metric::Done);
            (data.deciding(0).cloned(), data.order(0))
        };
        let places = |order: [usize; 3]| order.map(Some).to_vec();
        let expected = (Some(Metric::Done), places([1, 0, 2]));
        assert_eq!(order([10, 10, 8]), expected);
        let expected = (Some(Metric::Par2), places([2, 1, 0]));
        assert_eq!(order([10, 10, 10]), expected);
    }

    #[test]
    fn figures_of_values_are_metrics_if_a_run_has_them() {
        let design = design("seeds = 1\n[grid]\nallocator = ['alliance', 'nearest']\n");
        let mut rows = [row(0, Some(5.0)), row(1, Some(5.0))];
        if let RunResult::Ended(figures) = &mut rows[1].end {
            figures.mission.add("value_lost", 3.0);
        }
        let data = ComparisonData::of(&design, &comparison(), &rows);
        let own = data
            .metrics
            .iter()
            .filter(|metric| matches!(metric, Metric::Own(_)));
        let [lost] = own.collect::<Vec<_>>()[..] else {
            panic!("{:?}", data.metrics)
        };
        assert_eq!(
            (lost.name(), data.mean(0, 1, lost)),
            ("value_lost".to_owned(), Some(3.0))
        );
    }

    /// By hand: 121 s is 10 % worse than 110 s. The figure `seen` of the second mission is 0.9, 0.7 and 0.5, and more is
    /// better, so that 0.7 is worse than 1.0 by 30 %.
    #[test]
    fn a_gap_is_the_relative_difference_to_the_best_known_value() {
        let row = |mission: &str, seed, best| BestKnown {
            settings: [("mission".to_owned(), mission.to_owned())].into(),
            seed,
            metric: None,
            best,
        };
        let comparison = Comparison {
            best_known: vec![row("near", Some(2), 110.0), row("far", None, 1.0)],
            ..far_by(&own("seen", "seen"))
        };
        let data = data_with(|_, _, _| Some(121.0), 3, &comparison);
        let gap = data.metric_index(&Metric::Gap);
        assert_eq!(data.metrics[gap], Metric::Gap);
        let near = &data.blocks[0].cells[1].values[gap];
        let far = &data.blocks[3].cells[1].values[gap];
        let found = |value: Option<f64>| value.map(|value| (1000.0 * value).round());
        assert_eq!(
            near.iter().map(|value| found(*value)).collect::<Vec<_>>(),
            [None, Some(100.0), None]
        );
        assert_eq!(found(far[0]), Some(300.0));
    }
}
