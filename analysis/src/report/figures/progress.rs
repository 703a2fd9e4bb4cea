//! Progress of the mission: columns of mission.csv over time, and the time between recurring events.

use plotters::element::Polygon;
use plotters::prelude::DashedLineSeries;
use plotters::style::text_anchor::{HPos, VPos};
use plotters::style::{Color, RGBColor};
use run_log::MissionRow;
use scenario::mission::columns::{Column, ColumnKind, display_name};
use scenario::time::SimTime;

use super::RunFigures;
use super::timeline::Timeline;
use crate::figures::canvas::{
    Area, Chart, DrawResult, INK, Mark, TextLabel, X_AXIS_PX, curve, horizontal_line, line, px,
    rows_for,
};
use crate::figures::legend::Sample;
use crate::figures::simplify::within;
use crate::report::metrics::{Occurrence, Recurring};

const LEFT_PX: f64 = 58.0;
const PLOT_PX: f64 = 240.0;

/// Line styles of all columns except done counts, in turn, with dash and gap lengths, px. They have no hue because hues
/// belong to robots.
const OTHERS: [(RGBColor, Option<(f64, f64)>); 4] = [
    (RGBColor(140, 140, 140), None),
    (INK, Some((9.0, 4.0))),
    (INK, Some((1.5, 3.5))),
    (RGBColor(140, 140, 140), Some((9.0, 4.0))),
];
const LATE: RGBColor = RGBColor(213, 94, 0);

/// Groups columns by axis: all counts on one axis, and each other number on its own. Empty without columns.
pub fn axes(columns: &[Column]) -> Vec<Vec<Column>> {
    let of = |wanted: fn(ColumnKind) -> bool| {
        let found = columns.iter().filter(move |column| wanted(column.kind));
        found.copied()
    };
    let is_count = |kind| {
        matches!(
            kind,
            ColumnKind::Done | ColumnKind::Left | ColumnKind::Count | ColumnKind::Expired
        )
    };
    let counts: Vec<Column> = of(is_count).collect();
    let numbers = of(|kind| kind == ColumnKind::Real).map(|column| vec![column]);
    let axes = [counts].into_iter().chain(numbers);
    axes.filter(|columns| !columns.is_empty()).collect()
}

/// Draws columns of mission.csv on one axis.
pub fn columns(run: &RunFigures<'_>, title: &str, columns: &[Column]) -> anyhow::Result<String> {
    let mut others = OTHERS.into_iter().cycle();
    let mut style_of = |kind| match kind {
        ColumnKind::Done => Some((INK, 2.5, None)),
        _ => others.next().map(|(color, dashes)| (color, 1.5, dashes)),
    };
    let styles: Vec<_> = columns
        .iter()
        .filter_map(|column| style_of(column.kind))
        .collect();
    let names: Vec<String> = columns
        .iter()
        .map(|column| display_name(column.name))
        .collect();
    let sample = |&(color, width_px, dashes): &_| match dashes {
        None => Sample::Line(color, width_px),
        Some(dashes) => Sample::Dashed(color, dashes),
    };
    let legend = styles
        .iter()
        .map(sample)
        .zip(names.iter().map(String::as_str));
    let timeline = Timeline::new(run, run.window.clone(), LEFT_PX, legend.collect());
    let head_px = timeline.head_px();
    let rows = &run.history.mission;
    let values = columns
        .iter()
        .flat_map(|column| rows.iter().filter_map(|row| row.get(column.name)));
    let (least, most) = values.fold((0.0, 0.0), |(least, most), value| {
        (value.min(least), value.max(most))
    });
    // An axis needs a length.
    let most = if most > least { most } else { least + 1.0 };
    let bottom_px = head_px + PLOT_PX;
    run.sheet.svg(title, bottom_px + X_AXIS_PX, |area| {
        timeline.draw_head(area, std::slice::from_ref(&(head_px..bottom_px)))?;
        let margin = (most - least) * 0.05;
        let y = (least * 1.05..most + margin, title, 8);
        let chart = timeline.chart(area, head_px..bottom_px, y, true)?;
        for (column, &(color, width_px, dashes)) in columns.iter().zip(&styles) {
            let style = line(color, width_px);
            for points in steps(rows, run.history.end, column.name) {
                let points = within(&points, &timeline.window);
                match dashes {
                    None => curve(&chart, points, style)?,
                    Some((dash, gap)) => {
                        let series = DashedLineSeries::new(points, px(dash), px(gap), style);
                        for element in series {
                            chart.plotting_area().draw(&element)?;
                        }
                    }
                }
            }
        }
        Ok(())
    })
}

/// Returns a column as step lines. Each value holds until the next row; missing values leave a gap.
fn steps(rows: &[MissionRow], end: SimTime, column: &str) -> Vec<Vec<(f64, f64)>> {
    let mut lines = Vec::new();
    for part in rows.chunk_by(|a, b| a.get(column).is_some() == b.get(column).is_some()) {
        let mut points: Vec<(f64, f64)> = Vec::new();
        for row in part {
            let Some(value) = row.get(column) else {
                continue;
            };
            let at = row.t_ms.as_secs_f64();
            let before = points.last().map(|(_, before)| *before);
            if before == Some(value) {
                continue;
            }
            points.extend(before.map(|before| (at, before)));
            points.push((at, value));
        }
        let after = part
            .last()
            .and_then(|last| rows.iter().find(|row| row.t_ms > last.t_ms));
        let until = after.map_or(end, |row| row.t_ms).as_secs_f64();
        if let Some(&(_, value)) = points.last() {
            points.push((until, value));
            lines.push(points);
        }
    }
    lines
}

