//! Draws a recorded run from above as SVG: `cargo run -p missions --example draw_run -- runs/latest > run.svg`.
//!
//! Also shows how to read a run folder.

use std::fmt::{self, Write as _};
use std::path::PathBuf;

use glam::Vec2;
use missions::Registry;
use proto::view::{Mark, MarkOutline, MarkRole, View};
use run_log::{EventRow, PoseRow, RunLog};
use scenario::Scenario;
use scenario::mission::FigureValue;
use scenario::mission::columns::display_name as in_words;
use world_server::simulation::Simulation;

const SCALE: f32 = 80.0;

const MARGIN: f32 = 32.0;

/// The height of the legend below the room, px.
const LEGEND: f32 = 64.0;

/// The maximum deviation of a drawn path from the recorded poses, m.
const TOLERANCE_M: f32 = 0.02;

/// One color per robot, by rank. The colors repeat.
const COLORS: [&str; 8] = [
    "#2a6db5", "#c98f0a", "#2e8b57", "#a04ba5", "#c2452d", "#148f9b", "#6b6f2a", "#7a5c3e",
];

const FONT: &str = "font-family=\"Helvetica, Arial, DejaVu Sans, sans-serif\"";

/// A part of a robot's path with one line style.
struct Path {
    points: Vec<Vec2>,
    style: &'static str,
}

fn main() -> anyhow::Result<()> {
    let folder = std::env::args_os()
        .nth(1)
        .map_or_else(|| PathBuf::from("runs/latest"), PathBuf::from);
    let log = RunLog::open(&folder, &missions::Registry::built_in().vocabulary())?;
    print!("{}", draw(&log)?);
    Ok(())
}

fn draw(log: &RunLog) -> anyhow::Result<String> {
    let scenario = &log.run.setup.scenario;
    let (poses, events) = (log.rows::<PoseRow>()?, log.rows::<EventRow>()?);
    let (width, height) = (
        scenario.room.width_m * SCALE,
        scenario.room.height_m * SCALE,
    );
    let (full_width, full_height) = (width + 2.0 * MARGIN, height + 2.0 * MARGIN + LEGEND);

    let mut svg = String::new();
    writeln!(
        svg,
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {full_width} {full_height}\" role=\"img\">"
    )?;
    writeln!(
        svg,
        "<title>{}, seed {}</title>",
        scenario.name, log.run.setup.seed
    )?;
    writeln!(
        svg,
        "<rect width=\"{full_width}\" height=\"{full_height}\" rx=\"12\" fill=\"#eceae4\"/>"
    )?;
    writeln!(svg, "<g transform=\"translate({MARGIN} {MARGIN})\">")?;
    let mission = Registry::current().worlds().find(scenario)?;
    let start = Simulation::new(log.run.setup.clone(), mission, false).view();
    room(&mut svg, scenario, &start)?;
    let columns = log.run.setup.catalog.mission.vocabulary().columns;
    let robots = scenario.robots.iter().zip(COLORS.iter().cycle());
    for (robot, color) in robots.clone() {
        let robot_poses: Vec<&PoseRow> = poses
            .iter()
            .filter(|pose| pose.robot == robot.name)
            .collect();
        for path in paths(&robot_poses) {
            let points: Vec<String> = path.points.iter().map(|at| pair(scenario, *at)).collect();
            writeln!(
                svg,
                "<polyline points=\"{}\" fill=\"none\" stroke=\"{color}\" stroke-linejoin=\"round\" {}/>",
                points.join(" "),
                path.style
            )?;
        }
    }
    for (robot, color) in robots.clone() {
        let robot_poses: Vec<&PoseRow> = poses
            .iter()
            .filter(|pose| pose.robot == robot.name)
            .collect();
        for event in events.iter().filter(|event| event.robot == robot.name) {
            if !columns
                .iter()
                .any(|column| column.event == Some(&event.kind))
            {
                continue;
            }
            if let Some(pose) = robot_poses.iter().find(|pose| pose.t_ms >= event.t_ms) {
                let front = Vec2::from_angle(pose.heading_rad) * scenario.body.radius_m;
                let at = position(pose) + front;
                let at = pixels(scenario, at);
                writeln!(
                    svg,
                    "<circle cx=\"{:.1}\" cy=\"{:.1}\" r=\"4\" fill=\"{color}\" stroke=\"#fffdf8\" stroke-width=\"1\"/>",
                    at.x, at.y
                )?;
            }
        }
        if let Some(last) = robot_poses.last() {
            body(&mut svg, scenario, last, color)?;
        }
    }
    writeln!(svg, "</g>")?;
    legend(&mut svg, log, Vec2::new(MARGIN, 2.0 * MARGIN + height))?;
    writeln!(svg, "</svg>")?;
    Ok(svg)
}

