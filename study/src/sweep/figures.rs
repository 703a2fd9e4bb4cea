//! Completion and makespan against each swept column, as SVG.

use std::ops::Range;

use plotters::style::RGBColor;
use plotters::style::text_anchor::{HPos, VPos};

use super::statistics::Interval;
use super::summary::{Against, Summary};
use crate::palette::colors;
use crate::report::figures::canvas::{
    Area, Axes, Chart, Drawn, FAINT, Frame, INK, Lettering, Mark, TEXT_PX, WIDTH_PX, chart, curve,
    line, part, px, rows_for, svg,
};

const LEFT_PX: f64 = 62.0;
const RIGHT_PX: f64 = 16.0;
const PLOT_PX: f64 = 190.0;
const GAP_PX: f64 = 14.0;
const LEGEND_PX: f64 = 26.0;

/// Most rows of labels below the plots, so that long ones have room.
const LABEL_ROWS: usize = 3;
const ROW_PX: f64 = 16.0;

const LABELS: Lettering = Lettering {
    size_px: TEXT_PX,
    bold: false,
    color: INK,
    anchor: (HPos::Center, VPos::Center),
    upright: false,
};

/// Series that can be told apart by their marks.
const MARKS: [Mark; 4] = [Mark::Square, Mark::Diamond, Mark::Triangle, Mark::Cross];

/// Room between the series of a group, in groups.
const APART: f64 = 0.12;

/// A panel: what it shows, its axis, and where a summary stands on it with its interval.
struct Panel {
    what: &'static str,
    y: Range<f64>,
    at: fn(&Summary) -> Option<(f64, Interval)>,
}

/// The figure of a column.
///
/// # Errors
/// When it cannot be drawn.
pub fn draw(against: &Against) -> anyhow::Result<String> {
    let makespan = |summary: &Summary| {
        let found = summary.makespan_s?;
        Some((found.median, found.interval))
    };
    let summaries = against.series.iter().flat_map(|(_, groups)| groups);
    let longest = summaries
        .flatten()
        .filter_map(makespan)
        .map(|(_, (_, to))| to)
        .fold(0.0, f64::max);
    let panels = [
        Panel {
            what: "share of complete runs",
            // The ends, too, are seen.
            y: -0.04..1.04,
            at: |summary| Some((summary.share()?, summary.completion)),
        },
        Panel {
            what: "median makespan in s",
            y: 0.0..(longest * 1.08).max(1.0),
            at: makespan,
        },
    ];
    let is_named = against.series.len() > 1;
    let head_px = if is_named { LEGEND_PX } else { 4.0 };
    let plots_px = head_px + 2.0 * PLOT_PX + GAP_PX;
    let label_rows = label_rows(against);
    let used = label_rows.iter().flatten().max().map_or(0, |row| row + 1);
    let labels_px = (used as f64 + 1.0) * ROW_PX + 16.0;
    let colors = colors(against.series.iter().map(|(name, _)| name.as_str()));
    let title = format!("Completion and makespan by {}", against.column);
    svg(&title, plots_px + labels_px, |area| {
        if is_named {
            legend(area, against, &colors)?;
        }
        for (place, panel) in panels.iter().enumerate() {
            let top_px = head_px + place as f64 * (PLOT_PX + GAP_PX);
            let within = part(area, (0.0, top_px), (WIDTH_PX, PLOT_PX));
            draw_panel(area, &within, panel, against, &colors)?;
        }
        labels(area, against, plots_px, &label_rows)?;
        let below_px = plots_px + labels_px - ROW_PX;
        LABELS.write(area, &against.column, (WIDTH_PX / 2.0, below_px))
    })
}

/// Groups stand at 0, 1, …
fn x_range(against: &Against) -> Range<f64> {
    -0.5..against.groups.len() as f64 - 0.5
}

/// Of a group, in px.
fn x_px(against: &Against, group: usize) -> f64 {
    let width = WIDTH_PX - LEFT_PX - RIGHT_PX;
    LEFT_PX + width * (group as f64 + 0.5) / against.groups.len() as f64
}

