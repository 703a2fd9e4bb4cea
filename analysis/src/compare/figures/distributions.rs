//! Box plots of the primary metric over the seeds.

use plotters::style::{Color, RGBColor};

use super::{by_mission, ending, numbers, titled};
use crate::compare::analysis::{Analysis, Summary};
use crate::compare::data::ComparisonData;
use crate::compare::metrics::Metric;
use crate::figures::Figure;
use crate::figures::canvas::{
    Area, DrawResult, FAINT, INK, Sheet, TextLabel, line, path, rectangle,
};
use crate::figures::hints::{Hints, estimate_hint};

const NAMES_PX: f64 = 112.0;
const ROW_PX: f64 = 15.0;
const HEAD_PX: f64 = 26.0;
const FOOT_PX: f64 = 34.0;
/// The largest number of panels beside each other, and their least width, px.
const COLUMNS: usize = 3;
const LEAST_PX: f64 = 280.0;
const BOX: RGBColor = RGBColor(120, 170, 215);
const MEAN: RGBColor = RGBColor(190, 40, 40);

pub(super) fn draw(
    data: &ComparisonData,
    analysis: &Analysis,
    sheet: &Sheet,
) -> anyhow::Result<Vec<Figure>> {
    let missions = by_mission(data).into_iter();
    let figures = missions.map(|(mission, blocks)| {
        let metric = data.drawn(&blocks);
        let place = data.metric_index(metric);
        let summaries = |block: usize| {
            let metrics = analysis.blocks[block].summaries.iter();
            metrics.map(|metrics| metrics[place]).collect::<Vec<_>>()
        };
        let all = || blocks.iter().flat_map(|block| summaries(*block)).flatten();
        let least = all().map(|summary| summary.quantiles[0]);
        let most = all().map(|summary| summary.quantiles[6]);
        let scale = Scale::of(least.fold(f64::INFINITY, f64::min), most.fold(0.0, f64::max));
        let panel_px = HEAD_PX + ROW_PX * data.allocators.len() as f64 + FOOT_PX;
        // Few blocks have wide panels.
        let columns = COLUMNS.min(blocks.len()).min(((sheet.width_px / LEAST_PX) as usize).max(1));
        let column_px = sheet.width_px / columns as f64;
        let height_px = panel_px * blocks.len().div_ceil(columns) as f64;
        let title = titled(&format!("{} over the seeds", metric.heading()), mission);
        let mut hints = Hints::default();
        let svg = sheet.svg(&title, height_px, |area| {
            for (place, block) in blocks.iter().enumerate() {
                let (column, row) = ((place % columns) as f64, (place / columns) as f64);
                let place = ((column * column_px, row * panel_px), column_px);
                let found = summaries(*block);
                panel(area, place, data, *block, &found, scale)?;
                let width = column_px - NAMES_PX;
                for (row, (name, summary)) in data.allocators.iter().zip(&found).enumerate() {
                    if let Some(summary) = summary {
                        let (left, top) = place.0;
                        let corner = (left + NAMES_PX, top + HEAD_PX + ROW_PX * row as f64);
                        hints.add(corner, (width, ROW_PX), &describe(name, summary, metric));
                    }
                }
            }
            Ok(())
        })?;
        Ok(Figure {
            name: format!("distribution{}", ending(mission)),
            caption: format!(
                "{title}, logarithmic scale. Thin line: minimum to maximum; thick line: 5 to 95 %; box: 25 to 75 %; dark stroke: median; red stroke: mean."
            ),
            svg: hints.put_on(&svg),
            about: vec![("mission", mission.to_owned()), ("measure", metric.name())],
            numbers: Some(numbers(data, analysis, &blocks)),
        })
    });
    figures.collect()
}

