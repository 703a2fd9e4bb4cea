//! Draws a recorded run from above as SVG: `cargo run -p missions --example draw_run -- runs/latest > run.svg`.
//!
//! Also shows how to read a run folder.

use std::path::PathBuf;

use glam::Vec2;
use missions::Registry;
use proto::view::{Mark, MarkOutline, MarkRole};
use run_log::{EventRow, PoseRow, RunLog};
use scenario::Room;
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
const GRAY: &str = "#8d897f";
const INK: &str = "#4a4842";

const FONT: &str = "font-family=\"Helvetica, Arial, DejaVu Sans, sans-serif\"";

fn main() -> anyhow::Result<()> {
    let folder = std::env::args_os().nth(1);
    let folder = folder.map_or_else(|| PathBuf::from("runs/latest"), PathBuf::from);
    let log = RunLog::open(&folder, &Registry::built_in().vocabulary())?;
    print!("{}", draw(&log)?);
    Ok(())
}

/// Converts room coordinates, with y up, to pixels, with y down.
#[derive(Clone, Copy)]
struct Pixels {
    room: Room,
}

impl Pixels {
    fn of(self, at: Vec2) -> Vec2 {
        Vec2::new(at.x - self.room.x_m, self.room.high().y - at.y) * SCALE
    }
}

fn draw(log: &RunLog) -> anyhow::Result<String> {
    let setup = &log.run.setup;
    let scenario = &setup.scenario;
    let pixels = Pixels {
        room: scenario.room,
    };
    let size = scenario.room.size() * SCALE;
    let full = size + Vec2::new(2.0 * MARGIN, 2.0 * MARGIN + LEGEND);
    let mut svg = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {} {}\" role=\"img\">\n<title>{}, seed {}</title>\n",
        full.x, full.y, scenario.name, setup.seed
    );
    svg += &rectangle(Vec2::ZERO, full, "rx=\"12\" fill=\"#eceae4\"");
    svg += &format!("<g transform=\"translate({MARGIN} {MARGIN})\">\n");

    // The room and its contents before the first step.
    let border = format!("fill=\"#fffdf8\" stroke=\"{INK}\" stroke-width=\"5\"");
    svg += &rectangle(Vec2::ZERO, size, &border);
    let mission = Registry::current().worlds().find(scenario)?;
    let start = Simulation::new(setup.clone(), mission, false).view();
    for shown in &start.marks {
        svg += &mark(pixels, shown);
    }
    let fill = format!("fill=\"{GRAY}\"");
    for item in &start.items {
        svg += &circle(pixels.of(item.position), item.radius_m * SCALE, &fill);
    }
    for obstacle in &scenario.obstacles {
        let corner = Vec2::new(obstacle.x_m, obstacle.y_m + obstacle.height_m);
        let size = Vec2::new(obstacle.width_m, obstacle.height_m) * SCALE;
        svg += &rectangle(pixels.of(corner), size, &fill);
    }

    let (poses, events) = (log.rows::<PoseRow>()?, log.rows::<EventRow>()?);
    let columns = setup.catalog.mission.vocabulary().columns;
    let mut bodies = String::new();
    for (robot, color) in scenario.robots.iter().zip(COLORS.iter().cycle()) {
        let poses = poses.iter().filter(|pose| pose.robot == robot.name);
        let poses: Vec<&PoseRow> = poses.collect();
        // The line style of a path changes with the load.
        for part in poses.chunk_by(|a, b| a.carrying == b.carrying) {
            let points = corners(part.iter().map(|pose| position(pose)).collect());
            let points = points.into_iter().map(|at| pixels.of(at));
            let points: Vec<String> = points
                .map(|at| format!("{:.1},{:.1}", at.x, at.y))
                .collect();
            let style = match part[0].carrying {
                true => "stroke-width=\"2.4\" stroke-opacity=\"0.75\"",
                false => "stroke-width=\"1.1\" stroke-opacity=\"0.45\"",
            };
            svg += &format!(
                "<polyline points=\"{}\" fill=\"none\" stroke=\"{color}\" stroke-linejoin=\"round\" {style}/>\n",
                points.join(" ")
            );
        }
        let radius_m = scenario.body.radius_m;
        let front = |pose: &PoseRow| position(pose) + Vec2::from_angle(pose.heading_rad) * radius_m;
        for event in events.iter().filter(|event| event.robot == robot.name) {
            let mut counted = columns.iter().filter_map(|column| column.event);
            let pose = poses.iter().find(|pose| pose.t_ms >= event.t_ms);
            if let Some(pose) = pose.filter(|_| counted.any(|kind| kind == event.kind)) {
                let paint = format!("fill=\"{color}\" stroke=\"#fffdf8\" stroke-width=\"1\"");
                bodies += &circle(pixels.of(front(pose)), 4.0, &paint);
            }
        }
        if let Some(last) = poses.last() {
            let [at, nose] = [position(last), front(last)].map(|at| pixels.of(at));
            let paint = format!("fill=\"{color}\" stroke=\"#fffdf8\" stroke-width=\"2\"");
            bodies += &circle(at, radius_m * SCALE, &paint);
            bodies += &line(at, nose, "stroke=\"#fffdf8\" stroke-width=\"3\"");
        }
    }
    svg += &bodies;
    svg += "</g>\n";
    svg += &legend(log, Vec2::new(MARGIN, 2.0 * MARGIN + size.y));
    Ok(svg + "</svg>\n")
}

