//! How the mission went on: items over time, and the time between progress reports.

use alliance_proto::time::SimTime;
use missions::waste::data::WasteRow;
use missions::waste::data::WasteSection;
use plotters::element::Polygon;
use plotters::prelude::DashedLineSeries;
use plotters::style::text_anchor::{HPos, VPos};
use plotters::style::{Color, RGBColor};

use super::RunFigures;
use super::canvas::{
    Area, Axes, Chart, Drawn, Frame, INK, Lettering, Mark, WIDTH_PX, chart, curve, level, line,
    part, px, rows_for, svg,
};
use super::timeline::{Sample, Timeline};

const LEFT_PX: f64 = 58.0;
const PLOT_PX: f64 = 240.0;
const X_AXIS_PX: f64 = 40.0;

const DELIVERED: RGBColor = RGBColor(0, 114, 178);
const IN_SPILLS: RGBColor = RGBColor(213, 94, 0);
const CARRIED: RGBColor = RGBColor(0, 130, 95);
const ON_FLOOR: RGBColor = RGBColor(90, 90, 90);
const LATE: RGBColor = RGBColor(213, 94, 0);

/// Where the items were.
///
/// # Errors
/// When it cannot be drawn.
pub fn items(run: &RunFigures<'_>) -> anyhow::Result<String> {
    /// A number of a row, and its line: color, width, and length of its dashes and gaps, px.
    type Line = (fn(&WasteRow) -> u32, RGBColor, f64, Option<(f64, f64)>);
    let lines: [Line; 4] = [
        (|row| row.items_delivered, DELIVERED, 2.5, None),
        (|row| row.items_in_spills, IN_SPILLS, 1.5, None),
        (|row| row.items_carried, CARRIED, 1.5, Some((5.0, 3.0))),
        (|row| row.items_on_floor, ON_FLOOR, 1.5, Some((1.5, 3.0))),
    ];
    let legend = vec![
        (Sample::Line(DELIVERED, 2.5), "delivered (thick)"),
        (Sample::Line(IN_SPILLS, 1.5), "in spills (thin)"),
        (Sample::Broken(CARRIED), "carried (dashed)"),
        (Sample::Broken(ON_FLOOR), "on the floor (dotted)"),
    ];
    let timeline = Timeline::new(run.window.clone(), LEFT_PX, &run.faults, legend);
    let head_px = timeline.head_px();
    let rows = &run.history.mission;
    let total = rows.first().map_or(0, |row| {
        row.items_in_spills + row.items_carried + row.items_on_floor + row.items_delivered
    });
    let bottom_px = head_px + PLOT_PX;
    svg("Items over time", bottom_px + X_AXIS_PX, |area| {
        timeline.draw_head(area, std::slice::from_ref(&(head_px..bottom_px)))?;
        let panel = part(area, (0.0, head_px), (WIDTH_PX, PLOT_PX + X_AXIS_PX));
        let axes = Axes {
            x: (timeline.window.clone(), "time t in s"),
            y: (0.0..f64::from(total.max(1)) * 1.05, "items"),
            y_labels: 8,
        };
        let chart = chart(&panel, frame(&timeline), &axes)?;
        for (number, color, width_px, dashes) in lines {
            let points = steps(rows, run.history.end, number);
            let style = line(color, width_px);
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
        Ok(())
    })
}

fn frame(timeline: &Timeline<'_>) -> Frame {
    Frame {
        left: LEFT_PX,
        right: WIDTH_PX - timeline.edges.end,
        bottom: X_AXIS_PX,
    }
}

/// A line of steps: each row holds until the next one.
fn steps(rows: &[WasteRow], end: SimTime, number: impl Fn(&WasteRow) -> u32) -> Vec<(f64, f64)> {
    let mut points = Vec::new();
    let mut before = None;
    for row in rows {
        let (at, value) = (row.t_ms.as_secs_f64(), f64::from(number(row)));
        if before == Some(value) {
            continue;
        }
        points.extend(before.map(|value| (at, value)));
        points.push((at, value));
        before = Some(value);
    }
    points.extend(before.map(|value| (end.as_secs_f64(), value)));
    points
}

/// The time since the latest progress report, against the wanted period.
///
/// # Errors
/// When it cannot be drawn.
pub fn reports(run: &RunFigures<'_>) -> anyhow::Result<String> {
    let period = WasteSection::of(&run.history.setup.scenario).report_period_s;
    let legend = vec![
        (
            Sample::Line(INK, 1.5),
            "time since the latest report, or the start",
        ),
        (Sample::Broken(INK), "wanted period"),
        (Sample::Fill(LATE, 0.75), "late"),
        (
            Sample::Mark(Mark::Square, INK),
            "report, in the robot's color",
        ),
    ];
    let timeline = Timeline::new(run.window.clone(), LEFT_PX, &run.faults, legend);
    let head_px = timeline.head_px();
    let bottom_px = head_px + PLOT_PX;

    // From each report, or the start, to the next one; at last to the end of the log.
    let moments = run.metrics.reports.iter().map(|report| report.at);
    let moments: Vec<f64> = [SimTime::ZERO]
        .into_iter()
        .chain(moments)
        .chain([run.history.end])
        .map(SimTime::as_secs_f64)
        .collect();
    let rises = || moments.windows(2).map(|pair| (pair[0], pair[1]));
    let longest = rises().map(|(from, to)| to - from).fold(period, f64::max);

    let title = "Lateness of progress reports";
    svg(title, bottom_px + X_AXIS_PX, |area| {
        timeline.draw_head(area, std::slice::from_ref(&(head_px..bottom_px)))?;
        let panel = part(area, (0.0, head_px), (WIDTH_PX, PLOT_PX + X_AXIS_PX));
        let axes = Axes {
            x: (timeline.window.clone(), "time t in s"),
            y: (0.0..longest * 1.2, "time since report in s"),
            y_labels: 6,
        };
        let chart = chart(&panel, frame(&timeline), &axes)?;
        for (from, to) in rises() {
            if to - from > period {
                let late = vec![(from + period, period), (to, to - from), (to, period)];
                let late = Polygon::new(late, LATE.mix(0.75).filled());
                chart.plotting_area().draw(&late)?;
            }
            curve(&chart, vec![(from, 0.0), (to, to - from)], line(INK, 1.5))?;
        }
        level(&chart, timeline.window.clone(), period, line(INK, 1.0))?;
        report_marks(run, &timeline, area, &chart)
    })
}

/// A mark for each report, and as far as there is room, who made it and how late.
fn report_marks(
    run: &RunFigures<'_>,
    timeline: &Timeline<'_>,
    area: &Area<'_>,
    chart: &Chart<'_>,
) -> Drawn {
    let letters = Lettering {
        anchor: (HPos::Center, VPos::Bottom),
        ..Lettering::default()
    };
    let reports = &run.metrics.reports;
    let texts: Vec<String> = reports
        .iter()
        .map(|report| {
            let name = report.by.map_or("?", |rank| &run.history.robots[rank].name);
            match report.late {
                SimTime::ZERO => format!("{name}: in time"),
                late => format!("{name}: {:.1} s late", late.as_secs_f64()),
            }
        })
        .collect();
    // Left edges and widths, kept inside the figure.
    let places: Vec<(f64, f64)> = reports
        .iter()
        .zip(&texts)
        .map(|(report, text)| {
            let width = letters.width_px(text) + 6.0;
            let left = timeline.x_px(report.at) - width / 2.0;
            (left.min(WIDTH_PX - width), width)
        })
        .collect();
    let rows = rows_for(&places, 1);
    for (place, report) in reports.iter().enumerate() {
        let top = (report.at.as_secs_f64(), report.interval.as_secs_f64());
        let at = chart.plotting_area().map_coordinate(&top);
        let color = report.by.map_or(INK, |rank| run.colors[rank]);
        Mark::Square.draw(area, at, color)?;
        if rows[place].is_some() {
            let (left, width) = places[place];
            let above = (px(left + width / 2.0), at.1 - px(7.0));
            area.draw_text(&texts[place], &letters.style(), above)?;
        }
    }
    Ok(())
}
