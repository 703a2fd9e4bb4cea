//! The paths of the robots on a map of the room.

use std::f64::consts::TAU;
use std::ops::Range;

use glam::Vec2;
use plotters::element::{Polygon, Rectangle};
use plotters::style::{Color, RGBColor};
use proto::view::{ItemView, Mark as ViewMark, MarkOutline, MarkRole};
use scenario::Obstacle;

use super::{LOSSES, RunFigures};
use crate::figures::canvas::{
    Area, Axes, Chart, DrawResult, EDGE_PX, FAINT, Frame, INK, Mark, TEXT_PX, TextLabel, WHITE,
    X_AXIS_PX, chart, curve, line, part, px,
};
use crate::figures::legend::{Legend, Sample};
use crate::figures::palette;
use crate::figures::simplify::thin_way;
use crate::report::robot_history::TrackPoint;
use observation::stints::Loss;

const LEFT_PX: f64 = 58.0;
const RIGHT_PX: f64 = 22.0;
const TITLE_PX: f64 = 18.0;

/// Line widths of paths with and without an item, px.
const LADEN_PX: f64 = 2.5;
const EMPTY_PX: f64 = 0.9;

/// The maximum number of robots with full-size maps. More robots have small maps without axes.
const LARGE_MAPS: usize = 12;

/// Width of a small map, px: wide enough for a name.
const SMALL_PX: f64 = 52.0;

/// The level of detail of a map.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Detail {
    /// Objects in the room, and the names of places and robots.
    All,
    /// Objects in the room.
    Things,
    /// Only walls and paths.
    Paths,
}

/// Draws the paths of all robots on one map.
pub fn together(run: &RunFigures<'_>) -> anyhow::Result<String> {
    let all: Vec<usize> = (0..run.history.robots.len()).collect();
    let width = run.sheet.width_px;
    let height = map_height_px(run, width, width * 0.75);
    let legend = legend(run);
    run.sheet
        .svg("Paths of all robots", legend.height_px() + height, |area| {
            legend.draw(area, 0.0)?;
            let panel = part(area, (0.0, legend.height_px()), (width, height));
            Map::new(run, area, &panel, (width, height), Detail::All)?.draw(&all)
        })
}

/// Draws the path of each robot on its own map. Several robots share a map if there are too many.
pub fn apart(run: &RunFigures<'_>) -> anyhow::Result<String> {
    let robots = run.history.robots.len();
    let grid = Grid::fit(run, robots);
    let (width, height) = (grid.width_px, grid.height_px);
    let legend = legend(run);
    let head_px = legend.height_px();
    let full =
        head_px + robots.div_ceil(grid.each).div_ceil(grid.columns) as f64 * (height + TITLE_PX);
    run.sheet.svg("Path of each robot", full, |area| {
        legend.draw(area, 0.0)?;
        let ranks: Vec<usize> = (0..robots).collect();
        for (place, ranks) in ranks.chunks(grid.each).enumerate() {
            let left = (place % grid.columns) as f64 * width;
            let top = head_px + (place / grid.columns) as f64 * (height + TITLE_PX);
            let (first, last) = (ranks[0], ranks[ranks.len() - 1]);
            let name = |rank: usize| &run.history.robots[rank].name;
            let (title, color) = match first == last {
                true => (name(first).clone(), run.colors[first]),
                false => (format!("{} … {}", name(first), name(last)), INK),
            };
            let (size_px, indent) = match grid.say {
                Detail::Paths => (10.0, EDGE_PX),
                _ => (TEXT_PX, LEFT_PX),
            };
            let letters = TextLabel::BOLD.sized(size_px).colored(color);
            let title = letters.cut(&title, width - indent);
            letters.write(area, &title, (left + indent, top + TITLE_PX / 2.0))?;
            let panel = part(area, (left, top + TITLE_PX), (width, height));
            Map::new(run, area, &panel, (width, height), grid.say)?.draw(ranks)?;
        }
        Ok(())
    })
}

struct Grid {
    columns: usize,
    /// The number of robots per map.
    each: usize,
    width_px: f64,
    height_px: f64,
    say: Detail,
}

