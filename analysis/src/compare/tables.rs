//! All numbers as tables in CSV and Parquet.

use super::analysis::Analysis;
use super::data::{Block, ComparisonData};
use super::hypotheses::Verdict;
use crate::columns::Entry::{self, Flag, Number, Text, Whole};
use crate::columns::Table;

/// A table with the name of its files.
pub struct NamedTable {
    pub name: &'static str,
    pub description: &'static str,
    pub table: Table,
}

/// Returns the settings of a block, one per column.
fn settings<'d>(
    data: &'d ComparisonData,
    block: &'d Block,
) -> impl Iterator<Item = (&'d str, Entry)> {
    let columns = data.columns.iter().zip(&block.settings);
    columns.map(|(column, setting)| (column.as_str(), Text(setting.clone())))
}

/// Creates all tables except that of the runs.
#[must_use]
pub fn tables(data: &ComparisonData, analysis: &Analysis, verdicts: &[Verdict]) -> Vec<NamedTable> {
    let tables = [
        (
            "cells",
            "each metric of each allocator in each block: mean with 95 % interval, quantiles",
            cells(data, analysis),
        ),
        (
            "pairs",
            "each pair of allocators in each block: differences with 95 % intervals, effect, p, and p with Holm's correction",
            pairs(data, analysis),
        ),
        (
            "ranks",
            "mean ranks over all blocks, by metric",
            ranks(data, analysis),
        ),
        (
            "nemenyi",
            "each pair of allocators over all blocks: difference of mean ranks and p",
            differences(data, analysis),
        ),
        (
            "hypotheses",
            "the claims and the outcome of each part",
            claims(data, verdicts),
        ),
    ];
    let filled = tables.into_iter().filter(|(_, _, table)| table.rows() > 0);
    filled
        .map(|(name, description, table)| NamedTable {
            name,
            description,
            table,
        })
        .collect()
}

fn cells(data: &ComparisonData, analysis: &Analysis) -> Table {
    let mut table = Table::default();
    for (block, found) in data.blocks.iter().zip(&analysis.blocks) {
        for (rival, cell) in block.cells.iter().enumerate() {
            for (place, metric) in data.metrics.iter().enumerate() {
                let summary = found.summaries[rival][place].as_ref();
                let quantile = |at: usize| Number(summary.map(|summary| summary.quantiles[at]));
                let [mean, from, to] =
                    Entry::with_interval(summary.map(|summary| (summary.mean, summary.interval)));
                let row = [
                    ("allocator", Text(data.allocators[rival].clone())),
                    ("cell", Whole(cell.number)),
                    ("runs", Whole(cell.runs)),
                    ("failed", Whole(cell.failed)),
                    ("not_hit", Whole(cell.without_effect)),
                    ("equal", Flag(cell.is_constant)),
                    ("metric", Text(metric.name())),
                    ("n", Whole(summary.map_or(0, |summary| summary.n))),
                    ("mean", mean),
                    ("mean_from", from),
                    ("mean_to", to),
                    ("min", quantile(0)),
                    ("q05", quantile(1)),
                    ("q25", quantile(2)),
                    ("median", quantile(3)),
                    ("q75", quantile(4)),
                    ("q95", quantile(5)),
                    ("max", quantile(6)),
                ];
                table.add(settings(data, block).chain(row));
            }
        }
    }
    table
}

fn pairs(data: &ComparisonData, analysis: &Analysis) -> Table {
    let mut table = Table::default();
    for (block, found) in data.blocks.iter().zip(&analysis.blocks) {
        for (metric, pairs) in &found.pairs {
            for pair in pairs.iter().filter(|pair| pair.n > 0) {
                let [mean, mean_from, mean_to] = Entry::with_interval(pair.mean);
                let [median, median_from, median_to] = Entry::with_interval(pair.median);
                let row = [
                    ("metric", Text(metric.name())),
                    ("first", Text(data.allocators[pair.first].clone())),
                    ("second", Text(data.allocators[pair.second].clone())),
                    ("n", Whole(pair.n)),
                    ("mean_difference", mean),
                    ("mean_from", mean_from),
                    ("mean_to", mean_to),
                    ("median_difference", median),
                    ("median_from", median_from),
                    ("median_to", median_to),
                    ("effect", Number(Some(pair.effect))),
                    ("p", Number(pair.p)),
                    ("p_holm", Number(pair.adjusted)),
                    ("differ", Flag(pair.is_significant())),
                ];
                table.add(settings(data, block).chain(row));
            }
        }
    }
    table
}

fn ranks(data: &ComparisonData, analysis: &Analysis) -> Table {
    let mut table = Table::default();
    for ranking in &analysis.rankings {
        for place in ranking.order() {
            table.add([
                ("metric", Text(ranking.name.clone())),
                ("allocator", Text(data.allocators[place].clone())),
                (
                    "mean_rank",
                    Number(Some(ranking.friedman.mean_ranks[place])),
                ),
                ("blocks", Whole(ranking.friedman.blocks)),
                ("blocks_left_out", Whole(ranking.omitted_blocks.len())),
                ("chi_squared", Number(Some(ranking.friedman.statistic))),
                ("p", Number(Some(ranking.friedman.p))),
                ("critical_difference", Number(Some(ranking.critical))),
            ]);
        }
    }
    table
}

fn differences(data: &ComparisonData, analysis: &Analysis) -> Table {
    let mut table = Table::default();
    for ranking in &analysis.rankings {
        let order = ranking.order();
        for (place, first) in order.iter().enumerate() {
            for second in &order[place + 1..] {
                let ranks = &ranking.friedman.mean_ranks;
                table.add([
                    ("metric", Text(ranking.name.clone())),
                    ("first", Text(data.allocators[*first].clone())),
                    ("second", Text(data.allocators[*second].clone())),
                    ("difference", Number(Some(ranks[*second] - ranks[*first]))),
                    ("p", Number(Some(ranking.p(*first, *second)))),
                ]);
            }
        }
    }
    table
}

fn claims(data: &ComparisonData, verdicts: &[Verdict]) -> Table {
    let mut table = Table::default();
    for verdict in verdicts {
        for part in &verdict.parts {
            let [mean, from, to] = Entry::with_interval(part.found);
            let row = [
                ("claim", Text(part.claim.clone())),
                ("mean", mean),
                ("mean_from", from),
                ("mean_to", to),
                ("part", Text(part.outcome.as_str().to_owned())),
            ];
            let head = [
                ("hypothesis", Text(verdict.name.clone())),
                ("outcome", Text(verdict.outcome.as_str().to_owned())),
            ];
            table.add(
                head.into_iter()
                    .chain(settings(data, &data.blocks[part.block]))
                    .chain(row),
            );
        }
    }
    table
}
