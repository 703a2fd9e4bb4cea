//! Heat maps of the mean of the primary metric: allocators against classes of faults.

use std::ops::Range;

use plotters::style::{Color, RGBColor};

use super::{by_mission, ending, numbers, titled};
use crate::compare::analysis::Analysis;
use crate::compare::answer::best;
use crate::compare::data::ComparisonData;
use crate::compare::metrics::Metric;
use crate::figures::Figure;
use crate::figures::canvas::{
    Area, DrawResult, FAINT, INK, Sheet, TextLabel, WHITE, line, path, rectangle, write_in_rows,
};
use crate::figures::hints::{Hints, estimate_hint};

const LEFT_PX: f64 = 130.0;
const ROW_PX: f64 = 30.0;
const HEAD_PX: f64 = 44.0;
const LEGEND_PX: f64 = 46.0;

/// The ratio of the worse to the better value at which the color is darkest.
const DARKEST: f64 = 4.0;
const LIGHT: RGBColor = RGBColor(236, 244, 251);
const DARK: RGBColor = RGBColor(8, 64, 129);

pub(super) fn draw(
    data: &ComparisonData,
    analysis: &Analysis,
    sheet: &Sheet,
) -> anyhow::Result<Vec<Figure>> {
    let mut missions = by_mission(data);
    // A map of equal values shows nothing.
    missions.retain(|(_, blocks)| {
        let metric = data.drawn(blocks);
        blocks.iter().any(|block| !data.are_equal(*block, metric))
    });
    let figures = missions.into_iter().map(|(mission, blocks)| {
        let drawn = data.drawn(&blocks);
        let metric = drawn.heading();
        let title = titled(&format!("Mean {metric}"), mission);
        let rows = data.allocators.len() as f64;
        let width = width_px(blocks.len(), sheet);
        let svg = sheet.svg(&title, HEAD_PX + rows * ROW_PX + LEGEND_PX, |area| {
            heads(area, data, &blocks, width)?;
            for place in 0..data.allocators.len() {
                row(area, (data, analysis), (&blocks, width), place)?;
            }
            legend(area, HEAD_PX + rows * ROW_PX + 14.0)
        })?;
        Ok(Figure {
            name: format!("heat{}", ending(mission)),
            caption: format!(
                "{title}, by allocator and class of faults. A darker color means a worse value, as a ratio to the best allocator of the column (except the oracle). \
                 Framed: the best, with its 95 % interval. Small print of the others: the share of runs that completed the mission, if below 100 %. Hatched: no data."
            ),
            svg: hints(data, analysis, (&blocks, width)).put_on(&svg),
            about: vec![("mission", mission.to_owned()), ("measure", drawn.name())],
            numbers: Some(numbers(data, analysis, &blocks)),
        })
    });
    figures.collect()
}

/// Returns the hints of all cells with data.
fn hints(data: &ComparisonData, analysis: &Analysis, (blocks, width): (&[usize], f64)) -> Hints {
    let mut hints = Hints::default();
    let drawn = data.drawn(blocks);
    let place = data.metric_index(drawn);
    for (column, number) in blocks.iter().enumerate() {
        let block = &data.blocks[*number];
        for (rival, metrics) in analysis.blocks[*number].summaries.iter().enumerate() {
            let Some(found) = &metrics[place] else {
                continue;
            };
            let name = format!("{}, {}", data.allocators[rival], block.name());
            let show = |value: f64| drawn.show(value);
            let text = estimate_hint(&name, (found.mean, found.interval), show, found.n);
            let corner = (
                LEFT_PX + column as f64 * width,
                HEAD_PX + rival as f64 * ROW_PX,
            );
            hints.add(corner, (width, ROW_PX), &text);
        }
    }
    hints
}

/// Returns the width of a column. Few columns share the width of the figure.
fn width_px(blocks: usize, sheet: &Sheet) -> f64 {
    (sheet.width_px - LEFT_PX - 4.0) / blocks.max(1) as f64
}

fn heads(area: &Area<'_>, data: &ComparisonData, blocks: &[usize], width: f64) -> DrawResult {
    let x_px = |place: usize| LEFT_PX + (place as f64 + 0.5) * width;
    let name = |block: &usize| match data.blocks[*block].faults.as_str() {
        "" => "all runs".to_owned(),
        faults => faults.to_owned(),
    };
    let labels = blocks.iter().enumerate();
    let labels: Vec<(String, f64)> = labels
        .map(|(place, block)| (name(block), x_px(place)))
        .collect();
    write_in_rows(area, &labels, 2, |row| HEAD_PX - 12.0 - 16.0 * row as f64)
}

