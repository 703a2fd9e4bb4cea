//! Box plots of the primary metric over the seeds.

use std::ops::RangeInclusive;

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
        let scale = Scale::of(all().map(|summary| summary.quantiles));
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
                "{title}{}. Thin line: minimum to maximum; thick line: 5 to 95 %; box: 25 to 75 %; dark stroke: median; red stroke: mean.{}",
                if scale.is_log { ", logarithmic scale" } else { "" },
                if all().any(|summary| scale.cuts(&summary.quantiles)) {
                    " An arrow: the line goes on to a value far from all others."
                } else {
                    ""
                }
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

/// The scale of all panels of a figure. It has room for 5 to 95 % of the runs of each allocator, and for extreme values
/// that are not far away.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Scale {
    from: f64,
    to: f64,
    is_log: bool,
}

impl Scale {
    /// The ratios of the largest to the least value for which the scale is logarithmic, because some allocators need ten
    /// times as long as others. Near 0 a logarithmic scale would have no room for the large values.
    const LOG: RangeInclusive<f64> = 4.0..=1000.0;

    /// The share of the scale beside 5 to 95 % that an extreme value may take.
    const BESIDE: f64 = 0.5;

    fn of(all: impl Iterator<Item = [f64; 7]> + Clone) -> Self {
        let values = |place: usize| all.clone().map(move |quantiles| quantiles[place]);
        let low = values(1).fold(f64::INFINITY, f64::min);
        let high = values(5).fold(f64::NEG_INFINITY, f64::max);
        let is_log = low > 0.0 && Self::LOG.contains(&(high / low));
        let turned = |value: f64| if is_log { value.ln() } else { value };
        let back = |value: f64| if is_log { value.exp() } else { value };
        let (low, high) = (turned(low), turned(high));
        let span = (high - low).max(1e-3 * high.abs()).max(1e-9);
        let near = low - Self::BESIDE * span..=high + Self::BESIDE * span;
        let extremes = |place| {
            values(place)
                .map(turned)
                .filter(|value| near.contains(value))
        };
        let low = extremes(0).fold(low, f64::min);
        let high = extremes(6).fold(high, f64::max);
        let margin = 0.06 * span.max(high - low);
        let from = back(low - margin);
        // A scale that begins near 0 begins at 0.
        let from = if !is_log && low >= 0.0 && low < 0.4 * high {
            0.0
        } else {
            from
        };
        Self {
            from,
            to: back(high + margin),
            is_log,
        }
    }

    /// Returns the position of a value on the scale, 0 to 1.
    fn at(self, value: f64) -> f64 {
        let share = match self.is_log {
            true => (value.max(self.from) / self.from).ln() / (self.to / self.from).ln(),
            false => (value - self.from) / (self.to - self.from),
        };
        share.clamp(0.0, 1.0)
    }

    /// Checks whether the minimum or the maximum lies beyond the scale.
    fn cuts(self, quantiles: &[f64; 7]) -> bool {
        quantiles[0] < self.from || quantiles[6] > self.to
    }

    /// Returns round numbers on the scale, as many as have room.
    fn marks(self) -> Vec<f64> {
        if !self.is_log {
            return self.even_marks();
        }
        let steps: &[f64] = match self.to / self.from {
            wide if wide > 200.0 => &[1.0],
            wide if wide > 20.0 => &[1.0, 3.0],
            _ => &[1.0, 2.0, 5.0],
        };
        let marks = |power| steps.iter().map(move |step| step * 10_f64.powi(power));
        let rounded = (-9..10).flat_map(marks).map(rounded);
        let range = self.from..=self.to;
        rounded.filter(|mark| range.contains(mark)).collect()
    }

