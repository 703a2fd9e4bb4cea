//! Renders a run as an animated SVG: `cargo run --release -p analysis --example animate_run -- runs/latest > run.svg`.
//!
//! The entire run takes half a minute and repeats. Animated attributes (SMIL) show robots, items, the marks of any mission, and
//! each robot's activity.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::path::PathBuf;

use analysis::replay_views::retrace_into;
use glam::Vec2;
use missions::Registry;
use proto::control::AgentState;
use proto::view::{Mark, MarkOutline, MarkRole, View};
use run_log::{LogLevel, MemoryLog, RunLog};
use scenario::Setup;

/// The duration of the animation, which repeats.
const TIMING: &str = "dur=\"30s\" repeatCount=\"indefinite\"";
/// The number of frames; positions between them are interpolated.
const FRAMES: u64 = 600;
/// The scale, pixels per meter.
const SCALE: f32 = 70.0;
/// The margin around the room, px.
const MARGIN: f32 = 24.0;
/// The height of a robot's line below the room, px.
const LINE: f32 = 26.0;
const COLORS: [&str; 8] = [
    "#2a6db5", "#c98f0a", "#2e8b57", "#a04ba5", "#c2452d", "#148f9b", "#6b6f2a", "#7a5c3e",
];
/// The largest error of an interpolated value, px or degrees.
const TOLERANCE: f32 = 0.6;

fn main() -> anyhow::Result<()> {
    let folder = std::env::args_os().nth(1);
    let folder = folder.map_or_else(|| PathBuf::from("runs/latest"), PathBuf::from);
    let log = RunLog::open(&folder, &Registry::built_in().vocabulary())?;
    let every = (log.run.result.ticks / FRAMES).max(1);
    let mut views = Vec::new();
    retrace_into(&log, LogLevel::Off, MemoryLog::default(), |simulation| {
        let view = simulation.view();
        if view.tick % every == 0 || view.outcome.is_some() {
            views.push(view);
        }
    })?;
    print!("{}", Picture::of(&log.run.setup, &views));
    Ok(())
}

struct Picture<'a> {
    setup: &'a Setup,
    views: &'a [View],
    svg: String,
}

