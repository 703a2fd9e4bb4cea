//! SVG figures of completion, makespan and lateness against each swept column.

use std::ops::Range;

use plotters::style::RGBColor;

use super::design::{FAULTS, short};
use super::statistics::Interval;
use super::summary::{ColumnSeries, Summary};
use crate::columns::{Entry, Table};
use crate::figures::canvas::{
    Area, Axes, Chart, DrawResult, Frame, Mark, Sheet, TextLabel, chart, label_rows, part, series,
    write_in_rows,
};
use crate::figures::hints::{Hints, estimate_hint};
use crate::figures::legend::{Legend, Sample};
use crate::figures::palette::colors;
use crate::page::about;

const LEFT_PX: f64 = 62.0;
const RIGHT_PX: f64 = 16.0;
const PLOT_PX: f64 = 190.0;
const GAP_PX: f64 = 14.0;

/// The largest number of label rows below the plots, so that long labels have room.
const LABEL_ROWS: usize = 3;
const ROW_PX: f64 = 16.0;

/// The distance between the series of a group, px.
const APART_PX: f64 = 14.0;

/// The ratio of the largest to the smallest positive number from which the axis is logarithmic.
const LOG_FROM: f64 = 30.0;

/// One plot of a block: its title, y range and data.
struct Panel {
    what: String,
    y: Range<f64>,
    at: At,
}

/// Returns the position of a summary on the y axis, and its interval.
type At = fn(&Summary) -> Option<(f64, Interval)>;

/// Returns the columns of the measures of a summary, each with its interval; times in s.
#[must_use]
pub fn measures(summary: &Summary) -> [(&'static str, Entry); 13] {
    let share = summary.share().map(|share| (share, summary.completion));
    let [share, share_from, share_to] = Entry::with_interval(share);
    let [makespan, makespan_from, makespan_to] = Entry::with_interval(summary.makespan_s);
    let [lateness, lateness_from, lateness_to] = Entry::with_interval(summary.lateness_s);
    let measure = summary.primary.as_ref();
    let metric = measure.map_or("", |measure| &measure.metric);
    let [primary, primary_from, primary_to] =
        Entry::with_interval(measure.map(|measure| measure.median));
    [
        ("share", share),
        ("share_from", share_from),
        ("share_to", share_to),
        ("makespan_s", makespan),
        ("makespan_from_s", makespan_from),
        ("makespan_to_s", makespan_to),
        ("lateness_s", lateness),
        ("lateness_from_s", lateness_from),
        ("lateness_to_s", lateness_to),
        ("primary_metric", Entry::text(metric)),
        ("primary", primary),
        ("primary_from", primary_from),
        ("primary_to", primary_to),
    ]
}

/// Returns the numbers of the figure of a column: one row per class of faults, series and group.
#[must_use]
pub fn numbers(of_column: &[ColumnSeries]) -> Table {
    let mut table = Table::default();
    for against in of_column {
        for (name, groups) in &against.series {
            for (group, summary) in against.groups.iter().zip(groups) {
                let Some(summary) = summary else { continue };
                let group = [
                    ("column", Entry::text(&against.column)),
                    ("value", Entry::text(group)),
                    ("series", Entry::text(name)),
                    (
                        "faults",
                        Entry::text(against.faults.as_deref().unwrap_or_default()),
                    ),
                    ("runs", Entry::count(summary.runs)),
                ];
                table.add(group.into_iter().chain(measures(summary)));
            }
        }
    }
    table
}

/// Draws the figure of a column: one block per class of faults, one below the other.
pub fn draw(of_column: &[ColumnSeries], sheet: &Sheet) -> anyhow::Result<String> {
    let width_px = sheet.width_px;
    let blocks = of_column
        .iter()
        .map(|against| Block::new(against, width_px));
    let blocks: Vec<Block> = blocks.collect();
    let column = of_column.first().map_or("", |against| &against.column);
    let title = format!("Completion and times by {column}");
    let height_px = blocks.iter().map(Block::height_px).sum();
    let mut hints = Hints::default();
    let svg = sheet.svg(&title, height_px, |area| {
        let mut top_px = 0.0;
        for block in &blocks {
            let within = part(area, (0.0, top_px), (width_px, block.height_px()));
            block.draw(area, &within, &mut hints)?;
            if let Some(faults) = &block.against.faults {
                let about = about(&[(FAULTS, faults.clone())]).unwrap_or_default();
                hints.add_part(top_px, (width_px, block.height_px()), &about);
            }
            top_px += block.height_px();
        }
        Ok(())
    })?;
    Ok(hints.put_on(&svg))
}

struct Block<'s> {
    against: &'s ColumnSeries,
    width_px: f64,
    panels: Vec<Panel>,
}