/// Draws a mark of the mission in the color of its role, with its label above it.
fn mark(pixels: Pixels, mark: &Mark) -> String {
    let fill = match mark.role {
        MarkRole::Item => GRAY,
        MarkRole::Target => "#e3dff0",
        MarkRole::Zone => "#f6dcd2",
        MarkRole::Goal => "#dcebdc",
        MarkRole::Range => "#e6e9ec",
        MarkRole::Link => INK,
    };
    let bar = |from: Vec2, to: Vec2, width: f32| {
        let [from, to] = [from, to].map(|end| pixels.of(end));
        let paint =
            format!("stroke=\"{fill}\" stroke-width=\"{width:.1}\" stroke-linecap=\"round\"");
        (line(from, to, &paint), (from + to) / 2.0, "middle")
    };
    let (drawn, above, anchor) = match mark.outline {
        MarkOutline::Disc { center, radius_m } => {
            let (at, radius) = (pixels.of(center), radius_m * SCALE);
            // A range is drawn as an outline, so that it hides nothing.
            let paint = match mark.role {
                MarkRole::Range => "fill=\"none\" stroke",
                _ => "fill",
            };
            let drawn = circle(at, radius, &format!("{paint}=\"{fill}\""));
            (drawn, at - Vec2::new(0.0, radius), "middle")
        }
        MarkOutline::Rectangle { min, max } => {
            let corner = pixels.of(Vec2::new(min.x, max.y));
            let drawn = rectangle(corner, (max - min) * SCALE, &format!("fill=\"{fill}\""));
            (drawn, corner + Vec2::new(8.0, 0.0), "start")
        }
        MarkOutline::Bar {
            from,
            to,
            half_width_m,
        } => bar(from, to, 2.0 * half_width_m * SCALE),
        MarkOutline::Line { from, to } => bar(from, to, 1.5),
    };
    drawn + &label(above - Vec2::new(0.0, 8.0), anchor, &mark.label)
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
            let mut between = others[..end].iter();
            between.all(|at| distance_to_line(*at, *first, others[end]) < TOLERANCE_M)
        };
        let bend = (1..others.len()).find(|end| !is_straight(*end));
        let end = bend.unwrap_or(others.len());
        rest = &others[end.saturating_sub(1)..];
    }
    corners
}

fn distance_to_line(point: Vec2, from: Vec2, to: Vec2) -> f32 {
    let along = to - from;
    let share = (point - from).dot(along) / along.length_squared().max(f32::EPSILON);
    point.distance(from + along * share.clamp(0.0, 1.0))
}

fn legend(log: &RunLog, corner: Vec2) -> String {
    let mut svg = String::new();
    let scenario = &log.run.setup.scenario;
    let mut at = corner + Vec2::new(12.0, 0.0);
    for (robot, color) in scenario.robots.iter().zip(COLORS.iter().cycle()) {
        // The first figure of the mission for this robot.
        let figures = log.run.result.robots.get(&robot.name);
        let text = match figures.and_then(|figures| figures.mission.iter().next()) {
            Some((name, FigureValue::Count(count))) => {
                format!("{}: {count} {}", robot.name, in_words(name))
            }
            _ => robot.name.clone(),
        };
        svg += &circle(at, 9.0, &format!("fill=\"{color}\""));
        svg += &label(at + Vec2::new(16.0, 5.0), "start", &text);
        at.x += 220.0;
    }
    let thick = format!("stroke=\"{INK}\" stroke-width=\"2.4\"");
    let thin = format!("stroke=\"{INK}\" stroke-width=\"1.1\" stroke-opacity=\"0.6\"");
    let mut at = corner + Vec2::new(0.0, 34.0);
    let right = Vec2::new(corner.x + scenario.room.width_m * SCALE, at.y);
    for (text, style) in [("with an item", thick), ("without", thin)] {
        svg += &line(at, at + Vec2::new(40.0, 0.0), &style);
        svg += &label(at + Vec2::new(50.0, 5.0), "start", text);
        at.x += 170.0;
    }
    let scale = Vec2::new(SCALE, 0.0);
    svg += &line(
        right - scale,
        right,
        &format!("stroke=\"{INK}\" stroke-width=\"3\""),
    );
    svg + &label(right - scale / 2.0 - Vec2::new(0.0, 8.0), "middle", "1 m")
}

fn label(at: Vec2, anchor: &str, text: &str) -> String {
    format!(
        "<text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"{anchor}\" {FONT} font-size=\"16\" fill=\"{INK}\">{text}</text>\n",
        at.x, at.y
    )
}

fn circle(at: Vec2, radius: f32, paint: &str) -> String {
    format!(
        "<circle cx=\"{:.1}\" cy=\"{:.1}\" r=\"{radius}\" {paint}/>\n",
        at.x, at.y
    )
}

fn rectangle(corner: Vec2, size: Vec2, paint: &str) -> String {
    format!(
        "<rect x=\"{:.1}\" y=\"{:.1}\" width=\"{:.1}\" height=\"{:.1}\" {paint}/>\n",
        corner.x, corner.y, size.x, size.y
    )
}

fn line(from: Vec2, to: Vec2, paint: &str) -> String {
    format!(
        "<line x1=\"{:.1}\" y1=\"{:.1}\" x2=\"{:.1}\" y2=\"{:.1}\" {paint}/>\n",
        from.x, from.y, to.x, to.y
    )
}

fn position(pose: &PoseRow) -> Vec2 {
    Vec2::new(pose.x_m, pose.y_m)
}