/// Returns the text of a hint: quantiles and mean.
fn describe(name: &str, summary: &Summary, metric: &Metric) -> String {
    let show = |value: f64| metric.show(value);
    let [least, _, low, median, high, _, most] = summary.quantiles.map(show);
    let mean = estimate_hint("mean", (summary.mean, summary.interval), show, summary.n);
    format!("{name}: {least} – {most}, middle half {low} – {high}, median {median}, {mean}")
}

/// A logarithmic scale, because some allocators need ten times as long as others.
#[derive(Clone, Copy)]
struct Scale {
    from: f64,
    to: f64,
}

impl Scale {
    /// Creates a scale with a margin of 10 % around the values.
    fn of(least: f64, most: f64) -> Self {
        let least = least.clamp(1e-3, most.max(1e-3));
        Self {
            from: least / 1.1,
            to: most.max(least) * 1.1,
        }
    }

    /// Returns the position of a value on the scale, 0 to 1.
    fn at(self, value: f64) -> f64 {
        (value.max(self.from) / self.from).ln() / (self.to / self.from).ln()
    }

    /// Returns round numbers on the scale, as many as have room.
    fn marks(self) -> Vec<f64> {
        let steps: &[f64] = if self.to / self.from > 20.0 {
            &[1.0]
        } else if self.to / self.from > 4.0 {
            &[1.0, 2.0, 5.0]
        } else {
            &[1.0, 1.5, 2.0, 3.0, 4.0, 5.0, 7.0]
        };
        let marks = |power| steps.iter().map(move |step| step * 10_f64.powi(power));
        let rounded = (-3..7)
            .flat_map(marks)
            .map(|mark| (mark * 1e3).round() / 1e3);
        let range = self.from..=self.to;
        rounded.filter(|mark| range.contains(mark)).collect()
    }
}

fn panel(
    area: &Area<'_>,
    ((left, top), column_px): ((f64, f64), f64),
    data: &ComparisonData,
    block: usize,
    summaries: &[Option<Summary>],
    scale: Scale,
) -> DrawResult {
    let width = column_px - NAMES_PX - 22.0;
    let from = left + NAMES_PX;
    let x_px = |value: f64| from + width * scale.at(value);
    let bottom = top + HEAD_PX + ROW_PX * summaries.len() as f64;
    let path = |points: [(f64, f64); 2], color, width| path(area, &points, line(color, width));
    let head = TextLabel {
        bold: true,
        ..TextLabel::CENTERED
    };
    let faults = &data.blocks[block].faults;
    head.write(area, faults, (from + width / 2.0, top + 13.0))?;
    path([(from, bottom), (from + width, bottom)], INK, 1.0)?;
    for value in scale.marks() {
        let x = x_px(value);
        path([(x, bottom), (x, bottom + 4.0)], INK, 1.0)?;
        TextLabel::CENTERED.write(area, &value.to_string(), (x, bottom + 13.0))?;
    }
    let small = TextLabel::RIGHT.sized(10.5);
    for (place, (name, summary)) in data.allocators.iter().zip(summaries).enumerate() {
        let y = top + HEAD_PX + ROW_PX * (place as f64 + 0.5);
        small.write(area, name, (from - 6.0, y))?;
        let Some(summary) = summary else {
            let none = TextLabel::LEFT.sized(10.5).colored(FAINT);
            none.write(area, "no data", (from + 4.0, y))?;
            continue;
        };
        let at = summary.quantiles.map(x_px);
        path([(at[0], y), (at[6], y)], FAINT, 1.0)?;
        path([(at[1], y), (at[5], y)], INK, 2.0)?;
        let right = at[4].max(at[2] + 1.0);
        rectangle(area, at[2]..right, y - 4.5..y + 4.5, BOX.filled())?;
        path([(at[3], y - 5.5), (at[3], y + 5.5)], INK, 2.0)?;
        let mean = x_px(summary.mean);
        path([(mean, y - 3.5), (mean, y + 3.5)], MEAN, 2.0)?;
    }
    Ok(())
}