impl Grid {
    fn fit(run: &RunFigures<'_>, robots: usize) -> Self {
        let of = |columns: usize, each: usize, say: Detail| {
            let width_px = run.sheet.width_px / columns as f64;
            let height_px = match say {
                Detail::Paths => {
                    let (width, height) = room(run);
                    (width_px - 2.0 * EDGE_PX) * (height / width).min(1.5) + 2.0 * EDGE_PX
                }
                _ => map_height_px(run, width_px, 480.0),
            };
            Self {
                columns,
                each,
                width_px,
                height_px,
                say,
            }
        };
        let head_px = legend(run).height_px();
        let fits = |grid: &Self| {
            let rows = robots.div_ceil(grid.each).div_ceil(grid.columns);
            head_px + rows as f64 * (grid.height_px + TITLE_PX) <= run.sheet.max_height_px()
        };
        let large = of(robots.clamp(1, 3), 1, Detail::Things);
        if robots <= LARGE_MAPS && fits(&large) {
            return large;
        }
        let most_columns = ((run.sheet.width_px / SMALL_PX) as usize).max(1);
        // The number of columns grows before robots share a map.
        let single = (4.min(most_columns)..=most_columns).map(|columns| (columns, 1));
        let shared = (2..=robots.max(2)).map(|each| (most_columns, each));
        let mut grids = single
            .chain(shared)
            .map(|(columns, each)| of(columns, each, Detail::Paths));
        // A single map of all robots always fits.
        grids.find(fits).unwrap_or(large)
    }
}

/// Returns the height of a map with axes, px. A meter has the same length in x and y, unless the map would be too high.
pub(super) fn map_height_px(run: &RunFigures<'_>, width_px: f64, highest_px: f64) -> f64 {
    let (width, height) = room(run);
    ((width_px - LEFT_PX - RIGHT_PX) * height / width).min(highest_px) + X_AXIS_PX + 2.0
}

fn room(run: &RunFigures<'_>) -> (f64, f64) {
    let room = &run.history.setup.scenario.room;
    (room.width_m.into(), room.height_m.into())
}

/// Returns the ranges of x and y, m.
fn border(run: &RunFigures<'_>) -> [Range<f64>; 2] {
    let room = &run.history.setup.scenario.room;
    let (low, high) = (room.low(), room.high());
    [low.x.into()..high.x.into(), low.y.into()..high.y.into()]
}

fn legend(run: &RunFigures<'_>) -> Legend<'static> {
    let mut places = run.history.robots.iter().flat_map(|robot| &robot.track);
    let mut entries = match places.any(|place| place.carrying) {
        true => vec![
            (Sample::Line(INK, LADEN_PX), "with an item"),
            (Sample::Line(INK, EMPTY_PX), "without"),
        ],
        false => Vec::new(),
    };
    let [died, _] = LOSSES;
    entries.extend([
        (Sample::Mark(Mark::Triangle, WHITE), "start"),
        (Sample::Mark(Mark::Square, INK), "end"),
        died,
    ]);
    Legend::new(entries, LEFT_PX..run.sheet.width_px)
}

/// A map with its axes, on which the parts of a scene are drawn.
pub(super) struct Map<'m, 'a> {
    run: &'m RunFigures<'m>,
    area: &'m Area<'a>,
    pub chart: Chart<'a>,
    say: Detail,
}

/// The objects in a room besides robots.
pub(super) struct Scene<'s> {
    pub marks: &'s [ViewMark],
    pub items: &'s [ItemView],
    pub obstacles: &'s [Obstacle],
}

impl<'m, 'a> Map<'m, 'a> {
    /// Draws the axes of a map in a panel of that size, a part of `area`.
    pub(super) fn new(
        run: &'m RunFigures<'m>,
        area: &'m Area<'a>,
        panel: &Area<'a>,
        (width_px, height_px): (f64, f64),
        say: Detail,
    ) -> DrawResult<Self> {
        let border = border(run);
        let (width, height) = room(run);
        let (left, right, bottom, labels) = match say {
            Detail::Paths => (EDGE_PX, EDGE_PX, 0.0, 0),
            _ => (LEFT_PX, RIGHT_PX, X_AXIS_PX, 10),
        };
        // A map that would be too high becomes narrower.
        let plot_width = (height_px - bottom - 2.0) * width / height;
        let frame = Frame {
            left,
            right: (width_px - left - plot_width).max(right),
            bottom,
        };
        let axes = Axes {
            x: (border[0].clone(), "x in m"),
            y: (border[1].clone(), if labels > 0 { "y in m" } else { "" }),
            y_labels: labels,
        };
        let chart = chart(panel, frame, &axes)?;
        Ok(Self {
            run,
            area,
            chart,
            say,
        })
    }