/// Draws the room and its contents before the first step.
fn room(svg: &mut String, scenario: &Scenario, start: &View) -> fmt::Result {
    let (width, height) = (
        scenario.room.width_m * SCALE,
        scenario.room.height_m * SCALE,
    );
    writeln!(
        svg,
        "<rect width=\"{width}\" height=\"{height}\" fill=\"#fffdf8\" stroke=\"#4a4842\" stroke-width=\"5\"/>"
    )?;
    for shown in &start.marks {
        mark(svg, scenario, shown)?;
    }
    for item in &start.items {
        let at = pixels(scenario, item.position);
        let radius = item.radius_m * SCALE;
        writeln!(
            svg,
            "<circle cx=\"{:.1}\" cy=\"{:.1}\" r=\"{radius}\" fill=\"#8d897f\"/>",
            at.x, at.y
        )?;
    }
    for obstacle in &scenario.obstacles {
        let corner = Vec2::new(obstacle.x_m, obstacle.y_m + obstacle.height_m);
        let at = pixels(scenario, corner);
        writeln!(
            svg,
            "<rect x=\"{}\" y=\"{}\" width=\"{}\" height=\"{}\" fill=\"#8d897f\"/>",
            at.x,
            at.y,
            obstacle.width_m * SCALE,
            obstacle.height_m * SCALE
        )?;
    }
    Ok(())
}

/// Draws a mark of the mission in the color of its role, with its label above it.
fn mark(svg: &mut String, scenario: &Scenario, mark: &Mark) -> fmt::Result {
    let fill = match mark.role {
        MarkRole::Item => "#8d897f",
        MarkRole::Target => "#e3dff0",
        MarkRole::Zone => "#f6dcd2",
        MarkRole::Goal => "#dcebdc",
        MarkRole::Range => "#e6e9ec",
        MarkRole::Link => "#4a4842",
    };
    let bar = |svg: &mut String, from: Vec2, to: Vec2, width: f32| {
        let [from, to] = [from, to].map(|end| pixels(scenario, end));
        writeln!(
            svg,
            "<line x1=\"{:.1}\" y1=\"{:.1}\" x2=\"{:.1}\" y2=\"{:.1}\" stroke=\"{fill}\" stroke-width=\"{width:.1}\" stroke-linecap=\"round\"/>",
            from.x, from.y, to.x, to.y
        )?;
        Ok((from + to) / 2.0)
    };
    let (above, anchor) = match mark.outline {
        MarkOutline::Disc { center, radius_m } => {
            let (at, radius) = (pixels(scenario, center), radius_m * SCALE);
            // A range is drawn as an outline, so that it hides nothing.
            let paint = match mark.role {
                MarkRole::Range => "fill=\"none\" stroke",
                _ => "fill",
            };
            writeln!(
                svg,
                "<circle cx=\"{:.1}\" cy=\"{:.1}\" r=\"{radius}\" {paint}=\"{fill}\"/>",
                at.x, at.y
            )?;
            (at - Vec2::new(0.0, radius), "middle")
        }
        MarkOutline::Rectangle { min, max } => {
            let corner = pixels(scenario, Vec2::new(min.x, max.y));
            let size = (max - min) * SCALE;
            writeln!(
                svg,
                "<rect x=\"{:.1}\" y=\"{:.1}\" width=\"{:.1}\" height=\"{:.1}\" fill=\"{fill}\"/>",
                corner.x, corner.y, size.x, size.y
            )?;
            (corner + Vec2::new(8.0, 0.0), "start")
        }
        MarkOutline::Bar {
            from,
            to,
            half_width_m,
        } => (bar(svg, from, to, 2.0 * half_width_m * SCALE)?, "middle"),
        MarkOutline::Line { from, to } => (bar(svg, from, to, 1.5)?, "middle"),
    };
    label(svg, above - Vec2::new(0.0, 8.0), anchor, &mark.label)
}

/// Splits a robot's path where the line style changes.
fn paths(poses: &[&PoseRow]) -> Vec<Path> {
    poses
        .chunk_by(|a, b| style(a) == style(b))
        .map(|part| Path {
            points: corners(part.iter().map(|pose| position(pose)).collect()),
            style: style(part[0]),
        })
        .collect()
}

