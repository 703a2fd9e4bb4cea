//! The robots: their recent paths, bodies and names.

use std::f64::consts::TAU;

use glam::Vec2;
use maud::{Markup, html};
use plotters::style::RGBColor;
use proto::control::AgentState;
use proto::view::RobotView;

use super::floor::LABEL_PX;
use super::geometry::{Extent, Point, Projection, Taken, n, text};
use crate::figures::canvas::{INK, TextLabel, WHITE};
use crate::figures::palette::{QUIET_TEXT, TROUBLE, WALL, css};
use crate::figures::simplify::thin_way;

/// The number of pieces of a trail, each fainter than the one after it.
const PIECES: usize = 5;

/// The opacity of the newest piece of a trail.
const NEWEST: f64 = 0.75;

/// The largest team whose robots have their activity beside their names.
const ACTIVITIES_MAX: usize = 12;

/// The largest team in which each robot has a name. In larger ones only robots in trouble have.
const NAMES_MAX: usize = 60;

/// The distance of two lines of a label, px.
const LINE_PX: f64 = 13.0;

/// Draws the recent path of a robot, which fades with its age.
pub fn trail(p: &Projection, trail: &[Vec2], color: RGBColor) -> Markup {
    let points: Vec<Point> = trail.iter().map(|at| p.point(*at)).collect();
    let length = points.len().div_ceil(PIECES).max(1);
    let pieces = (0..PIECES).filter_map(|piece| {
        // A piece ends where the next one begins.
        let from = piece * length;
        let part = points.get(from..(from + length + 1).min(points.len()))?;
        let line = thin_way(part, 0.3);
        let path: Vec<String> = line
            .iter()
            .map(|(x, y)| format!("{} {}", n(*x), n(*y)))
            .collect();
        let opacity = NEWEST * (piece as f64 + 1.0) / PIECES as f64;
        (line.len() > 1).then(|| (format!("M{}", path.join("L")), opacity))
    });
    html! {
        @for (path, opacity) in pieces {
            path d=(path) fill="none" stroke=(css(color)) stroke-width="2" stroke-opacity=(n(opacity))
                stroke-linejoin="round" {}
        }
    }
}

/// Draws the body of a robot with its heading. A dead robot is crossed out, a silent one hatched, a joining one pale.
pub fn body(
    at: Point,
    heading_rad: f32,
    radius: f64,
    state: AgentState,
    color: RGBColor,
) -> Markup {
    let is_dead = state == AgentState::Dead;
    let fill = css(if is_dead { QUIET_TEXT } else { color });
    let opacity = match state {
        AgentState::Dead => Some("0.4"),
        AgentState::Coming => Some("0.35"),
        _ => None,
    };
    let (sin, cos) = libm::sincos(f64::from(heading_rad));
    // A point in the frame of the robot: x ahead, y to the left.
    let place = |ahead: f64, left: f64| {
        let (ahead, left) = (ahead * radius, left * radius);
        format!(
            "{} {}",
            n(ahead * cos - left * sin),
            n(-ahead * sin - left * cos)
        )
    };
    let nose = format!(
        "M{}L{}L{}Z",
        place(1.5, 0.0),
        place(0.75, 0.6),
        place(0.75, -0.6)
    );
    let edge = n((radius * 0.14).clamp(0.75, 1.5));
    let arm = n(radius * 0.95);
    html! {
        g transform=(format!("translate({} {})", n(at.0), n(at.1))) {
            path d=(nose) fill=(css(WALL)) stroke=(css(WALL)) stroke-width=(edge) stroke-linejoin="round"
                opacity=[opacity] {}
            @if opacity.is_some() { circle r=(n(radius)) fill=(css(WHITE)) {} }
            circle r=(n(radius)) fill=(fill) fill-opacity=[opacity] stroke=(css(WALL)) stroke-width=(edge)
                stroke-dasharray=[(state == AgentState::Coming).then_some("3 3")] {}
            @if state == AgentState::Silent {
                path d=(stripes(radius)) fill="none" stroke=(css(WHITE)) stroke-width="2" {}
            }
            @if is_dead {
                path d=(format!("M-{arm} -{arm}L{arm} {arm}M{arm} -{arm}L-{arm} {arm}")) fill="none"
                    stroke=(css(TROUBLE)) stroke-width=(n((radius * 0.28).clamp(1.5, 3.0))) stroke-linecap="round" {}
            }
        }
    }
}

