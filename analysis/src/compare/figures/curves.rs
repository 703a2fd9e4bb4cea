//! Curves of the mean of the primary metric against message loss and against the team size, if the plan varies them.

use std::collections::BTreeMap;
use std::ops::Range;

use super::{ending, numbers, round_up, titled};
use crate::compare::analysis::Analysis;
use crate::compare::data::{Block, ComparisonData};
use crate::figures::Figure;
use crate::figures::canvas::{Axes, FRAME, Mark, Sheet, chart, part, series};
use crate::figures::hints::{Hints, estimate_hint};
use crate::figures::legend::{Legend, Sample};
use crate::figures::palette::colors;

const PLOT_PX: f64 = 330.0;
const LEGEND_PX: f64 = 170.0;

struct Against {
    file: &'static str,
    axis: &'static str,
    x: fn(&Block) -> Option<f64>,
    /// Blocks of one family differ only in x.
    family: fn(&Block) -> String,
}

const AGAINST: [Against; 2] = [
    Against {
        file: "loss",
        axis: "probability of message loss",
        x: |block| block.axes.loss,
        family: |block| block.mission.clone(),
    },
    Against {
        file: "team",
        axis: "robots",
        x: |block| Some(block.axes.robots as f64),
        family: |block| {
            let digits = |letter: char| letter.is_ascii_digit();
            let stem = block.mission.trim_end_matches(digits);
            let mut parts = vec![stem.trim_end_matches(['-', ' ', '_']), &block.faults];
            parts.retain(|part| !part.is_empty());
            parts.join(", ")
        },
    },
];

/// Draws one figure per mission against loss, and one per family of missions and class of faults against team size.
pub(super) fn draw(
    data: &ComparisonData,
    analysis: &Analysis,
    sheet: &Sheet,
) -> anyhow::Result<Vec<Figure>> {
    let mut figures = Vec::new();
    for against in AGAINST {
        let mut families: BTreeMap<String, Vec<(f64, usize)>> = BTreeMap::new();
        for (number, block) in data.blocks.iter().enumerate() {
            if let Some(x) = (against.x)(block) {
                let family = families.entry((against.family)(block));
                family.or_default().push((x, number));
            }
        }
        for (family, mut points) in families {
            points.sort_by(|a, b| a.0.total_cmp(&b.0));
            // Two blocks at one x value do not form a family.
            let rises = points.windows(2).all(|pair| pair[0].0 < pair[1].0);
            if points.len() < 2 || !rises {
                continue;
            }
            let blocks: Vec<usize> = points.iter().map(|(_, block)| *block).collect();
            let drawn = data.drawn(&blocks);
            let metric = drawn.heading();
            let title = titled(&format!("Mean {metric} by {}", against.axis), &family);
            figures.push(Figure {
                about: vec![("measure", drawn.name())],
                name: format!("{}{}", against.file, ending(&family)),
                caption: format!("{title}. Bars: 95 % intervals, shifted sideways for legibility."),
                svg: one((&title, sheet), &against, &points, data, analysis)?,
                numbers: Some(numbers(data, analysis, &blocks)),
            });
        }
    }
    Ok(figures)
}

fn one(
    (title, sheet): (&str, &Sheet),
    against: &Against,
    points: &[(f64, usize)],
    data: &ComparisonData,
    analysis: &Analysis,
) -> anyhow::Result<String> {
    let numbers: Vec<usize> = points.iter().map(|(_, block)| *block).collect();
    let metric = data.drawn(&numbers);
    let place = data.metric_index(metric);
    let colors = colors(data.allocators.iter().map(String::as_str));
    let (first, last) = (points[0].0, points[points.len() - 1].0);
    let margin = (last - first) * 0.06;
    let x: Range<f64> = first - margin..last + margin;
    let blocks = points.iter().map(|(_, block)| &analysis.blocks[*block]);
    let all = blocks.flat_map(|block| &block.summaries);
    let ends = all.filter_map(|metrics| Some(metrics[place]?.interval.1));
    let most = ends.fold(0.0, f64::max);
    let names = data.allocators.iter().zip(&colors).enumerate();
    let entries = names
        .map(|(number, (name, color))| (Sample::Mark(Mark::of_series(number), *color), &**name));
    let legend = Legend::column(entries.collect(), sheet.width_px - LEGEND_PX);
    let mut hints = Hints::default();
    let svg = sheet.svg(title, PLOT_PX.max(legend.height_px()) + 10.0, |area| {
        legend.draw(area, 6.0)?;
        let within = part(area, (0.0, 6.0), (sheet.width_px - LEGEND_PX, PLOT_PX));
        let label = format!("mean {}", metric.heading());
        let axes = Axes {
            x: (x, against.axis),
            y: (0.0..round_up(most), &label),
            y_labels: 6,
        };
        let chart = chart(&within, FRAME, &axes)?;
        for (rival, color) in colors.iter().enumerate() {
            let middle = (data.allocators.len() as f64 - 1.0) / 2.0;
            let shift = (rival as f64 - middle) * margin * 0.12;
            let line = points.iter().filter_map(|(x, block)| {
                let summary = analysis.blocks[*block].summaries[rival][place]?;
                Some((x + shift, summary.mean, summary.interval))
            });
            let line: Vec<_> = line.collect();
            series(area, &chart, &line, (Mark::of_series(rival), *color))?;
            for (x, block) in points {
                if let Some(found) = &analysis.blocks[*block].summaries[rival][place] {
                    let name = format!("{}, {} {x}", data.allocators[rival], against.axis);
                    let show = |value: f64| metric.show(value);
                    let text = estimate_hint(&name, (found.mean, found.interval), show, found.n);
                    hints.add_at(&chart, (x + shift, found.mean), &text);
                }
            }
        }
        Ok(())
    })?;
    Ok(hints.put_on(&svg))
}
