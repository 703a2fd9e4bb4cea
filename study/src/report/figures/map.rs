//! Where the robots went, on the map of the room.

use std::f64::consts::TAU;
use std::ops::Range;

use alliance_proto::view::{MarkOutline, MarkRole};
use glam::Vec2;
use plotters::element::{PathElement, Polygon, Rectangle};
use plotters::style::text_anchor::{HPos, VPos};
use plotters::style::{Color, RGBColor};

use super::canvas::{
    Area, Axes, BOLD, Chart, Drawn, FAINT, Frame, INK, Lettering, Mark, WIDTH_PX, chart, curve,
    line, part, px, svg,
};
use super::{RunFigures, WHITE};
use crate::palette;
use crate::report::failures::Loss;
use crate::report::history::Place;
use crate::report::thin::thin_way;

const LEFT_PX: f64 = 58.0;
const RIGHT_PX: f64 = 22.0;
const X_AXIS_PX: f64 = 40.0;
const TITLE_PX: f64 = 18.0;
const LEGEND_PX: f64 = 20.0;

/// Widths of ways with and without an item.
const LADEN_PX: f64 = 2.5;
const EMPTY_PX: f64 = 0.9;

/// Up to this penetrability a component is solid (thesis §3.2.2.1).
const SOLID: f32 = 0.1;

/// The ways of all robots on one map.
///
/// # Errors
/// When it cannot be drawn.
pub fn together(run: &RunFigures<'_>) -> anyhow::Result<String> {
    let all: Vec<usize> = (0..run.history.robots.len()).collect();
    let height = map_height_px(run, WIDTH_PX, 720.0);
    svg("Ways of all robots", height + LEGEND_PX, |area| {
        legend(run, area)?;
        let panel = part(area, (0.0, LEGEND_PX), (WIDTH_PX, height));
        map(run, area, &panel, (WIDTH_PX, height), &all, true)
    })
}

/// The way of each robot on a map of its own.
///
/// # Errors
/// When it cannot be drawn.
pub fn apart(run: &RunFigures<'_>) -> anyhow::Result<String> {
    let robots = run.history.robots.len();
    let columns = robots.clamp(1, 3);
    let width = WIDTH_PX / columns as f64;
    let height = map_height_px(run, width, 480.0);
    let rows = robots.div_ceil(columns);
    let full = LEGEND_PX + rows as f64 * (height + TITLE_PX);
    svg("Way of each robot", full, |area| {
        legend(run, area)?;
        for (rank, robot) in run.history.robots.iter().enumerate() {
            let left = (rank % columns) as f64 * width;
            let top = LEGEND_PX + (rank / columns) as f64 * (height + TITLE_PX);
            let name = Lettering {
                bold: true,
                color: run.colors[rank],
                ..Lettering::default()
            };
            name.write(area, &robot.name, (left + LEFT_PX, top + TITLE_PX / 2.0))?;
            let panel = part(area, (left, top + TITLE_PX), (width, height));
            map(run, area, &panel, (width, height), &[rank], false)?;
        }
        Ok(())
    })
}

/// Height of a map of that width with its axes, px: a meter is as long in y as in x, unless the map became too high.
fn map_height_px(run: &RunFigures<'_>, width_px: f64, highest_px: f64) -> f64 {
    let (width, height) = room(run);
    ((width_px - LEFT_PX - RIGHT_PX) * height / width).min(highest_px) + X_AXIS_PX + 2.0
}

fn room(run: &RunFigures<'_>) -> (f64, f64) {
    let room = &run.history.setup.scenario.room;
    (room.width_m.into(), room.height_m.into())
}

fn legend(run: &RunFigures<'_>, area: &Area<'_>) -> Drawn {
    let y = LEGEND_PX / 2.0;
    let letters = Lettering::default();
    let mut x = LEFT_PX;
    let mut places = run.history.robots.iter().flat_map(|robot| &robot.track);
    let ways: &[(&str, f64)] = match places.any(|place| place.carrying) {
        true => &[("with an item", LADEN_PX), ("without", EMPTY_PX)],
        false => &[],
    };
    for (text, width_px) in ways {
        let ends = [(px(x), px(y)), (px(x + 22.0), px(y))];
        area.draw(&PathElement::new(ends, line(INK, *width_px)))?;
        letters.write(area, text, (x + 28.0, y))?;
        x += 28.0 + letters.width_px(text) + 18.0;
    }
    for (text, mark, color) in [
        ("start", Mark::Triangle, WHITE),
        ("end", Mark::Square, INK),
        ("died", Mark::Cross, INK),
    ] {
        mark.draw(area, (px(x + 6.0), px(y)), color)?;
        letters.write(area, text, (x + 16.0, y))?;
        x += 16.0 + letters.width_px(text) + 18.0;
    }
    Ok(())
}