fn row(
    area: &Area<'_>,
    (data, analysis): (&ComparisonData, &Analysis),
    (blocks, width): (&[usize], f64),
    rival: usize,
) -> DrawResult {
    let top_px = HEAD_PX + rival as f64 * ROW_PX;
    let at = (LEFT_PX - 8.0, top_px + ROW_PX / 2.0);
    TextLabel::RIGHT.write(area, &data.allocators[rival], at)?;
    let metric = data.drawn(blocks);
    for (place, block) in blocks.iter().enumerate() {
        let left_px = LEFT_PX + place as f64 * width;
        let x = left_px..left_px + width - 1.0;
        let y = top_px..top_px + ROW_PX - 1.0;
        cell(area, (data, analysis, metric), (*block, rival), (x, y))?;
    }
    Ok(())
}

fn cell(
    area: &Area<'_>,
    (data, analysis, metric): (&ComparisonData, &Analysis, &Metric),
    (block, rival): (usize, usize),
    (x, y): (Range<f64>, Range<f64>),
) -> DrawResult {
    let Some(mean) = data.mean(block, rival, metric) else {
        return empty(area, x, y);
    };
    let best = best(data, block).and_then(|best| data.mean(block, best, metric));
    let share = match best {
        Some(best) if metric.more_is_better() => depth(best, Some(mean)),
        best => depth(mean, best),
    };
    let (middle_px, top_px) = ((x.start + x.end + 1.0) / 2.0, y.start);
    rectangle(area, x.clone(), y.clone(), between(share).filled())?;
    let color = if share > 0.55 { WHITE } else { INK };
    let letters = TextLabel::CENTERED.colored(color);
    let is_best = best == Some(mean);
    let place = data.metric_index(metric);
    let summary = analysis.blocks[block].summaries[rival][place].filter(|_| is_best);
    let interval = summary.map(|summary| {
        let (from, to) = summary.interval;
        format!("{} – {}", metric.show(from), metric.show(to)).replace(" s", "")
    });
    // Only the first text has room.
    let completed = completion(block, rival, data).or(interval);
    let y_px = top_px + completed.as_ref().map_or(ROW_PX / 2.0, |_| 10.0);
    let value = metric.show(mean);
    let value_letters = TextLabel {
        bold: is_best,
        ..letters
    };
    value_letters.write(area, value.trim_end_matches(" s"), (middle_px, y_px))?;
    if is_best {
        let (x, y) = (x.start + 1.5..x.end - 1.5, y.start + 1.5..y.end - 1.5);
        rectangle(area, x, y, line(INK, 1.5))?;
    }
    if let Some(share) = completed {
        let small = letters.sized(9.0);
        small.write(area, &share, (middle_px, top_px + 22.0))?;
    }
    Ok(())
}

/// Returns the share of complete runs as text, or `None` if all completed.
fn completion(block: usize, rival: usize, data: &ComparisonData) -> Option<String> {
    let share = data.mean(block, rival, &Metric::Completion)?;
    (share < 1.0).then(|| format!("{:.0} % done", (100.0 * share).floor()))
}

/// Returns 0 for equal values and 1 if `more` is [`DARKEST`] times `less`.
fn depth(more: f64, less: Option<f64>) -> f64 {
    match less {
        Some(less) if less > 0.0 => ((more / less).ln() / DARKEST.ln()).clamp(0.0, 1.0),
        Some(_) if more > 0.0 => 1.0,
        _ => 0.0,
    }
}

fn between(share: f64) -> RGBColor {
    let mix = |from: u8, to: u8| {
        let (from, to) = (f64::from(from), f64::from(to));
        (from + share * (to - from)).round() as u8
    };
    RGBColor(
        mix(LIGHT.0, DARK.0),
        mix(LIGHT.1, DARK.1),
        mix(LIGHT.2, DARK.2),
    )
}

fn empty(area: &Area<'_>, x: Range<f64>, y: Range<f64>) -> DrawResult {
    let height = y.end - y.start;
    let mut from = x.start - height;
    while from < x.end {
        // The line runs from the lower edge to the upper one, cut off at the sides.
        let (low, high) = (from.max(x.start), (from + height).min(x.end));
        let ends = [(low, y.end - (low - from)), (high, y.end - (high - from))];
        path(area, &ends, line(FAINT, 0.75))?;
        from += 7.0;
    }
    Ok(())
}

fn legend(area: &Area<'_>, top_px: f64) -> DrawResult {
    let width = 40.0;
    for (place, factor) in [1.0_f64, 1.41, 2.0, 2.83, DARKEST].into_iter().enumerate() {
        let left_px = LEFT_PX + place as f64 * width;
        let color = between(depth(factor, Some(1.0)));
        let (x, y) = (left_px..left_px + width, top_px..top_px + 12.0);
        rectangle(area, x, y, color.filled())?;
        let more = if factor == DARKEST { "+" } else { "" };
        let label = format!("{factor:.1}{more}");
        TextLabel::CENTERED.write(area, &label, (left_px + width / 2.0, top_px + 22.0))?;
    }
    TextLabel::RIGHT.write(area, "times the best", (LEFT_PX - 8.0, top_px + 6.0))
}