fn draw_panel(
    area: &Area<'_>,
    within: &Area<'_>,
    panel: &Panel,
    against: &Against,
    colors: &[RGBColor],
) -> Drawn {
    let frame = Frame {
        left: LEFT_PX,
        right: RIGHT_PX,
        bottom: 0.0,
    };
    let axes = Axes {
        x: (x_range(against), ""),
        y: (panel.y.clone(), panel.what),
        y_labels: 6,
    };
    let chart = chart(within, frame, &axes)?;
    let middle = (against.series.len() as f64 - 1.0) / 2.0;
    for (place, (_, groups)) in against.series.iter().enumerate() {
        let shift = (place as f64 - middle) * APART;
        let points: Vec<_> = groups
            .iter()
            .enumerate()
            .filter_map(|(group, summary)| {
                let (at, interval) = (panel.at)(summary.as_ref()?)?;
                Some((group as f64 + shift, at, interval))
            })
            .collect();
        draw_series(
            area,
            &chart,
            &points,
            (MARKS[place % MARKS.len()], colors[place]),
        )?;
    }
    Ok(())
}

fn draw_series(
    area: &Area<'_>,
    chart: &Chart<'_>,
    points: &[(f64, f64, Interval)],
    (mark, color): (Mark, RGBColor),
) -> Drawn {
    let middles = points.iter().map(|(x, at, _)| (*x, *at)).collect();
    curve(chart, middles, line(FAINT, 0.75))?;
    for &(x, at, (from, to)) in points {
        curve(chart, vec![(x, from), (x, to)], line(color, 2.0))?;
        mark.draw(area, chart.plotting_area().map_coordinate(&(x, at)), color)?;
    }
    Ok(())
}

fn legend(area: &Area<'_>, against: &Against, colors: &[RGBColor]) -> Drawn {
    let letters = Lettering::default();
    let mut left_px = LEFT_PX;
    for (place, (name, _)) in against.series.iter().enumerate() {
        let at = (px(left_px + 6.0), px(LEGEND_PX / 2.0));
        MARKS[place % MARKS.len()].draw(area, at, colors[place])?;
        letters.write(area, name, (left_px + 18.0, LEGEND_PX / 2.0))?;
        left_px += letters.width_px(name) + 44.0;
    }
    Ok(())
}

/// The row in which each group's name has room below the plots, if any.
fn label_rows(against: &Against) -> Vec<Option<usize>> {
    let places: Vec<(f64, f64)> = against
        .groups
        .iter()
        .enumerate()
        .map(|(group, name)| {
            let width = LABELS.width_px(name) + 8.0;
            (x_px(against, group) - width / 2.0, width)
        })
        .collect();
    rows_for(&places, LABEL_ROWS)
}

fn labels(area: &Area<'_>, against: &Against, top_px: f64, rows: &[Option<usize>]) -> Drawn {
    for (group, row) in rows.iter().enumerate() {
        if let Some(row) = row {
            let y_px = top_px + (*row as f64 + 0.75) * ROW_PX;
            LABELS.write(area, &against.groups[group], (x_px(against, group), y_px))?;
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::super::results::tests::{complete, design, failed, incomplete};
    use super::super::summary::by_column;
    use super::*;

    #[test]
    fn a_mark_for_every_group_with_runs_in_both_panels() {
        let design = design("presets = ['team', 'par98']\n[grid]\nbody.speed_m_s = [0.5, 0.25]\n");
        // One group has no makespan, and one nothing at all.
        let rows = [
            complete(0, 4_000),
            complete(1, 5_000),
            incomplete(2),
            failed(3),
        ];
        let drawn: Vec<String> = by_column(&design, &rows)
            .iter()
            .map(|against| draw(against).unwrap())
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
        // Three with a share, two with a makespan, two in the legend.
        assert_eq!(text.matches("<polygon").count(), 3 + 2 + 2);
        assert!(drawn[1].contains("<title>Completion and makespan by preset</title>"));
    }
}