/// Draws the time since the latest recurring event, with the wanted period if there is one.
pub fn recurring(run: &RunFigures<'_>, recurring: &Recurring) -> anyhow::Result<String> {
    let period = recurring.period.map(SimTime::as_secs_f64);
    let mut legend = vec![
        (
            Sample::Line(INK, 1.5),
            "time since the latest event, or the start",
        ),
        (
            Sample::Mark(Mark::Square, INK),
            "event, in the robot's color",
        ),
    ];
    if period.is_some() {
        legend.push((Sample::Dashed(INK, (4.0, 4.0)), "wanted period"));
        legend.push((Sample::Fill(LATE, 0.75), "late"));
    }
    let timeline = Timeline::new(run, run.window.clone(), LEFT_PX, legend);
    let head_px = timeline.head_px();
    let bottom_px = head_px + PLOT_PX;

    // Each rise starts at an event, or the start, and ends at the next event or the end of the log.
    let moments = recurring.moments.iter().map(|moment| moment.at);
    let moments: Vec<f64> = [SimTime::ZERO]
        .into_iter()
        .chain(moments)
        .chain([run.history.end])
        .map(SimTime::as_secs_f64)
        .collect();
    let rises = || moments.windows(2).map(|pair| (pair[0], pair[1]));
    let longest = rises().map(|(from, to)| to - from);
    let longest = longest.fold(period.unwrap_or(run.history.step.as_secs_f64()), f64::max);

    let title = format!("Time between '{}' events", recurring.event);
    run.sheet.svg(&title, bottom_px + X_AXIS_PX, |area| {
        timeline.draw_head(area, std::slice::from_ref(&(head_px..bottom_px)))?;
        let y = (0.0..longest * 1.2, "time since the event in s", 6);
        let chart = timeline.chart(area, head_px..bottom_px, y, true)?;
        for (from, to) in rises() {
            let line_within = within(&[(from, 0.0), (to, to - from)], &timeline.window);
            if let Some(period) = period {
                let late = within(
                    &[(from + period, period), (to, to - from)],
                    &timeline.window,
                );
                if let [first, last] = late[..]
                    && first.0 < last.0
                {
                    let late = vec![first, last, (last.0, period), (first.0, period)];
                    let late = Polygon::new(late, LATE.mix(0.75).filled());
                    chart.plotting_area().draw(&late)?;
                }
            }
            curve(&chart, line_within, line(INK, 1.5))?;
        }
        if let Some(period) = period {
            horizontal_line(&chart, timeline.window.clone(), period, line(INK, 1.0))?;
        }
        moment_marks(run, recurring, &timeline, area, &chart)
    })
}

/// Draws a mark for each event, with robot and lateness where there is room.
fn moment_marks(
    run: &RunFigures<'_>,
    recurring: &Recurring,
    timeline: &Timeline<'_>,
    area: &Area<'_>,
    chart: &Chart<'_>,
) -> DrawResult {
    let letters = TextLabel {
        anchor: (HPos::Center, VPos::Bottom),
        ..TextLabel::LEFT
    };
    let moments = recurring.moments.iter();
    let moments: Vec<&Occurrence> = moments.filter(|moment| timeline.shows(moment.at)).collect();
    let texts: Vec<String> = moments
        .iter()
        .map(|moment| {
            let name = moment.by.map_or("?", |rank| &run.history.robots[rank].name);
            match (recurring.period, moment.late) {
                (None, _) => name.to_owned(),
                (Some(_), SimTime::ZERO) => format!("{name}: in time"),
                (Some(_), late) => format!("{name}: {:.1} s late", late.as_secs_f64()),
            }
        })
        .collect();
    // Left edges and widths, limited to the figure.
    let places: Vec<(f64, f64)> = moments
        .iter()
        .zip(&texts)
        .map(|(moment, text)| {
            let width = letters.width_px(text) + 6.0;
            let left = timeline.x_px(moment.at) - width / 2.0;
            (left.min(run.sheet.width_px - width), width)
        })
        .collect();
    let rows = rows_for(&places, 1);
    for (place, moment) in moments.iter().enumerate() {
        let top = (moment.at.as_secs_f64(), moment.interval.as_secs_f64());
        let at = chart.plotting_area().map_coordinate(&top);
        let color = moment.by.map_or(INK, |rank| run.colors[rank]);
        Mark::Square.draw(area, at, color)?;
        if rows[place].is_some() {
            let (left, width) = places[place];
            let above = (px(left + width / 2.0), at.1 - px(7.0));
            area.draw_text(&texts[place], &letters.style(), above)?;
        }
    }
    Ok(())
}