impl<'s> Block<'s> {
    fn new(against: &'s ColumnSeries, width_px: f64) -> Self {
        let primary = summaries(against).find_map(|summary| summary.primary.as_ref());
        let primary =
            primary.map_or_else(String::new, |primary| format!("median {}", primary.metric));
        let share = Panel {
            what: "share of complete runs".to_owned(),
            // Keeps marks at 0 and 1 visible.
            y: -0.04..1.04,
            at: |summary| Some((summary.share()?, summary.completion)),
        };
        let measures: [(&str, At); 3] = [
            (primary.as_str(), |summary| {
                summary.primary.as_ref().map(|primary| primary.median)
            }),
            ("median makespan in s", |summary| summary.makespan_s),
            ("median lateness in s", |summary| summary.lateness_s),
        ];
        let panels = measures.map(|(what, at)| median_panel(against, what, at));
        let panels: Vec<Panel> = panels.into_iter().flatten().collect();
        // A constant share shows nothing, unless there is nothing else.
        let share = Some(share).filter(|_| panels.is_empty() || !has_equal_shares(against));
        Self {
            against,
            width_px,
            panels: share.into_iter().chain(panels).collect(),
        }
    }

    /// Returns the legend, which is empty for a single series.
    fn legend(&self) -> Legend<'s> {
        let series = &self.against.series;
        let names = series.iter().map(|(name, _)| name.as_str());
        let samples = names.clone().zip(colors(names)).enumerate();
        let entries = samples.filter(|_| series.len() > 1);
        let entries = entries
            .map(|(number, (name, color))| (Sample::Mark(Mark::of_series(number), color), name));
        Legend::new(entries.collect(), LEFT_PX..self.width_px)
    }

    fn head_px(&self) -> f64 {
        self.legend().height_px() + 6.0
    }

    fn plots_px(&self) -> f64 {
        self.head_px() + self.panels.len() as f64 * (PLOT_PX + GAP_PX) - GAP_PX
    }

    fn height_px(&self) -> f64 {
        let rows = label_rows(&labels(self.against, self.width_px), LABEL_ROWS).into_iter();
        let used = rows.flatten().max().map_or(0, |row| row + 1);
        self.plots_px() + (used as f64 + 1.0) * ROW_PX + 16.0
    }

    /// Draws the block in its part of the area.
    fn draw(&self, area: &Area<'_>, within: &Area<'_>, hints: &mut Hints) -> DrawResult {
        let against = self.against;
        let colors = colors(against.series.iter().map(|(name, _)| name.as_str()));
        self.legend().draw(within, 0.0)?;
        for (place, panel) in self.panels.iter().enumerate() {
            let top_px = self.head_px() + place as f64 * (PLOT_PX + GAP_PX);
            let plot = part(within, (0.0, top_px), (self.width_px, PLOT_PX));
            let chart = draw_panel(area, (&plot, self.width_px), panel, against, &colors)?;
            add_hints(hints, &chart, self.width_px, panel, against);
        }
        write_in_rows(within, &labels(against, self.width_px), LABEL_ROWS, |row| {
            self.plots_px() + (row as f64 + 0.75) * ROW_PX
        })?;
        let scale = if is_log(against) {
            ", logarithmic scale"
        } else {
            ""
        };
        let under = against.faults.iter();
        let under: String = under.map(|faults| format!(" (faults: {faults})")).collect();
        let text = format!("{}{scale}{under}", against.column);
        TextLabel::CENTERED.write(
            within,
            &text,
            (self.width_px / 2.0, self.height_px() - ROW_PX),
        )
    }
}

