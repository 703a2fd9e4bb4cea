//! The floor: marks of the mission, obstacles, items, the wall and the scale.

use std::fmt::Write;

use glam::Vec2;
use maud::{Markup, html};
use plotters::style::RGBColor;
use proto::view::{Mark, MarkOutline, MarkRole, View, Work};
use scenario::Obstacle;

use super::geometry::{Extent, Point, Projection, Taken, line, n, segment, text};
use crate::figures::canvas::{TextLabel, WHITE};
use crate::figures::palette::{FAST, FLOOR, ITEM, QUIET_TEXT, SLOW, SOLID, WALL, css, mark_colors};

/// Discs with work have at least this radius, px.
const LEAST_DISC_PX: f64 = 3.0;

/// Discs below this radius, px, have no labels among many marks.
const SMALL_DISC_PX: f64 = 22.0;

/// The largest number of marks of which small ones have labels.
const LABELS_MAX: usize = 60;

/// The font size of labels, px.
pub const LABEL_PX: f64 = 11.0;

/// The least length of the scale bar, px.
const SCALE_PX: f64 = 40.0;

pub fn ground(p: &Projection) -> Markup {
    rectangle(&p.extent(), &css(FLOOR), None)
}

pub fn wall(p: &Projection) -> Markup {
    let room = p.extent();
    let outside = Extent {
        left: room.left - 1.5,
        top: room.top - 1.5,
        right: room.right + 1.5,
        bottom: room.bottom + 1.5,
    };
    html! {
        rect x=(n(outside.left)) y=(n(outside.top)) width=(n(outside.right - outside.left))
            height=(n(outside.bottom - outside.top)) rx="2" fill="none" stroke=(css(WALL)) stroke-width="3" {}
    }
}

fn rectangle(place: &Extent, fill: &str, stroke: Option<&str>) -> Markup {
    html! {
        rect x=(n(place.left)) y=(n(place.top)) width=(n(place.right - place.left))
            height=(n(place.bottom - place.top)) fill=(fill) stroke=[stroke] {}
    }
}

/// Draws the marks. A mark is filled by the share of its work that is left.
pub fn marks(p: &Projection, marks: &[Mark]) -> Markup {
    html! { @for mark in marks { (shape(p, mark)) } }
}

fn shape(p: &Projection, mark: &Mark) -> Markup {
    let (empty, full) = mark_colors(mark);
    let share = f64::from(mark.share_left());
    let dashes = match mark.role {
        MarkRole::Zone | MarkRole::Range => Some("4 4"),
        _ => None,
    };
    let is_range = mark.role == MarkRole::Range;
    let edge = css(if is_range { full } else { QUIET_TEXT });
    match mark.outline {
        MarkOutline::Disc { center, radius_m } => {
            let least = if mark.work.is_some() {
                LEAST_DISC_PX
            } else {
                0.0
            };
            let (at, radius) = (p.point(center), p.length(radius_m).max(least));
            let fill = if is_range {
                "none".to_owned()
            } else {
                css(empty)
            };
            html! {
                (circle(at, radius, &fill))
                @if !is_range { (level(at, radius, full, share)) }
                circle cx=(n(at.0)) cy=(n(at.1)) r=(n(radius)) fill="none" stroke=(edge)
                    stroke-dasharray=[dashes] {}
            }
        }
        MarkOutline::Rectangle { min, max } => {
            let (left, bottom) = p.point(min);
            let (right, top) = p.point(max);
            let whole = Extent {
                left,
                top,
                right,
                bottom,
            };
            let filled = Extent {
                top: bottom - share * (bottom - top),
                ..whole
            };
            html! {
                (rectangle(&whole, &css(empty), None))
                @if share > 0.0 { (rectangle(&filled, &css(full), None)) }
                rect x=(n(left)) y=(n(top)) width=(n(right - left)) height=(n(bottom - top)) fill="none"
                    stroke=(edge) stroke-dasharray=[dashes] {}
            }
        }
        MarkOutline::Bar {
            from,
            to,
            half_width_m,
        } => {
            let width = (2.0 * p.length(half_width_m)).max(2.0);
            let color = if mark.work.is_some() { empty } else { full };
            let (from, to) = (p.point(from), p.point(to));
            let part = |from: f64, to: f64| from + share * (to - from);
            let level = (part(from.0, to.0), part(from.1, to.1));
            html! {
                (line(from, to, QUIET_TEXT, width + 2.0))
                (line(from, to, color, width))
                @if share > 0.0 { (line(from, level, full, width)) }
            }
        }
        MarkOutline::Line { from, to } => {
            let width = if mark.role == MarkRole::Goal {
                "4"
            } else {
                "1.5"
            };
            html! {
                path d=(segment_of(p, from, to)) fill="none" stroke=(css(full)) stroke-width=(width)
                    stroke-dasharray=[dashes] {}
            }
        }
    }
}