    /// Draws the start state of the room and the paths of these robots.
    fn draw(&self, robots: &[usize]) -> DrawResult {
        let (run, window) = (self.run, &self.run.window);
        self.scene(&Scene {
            marks: &run.history.marks,
            items: &run.history.items,
            obstacles: &run.history.obstacles,
        })?;
        for &rank in robots {
            self.track(rank, track(run, rank, window))?;
        }
        for &rank in robots {
            self.ends(rank)?;
        }
        if self.say == Detail::All {
            self.names()?;
        }
        Ok(())
    }

    pub(super) fn scene(&self, scene: &Scene<'_>) -> DrawResult {
        let (run, area, chart, say) = (self.run, self.area, &self.chart, self.say);
        let [border_x, border_y] = border(run);
        let plot = chart.plotting_area();
        let rectangle = |x: Range<f64>, y: Range<f64>, color: RGBColor, opacity: f64| {
            let inside = |value: f64, border: &Range<f64>| value.clamp(border.start, border.end);
            let corners = [
                (inside(x.start, &border_x), inside(y.start, &border_y)),
                (inside(x.end, &border_x), inside(y.end, &border_y)),
            ];
            plot.draw(&Rectangle::new(corners, color.mix(opacity).filled()))
        };
        let label = |text: &str, at: (f64, f64)| {
            let letters = TextLabel::CENTERED;
            match say == Detail::All {
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
                let inside = |at: f64, border: &Range<f64>| at.clamp(border.start, border.end);
                (inside(x, &border_x), inside(y, &border_y))
            };
            (0..=72).map(corner).collect()
        };
        let disc = |center: Vec2, radius: f32, color: RGBColor| {
            plot.draw(&Polygon::new(circle(center, radius), color.filled()))
        };
        // True thickness, but at least visible.
        let bar = |from: Vec2, to: Vec2, thickness_m: f32, color: RGBColor| {
            let ends = [from, to].map(|end| (f64::from(end.x), f64::from(end.y)));
            let (left, _) = plot.map_coordinate(&(0.0, 0.0));
            let (right, _) = plot.map_coordinate(&(f64::from(thickness_m), 0.0));
            let width_px = f64::from(right - left) / f64::from(px(1.0));
            curve(chart, ends.to_vec(), line(color, width_px.max(1.5)))
        };

        let (width, height) = room(run);
        let below = height * 0.03;
        let (marks, items) = match say {
            Detail::Paths => (&[][..], &[][..]),
            _ => (scene.marks, scene.items),
        };
        for mark in marks {
            let color = palette::mark_color(mark);
            match mark.outline {
                MarkOutline::Disc { center, radius_m } => match mark.role {
                    // A range is an outline, so that it hides nothing.
                    MarkRole::Range => curve(chart, circle(center, radius_m), line(color, 1.0))?,
                    _ => disc(center, radius_m, color)?,
                },
                MarkOutline::Rectangle { min, max } => {
                    let sides = [min.x..max.x, min.y..max.y];
                    let [x, y] = sides.map(|side| f64::from(side.start)..f64::from(side.end));
                    rectangle(x, y, color, 1.0)?;
                }
                MarkOutline::Bar {
                    from,
                    to,
                    half_width_m,
                } => bar(from, to, 2.0 * half_width_m, color)?,
                MarkOutline::Line { from, to } => bar(from, to, 0.0, color)?,
            }
            if !mark.is_labelled(marks.len()) {
                continue;
            }
            let top = mark.outline.label_place();
            // At a wall, only the inside has room for a label.
            let (left, right) = (border_x.start + width * 0.06, border_x.start + width * 0.94);
            let x = f64::from(top.x).clamp(left, right);
            let y = (f64::from(top.y) + below).min(border_y.end - below);
            label(&mark.label, (x, y))?;
        }
        for item in items {
            disc(item.position, item.radius_m, palette::ITEM)?;
        }
        for obstacle in scene.obstacles {
            let (x, y) = (f64::from(obstacle.x_m), f64::from(obstacle.y_m));
            let x = x..x + f64::from(obstacle.width_m);
            let y = y..y + f64::from(obstacle.height_m);
            let opacity = if obstacle.is_solid() { 1.0 } else { 0.3 };
            rectangle(x, y, FAINT, opacity)?;
        }
        let [x, y] = [
            [
                border_x.start,
                border_x.end,
                border_x.end,
                border_x.start,
                border_x.start,
            ],
            [
                border_y.start,
                border_y.start,
                border_y.end,
                border_y.end,
                border_y.start,
            ],
        ];
        curve(chart, x.into_iter().zip(y).collect(), line(INK, 2.0))
    }

