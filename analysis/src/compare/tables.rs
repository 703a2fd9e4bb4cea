//! All numbers as tables in CSV and Parquet.

use super::analysis::{Analysis, Summary};
use super::answer::best;
use super::data::{Block, ComparisonData};
use super::hypotheses::Verdict;
use crate::columns::latex::{self, LatexCell};
use crate::columns::{Entry, Table};
use crate::page::number as number_of;

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
    columns.map(|(column, setting)| (column.as_str(), Entry::text(setting)))
}

/// Creates all tables except that of the runs.
#[must_use]
pub fn tables(data: &ComparisonData, analysis: &Analysis, verdicts: &[Verdict]) -> Vec<NamedTable> {
    let named = |name, description, table| NamedTable {
        name,
        description,
        table,
    };
    let mut tables = vec![
        named(
            "cells",
            "each metric of each allocator in each block: mean with 95 % interval, quantiles",
            cells(data, analysis),
        ),
        named(
            "pairs",
            "each pair of allocators in each block: differences with 95 % intervals, effect, p, and p with Holm's correction",
            pairs(data, analysis),
        ),
        named(
            "ranks",
            "mean ranks over all blocks, by metric",
            ranks(data, analysis),
        ),
        named(
            "nemenyi",
            "each pair of allocators over all blocks: difference of mean ranks and p",
            differences(data, analysis),
        ),
        named(
            "hypotheses",
            "the claims and the outcome of each part",
            claims(data, verdicts),
        ),
    ];
    tables.retain(|named| named.table.rows() > 0);
    tables
}

/// The name of the file with the table of [`latex`].
pub const LATEX: &str = "cells.tex";

/// Returns the means of the primary metrics with their intervals as a table for LaTeX: a row per block, a column per
/// allocator, and the best of each block in bold.
#[must_use]
pub fn latex(data: &ComparisonData, analysis: &Analysis) -> String {
    let heads = ["block", "metric"].map(str::to_owned).into_iter();
    let heads: Vec<String> = heads.chain(data.allocators.iter().cloned()).collect();
    let rows = data.blocks.iter().enumerate().map(|(number, block)| {
        let place = data.metric_index(&block.primary);
        let best = best(data, number);
        let name = block.name();
        let named = [name.as_str(), &block.primary.heading()].map(LatexCell::new);
        let rivals = analysis.blocks[number].summaries.iter().enumerate();
        let means = rivals.map(|(rival, metrics)| LatexCell {
            text: metrics[place].as_ref().map_or_else(
                || "–".to_owned(),
                |Summary {
                     mean,
                     interval: (from, to),
                     ..
                 }| {
                    format!(
                        "{} [{} – {}]",
                        number_of(*mean),
                        number_of(*from),
                        number_of(*to)
                    )
                },
            ),
            is_best: best == Some(rival),
        });
        named.into_iter().chain(means).collect()
    });
    let note = "Means of the primary metric of each mission with 95 % intervals. Bold: the best, except the oracle.";
    latex::table("comparison", note, &heads, &rows.collect::<Vec<_>>())
}

fn cells(data: &ComparisonData, analysis: &Analysis) -> Table {
    let mut table = Table::default();
    for (block, found) in data.blocks.iter().zip(&analysis.blocks) {
        for (rival, cell) in block.cells.iter().enumerate() {
            for (place, metric) in data.metrics.iter().enumerate() {
                let summary = found.summaries[rival][place].as_ref();
                let quantile =
                    |at: usize| Entry::computed(summary.map(|summary| summary.quantiles[at]));
                let [mean, from, to] =
                    Entry::with_interval(summary.map(|summary| (summary.mean, summary.interval)));
                let row = [
                    ("allocator", Entry::text(&data.allocators[rival])),
                    ("cell", Entry::count(cell.number)),
                    ("runs", Entry::count(cell.runs)),
                    ("failed", Entry::count(cell.failed)),
                    ("not_hit", Entry::count(cell.without_effect)),
                    ("equal", Entry::Flag(cell.is_constant)),
                    ("metric", Entry::text(metric.name())),
                    ("n", Entry::count(summary.map_or(0, |summary| summary.n))),
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
                    ("metric", Entry::text(metric.name())),
                    ("first", Entry::text(&data.allocators[pair.first])),
                    ("second", Entry::text(&data.allocators[pair.second])),
                    ("n", Entry::count(pair.n)),
                    ("mean_difference", mean),
                    ("mean_from", mean_from),
                    ("mean_to", mean_to),
                    ("median_difference", median),
                    ("median_from", median_from),
                    ("median_to", median_to),
                    ("effect", Entry::computed(pair.effect)),
                    ("p", Entry::computed(pair.p)),
                    ("p_holm", Entry::computed(pair.adjusted)),
                    ("differ", Entry::Flag(pair.is_significant())),
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
                ("metric", Entry::text(&ranking.name)),
                ("allocator", Entry::text(&data.allocators[place])),
                (
                    "mean_rank",
                    Entry::computed(ranking.friedman.mean_ranks[place]),
                ),
                ("blocks", Entry::count(ranking.friedman.blocks)),
                (
                    "blocks_left_out",
                    Entry::count(ranking.omitted_blocks.len()),
                ),
                ("chi_squared", Entry::computed(ranking.friedman.statistic)),
                ("p", Entry::computed(ranking.friedman.p)),
                ("critical_difference", Entry::computed(ranking.critical)),
                (
                    "mean_rank_from",
                    Entry::computed(ranking.intervals[place].0),
                ),
                ("mean_rank_to", Entry::computed(ranking.intervals[place].1)),
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
                    ("metric", Entry::text(&ranking.name)),
                    ("first", Entry::text(&data.allocators[*first])),
                    ("second", Entry::text(&data.allocators[*second])),
                    (
                        "difference",
                        Entry::computed(ranks[*second] - ranks[*first]),
                    ),
                    ("p", Entry::computed(ranking.p(*first, *second))),
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
                ("claim", Entry::text(&part.claim)),
                ("mean", mean),
                ("mean_from", from),
                ("mean_to", to),
                ("part", Entry::text(part.outcome.as_str())),
            ];
            let head = [
                ("hypothesis", Entry::text(&verdict.name)),
                ("outcome", Entry::text(verdict.outcome.as_str())),
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
