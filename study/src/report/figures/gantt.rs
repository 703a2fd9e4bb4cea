//! Who did what: a lane for each robot and task, and below them the tasks that nobody was productive on.

use std::ops::Range;

use plotters::element::PathElement;
use plotters::style::text_anchor::{HPos, VPos};

use super::canvas::{
    Area, Axes, Chart, Drawn, FAINT, Frame, INK, Lettering, Mark, WIDTH_PX, chart, curve, fill,
    hatch, line, part, px, svg,
};
use super::timeline::{Sample, Timeline};
use super::{ABSENT, RunFigures, WHITE};
use crate::report::spans::Spans;

const LEFT_PX: f64 = 210.0;
const LANE_PX: f64 = 17.0;
const X_AXIS_PX: f64 = 40.0;

/// Height of a bar, as shares of its lane.
const BAR: Range<f64> = 0.12..0.88;

/// Draws it.
///
/// # Errors
/// When it cannot be drawn.
pub fn draw(run: &RunFigures<'_>) -> anyhow::Result<String> {
    let legend = vec![
        (Sample::Fill(INK, 1.0), "active"),
        (Sample::Hatch(INK, 4.0), "waiting"),
        (Sample::Fill(FAINT, ABSENT), "dead or stopped"),
        (Sample::Stroke(INK), "effect: delivery, report, finding"),
        (Sample::Mark(Mark::Diamond, INK), "took over"),
        (Sample::Hatch(INK, 2.5), "applicable, nobody productive"),
    ];
    let timeline = Timeline::new(run.window.clone(), LEFT_PX, &run.faults, legend);
    let head_px = timeline.head_px();
    let lanes = lane(run, run.history.robots.len() + 1, 0);
    let bottom_px = head_px + lanes * LANE_PX;
    svg("Who did what", bottom_px + X_AXIS_PX + 4.0, |area| {
        let size = (WIDTH_PX, bottom_px - head_px + X_AXIS_PX);
        let panel = part(area, (0.0, head_px), size);
        let frame = Frame {
            left: LEFT_PX,
            right: WIDTH_PX - timeline.edges.end,
            bottom: X_AXIS_PX,
        };
        let axes = Axes {
            x: (timeline.window.clone(), "time t in s"),
            y: (lanes..0.0, ""),
            y_labels: 0,
        };
        let chart = chart(&panel, frame, &axes)?;
        bars(run, &timeline, area, &chart)?;
        marks(run, area, &chart)?;
        names(run, &timeline, area, &chart)?;
        timeline.draw_head(area, bottom_px)
    })
}

/// Upper edge of the lane for a task of a robot; the lanes after those of the last one are nobody's.
fn lane(run: &RunFigures<'_>, rank: usize, task: usize) -> f64 {
    (rank * run.history.catalog.tasks.len() + task) as f64
}

/// When who was active, waiting, or not there; and below, when nobody was productive.
fn bars(
    run: &RunFigures<'_>,
    timeline: &Timeline<'_>,
    area: &Area<'_>,
    chart: &Chart<'_>,
) -> Drawn {
    let shown = |spans: &Spans| -> Vec<Range<f64>> {
        spans.iter().filter_map(|span| timeline.cut(span)).collect()
    };
    let bar = |top: f64| top + BAR.start..top + BAR.end;
    let robots = &run.history.robots;
    for (rank, robot) in robots.iter().enumerate() {
        let color = run.colors[rank];
        for span in shown(&run.history.absent(rank)) {
            let group = lane(run, rank, 0)..lane(run, rank + 1, 0);
            fill(chart, span, group, FAINT, ABSENT)?;
        }
        for set in &robot.sets {
            let top = lane(run, rank, set.task.index());
            for span in shown(&set.active) {
                fill(chart, span, bar(top), color, 1.0)?;
            }
            for span in shown(&set.waiting) {
                hatch(area, chart, span, bar(top), (color, 4.0))?;
            }
        }
    }
    for (task, figures) in run.metrics.tasks.iter().enumerate() {
        let top = lane(run, robots.len(), task);
        for span in shown(&figures.orphan) {
            hatch(area, chart, span, bar(top), (INK, 2.5))?;
        }
    }
    Ok(())
}

/// Effects and takeovers.
fn marks(run: &RunFigures<'_>, area: &Area<'_>, chart: &Chart<'_>) -> Drawn {
    let plot = chart.plotting_area();
    for stint in &run.metrics.stints {
        let middle = lane(run, stint.robot, stint.task.index()) + 0.5;
        for effect in &stint.effects {
            let (x, y) = plot.map_coordinate(&(effect.as_secs_f64(), middle));
            let ends = [(x, y - px(6.5)), (x, y + px(6.5))];
            area.draw(&PathElement::new(ends, line(WHITE, 1.5)))?;
        }
    }
    for takeover in &run.metrics.takeovers {
        let middle = lane(run, takeover.by, takeover.task.index()) + 0.5;
        let at = plot.map_coordinate(&(takeover.at.as_secs_f64(), middle));
        Mark::Diamond.draw(area, at, INK)?;
    }
    Ok(())
}

/// Robots and tasks beside their lanes, and lines between the robots.
fn names(
    run: &RunFigures<'_>,
    timeline: &Timeline<'_>,
    area: &Area<'_>,
    chart: &Chart<'_>,
) -> Drawn {
    let plot = chart.plotting_area();
    let (from, to) = (timeline.window.start, timeline.window.end);
    let robots = run.history.robots.iter();
    let robots = robots
        .map(|robot| robot.name.as_str())
        .zip(run.colors.iter().copied());
    for (rank, (name, color)) in robots.chain([("nobody", INK)]).enumerate() {
        let edge = lane(run, rank, 0);
        curve(chart, vec![(from, edge), (to, edge)], line(FAINT, 0.75))?;
        let robot = Lettering {
            bold: true,
            color,
            ..Lettering::default()
        };
        let task = Lettering {
            anchor: (HPos::Right, VPos::Center),
            ..Lettering::default()
        };
        let (left, first) = plot.map_coordinate(&(from, edge + 0.5));
        area.draw_text(name, &robot.style(), (px(6.0), first))?;
        for (place, spec) in run.history.catalog.tasks.iter().enumerate() {
            let (_, y) = plot.map_coordinate(&(from, lane(run, rank, place) + 0.5));
            area.draw_text(&spec.name, &task.style(), (left - px(10.0), y))?;
        }
    }
    Ok(())
}