    /// Draws the positions of a robot as a path, thicker where it carries an item.
    pub(super) fn track(&self, rank: usize, track: &[TrackPoint]) -> DrawResult {
        let (width, _) = room(self.run);
        // The tolerance is half a pixel.
        let (across, _) = self.chart.plotting_area().dim_in_pixel();
        let distance = width * f64::from(px(0.5)) / f64::from(across.max(1));
        let mut before: Option<&TrackPoint> = None;
        for part in track.chunk_by(|a, b| a.carrying == b.carrying) {
            let points = before.into_iter().chain(part).map(TrackPoint::position);
            let points: Vec<(f64, f64)> = points.collect();
            before = part.last();
            let width_px = if part[0].carrying { LADEN_PX } else { EMPTY_PX };
            let style = line(self.run.colors[rank], width_px);
            curve(&self.chart, thin_way(&points, distance), style)?;
        }
        Ok(())
    }

    /// Marks the start, the death and the end of a robot.
    fn ends(&self, rank: usize) -> DrawResult {
        let run = self.run;
        let [first, .., last] = track(run, rank, &run.window) else {
            return Ok(());
        };
        let plot = self.chart.plotting_area();
        let radius_px = if self.say == Detail::Paths { 2.5 } else { 4.5 };
        let mark = |mark: Mark, place: &TrackPoint, color| {
            mark.draw_sized(
                self.area,
                plot.map_coordinate(&place.position()),
                color,
                radius_px,
            )
        };
        mark(Mark::Triangle, first, WHITE)?;
        mark(Mark::Square, last, run.colors[rank])?;
        let deaths = run.metrics.failures.iter();
        for death in deaths.filter(|loss| loss.robot == rank && loss.loss == Loss::Died) {
            let tick = (death.at.0 / run.history.step.0) as usize;
            let shown = run.window.contains(&death.at.as_secs_f64());
            if let Some(place) = run.history.robots[rank].track.get(tick).filter(|_| shown) {
                mark(Mark::Cross, place, INK)?;
            }
        }
        Ok(())
    }

    /// Writes the robots' names beside the ends of their paths.
    fn names(&self) -> DrawResult {
        let robots = self.run.history.robots.iter().enumerate();
        let ends = robots.filter_map(|(rank, robot)| {
            let last = track(self.run, rank, &self.run.window).last()?;
            let at = self.chart.plotting_area().map_coordinate(&last.position());
            Some((vec![robot.name.clone()], at))
        });
        beside(self.area, &ends.collect::<Vec<_>>(), px(6.0))
    }
}

/// Returns the positions of a robot in a window of time, s.
pub(super) fn track<'h>(
    run: &RunFigures<'h>,
    rank: usize,
    window: &Range<f64>,
) -> &'h [TrackPoint] {
    let all = &run.history.robots[rank].track;
    let tick = |at: f64| ((at / run.history.step.as_secs_f64()).ceil() as usize).min(all.len());
    let (from, to) = (tick(window.start), tick(window.end));
    &all[from.min(to)..to]
}

/// Writes names beside objects with a radius of `reach`. Each object has several candidate names and four corners. The
/// first combination with room is used.
pub(super) fn beside(
    area: &Area<'_>,
    ends: &[(Vec<String>, (i32, i32))],
    reach: i32,
) -> DrawResult {
    let letters = TextLabel::BOLD;
    let half = px(6.0);
    let (across, _) = area.dim_in_pixel();
    let across = across as i32;
    let around = |at: i32| at - reach..at + reach;
    let taken = ends.iter().map(|(_, (x, y))| (around(*x), around(*y)));
    let mut taken: Vec<(Range<i32>, Range<i32>)> = taken.collect();
    for (names, (x, y)) in ends {
        let corners = names.iter().flat_map(|name| {
            let width = px(letters.width_px(name));
            [x + reach + px(2.0), x - reach - px(2.0) - width]
                .into_iter()
                .filter(move |left| *left >= 0 && left + width <= across)
                .flat_map(|left| [y - px(9.0), y + px(9.0)].map(|middle| (left, middle)))
                .map(move |(left, middle)| (name, left..left + width, middle - half..middle + half))
        });
        let mut free = corners.filter(|(_, columns, rows)| {
            let mut others = taken.iter();
            !others.any(|(x, y)| overlap(x, columns) && overlap(y, rows))
        });
        if let Some((name, columns, rows)) = free.next() {
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