fn segment_of(p: &Projection, from: Vec2, to: Vec2) -> String {
    let (from, to) = (p.point(from), p.point(to));
    format!("M{} {}L{} {}", n(from.0), n(from.1), n(to.0), n(to.1))
}

fn circle(at: Point, radius: f64, fill: &str) -> Markup {
    html! { circle cx=(n(at.0)) cy=(n(at.1)) r=(n(radius)) fill=(fill) {} }
}

/// Fills a disc from below.
fn level(at: Point, radius: f64, color: RGBColor, share: f64) -> Markup {
    html! {
        @if share >= 0.999 { (circle(at, radius, &css(color))) }
        @else if share > 0.001 { path d=(segment(at, radius, share)) fill=(css(color)) {} }
    }
}

/// Writes the labels of the marks where there is room: the name with the work that is left, or else the name.
pub fn mark_labels(p: &Projection, marks: &[Mark], taken: &mut Taken) -> Markup {
    let room = p.extent();
    let mut labels = Vec::new();
    let has_label = |mark: &&Mark| {
        // Among many marks, small ones have no labels.
        let is_small = matches!(mark.outline, MarkOutline::Disc { radius_m, .. } if p.length(radius_m) < SMALL_DISC_PX);
        mark.is_labelled(marks.len()) && !(is_small && marks.len() > LABELS_MAX)
    };
    for mark in marks.iter().filter(has_label) {
        let (x, top) = p.point(mark.outline.label_place());
        let letters = TextLabel::CENTERED.sized(LABEL_PX).colored(QUIET_TEXT);
        let words = [label_with_work(mark), Some(mark.label.clone())];
        let places = words.into_iter().flatten().flat_map(|words| {
            let half = letters.width_px(&words) / 2.0 + 2.0;
            let inside = x.min(room.right - half - 4.0).max(room.left + half + 4.0);
            // Above the mark, or inside below its top if the mark lies at the wall.
            [top - 9.0, top + 11.0].map(|y| {
                let at = (inside, y);
                ((words.clone(), at), Extent::around(at, half, 7.0))
            })
        });
        if let Some(((words, at), _)) = taken.first_free(places) {
            labels.push(text(&letters, &words, at, "middle"));
        }
    }
    html! { @for label in labels { (label) } }
}

/// Returns the label with the work that is left, such as `box 6/12 left`, `box done`, or `None` without an amount.
fn label_with_work(mark: &Mark) -> Option<String> {
    let Work { left, all, unit } = mark.work.as_ref()?;
    let label = &mark.label;
    if *left <= 0.0 {
        return Some(format!("{label} done"));
    }
    if unit.is_empty() {
        return None;
    }
    let amount = |value: f32| match *all >= 10.0 {
        true => format!("{}", value.ceil()),
        false => format!("{}", (value * 10.0).round() / 10.0),
    };
    // A label has room for the symbol of a unit, and not for the name of counted things.
    let unit = if unit.len() > 2 {
        String::new()
    } else {
        format!(" {unit}")
    };
    Some(format!(
        "{label} {}/{}{unit} left",
        amount(*left),
        amount(*all)
    ))
}

/// Draws the obstacles: solid ones hatched, slow patches dotted, fast patches with arrow heads.
pub fn obstacles(p: &Projection, obstacles: &[Obstacle]) -> Markup {
    html! { @for obstacle in obstacles { (rectangle_on_floor(p, obstacle)) } }
}

fn rectangle_on_floor(p: &Projection, obstacle: &Obstacle) -> Markup {
    let (left, bottom) = p.point(Vec2::new(obstacle.x_m, obstacle.y_m));
    let size = Vec2::new(obstacle.width_m, obstacle.height_m);
    let (right, top) = p.point(Vec2::new(obstacle.x_m, obstacle.y_m) + size);
    let place = Extent {
        left,
        top,
        right,
        bottom,
    };
    let (color, pattern, opacity) = match obstacle.penetrability {
        _ if obstacle.is_solid() => (SOLID, hatch(&place), "0.85"),
        share if share < 1.0 => (SLOW, dots(&place), "0.25"),
        share if share > 1.0 => (FAST, arrow_heads(&place), "0.2"),
        _ => (QUIET_TEXT, String::new(), "0.08"),
    };
    let ink = css(if obstacle.is_solid() { FLOOR } else { color });
    let note = format!("{}×", obstacle.penetrability);
    let letters = TextLabel::CENTERED.sized(LABEL_PX).colored(color);
    let has_room = letters.width_px(&note) + 6.0 < right - left && bottom - top > 18.0;
    html! {
        rect x=(n(left)) y=(n(top)) width=(n(right - left)) height=(n(bottom - top)) fill=(css(color))
            fill-opacity=(opacity) {}
        @if !pattern.is_empty() {
            path d=(pattern) fill="none" stroke=(ink) stroke-width="1.2" stroke-linecap="round" stroke-opacity="0.5" {}
        }
        rect x=(n(left)) y=(n(top)) width=(n(right - left)) height=(n(bottom - top)) fill="none"
            stroke=(css(color)) stroke-width="1.5" {}
        @if !obstacle.is_solid() && has_room {
            (text(&letters, &note, ((left + right) / 2.0, (top + bottom) / 2.0), "middle"))
        }
    }
}