/// Returns diagonal stripes within a circle around the origin.
fn stripes(radius: f64) -> String {
    let chords = [-0.6, 0.0, 0.6].map(|distance: f64| {
        let half = (1.0 - distance * distance).sqrt();
        let (sin, cos) = libm::sincos(TAU / 8.0);
        let end = |along: f64| {
            let (x, y) = (along * cos + distance * sin, -along * sin + distance * cos);
            format!("{} {}", n(0.9 * radius * x), n(0.9 * radius * y))
        };
        format!("M{}L{}", end(-half), end(half))
    });
    chords.concat()
}

/// A robot with the texts of its label.
pub struct Named<'a> {
    pub name: &'a str,
    /// The activity or the state.
    pub doing: &'a str,
    pub robot: &'a RobotView,
    pub at: Point,
}

/// Writes the names of the robots where there is room, robots in trouble first.
pub fn names(robots: &[Named<'_>], radius: f64, taken: &mut Taken) -> Markup {
    let team = robots.len();
    let in_mission = |named: &&Named<'_>| named.robot.state != AgentState::Absent;
    let shown = robots.iter().filter(in_mission);
    let (troubled, others): (Vec<_>, Vec<_>) = shown.partition(|named| is_troubled(named.robot));
    let others = others.into_iter().filter(|_| team <= NAMES_MAX);
    for named in robots.iter().filter(in_mission) {
        taken.take(Extent::around(named.at, radius, radius));
    }
    let mut labels = Vec::new();
    for named in troubled.into_iter().chain(others) {
        let has_state = is_troubled(named.robot) && team <= NAMES_MAX;
        let with_doing = (team <= ACTIVITIES_MAX || has_state) && !named.doing.is_empty();
        let full = [named.name, named.doing];
        let texts = with_doing
            .then_some(&full[..])
            .into_iter()
            .chain([&full[..1]]);
        let places = texts.flat_map(|lines| around(named.at, radius, lines));
        if let Some(((lines, top), place)) = taken.first_free(places) {
            let x = (place.left + place.right) / 2.0;
            labels.push(label(lines, (x, top), is_troubled(named.robot)));
        }
    }
    html! { @for label in labels { (label) } }
}

/// Returns `true` if the robot does not answer.
#[must_use]
pub fn is_troubled(robot: &RobotView) -> bool {
    matches!(robot.state, AgentState::Dead | AgentState::Silent)
}

fn letters(line: usize) -> TextLabel {
    match line {
        0 => TextLabel::BOLD.sized(LABEL_PX),
        _ => TextLabel::LEFT.sized(LABEL_PX),
    }
}

/// Returns the places around a robot for some lines of text: below, above, right and left of it.
fn around<'l>(
    (x, y): Point,
    radius: f64,
    lines: &'l [&'l str],
) -> [((&'l [&'l str], f64), Extent); 4] {
    let widths = lines.iter().enumerate();
    let width = widths
        .map(|(line, words)| letters(line).width_px(words))
        .fold(0.0, f64::max);
    let (half_width, half_height) = (width / 2.0 + 2.0, LINE_PX * lines.len() as f64 / 2.0);
    let gap = 1.5 * radius + 3.0;
    [
        (x, y + gap + half_height),
        (x, y - gap - half_height),
        (x + gap + half_width, y),
        (x - gap - half_width, y),
    ]
    .map(|middle| {
        let place = Extent::around(middle, half_width, half_height);
        ((lines, place.top), place)
    })
}

fn label(lines: &[&str], (x, top): Point, is_troubled: bool) -> Markup {
    let color = if is_troubled { TROUBLE } else { INK };
    html! {
        @for (line, words) in lines.iter().enumerate() {
            @let y = top + LINE_PX * (line as f64 + 0.5);
            (text(&letters(line).colored(color), words, (x, y), "middle"))
        }
    }
}