/// Draws a map in a panel of that size; if `named`, with the names of places and robots.
fn map(
    run: &RunFigures<'_>,
    area: &Area<'_>,
    panel: &Area<'_>,
    (width_px, height_px): (f64, f64),
    robots: &[usize],
    named: bool,
) -> Drawn {
    let (width, height) = room(run);
    // A map that would be too high is narrower instead.
    let plot_width = (height_px - X_AXIS_PX - 2.0) * width / height;
    let frame = Frame {
        left: LEFT_PX,
        right: (width_px - LEFT_PX - plot_width).max(RIGHT_PX),
        bottom: X_AXIS_PX,
    };
    let axes = Axes {
        x: (0.0..width, "x in m"),
        y: (0.0..height, "y in m"),
        y_labels: 10,
    };
    let chart = chart(panel, frame, &axes)?;
    furniture(run, area, &chart, named)?;
    for &rank in robots {
        way(run, &chart, rank)?;
    }
    for &rank in robots {
        ends(run, area, &chart, rank)?;
    }
    if named {
        names(run, area, &chart)?;
    }
    Ok(())
}

/// What is in the room before the robots are.
fn furniture(run: &RunFigures<'_>, area: &Area<'_>, chart: &Chart<'_>, named: bool) -> Drawn {
    let (width, height) = room(run);
    let plot = chart.plotting_area();
    let rectangle = |x: Range<f64>, y: Range<f64>, color: RGBColor, opacity: f64| {
        let inside = |value: f64, most: f64| value.clamp(0.0, most);
        let corners = [
            (inside(x.start, width), inside(y.start, height)),
            (inside(x.end, width), inside(y.end, height)),
        ];
        plot.draw(&Rectangle::new(corners, color.mix(opacity).filled()))
    };
    let label = |text: &str, at: (f64, f64)| {
        let letters = Lettering {
            anchor: (HPos::Center, VPos::Center),
            ..Lettering::default()
        };
        match named {
            true => area.draw_text(text, &letters.style(), plot.map_coordinate(&at)),
            false => Ok(()),
        }
    };
    let circle = |center: Vec2, radius: f32| -> Vec<(f64, f64)> {
        let corner = |turn: i32| {
            let (sin, cos) = (TAU * f64::from(turn) / 72.0).sin_cos();
            let (x, y) = (f64::from(center.x), f64::from(center.y));
            let radius = f64::from(radius);
            let (x, y) = (x + radius * cos, y + radius * sin);
            (x.clamp(0.0, width), y.clamp(0.0, height))
        };
        (0..=72).map(corner).collect()
    };
    let disc = |center: Vec2, radius: f32, color: RGBColor| {
        plot.draw(&Polygon::new(circle(center, radius), color.filled()))
    };
    // As thick as it is, but thick enough to be seen.
    let bar = |from: Vec2, to: Vec2, thickness_m: f32, color: RGBColor| {
        let ends = [from, to].map(|end| (f64::from(end.x), f64::from(end.y)));
        let (left, _) = plot.map_coordinate(&(0.0, 0.0));
        let (right, _) = plot.map_coordinate(&(f64::from(thickness_m), 0.0));
        let width_px = f64::from(right - left) / f64::from(px(1.0));
        curve(chart, ends.to_vec(), line(color, width_px.max(1.5)))
    };

    let below = height * 0.03;
    for mark in &run.history.marks {
        let color = palette::of_mark(mark);
        let top = match mark.outline {
            MarkOutline::Disc { center, radius_m } => {
                match mark.role {
                    // How far something reaches hides nothing.
                    MarkRole::Range => curve(chart, circle(center, radius_m), line(color, 1.0))?,
                    _ => disc(center, radius_m, color)?,
                }
                center + Vec2::new(0.0, radius_m)
            }
            MarkOutline::Rectangle { min, max } => {
                let sides = [min.x..max.x, min.y..max.y];
                let [x, y] = sides.map(|side| f64::from(side.start)..f64::from(side.end));
                rectangle(x, y, color, 1.0)?;
                Vec2::new((min.x + max.x) / 2.0, max.y)
            }
            MarkOutline::Bar {
                from,
                to,
                half_width_m,
            } => {
                bar(from, to, 2.0 * half_width_m, color)?;
                (from + to) / 2.0
            }
            MarkOutline::Line { from, to } => {
                bar(from, to, 0.0, color)?;
                (from + to) / 2.0
            }
        };
        if !mark.is_labelled(run.history.marks.len()) {
            continue;
        }
        // Beside a wall there is room inside only.
        let x = f64::from(top.x).clamp(width * 0.06, width * 0.94);
        label(
            &mark.label,
            (x, (f64::from(top.y) + below).min(height - below)),
        )?;
    }
    for item in &run.history.items {
        disc(item.position, item.radius_m, palette::ITEM)?;
    }
    for obstacle in &run.history.obstacles {
        let (x, y) = (f64::from(obstacle.x_m), f64::from(obstacle.y_m));
        let x = x..x + f64::from(obstacle.width_m);
        let y = y..y + f64::from(obstacle.height_m);
        let opacity = if obstacle.penetrability <= SOLID {
            1.0
        } else {
            0.3
        };
        rectangle(x, y, FAINT, opacity)?;
    }
    let border = vec![
        (0.0, 0.0),
        (width, 0.0),
        (width, height),
        (0.0, height),
        (0.0, 0.0),
    ];
    curve(chart, border, line(INK, 2.0))
}

