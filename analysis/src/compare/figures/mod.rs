//! SVG figures of a comparison.

mod curves;
mod distributions;
mod heat;
mod ranks;

use super::analysis::Analysis;
use super::data::ComparisonData;
use crate::columns::{Entry, Table};
use crate::figures::canvas::Sheet;
use crate::figures::{Figure, plain};

/// Draws the main ranks, heat maps, curves, distributions and further ranks, in this order. The first figure shows the main
/// result.
pub fn figures(
    data: &ComparisonData,
    analysis: &Analysis,
    sheet: &Sheet,
) -> anyhow::Result<Vec<Figure>> {
    let mut all = ranks::draw(data, analysis, sheet)?;
    let further = all.split_off(all.len().min(1));
    all.extend(heat::draw(data, analysis, sheet)?);
    all.extend(curves::draw(data, analysis, sheet)?);
    all.extend(distributions::draw(data, analysis, sheet)?);
    all.extend(further);
    Ok(all)
}

/// Returns the summaries of the drawn metric in some blocks as numbers of a figure: one row per block and allocator.
fn numbers(data: &ComparisonData, analysis: &Analysis, blocks: &[usize]) -> Table {
    let mut table = Table::default();
    let metric = data.drawn(blocks);
    let place = data.metric_index(metric);
    for &number in blocks {
        let block = &data.blocks[number];
        for (rival, metrics) in analysis.blocks[number].summaries.iter().enumerate() {
            let summary = metrics[place].as_ref();
            let estimate = summary.map(|summary| (summary.mean, summary.interval));
            let [mean, from, to] = Entry::with_interval(estimate);
            let quantile =
                |at: usize| Entry::computed(summary.map(|summary| summary.quantiles[at]));
            table.add([
                ("mission", Entry::text(&block.mission)),
                ("faults", Entry::text(&block.faults)),
                ("loss", Entry::number(block.axes.loss)),
                ("robots", Entry::count(block.axes.robots)),
                ("allocator", Entry::text(&data.allocators[rival])),
                ("metric", Entry::text(metric.name())),
                ("runs", Entry::count(summary.map_or(0, |summary| summary.n))),
                ("mean", mean),
                ("from", from),
                ("to", to),
                ("minimum", quantile(0)),
                ("q25", quantile(2)),
                ("median", quantile(3)),
                ("q75", quantile(4)),
                ("maximum", quantile(6)),
            ]);
        }
    }
    table
}

/// Returns the missions with the indices of their blocks.
fn by_mission(data: &ComparisonData) -> Vec<(&str, Vec<usize>)> {
    let missions = data.missions().into_iter();
    let with_blocks = missions.map(|mission| {
        let all = 0..data.blocks.len();
        let blocks = all.filter(|block| data.blocks[*block].mission == mission);
        (mission, blocks.collect())
    });
    with_blocks.collect()
}

/// Returns a title followed by a name, which may be empty.
fn titled(title: &str, name: &str) -> String {
    match name {
        "" => title.to_owned(),
        _ => format!("{title}: {name}"),
    }
}

/// Returns `-name`, or an empty string.
fn ending(name: &str) -> String {
    match plain(name).as_str() {
        "" => String::new(),
        plain => format!("-{plain}"),
    }
}

/// Rounds up to 1, 2, 2.5 or 5 times a power of ten.
fn round_up(number: f64) -> f64 {
    if number <= 0.0 || !number.is_finite() {
        return 1.0;
    }
    let power = 10_f64.powf(number.log10().floor());
    let steps = [1.0, 2.0, 2.5, 5.0, 10.0];
    let step = steps.into_iter().find(|step| step * power >= number);
    step.unwrap_or(10.0) * power
}
