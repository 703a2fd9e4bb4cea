//! Who did what: a lane for each robot and task, and below them the tasks that nobody was productive on.

use std::ops::Range;

use plotters::element::PathElement;
use plotters::style::text_anchor::{HPos, VPos};

use super::canvas::{
    Area, Axes, Chart, Drawn, FAINT, Frame, INK, Lettering, Mark, WIDTH_PX, chart, curve, fill,
    hatch, line, part, px, svg,
};
use super::timeline::{Sample, Timeline};
use super::{ABSENT, RunFigures};
use crate::report::spans::Spans;

const LEFT_PX: f64 = 210.0;
const LANE_PX: f64 = 17.0;
const X_AXIS_PX: f64 = 40.0;

/// Ticks of a bar are at least so far apart, px.
const TICK_APART_PX: f64 = 4.0;

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
        (Sample::Ticked(INK), "effect on the world"),
        (Sample::Mark(Mark::Diamond, INK), "took over"),
        (Sample::Hatch(INK, 2.5), "applicable, nobody productive"),
    ];
    let timeline = Timeline::new(run.window.clone(), LEFT_PX, &run.faults, legend);
    let head_px = timeline.head_px();
    let lanes = lane(run, run.history.robots.len() + 1, 0);
    let bottom_px = head_px + lanes * LANE_PX;
    svg("Who did what", bottom_px + X_AXIS_PX + 4.0, |area| {
        timeline.draw_head(area, std::slice::from_ref(&(head_px..bottom_px)))?;
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
        names(run, &timeline, area, &chart)
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
        let top = lane(run, stint.robot, stint.task.index()) + BAR.start;
        let mut last = i32::MIN;
        for effect in &stint.effects {
            let (x, y) = plot.map_coordinate(&(effect.as_secs_f64(), top));
            // Ticks that ran into each other would hide the bar and tell no number.
            if x < last.saturating_add(px(TICK_APART_PX)) {
                continue;
            }
            last = x;
            let ends = [(x, y - px(2.0)), (x, y + px(2.5))];
            area.draw(&PathElement::new(ends, line(INK, 1.0)))?;
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

#[cfg(test)]
mod tests {
    use alliance_proto::scenario::{Scenario, Setup};
    use missions::Registry;

    use crate::palette;
    use crate::report::figures::figures;
    use crate::report::metrics::Metrics;
    use crate::report::tests::run_of;

    /// An element of the drawing: its box in px, and its color.
    struct Painted {
        x: (f64, f64),
        y: (f64, f64),
        color: String,
    }

    /// Filled rectangles and lines of an SVG, in the order in which they are drawn.
    fn painted(svg: &str) -> Vec<Painted> {
        let value = |element: &str, name: &str| {
            let from = element.find(&format!(" {name}=\""))? + name.len() + 3;
            let to = from + element[from..].find('"')?;
            Some(element[from..to].to_owned())
        };
        let number =
            |text: &str| text.parse::<f64>().unwrap() / super::super::canvas::px(1.0) as f64;
        let mut all = Vec::new();
        for element in svg.split('<') {
            if element.starts_with("rect") && value(element, "opacity").as_deref() == Some("1") {
                let of = |name| number(&value(element, name).unwrap());
                let (x, y) = (of("x"), of("y"));
                let color = value(element, "fill").unwrap();
                all.push(Painted {
                    x: (x, x + of("width")),
                    y: (y, y + of("height")),
                    color,
                });
            } else if element.starts_with("polyline") {
                let points = value(element, "points").unwrap();
                let points: Vec<(f64, f64)> = points
                    .split_whitespace()
                    .map(|point| point.split_once(',').unwrap())
                    .map(|(x, y)| (number(x), number(y)))
                    .collect();
                let half = number(&value(element, "stroke-width").unwrap()) / 2.0;
                let xs = points.iter().map(|point| point.0);
                let ys = points.iter().map(|point| point.1);
                let least = |all: &mut dyn Iterator<Item = f64>| all.fold(f64::MAX, f64::min);
                let most = |all: &mut dyn Iterator<Item = f64>| all.fold(f64::MIN, f64::max);
                all.push(Painted {
                    x: (least(&mut xs.clone()) - half, most(&mut xs.clone()) + half),
                    y: (least(&mut ys.clone()), most(&mut ys.clone())),
                    color: value(element, "stroke").unwrap(),
                });
            }
        }
        all
    }

    /// Gold and green search for two minutes, with an effect in every few steps: their bars are there all the same.
    #[test]
    fn effects_do_not_hide_the_bars_on_which_they_are_marked() {
        let text =
            include_str!("../../../../missions/src/waste/scenarios/thesis-trapped-robot.toml");
        let scenario = Scenario::parse(
            "thesis-trapped-robot",
            text,
            &Registry::built_in().vocabulary(),
        )
        .unwrap();
        let (history, run) = run_of(Setup::resolve(scenario, 1, None).unwrap().setup);
        let metrics = Metrics::of(&history, &run);
        let figures = figures(&history, &metrics).unwrap();
        let all = painted(
            &figures
                .iter()
                .find(|figure| figure.name == "gantt")
                .unwrap()
                .svg,
        );
        let names = history.robots.iter().map(|robot| robot.name.as_str());
        let colors = palette::colors(names);
        let task = history.task_named("find-locations").unwrap();
        let mut seen = 0;
        for stint in metrics.stints.iter().filter(|stint| stint.task == task) {
            let color = &colors[stint.robot];
            let color = format!("#{:02X}{:02X}{:02X}", color.0, color.1, color.2);
            let long = stint.span.length().as_secs_f64() > 20.0;
            let bars: Vec<&Painted> = all
                .iter()
                .filter(|bar| bar.color == color && bar.y.1 - bar.y.0 > 8.0)
                .collect();
            if !long || stint.effects.len() < 50 {
                continue;
            }
            seen += 1;
            // The widest bar of the robot is that of such a search; a quarter from its upper edge it is looked at.
            let bar = bars
                .iter()
                .max_by(|a, b| (a.x.1 - a.x.0).total_cmp(&(b.x.1 - b.x.0)))
                .unwrap();
            for share in [0.25, 0.5, 0.75] {
                let y = bar.y.0 + share * (bar.y.1 - bar.y.0);
                let places = 400;
                let place = |index: i32| {
                    bar.x.0 + (bar.x.1 - bar.x.0) * (f64::from(index) + 0.5) / f64::from(places)
                };
                let hidden = (0..places).filter(|index| {
                    let x = place(*index);
                    let inside =
                        |it: &&Painted| it.x.0 <= x && x <= it.x.1 && it.y.0 <= y && y <= it.y.1;
                    all.iter().rfind(inside).unwrap().color != color
                });
                let hidden = hidden.count();
                assert!(
                    hidden * 10 < places as usize * 3,
                    "{hidden} of {places} at {share}"
                );
            }
        }
        assert!(seen >= 2, "{seen} long searches");
    }
}