/// A robot's way: thick where it carried something.
fn way(run: &RunFigures<'_>, chart: &Chart<'_>, rank: usize) -> Drawn {
    let (width, _) = room(run);
    // Half a pixel.
    let distance = width / WIDTH_PX / 2.0;
    let track = &run.history.robots[rank].track;
    let mut before: Option<&Place> = None;
    for part in track.chunk_by(|a, b| a.carrying == b.carrying) {
        let points: Vec<(f64, f64)> = before
            .into_iter()
            .chain(part)
            .map(|at| at.position)
            .collect();
        before = part.last();
        let width_px = if part[0].carrying { LADEN_PX } else { EMPTY_PX };
        let style = line(run.colors[rank], width_px);
        curve(chart, thin_way(&points, distance), style)?;
    }
    Ok(())
}

/// Where it started, where it died, and where it was at the end.
fn ends(run: &RunFigures<'_>, area: &Area<'_>, chart: &Chart<'_>, rank: usize) -> Drawn {
    let robot = &run.history.robots[rank];
    let [first, .., last] = robot.track.as_slice() else {
        return Ok(());
    };
    let plot = chart.plotting_area();
    Mark::Triangle.draw(area, plot.map_coordinate(&first.position), WHITE)?;
    let end = plot.map_coordinate(&last.position);
    Mark::Square.draw(area, end, run.colors[rank])?;
    let deaths = run.metrics.failures.iter();
    for death in deaths.filter(|loss| loss.robot == rank && loss.loss == Loss::Died) {
        let tick = (death.at.0 / run.history.step.0) as usize;
        if let Some(place) = robot.track.get(tick) {
            Mark::Cross.draw(area, plot.map_coordinate(&place.position), INK)?;
        }
    }
    Ok(())
}

/// Writes the robots' names beside their ends, in one of four places; a name that has room in none is left out.
fn names(run: &RunFigures<'_>, area: &Area<'_>, chart: &Chart<'_>) -> Drawn {
    let letters = Lettering {
        bold: true,
        ..Lettering::default()
    };
    let half = px(6.0);
    let ends: Vec<(&str, (i32, i32))> = run
        .history
        .robots
        .iter()
        .filter_map(|robot| {
            let last = robot.track.last()?;
            let at = chart.plotting_area().map_coordinate(&last.position);
            Some((robot.name.as_str(), at))
        })
        .collect();
    let mut taken: Vec<(Range<i32>, Range<i32>)> = ends
        .iter()
        .map(|(_, (x, y))| (x - half..x + half, y - half..y + half))
        .collect();
    for (name, (x, y)) in ends {
        let width = px(letters.width_px(name) * BOLD);
        let free = [x + px(8.0), x - px(8.0) - width]
            .into_iter()
            .flat_map(|left| [y - px(9.0), y + px(9.0)].map(|middle| (left, middle)))
            .map(|(left, middle)| (left..left + width, middle - half..middle + half))
            .find(|(columns, rows)| {
                let mut others = taken.iter();
                !others.any(|(x, y)| overlap(x, columns) && overlap(y, rows))
            });
        if let Some((columns, rows)) = free {
            let at = (columns.start, rows.start + half);
            area.draw_text(name, &letters.style(), at)?;
            taken.push((columns, rows));
        }
    }
    Ok(())
}

fn overlap(a: &Range<i32>, b: &Range<i32>) -> bool {
    a.start < b.end && b.start < a.end
}