/// Returns the summaries of all series and groups with runs.
fn summaries(against: &ColumnSeries) -> impl Iterator<Item = &Summary> {
    let groups = against.series.iter().flat_map(|(_, groups)| groups);
    groups.flatten()
}

fn has_equal_shares(against: &ColumnSeries) -> bool {
    let mut shares = summaries(against).filter_map(Summary::share);
    let first = shares.next();
    shares.all(|share| Some(share) == first)
}

/// Creates a panel of medians whose range covers all intervals. Returns `None` if the measure is constant or has no values.
fn median_panel(against: &ColumnSeries, what: &str, at: At) -> Option<Panel> {
    let found: Vec<_> = summaries(against).filter_map(at).collect();
    if found.windows(2).all(|pair| pair[0] == pair[1]) {
        return None;
    }
    let intervals = found.iter().map(|(_, interval)| *interval);
    let (least, most) = intervals.reduce(|all, one| (all.0.min(one.0), all.1.max(one.1)))?;
    let margin = (most - least) * 0.08;
    Some(Panel {
        what: what.to_owned(),
        y: (least - margin).max(0.0)..most + margin,
        at,
    })
}

fn is_log(against: &ColumnSeries) -> bool {
    let numbers = against.numbers.as_deref().unwrap_or_default();
    let ends = numbers.first().zip(numbers.last());
    ends.is_some_and(|(least, most)| *least > 0.0 && most / least >= LOG_FROM)
}

/// Returns the x coordinate of a group. Numbers are to scale, from 0 to the number of groups less one; other groups are at 0,
/// 1, ...
fn place(against: &ColumnSeries, group: usize) -> f64 {
    let Some(numbers) = &against.numbers else {
        return group as f64;
    };
    let scaled = |number: f64| match is_log(against) {
        true => number.ln(),
        false => number,
    };
    let last = numbers.len() - 1;
    let (least, most) = (scaled(numbers[0]), scaled(numbers[last]));
    (scaled(numbers[group]) - least) / (most - least) * last as f64
}

/// Returns the x range of [`place`].
fn x_range(against: &ColumnSeries) -> Range<f64> {
    -0.5..against.groups.len() as f64 - 0.5
}

/// Returns the x position of a group, px.
fn x_px(against: &ColumnSeries, group: usize, width_px: f64) -> f64 {
    let width = width_px - LEFT_PX - RIGHT_PX;
    LEFT_PX + width * (place(against, group) + 0.5) / against.groups.len() as f64
}

/// Returns the distance of a series from the middle of its group.
fn shift(against: &ColumnSeries, number: usize, width_px: f64) -> f64 {
    let middle = (against.series.len() as f64 - 1.0) / 2.0;
    let group_px = (width_px - LEFT_PX - RIGHT_PX) / against.groups.len() as f64;
    (number as f64 - middle) * APART_PX / group_px
}

fn add_hints(
    hints: &mut Hints,
    chart: &Chart<'_>,
    width_px: f64,
    panel: &Panel,
    against: &ColumnSeries,
) {
    for (number, (series, groups)) in against.series.iter().enumerate() {
        let shift = shift(against, number, width_px);
        for (group, summary) in groups.iter().enumerate() {
            let Some(summary) = summary else { continue };
            let Some(found) = (panel.at)(summary) else {
                continue;
            };
            let mut name = format!("{} {}", against.column, short(&against.groups[group]));
            if against.series.len() > 1 {
                name += &format!(", {series}");
            }
            let text = format!("{name}, {}", panel.what);
            let text = estimate_hint(&text, found, |value| format!("{value:.3}"), summary.runs);
            hints.add_at(chart, (place(against, group) + shift, found.0), &text);
        }
    }
}

fn draw_panel<'a>(
    area: &Area<'_>,
    (within, width_px): (&Area<'a>, f64),
    panel: &Panel,
    against: &ColumnSeries,
    colors: &[RGBColor],
) -> DrawResult<Chart<'a>> {
    let frame = Frame {
        left: LEFT_PX,
        right: RIGHT_PX,
        bottom: 0.0,
    };
    let axes = Axes {
        x: (x_range(against), ""),
        y: (panel.y.clone(), &panel.what),
        y_labels: 6,
    };
    let chart = chart(within, frame, &axes)?;
    for (number, (_, groups)) in against.series.iter().enumerate() {
        let shift = shift(against, number, width_px);
        let points = groups.iter().enumerate().filter_map(|(group, summary)| {
            let (at, interval) = (panel.at)(summary.as_ref()?)?;
            Some((place(against, group) + shift, at, interval))
        });
        let points: Vec<_> = points.collect();
        let mark = Mark::of_series(number);
        series(area, &chart, &points, (mark, colors[number]))?;
    }
    Ok(chart)
}