    fn even_marks(self) -> Vec<f64> {
        /// The largest number of marks.
        const MOST: f64 = 6.0;
        let length = self.to - self.from;
        let power = 10_f64.powf((length / MOST).log10().floor());
        let steps = [1.0, 2.0, 5.0, 10.0].map(|step| step * power);
        let step = steps.into_iter().find(|step| length / step <= MOST);
        let step = step.unwrap_or(10.0 * power);
        let (first, last) = (
            (self.from / step).ceil() as i64,
            (self.to / step).floor() as i64,
        );
        (first..=last)
            .map(|mark| rounded(mark as f64 * step))
            .collect()
    }
}

/// Removes the error of floating-point numbers from a round number.
fn rounded(mark: f64) -> f64 {
    (mark * 1e9).round() / 1e9
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
        let arrow = |tip: f64, back: f64| {
            let ends = [-3.0, 3.0].map(|side| [(back, y + side), (tip, y)]);
            ends.into_iter().try_for_each(|ends| path(ends, INK, 1.0))
        };
        if summary.quantiles[0] < scale.from {
            arrow(from, from + 4.0)?;
        }
        if summary.quantiles[6] > scale.to {
            arrow(from + width, from + width - 4.0)?;
        }
        path([(at[1], y), (at[5], y)], INK, 2.0)?;
        let right = at[4].max(at[2] + 1.0);
        rectangle(area, at[2]..right, y - 4.5..y + 4.5, BOX.filled())?;
        path([(at[3], y - 5.5), (at[3], y + 5.5)], INK, 2.0)?;
        let mean = x_px(summary.mean);
        path([(mean, y - 3.5), (mean, y + 3.5)], MEAN, 2.0)?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns the scale of some allocators, each with minimum, 5 %, 95 % and maximum.
    fn scale<const N: usize>(all: [[f64; 4]; N]) -> Scale {
        let quantiles =
            |[least, low, high, most]: [f64; 4]| [least, low, low, low, high, high, most];
        Scale::of(all.into_iter().map(quantiles))
    }

    #[test]
    fn a_scale_has_room_for_most_runs_of_each_allocator() {
        // Allocators that differ by a factor of eight.
        let times = scale([[290.0, 300.0, 320.0, 340.0], [2400.0; 4]]);
        assert!(
            times.is_log && times.from < 290.0 && times.to > 2400.0,
            "{times:?}"
        );
        assert_eq!(times.marks(), [500.0, 1000.0, 2000.0]);
        // A single extreme value, near 0 or far away, is cut.
        let near_zero = [[0.05, 300.0, 320.0, 340.0], [310.0, 310.0, 330.0, 90_000.0]];
        let cut = scale(near_zero);
        assert!(!cut.is_log && cut.from > 280.0 && cut.to < 350.0, "{cut:?}");
        assert!(cut.cuts(&[0.05, 300.0, 300.0, 300.0, 320.0, 320.0, 340.0]));
        assert!(!cut.cuts(&[310.0; 7]));
        assert_eq!((cut.at(0.05), cut.at(1e9)), (0.0, 1.0));
        // Zeros are no reason for a logarithmic scale.
        let zeros = scale([[0.0, 0.0, 9.0, 10.0], [0.0; 4]]);
        assert_eq!((zeros.is_log, zeros.from), (false, 0.0));
        assert_eq!(zeros.marks(), [0.0, 2.0, 4.0, 6.0, 8.0, 10.0]);
        let shares = scale([[0.42, 0.43, 0.44, 0.45], [0.33, 0.34, 0.36, 0.37]]);
        assert!(!shares.is_log && shares.from > 0.3, "{shares:?}");
        assert_eq!(shares.marks(), [0.35, 0.4, 0.45]);
        let equal = scale([[240.0; 4]]);
        assert!(
            equal.from < 240.0 && 240.0 < equal.to && equal.at(240.0) == 0.5,
            "{equal:?}"
        );
        let losses = scale([[-3.0, -2.0, 1.0, 2.0]]);
        assert!(losses.from < -3.0 && losses.at(-3.0) > 0.0, "{losses:?}");
    }
}