/// Removes the points of a path that a straight line replaces within [`TOLERANCE_M`].
fn corners(mut points: Vec<Vec2>) -> Vec<Vec2> {
    // Repeated points of a waiting robot would make the search below slow.
    points.dedup();
    let mut corners = Vec::new();
    let mut rest = points.as_slice();
    while let [first, others @ ..] = rest {
        corners.push(*first);
        let is_straight = |end: usize| {
            others[..end]
                .iter()
                .all(|at| distance_to_line(*at, *first, others[end]) < TOLERANCE_M)
        };
        let end = (1..others.len())
            .find(|end| !is_straight(*end))
            .unwrap_or(others.len());
        rest = &others[end.saturating_sub(1)..];
    }
    corners
}

fn distance_to_line(point: Vec2, from: Vec2, to: Vec2) -> f32 {
    let along = to - from;
    let share = (point - from).dot(along) / along.length_squared().max(f32::EPSILON);
    point.distance(from + along * share.clamp(0.0, 1.0))
}

fn style(pose: &PoseRow) -> &'static str {
    if pose.carrying {
        "stroke-width=\"2.4\" stroke-opacity=\"0.75\""
    } else {
        "stroke-width=\"1.1\" stroke-opacity=\"0.45\""
    }
}

fn body(svg: &mut String, scenario: &Scenario, pose: &PoseRow, color: &str) -> fmt::Result {
    let radius = scenario.body.radius_m * SCALE;
    let at = pixels(scenario, position(pose));
    let nose = at + Vec2::new(pose.heading_rad.cos(), -pose.heading_rad.sin()) * radius;
    writeln!(
        svg,
        "<circle cx=\"{0:.1}\" cy=\"{1:.1}\" r=\"{radius}\" fill=\"{color}\" stroke=\"#fffdf8\" stroke-width=\"2\"/>\
         <line x1=\"{0:.1}\" y1=\"{1:.1}\" x2=\"{2:.1}\" y2=\"{3:.1}\" stroke=\"#fffdf8\" stroke-width=\"3\"/>",
        at.x, at.y, nose.x, nose.y
    )
}

fn legend(svg: &mut String, log: &RunLog, corner: Vec2) -> fmt::Result {
    let scenario = &log.run.setup.scenario;
    let mut x = corner.x + 12.0;
    for (robot, color) in scenario.robots.iter().zip(COLORS.iter().cycle()) {
        // The first figure of the mission for this robot.
        let figures = log.run.result.robots.get(&robot.name);
        let first = figures.and_then(|figures| figures.mission.iter().next());
        let text = match first {
            Some((name, FigureValue::Count(count))) => {
                format!("{}: {count} {}", robot.name, in_words(name))
            }
            _ => robot.name.clone(),
        };
        writeln!(
            svg,
            "<circle cx=\"{x}\" cy=\"{}\" r=\"9\" fill=\"{color}\"/>",
            corner.y
        )?;
        label(svg, Vec2::new(x + 16.0, corner.y + 5.0), "start", &text)?;
        x += 220.0;
    }
    let kinds = [
        ("with an item", "stroke-width=\"2.4\""),
        ("without", "stroke-width=\"1.1\" stroke-opacity=\"0.6\""),
    ];
    let mut x = corner.x;
    let y = corner.y + 34.0;
    for (text, style) in kinds {
        writeln!(
            svg,
            "<line x1=\"{x}\" y1=\"{y}\" x2=\"{}\" y2=\"{y}\" stroke=\"#4a4842\" {style}/>",
            x + 40.0
        )?;
        label(svg, Vec2::new(x + 50.0, y + 5.0), "start", text)?;
        x += 170.0;
    }
    let right = corner.x + scenario.room.width_m * SCALE;
    writeln!(
        svg,
        "<line x1=\"{}\" y1=\"{y}\" x2=\"{right}\" y2=\"{y}\" stroke=\"#4a4842\" stroke-width=\"3\"/>",
        right - SCALE
    )?;
    label(
        svg,
        Vec2::new(right - SCALE / 2.0, y - 8.0),
        "middle",
        "1 m",
    )
}

fn label(svg: &mut String, at: Vec2, anchor: &str, text: &str) -> fmt::Result {
    writeln!(
        svg,
        "<text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"{anchor}\" {FONT} font-size=\"16\" fill=\"#4a4842\">{text}</text>",
        at.x, at.y
    )
}

fn position(pose: &PoseRow) -> Vec2 {
    Vec2::new(pose.x_m, pose.y_m)
}

/// Converts room coordinates, with y up, to pixels, with y down.
fn pixels(scenario: &Scenario, at: Vec2) -> Vec2 {
    Vec2::new(at.x, scenario.room.height_m - at.y) * SCALE
}

fn pair(scenario: &Scenario, at: Vec2) -> String {
    let at = pixels(scenario, at);
    format!("{:.1},{:.1}", at.x, at.y)
}