/// Returns the labels of the groups with their x positions, px.
fn labels(against: &ColumnSeries, width_px: f64) -> Vec<(String, f64)> {
    let groups = against.groups.iter().enumerate();
    groups
        .map(|(group, name)| (short(name), x_px(against, group, width_px)))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::super::results::tests::{complete, design, failed, incomplete};
    use super::super::summary::by_column;
    use super::*;

    #[test]
    fn every_group_with_runs_has_a_mark_in_each_panel() {
        let design = design("presets = ['team', 'par98']\n[grid]\nbody.speed_m_s = [0.5, 0.25]\n");
        // One group has no makespan, another has no runs.
        let two = [complete(0, 4_000), complete(1, 5_000)];
        let rows = [&two[..], &[incomplete(2), failed(3)]].concat();
        let drawn: Vec<String> = by_column(&design, &rows)
            .iter()
            .map(|against| draw(std::slice::from_ref(against), &Sheet::default()).unwrap())
            .collect();
        assert_eq!(drawn.len(), 2);
        let text = &drawn[0];
        for name in [
            "body.speed_m_s",
            "team",
            "par98",
            "0.25",
            "share of complete runs",
        ] {
            assert!(text.contains(name), "{name}");
        }
        // Marks: three shares, two makespans, two in the legend. The latenesses are equal.
        assert_eq!(text.matches("<polygon").count(), 3 + 2 + 2);
        assert!(drawn[1].contains("<title>Completion and times by preset</title>"));
    }

    #[test]
    fn numbers_are_to_scale_and_names_equally_spaced() {
        let by = |values: &str| {
            let design = design(&format!("[grid]\n{values}\n"));
            let runs = 0..design.runs().unwrap();
            let rows: Vec<_> = runs.map(|run| complete(run, 4_000)).collect();
            by_column(&design, &rows).remove(0)
        };
        let places = |against: &ColumnSeries| -> Vec<f64> {
            let groups = 0..against.groups.len();
            groups.map(|group| place(against, group)).collect()
        };
        let even = by("body.speed_m_s = [0.5, 0.1, 0.2]");
        let expected = [0.0, 0.5, 2.0];
        for (place, expected) in places(&even).iter().zip(expected) {
            assert!((place - expected).abs() < 1e-9, "{place}");
        }
        let wide = by("alliance.defaults.ceased_after_s = [2.0, 20.0, 200.0]");
        assert!((places(&wide)[1] - 1.0).abs() < 1e-9);
        let other = ColumnSeries {
            faults: Some("gold-dies".to_owned()),
            ..wide.clone()
        };
        let text = draw(&[wide, other], &Sheet::default()).unwrap();
        assert_eq!(
            text.matches("{&quot;faults&quot;:&quot;gold-dies&quot;}")
                .count(),
            1
        );
        for axis in [
            "ceased_after_s, logarithmic scale\n",
            "ceased_after_s, logarithmic scale (faults: gold-dies)",
        ] {
            assert!(text.contains(axis), "{text}");
        }
        assert_eq!(
            places(&by("alliance.switches.waiting = [true, false]")),
            [0.0, 1.0]
        );
    }

    #[test]
    fn a_time_axis_starts_near_the_least_time() {
        let design = design("[grid]\nbody.speed_m_s = [0.5, 0.25]\n");
        let rows = [complete(0, 400_000), complete(1, 420_000)];
        let against = by_column(&design, &rows).remove(0);
        let panel = median_panel(&against, "", |summary| summary.makespan_s).unwrap();
        assert_eq!(panel.y, 398.4..421.6);
        assert!(median_panel(&against, "", |_| None).is_none());
        assert!(median_panel(&against, "", |summary| summary.lateness_s).is_none());
    }
}