impl<'a> Picture<'a> {
    fn of(setup: &'a Setup, views: &'a [View]) -> String {
        let mut picture = Self {
            setup,
            views,
            svg: String::new(),
        };
        let room = Vec2::new(setup.scenario.room.width_m, setup.scenario.room.height_m) * SCALE;
        let below = LINE * (setup.scenario.robots.len() as f32 + 0.6);
        let (width, height) = (room.x + 2.0 * MARGIN, room.y + 2.0 * MARGIN + below);
        picture.put(&format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {width} {height}\" role=\"img\" font-family=\"Helvetica, Arial, DejaVu Sans, sans-serif\" font-size=\"15\">\n\
             <title>{}, seed {}, {:.0} s in half a minute</title>\n\
             <rect width=\"{width}\" height=\"{height}\" rx=\"12\" fill=\"#eceae4\"/>\n\
             <g transform=\"translate({MARGIN} {MARGIN})\">\n\
             <rect width=\"{}\" height=\"{}\" fill=\"#fffdf8\" stroke=\"#4a4842\" stroke-width=\"5\"/>",
            setup.scenario.name,
            setup.seed,
            views.last().map_or(0.0, |view| view.now.as_secs_f64()),
            room.x,
            room.y
        ));
        picture.marks();
        picture.obstacles();
        picture.items();
        picture.robots();
        picture.captions(room.y + MARGIN);
        picture.clock(room);
        picture.svg += "</g>\n</svg>\n";
        picture.svg
    }

    fn put(&mut self, line: &str) {
        self.svg += line;
        self.svg.push('\n');
    }

    /// Writes an element whose attributes have these values in the views. `None` hides the element.
    fn element(&mut self, name: &str, fixed: &str, attributes: &[(&str, Vec<Option<f32>>)]) {
        let _ = write!(self.svg, "<{name} {fixed}");
        let mut animations = String::new();
        for (attribute, values) in attributes {
            let mut last = values.iter().flatten().next().copied().unwrap_or_default();
            // Writing to a String cannot fail.
            let _ = write!(self.svg, " {attribute}=\"{last:.1}\"");
            // A hidden element keeps its last position.
            let everywhere = values.iter().map(|value| {
                last = value.unwrap_or(last);
                last
            });
            animations += &moving(attribute, &everywhere.collect::<Vec<f32>>());
        }
        let is_there = |at: usize| attributes.iter().all(|(_, values)| values[at].is_some());
        let is_there: Vec<bool> = (0..self.views.len()).map(is_there).collect();
        animations += &shown(&is_there);
        self.put(&format!(">{animations}</{name}>"));
    }

    fn values(&self, of: impl Fn(&View) -> Option<f32>) -> Vec<Option<f32>> {
        self.views.iter().map(of).collect()
    }

    /// Returns both coordinates of a point for each view, in pixels; y points down.
    fn point(
        &self,
        names: [&'static str; 2],
        of: impl Fn(&View) -> Option<Vec2>,
    ) -> [(&'static str, Vec<Option<f32>>); 2] {
        let height = self.setup.scenario.room.height_m;
        let x = self.values(|view| of(view).map(|at| at.x * SCALE));
        let y = self.values(|view| of(view).map(|at| (height - at.y) * SCALE));
        [(names[0], x), (names[1], y)]
    }

    fn marks(&mut self) {
        let mut known: BTreeMap<&str, &Mark> = BTreeMap::new();
        let views = self.views;
        let mut order = Vec::new();
        for mark in views.iter().flat_map(|view| &view.marks) {
            if known.insert(&mark.id, mark).is_none() {
                order.push(mark);
            }
        }
        for mark in order {
            self.mark(mark);
        }
    }

    fn mark(&mut self, first: &Mark) {
        let fill = match first.role {
            MarkRole::Item => "#8d897f",
            MarkRole::Target => "#c9a3d8",
            MarkRole::Zone => "#f6dcd2",
            MarkRole::Goal => "#dcebdc",
            MarkRole::Range => "#eef0f2",
            MarkRole::Link => "#4a4842",
        };
        let now = |view: &View| {
            view.marks
                .iter()
                .find(|mark| mark.id == first.id)
                .map(|mark| mark.outline)
        };
        let end = |second: bool| {
            move |view: &View| match now(view)? {
                MarkOutline::Bar { from, to, .. } | MarkOutline::Line { from, to } => {
                    Some(if second { to } else { from })
                }
                MarkOutline::Disc { center, .. } => Some(center),
                MarkOutline::Rectangle { min, max } => Some(Vec2::new(min.x, max.y)),
            }
        };
        match first.outline {
            MarkOutline::Disc { radius_m, .. } => {
                let at = self.point(["cx", "cy"], end(false));
                let fixed = format!("r=\"{:.1}\" fill=\"{fill}\"", radius_m * SCALE);
                self.element("circle", &fixed, &at);
            }
            MarkOutline::Rectangle { min, max } => {
                let size = (max - min) * SCALE;
                let at = self.point(["x", "y"], end(false));
                let fixed = format!(
                    "width=\"{:.1}\" height=\"{:.1}\" fill=\"{fill}\"",
                    size.x, size.y
                );
                self.element("rect", &fixed, &at);
            }
            MarkOutline::Bar { half_width_m, .. } => {
                self.line(fill, 2.0 * half_width_m * SCALE, end(false), end(true))
            }
            MarkOutline::Line { .. } => self.line(fill, 1.5, end(false), end(true)),
        }
    }

    fn line(
        &mut self,
        color: &str,
        width: f32,
        from: impl Fn(&View) -> Option<Vec2>,
        to: impl Fn(&View) -> Option<Vec2>,
    ) {
        let ends = [self.point(["x1", "y1"], from), self.point(["x2", "y2"], to)].concat();
        let fixed =
            format!("stroke=\"{color}\" stroke-width=\"{width:.1}\" stroke-linecap=\"round\"");
        self.element("line", &fixed, &ends);
    }

    fn obstacles(&mut self) {
        let height = self.setup.scenario.room.height_m;
        for obstacle in &self.setup.scenario.obstacles {
            let (x, y) = (obstacle.x_m, height - obstacle.y_m - obstacle.height_m);
            let [x, y, width, height] =
                [x, y, obstacle.width_m, obstacle.height_m].map(|length| length * SCALE);
            self.put(&format!(
                "<rect x=\"{x:.1}\" y=\"{y:.1}\" width=\"{width:.1}\" height=\"{height:.1}\" fill=\"#8d897f\"/>"
            ));
        }
    }

    fn items(&mut self) {
        let first = self.views.first().map_or(&[][..], |view| &view.items);
        for (index, item) in first.iter().enumerate() {
            let at = self.point(["cx", "cy"], |view| {
                let item = view.items.get(index)?;
                Some(match item.carrier {
                    // The gripper holds the item in front of the robot.
                    Some(robot) => {
                        let pose = view.robots[robot.index()].pose;
                        pose.position
                            + Vec2::from_angle(pose.heading_rad) * self.setup.scenario.body.radius_m
                    }
                    None => item.position,
                })
            });
            let radius = item.radius_m * SCALE;
            self.element(
                "circle",
                &format!("r=\"{radius:.1}\" fill=\"#c43c28\""),
                &at,
            );
        }
    }

    fn robots(&mut self) {
        let radius = self.setup.scenario.body.radius_m * SCALE;
        for index in 0..self.setup.scenario.robots.len() {
            let color = COLORS[index % COLORS.len()];
            let at = self.point(["x", "y"], |view| {
                Some(view.robots.get(index)?.pose.position)
            });
            let [x, y] =
                [0, 1].map(|axis| at[axis].1.iter().flatten().copied().collect::<Vec<f32>>());
            // Degrees clockwise, without jumps of a full turn.
            let mut heading: f32 = 0.0;
            let turned = self
                .views
                .iter()
                .filter_map(|view| view.robots.get(index))
                .map(|robot| {
                    let wanted = -robot.pose.heading_rad.to_degrees();
                    heading += (wanted - heading + 180.0).rem_euclid(360.0) - 180.0;
                    heading
                });
            let turned: Vec<f32> = turned.collect();
            let states = self.views.iter().filter_map(|view| view.robots.get(index));
            let is_dead: Vec<bool> = states
                .map(|robot| robot.state == AgentState::Dead)
                .collect();
            let cross = radius * 1.2;
            self.put(&format!(
                "<g>{}<g>{}<circle r=\"{radius:.1}\" fill=\"{color}\" stroke=\"#fffdf8\" stroke-width=\"2\"/>\
                 <line x2=\"{radius:.1}\" stroke=\"#fffdf8\" stroke-width=\"3\"/></g>\
                 <path d=\"M-{cross:.1} -{cross:.1} {cross:.1} {cross:.1}M-{cross:.1} {cross:.1} {cross:.1} -{cross:.1}\" stroke=\"#1e1e1e\" stroke-width=\"5\" opacity=\"0\">{}</path></g>",
                transform("translate", &[&x, &y]),
                transform("rotate", &[&turned]),
                shown(&is_dead),
            ));
        }
    }

    /// Writes each robot's current task as text.
    fn captions(&mut self, top: f32) {
        for (index, robot) in self.setup.scenario.robots.iter().enumerate() {
            let y = top + LINE * (index as f32 + 0.5);
            let color = COLORS[index % COLORS.len()];
            let doing = self.views.iter().map(|view| {
                let robot = view.robots.get(index)?;
                Some(match (robot.state, robot.active) {
                    (AgentState::Dead, _) => "dead: its process was killed",
                    (_, Some(set)) => self.setup.catalog.sets[set.index()].name.as_str(),
                    (_, None) => "–",
                })
            });
            let doing: Vec<Option<&str>> = doing.collect();
            self.put(&format!(
                "<circle cx=\"12\" cy=\"{:.1}\" r=\"8\" fill=\"{color}\"/><text x=\"28\" y=\"{y:.1}\" fill=\"#4a4842\">{}</text>",
                y - 5.0,
                robot.name
            ));
            let mut all: Vec<&str> = doing.iter().flatten().copied().collect();
            all.sort_unstable();
            all.dedup();
            for words in all {
                let is_doing: Vec<bool> = doing.iter().map(|now| *now == Some(words)).collect();
                let shown = shown(&is_doing);
                self.put(&format!("<text x=\"110\" y=\"{y:.1}\" fill=\"#4a4842\" opacity=\"0\">{words}{shown}</text>"));
            }
        }
    }

    /// Draws the elapsed time as a line along the lower wall.
    fn clock(&mut self, room: Vec2) {
        let moving = moving("width", &[0.0, room.x]);
        self.put(&format!(
            "<rect y=\"{:.1}\" width=\"0\" height=\"4\" fill=\"#2a6db5\">{moving}</rect>",
            room.y + 4.0
        ));
    }
}

/// Returns the animation of an attribute; empty if it never changes.
fn moving(attribute: &str, values: &[f32]) -> String {
    let corners = corners(&[values]);
    if corners.iter().all(|at| values[*at] == values[0]) {
        return String::new();
    }
    let listed = corners.iter().map(|at| format!("{:.1}", values[*at]));
    format!(
        "<animate attributeName=\"{attribute}\" {TIMING} keyTimes=\"{}\" values=\"{}\"/>",
        key_times(&corners, values.len()),
        join(listed)
    )
}

/// Returns the animation of an element's visibility; empty if it is always visible.
fn shown(is_shown: &[bool]) -> String {
    if is_shown.iter().all(|shown| *shown) {
        return String::new();
    }
    let changes = (0..is_shown.len()).filter(|at| *at == 0 || is_shown[*at] != is_shown[at - 1]);
    let changes: Vec<usize> = changes.collect();
    let listed = changes.iter().map(|at| u8::from(is_shown[*at]).to_string());
    format!(
        "<animate attributeName=\"opacity\" {TIMING} calcMode=\"discrete\" keyTimes=\"{}\" values=\"{}\"/>",
        key_times(&changes, is_shown.len()),
        join(listed)
    )
}

/// Returns the animation of a transformation, from the values of its parameters.
fn transform(kind: &str, parameters: &[&[f32]]) -> String {
    let corners = corners(parameters);
    let listed = corners.iter().map(|at| {
        let each = parameters
            .iter()
            .map(|values| format!("{:.1}", values[*at]));
        each.collect::<Vec<_>>().join(" ")
    });
    format!(
        "<animateTransform attributeName=\"transform\" type=\"{kind}\" {TIMING} keyTimes=\"{}\" values=\"{}\"/>",
        key_times(&corners, parameters[0].len()),
        join(listed)
    )
}

fn key_times(corners: &[usize], count: usize) -> String {
    let last = count.saturating_sub(1).max(1) as f32;
    join(corners.iter().map(|at| format!("{:.4}", *at as f32 / last)))
}

fn join(values: impl Iterator<Item = String>) -> String {
    values.collect::<Vec<_>>().join(";")
}

/// Returns the indices whose values must be listed so that linear interpolation is exact enough: the first, the last, and
/// corners.
fn corners(all: &[&[f32]]) -> Vec<usize> {
    let count = all[0].len();
    let is_straight = |from: usize, to: usize| {
        let mut between = from + 1..to;
        between.all(|at| {
            let share = (at - from) as f32 / (to - from) as f32;
            all.iter().all(|values| {
                let line = values[from] + share * (values[to] - values[from]);
                (values[at] - line).abs() <= TOLERANCE
            })
        })
    };
    let mut corners = vec![0];
    let mut from = 0;
    while from + 1 < count {
        let mut to = from + 1;
        while to + 1 < count && is_straight(from, to + 1) {
            to += 1;
        }
        corners.push(to);
        from = to;
    }
    corners
}
