//! All numbers as tables in CSV and Parquet.

use anyhow::Context;

use super::analysis::Analysis;
use super::data::{Block, ComparisonData};
use super::hypotheses::Verdict;
use crate::sweep::parquet::to_parquet;
use crate::sweep::results::Values::{Flags, Integers, Numbers, Texts};
use crate::sweep::results::{Column, csv};

pub struct Table {
    pub name: &'static str,
    pub description: &'static str,
    pub columns: Vec<Column>,
}

impl Table {
    /// Returns the files with their names.
    pub fn files(&self) -> anyhow::Result<[(String, Vec<u8>); 2]> {
        let rows = self
            .columns
            .first()
            .context("the table has no columns")?
            .rows();
        Ok([
            (format!("{}.csv", self.name), csv(&self.columns, rows)?),
            (format!("{}.parquet", self.name), to_parquet(&self.columns)?),
        ])
    }
}

struct Filling {
    columns: Vec<Column>,
    rows: usize,
}

enum Entry {
    Text(String),
    Whole(usize),
    Number(Option<f64>),
    Flag(bool),
}

impl Filling {
    fn new() -> Self {
        Self {
            columns: Vec::new(),
            rows: 0,
        }
    }

    /// Appends a row. All rows need the same names with the same types.
    fn add<'n>(&mut self, row: impl IntoIterator<Item = (&'n str, Entry)>) {
        for (place, (name, entry)) in row.into_iter().enumerate() {
            if self.rows == 0 {
                let values = match &entry {
                    Entry::Text(_) => Texts(Vec::new()),
                    Entry::Whole(_) => Integers(Vec::new()),
                    Entry::Number(_) => Numbers(Vec::new()),
                    Entry::Flag(_) => Flags(Vec::new()),
                };
                let name = name.to_owned();
                self.columns.push(Column { name, values });
            }
            match (&mut self.columns[place].values, entry) {
                (Texts(values), Entry::Text(text)) => values.push(Some(text)),
                // Counts of runs and seeds are far below 2^63.
                (Integers(values), Entry::Whole(count)) => values.push(Some(count as i64)),
                (Numbers(values), Entry::Number(number)) => values.push(number),
                (Flags(values), Entry::Flag(flag)) => values.push(Some(flag)),
                _ => debug_assert!(false, "{name} changes its type"),
            }
        }
        self.rows += 1;
    }
}

use Entry::{Flag, Number, Text, Whole};

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
pub fn tables(data: &ComparisonData, analysis: &Analysis, verdicts: &[Verdict]) -> Vec<Table> {
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
    let filled = tables
        .into_iter()
        .filter(|(_, _, filling)| filling.rows > 0);
    filled
        .map(|(name, what, filling)| Table {
            name,
            description: what,
            columns: filling.columns,
        })
        .collect()
}

fn cells(data: &ComparisonData, analysis: &Analysis) -> Filling {
    let mut filling = Filling::new();
    for (block, found) in data.blocks.iter().zip(&analysis.blocks) {
        for (rival, cell) in block.cells.iter().enumerate() {
            for (place, metric) in data.metrics.iter().enumerate() {
                let summary = found.summaries[rival][place].as_ref();
                let quantile = |at: usize| Number(summary.map(|summary| summary.quantiles[at]));
                let row = [
                    ("allocator", Text(data.allocators[rival].clone())),
                    ("cell", Whole(cell.number)),
                    ("runs", Whole(cell.runs)),
                    ("failed", Whole(cell.failed)),
                    ("not_hit", Whole(cell.without_effect)),
                    ("equal", Flag(cell.is_constant)),
                    ("metric", Text(metric.name())),
                    ("n", Whole(summary.map_or(0, |summary| summary.n))),
                    ("mean", Number(summary.map(|summary| summary.mean))),
                    (
                        "mean_from",
                        Number(summary.map(|summary| summary.interval.0)),
                    ),
                    ("mean_to", Number(summary.map(|summary| summary.interval.1))),
                    ("min", quantile(0)),
                    ("q05", quantile(1)),
                    ("q25", quantile(2)),
                    ("median", quantile(3)),
                    ("q75", quantile(4)),
                    ("q95", quantile(5)),
                    ("max", quantile(6)),
                ];
                filling.add(settings(data, block).chain(row));
            }
        }
    }
    filling
}

fn pairs(data: &ComparisonData, analysis: &Analysis) -> Filling {
    let mut filling = Filling::new();
    for (block, found) in data.blocks.iter().zip(&analysis.blocks) {
        for (metric, pairs) in &found.pairs {
            for pair in pairs.iter().filter(|pair| pair.n > 0) {
                let row = [
                    ("metric", Text(metric.name())),
                    ("first", Text(data.allocators[pair.first].clone())),
                    ("second", Text(data.allocators[pair.second].clone())),
                    ("n", Whole(pair.n)),
                    ("mean_difference", Number(pair.mean.map(|(mean, _)| mean))),
                    (
                        "mean_from",
                        Number(pair.mean.map(|(_, interval)| interval.0)),
                    ),
                    ("mean_to", Number(pair.mean.map(|(_, interval)| interval.1))),
                    (
                        "median_difference",
                        Number(pair.median.map(|(median, _)| median)),
                    ),
                    (
                        "median_from",
                        Number(pair.median.map(|(_, interval)| interval.0)),
                    ),
                    (
                        "median_to",
                        Number(pair.median.map(|(_, interval)| interval.1)),
                    ),
                    ("effect", Number(Some(pair.effect))),
                    ("p", Number(pair.p)),
                    ("p_holm", Number(pair.adjusted)),
                    ("differ", Flag(pair.is_significant())),
                ];
                filling.add(settings(data, block).chain(row));
            }
        }
    }
    filling
}

fn ranks(data: &ComparisonData, analysis: &Analysis) -> Filling {
    let mut filling = Filling::new();
    for ranking in &analysis.rankings {
        for place in ranking.order() {
            filling.add([
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
    filling
}

fn differences(data: &ComparisonData, analysis: &Analysis) -> Filling {
    let mut filling = Filling::new();
    for ranking in &analysis.rankings {
        let order = ranking.order();
        for (place, first) in order.iter().enumerate() {
            for second in &order[place + 1..] {
                let ranks = &ranking.friedman.mean_ranks;
                filling.add([
                    ("metric", Text(ranking.name.clone())),
                    ("first", Text(data.allocators[*first].clone())),
                    ("second", Text(data.allocators[*second].clone())),
                    ("difference", Number(Some(ranks[*second] - ranks[*first]))),
                    ("p", Number(Some(ranking.p(*first, *second)))),
                ]);
            }
        }
    }
    filling
}

fn claims(data: &ComparisonData, verdicts: &[Verdict]) -> Filling {
    let mut filling = Filling::new();
    for verdict in verdicts {
        for part in &verdict.parts {
            let row = [
                ("claim", Text(part.claim.clone())),
                ("mean", Number(part.found.map(|(mean, _)| mean))),
                (
                    "mean_from",
                    Number(part.found.map(|(_, interval)| interval.0)),
                ),
                (
                    "mean_to",
                    Number(part.found.map(|(_, interval)| interval.1)),
                ),
                ("part", Text(part.outcome.as_str().to_owned())),
            ];
            let head = [
                ("hypothesis", Text(verdict.name.clone())),
                ("outcome", Text(verdict.outcome.as_str().to_owned())),
            ];
            filling.add(
                head.into_iter()
                    .chain(settings(data, &data.blocks[part.block]))
                    .chain(row),
            );
        }
    }
    filling
}
