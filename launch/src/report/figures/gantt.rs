//! Who did what: a lane for each robot and task, and below them the tasks that nobody was productive on.

use plotters::element::PathElement;
use plotters::style::RGBColor;
use plotters::style::text_anchor::{HPos, VPos};

use super::canvas::{
    Axes, FAINT, Frame, INK, Lettering, Mark, WIDTH_PX, chart, curve, fill, hatch, line, part, px,
    svg,
};
use super::timeline::{Sample, Timeline};
use super::{Scene, WHITE};
use crate::report::spans::{Span, Spans};

const LEFT_PX: f64 = 210.0;
const LANE_PX: f64 = 17.0;
const X_AXIS_PX: f64 = 40.0;

/// Draws it.
///
/// # Errors
/// When it cannot be drawn.
pub fn draw(scene: &Scene<'_>) -> anyhow::Result<String> {
    let history = scene.history;
    let legend = vec![
        (Sample::Fill(INK, 1.0), "active"),
        (Sample::Hatch(INK, 4.0), "waiting"),
        (Sample::Fill(FAINT, 0.6), "dead or stopped"),
        (Sample::Stroke(INK), "effect: delivery, report, finding"),
        (Sample::Mark(Mark::Diamond, INK), "took over"),
        (Sample::Hatch(INK, 2.5), "applicable, nobody productive"),
    ];
    let timeline = Timeline::new(scene.window.clone(), LEFT_PX, &scene.faults, legend);
    let head_px = timeline.head_px();
    let tasks = history.catalog.tasks.len();
    let lanes = (history.robots.len() + 1) * tasks;
    let bottom_px = head_px + lanes as f64 * LANE_PX;
    svg("Who did what", bottom_px + X_AXIS_PX + 4.0, |area| {
        let panel = part(
            area,
            (0.0, head_px),
            (WIDTH_PX, bottom_px - head_px + X_AXIS_PX),
        );
        let frame = Frame {
            left: LEFT_PX,
            right: WIDTH_PX - timeline.edges.end,
            bottom: X_AXIS_PX,
        };
        let axes = Axes {
            x: (timeline.window.clone(), "time t in s"),
            y: (lanes as f64..0.0, ""),
            y_labels: 0,
        };
        let chart = chart(&panel, frame, &axes)?;
        let lane = |rank: usize, task: usize| (rank * tasks + task) as f64;

        let all = Spans::from_iter([Span {
            from: Default::default(),
            to: history.end,
        }]);
        for (rank, robot) in history.robots.iter().enumerate() {
            for span in all.without(&robot.present).iter() {
                if let Some(span) = timeline.cut(span) {
                    let lanes = lane(rank, 0)..lane(rank + 1, 0);
                    fill(&chart, span, lanes, FAINT, 0.45)?;
                }
            }
            for set in &robot.sets {
                let top = lane(rank, set.task.index());
                for span in set.active.iter().filter_map(|span| timeline.cut(span)) {
                    fill(
                        &chart,
                        span,
                        top + 0.12..top + 0.88,
                        scene.colors[rank],
                        1.0,
                    )?;
                }
                for span in set.waiting.iter().filter_map(|span| timeline.cut(span)) {
                    let lanes = top + 0.12..top + 0.88;
                    hatch(area, &chart, span, lanes, (scene.colors[rank], 4.0))?;
                }
            }
        }
        for (task, figures) in scene.metrics.tasks.iter().enumerate() {
            let top = lane(history.robots.len(), task);
            for span in figures.orphan.iter().filter_map(|span| timeline.cut(span)) {
                hatch(area, &chart, span, top + 0.12..top + 0.88, (INK, 2.5))?;
            }
        }
        let plot = chart.plotting_area();
        for stint in &scene.metrics.stints {
            let middle = lane(stint.robot, stint.task.index()) + 0.5;
            for effect in &stint.effects {
                let (x, y) = plot.map_coordinate(&(effect.as_secs_f64(), middle));
                let ends = [(x, y - px(6.5)), (x, y + px(6.5))];
                area.draw(&PathElement::new(ends, line(WHITE, 1.5)))?;
            }
        }
        for takeover in &scene.metrics.takeovers {
            let middle = lane(takeover.by, takeover.task.index()) + 0.5;
            let at = plot.map_coordinate(&(takeover.at.as_secs_f64(), middle));
            Mark::Diamond.draw(area, at, INK)?;
        }

        let label = |color: RGBColor, bold: bool, anchor: HPos| Lettering {
            color,
            bold,
            anchor: (anchor, VPos::Center),
            ..Lettering::default()
        };
        let robots = history.robots.iter().map(|robot| robot.name.as_str());
        let colors = scene.colors.iter().copied().chain([INK]);
        for (rank, (name, color)) in robots.chain(["nobody"]).zip(colors).enumerate() {
            let y = |lane: f64| head_px + 2.0 + lane * (bottom_px - head_px - 2.0) / lanes as f64;
            let first = y(lane(rank, 0) + 0.5);
            label(color, true, HPos::Left).write(area, name, (6.0, first))?;
            for (task, spec) in history.catalog.tasks.iter().enumerate() {
                let at = (LEFT_PX - 10.0, y(lane(rank, task) + 0.5));
                label(INK, false, HPos::Right).write(area, &spec.name, at)?;
            }
            let (from, to) = (timeline.window.start, timeline.window.end);
            let edge = lane(rank, 0);
            curve(&chart, vec![(from, edge), (to, edge)], line(FAINT, 0.75))?;
        }
        timeline.draw_head(area, bottom_px)
    })
}
