//! Critical difference diagrams (Demšar 2006): mean ranks on a line, with bars over groups without significant difference.

use plotters::element::Circle;
use plotters::style::Color;
use terminal::counted;

use crate::columns::{Entry, Table};
use crate::compare::analysis::{Analysis, PRIMARY, Ranking};
use crate::compare::answer::p_value;
use crate::compare::data::ComparisonData;
use crate::figures::canvas::{Area, DrawResult, INK, Sheet, TextLabel, line, path, px};
use crate::figures::{Figure, plain};

const SIDE_PX: f64 = 190.0;
const AXIS_PX: f64 = 64.0;
const BAR_PX: f64 = 9.0;
const LABEL_PX: f64 = 20.0;

pub(super) fn draw(
    data: &ComparisonData,
    analysis: &Analysis,
    sheet: &Sheet,
) -> anyhow::Result<Vec<Figure>> {
    let rankings = analysis.rankings.iter();
    rankings
        .map(|ranking| {
            let name = &ranking.name;
            let by = match name.as_str() {
                PRIMARY => "each mission's own measure",
                other => other,
            };
            let title = format!("Mean ranks by {by}");
            let bars = bars(ranking);
            let half = data.allocators.len().div_ceil(2) as f64;
            let labels_px = AXIS_PX + 14.0 + bars.len() as f64 * BAR_PX;
            let height_px = labels_px + (half + 0.5) * LABEL_PX;
            let svg = sheet.svg(&title, height_px, |area| {
                diagram(area, data, ranking, &bars, (labels_px, sheet.width_px))
            })?;
            let first = ranking.first;
            let left = match ranking.omitted_blocks.len() {
                0 => String::new(),
                count => format!(" Omitted: {}, because an allocator has no data or all allocators are equal.", counted(count, "block")),
            };
            Ok(Figure {
                caption: format!(
                    "Mean ranks of {} allocators by {by} over {} blocks; rank 1: {first}. Friedman: χ² = {:.1}, p {}. \
                     Ranks that are CD = {:.2} or more apart differ significantly (Nemenyi, 5 %). A bar joins allocators without a significant difference.{left}",
                    data.allocators.len(),
                    ranking.friedman.blocks,
                    ranking.friedman.statistic,
                    p_value(ranking.friedman.p),
                    ranking.critical
                ),
                name: format!("ranks-{}", plain(name)),
                svg,
                about: vec![("measure", name.clone())],
                numbers: Some(numbers(data, ranking)),
            })
        })
        .collect()
}

/// Returns the mean rank of each allocator.
fn numbers(data: &ComparisonData, ranking: &Ranking) -> Table {
    let ranks = data.allocators.iter().zip(&ranking.friedman.mean_ranks);
    Table::of_rows(ranks.map(|(name, rank)| {
        [
            ("allocator", Entry::text(name)),
            ("mean_rank", Entry::computed(*rank)),
            ("critical_difference", Entry::computed(ranking.critical)),
        ]
    }))
}

/// Returns the first and last index, in rank order, of each maximal group without a significant difference.
fn bars(ranking: &Ranking) -> Vec<(usize, usize)> {
    let ranks = &ranking.friedman.mean_ranks;
    let order = ranking.order();
    let mut bars: Vec<(usize, usize)> = Vec::new();
    for (from, place) in order.iter().enumerate() {
        let near = order[from..]
            .iter()
            .take_while(|other| ranks[**other] - ranks[*place] < ranking.critical);
        let to = from + near.count() - 1;
        if to > from && bars.last().is_none_or(|(_, last)| to > *last) {
            bars.push((from, to));
        }
    }
    bars
}

fn diagram(
    area: &Area<'_>,
    data: &ComparisonData,
    ranking: &Ranking,
    bars: &[(usize, usize)],
    (labels_px, width_px): (f64, f64),
) -> DrawResult {
    // The names have room at both sides, and so has the axis.
    let side_px = SIDE_PX.min(width_px / 3.0);
    let count = data.allocators.len();
    let most = count as f64;
    let x_px =
        |rank: f64| side_px + (width_px - 2.0 * side_px) * (rank - 1.0) / (most - 1.0).max(1.0);
    let path = |points: &[(f64, f64)], width| path(area, points, line(INK, width));
    path(&[(x_px(1.0), AXIS_PX), (x_px(most), AXIS_PX)], 1.0)?;
    for rank in 1..=count {
        let x = x_px(rank as f64);
        path(&[(x, AXIS_PX - 5.0), (x, AXIS_PX)], 1.0)?;
        TextLabel::CENTERED.write(area, &rank.to_string(), (x, AXIS_PX - 14.0))?;
    }
    // The bar is not longer than the axis.
    let critical = ranking.critical.min(most - 1.0);
    path(&[(x_px(1.0), 22.0), (x_px(1.0 + critical), 22.0)], 2.0)?;
    for end in [1.0, 1.0 + critical] {
        path(&[(x_px(end), 18.0), (x_px(end), 26.0)], 1.0)?;
    }
    let cd = format!("CD = {:.2}", ranking.critical);
    TextLabel::CENTERED.write(area, &cd, (x_px(1.0 + critical / 2.0), 9.0))?;

    let ranks = &ranking.friedman.mean_ranks;
    let order = ranking.order();
    for (number, (from, to)) in bars.iter().enumerate() {
        let y = AXIS_PX + 10.0 + number as f64 * BAR_PX;
        let (from, to) = (x_px(ranks[order[*from]]), x_px(ranks[order[*to]]));
        path(&[(from - 3.0, y), (to + 3.0, y)], 4.0)?;
    }
    let half = count.div_ceil(2);
    for (place, rival) in order.iter().enumerate() {
        let x = x_px(ranks[*rival]);
        let is_left = place < half;
        let row = if is_left { place } else { count - 1 - place };
        let y = labels_px + (row as f64 + 0.5) * LABEL_PX;
        let end = if is_left {
            side_px - 12.0
        } else {
            width_px - side_px + 12.0
        };
        path(&[(x, AXIS_PX), (x, y), (end, y)], 0.75)?;
        area.draw(&Circle::new((px(x), px(AXIS_PX)), px(2.5), INK.filled()))?;
        let name = &data.allocators[*rival];
        let rank = ranks[*rival];
        if is_left {
            TextLabel::RIGHT.write(area, &format!("{name}  {rank:.2}"), (end - 6.0, y))?;
        } else {
            TextLabel::LEFT.write(area, &format!("{rank:.2}  {name}"), (end + 6.0, y))?;
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::compare::statistics::friedman::Friedman;

    #[test]
    fn bars_join_groups_without_difference_and_none_contains_another() {
        let ranking = |mean_ranks: Vec<f64>, critical| Ranking {
            name: "par2_s".to_owned(),
            is_primary: true,
            first: "best",
            intervals: Vec::new(),
            blocks: Vec::new(),
            friedman: Friedman {
                blocks: 9,
                ranks: Vec::new(),
                mean_ranks,
                statistic: 1.0,
                p: 0.1,
            },
            critical,
            omitted_blocks: Vec::new(),
        };
        // Mean ranks in order: 1, 1.5, 2.2, 4.
        let ranks = vec![2.2, 1.0, 4.0, 1.5];
        assert_eq!(bars(&ranking(ranks.clone(), 1.0)), [(0, 1), (1, 2)]);
        assert_eq!(bars(&ranking(ranks.clone(), 2.0)), [(0, 2), (2, 3)]);
        assert_eq!(bars(&ranking(ranks.clone(), 9.0)), [(0, 3)]);
        assert_eq!(bars(&ranking(ranks, 0.1)), []);
    }
}