/// Returns diagonal lines over a rectangle, clipped to it.
fn hatch(place: &Extent) -> String {
    let (width, height) = (place.right - place.left, place.bottom - place.top);
    let mut path = String::new();
    let mut shift = 8.0 - height;
    while shift < width {
        // The line rises from (shift, height) to (shift + height, 0).
        let from = shift.max(0.0);
        let to = (shift + height).min(width);
        let y = |x: f64| place.bottom - (x - shift);
        // Writing to a String cannot fail.
        let _ = write!(
            path,
            "M{} {}L{} {}",
            n(place.left + from),
            n(y(from)),
            n(place.left + to),
            n(y(to))
        );
        shift += 8.0;
    }
    path
}

/// Returns the points of a grid with this spacing inside a rectangle.
fn grid(place: &Extent, step: f64) -> Vec<Point> {
    let steps = |from: f64, to: f64| {
        let count = ((to - from) / step).floor().clamp(0.0, 400.0);
        (0..count as u32).map(move |index| from + step * (f64::from(index) + 0.5))
    };
    let rows = steps(place.top, place.bottom);
    rows.flat_map(|y| steps(place.left, place.right).map(move |x| (x, y)))
        .collect()
}

fn dots(place: &Extent) -> String {
    let points = grid(place, 8.0).into_iter();
    points
        .map(|(x, y)| format!("M{} {}h1", n(x), n(y)))
        .collect()
}

fn arrow_heads(place: &Extent) -> String {
    let points = grid(place, 14.0).into_iter();
    points
        .map(|(x, y)| format!("M{} {}l4 4l-4 4", n(x - 2.0), n(y - 4.0)))
        .collect()
}

/// Draws the items on the floor, and the carried ones in front of their robots, as diamonds.
pub fn items(p: &Projection, view: &View, body_m: f32) -> Markup {
    let mut path = String::new();
    for item in &view.items {
        let carrier = item
            .carrier
            .and_then(|robot| view.robots.get(robot.index()));
        let position = carrier.map_or(item.position, |robot| {
            let ahead = body_m + item.radius_m;
            let (sin, cos) = libm::sincosf(robot.pose.heading_rad);
            robot.pose.position + ahead * Vec2::new(cos, sin)
        });
        let (x, y) = p.point(position);
        let size = p.length(item.radius_m).max(2.5);
        let (half, side) = (n(size), n(-size));
        // Writing to a String cannot fail.
        let _ = write!(
            path,
            "M{} {}l{half} {half}l{side} {half}l{side} {side}Z",
            n(x),
            n(y - size)
        );
    }
    html! {
        @if !path.is_empty() {
            path d=(path) fill=(css(ITEM)) stroke=(css(WHITE)) stroke-width="0.8" {}
        }
    }
}

/// Draws the scale bar in the lower right corner of the room, on the floor.
pub fn scale(p: &Projection, taken: &mut Taken) -> Markup {
    let length_m = round_length(SCALE_PX / p.scale);
    let width = p.scale * length_m;
    let room = p.extent();
    let (x, y) = (room.right - width - 12.0, room.bottom - 10.0);
    let middle = (x + width / 2.0, y - 9.0);
    let letters = TextLabel::CENTERED.sized(LABEL_PX).colored(QUIET_TEXT);
    let words = format!("{} m", n(length_m));
    taken.take(Extent::around((middle.0, y - 6.0), width / 2.0 + 3.0, 12.0));
    let path = format!("M{} {}v4h{}v-4", n(x), n(y - 4.0), n(width));
    html! {
        path d=(path) fill="none" stroke=(css(QUIET_TEXT)) stroke-width="1.5" {}
        (text(&letters, &words, middle, "middle"))
    }
}

/// Returns the shortest round length of at least `least`: 1, 2 or 5 times a power of ten.
fn round_length(least: f64) -> f64 {
    let power = 10_f64.powf(least.log10().floor());
    let rounds = [1.0, 2.0, 5.0].map(|factor| factor * power);
    let found = rounds.into_iter().find(|length| *length >= least * 0.999);
    found.unwrap_or(10.0 * power)
}
