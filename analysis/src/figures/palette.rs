//! Colors of robots, tasks and marks in figures.

use observation::colors::{Rgb, TASKS};
use plotters::style::RGBColor;
use proto::view::{Mark, MarkRole};

/// The color of robots that share a row.
pub const SHARED_ROW: RGBColor = drawn(TASKS[0]);

/// Returns a color as the figures draw it.
const fn drawn(Rgb(red, green, blue): Rgb) -> RGBColor {
    RGBColor(red, green, blue)
}

/// Returns the color of a task by its catalog index: each hue full, pale and dark in turn.
#[must_use]
pub fn task_color(task: usize) -> RGBColor {
    let Rgb(red, green, blue) = TASKS[task % TASKS.len()];
    let toned = |part: u8| match task / TASKS.len() % 3 {
        0 => part,
        1 => part + (255 - part) / 2,
        _ => part / 2 + part / 10,
    };
    RGBColor(toned(red), toned(green), toned(blue))
}

/// Returns the readable text color on a background color: black or white.
#[must_use]
pub fn text_color_on(RGBColor(red, green, blue): RGBColor) -> RGBColor {
    let light = 299 * u32::from(red) + 587 * u32::from(green) + 114 * u32::from(blue);
    if light > 140_000 {
        RGBColor(0, 0, 0)
    } else {
        RGBColor(255, 255, 255)
    }
}

pub const ITEM: RGBColor = RGBColor(122, 74, 30);

/// The floor of the room, its lines and walls, and texts on it.
pub const FLOOR: RGBColor = RGBColor(255, 254, 251);
pub const WALL: RGBColor = RGBColor(32, 36, 44);
pub const QUIET_TEXT: RGBColor = RGBColor(86, 92, 102);
pub const QUIET_LINE: RGBColor = RGBColor(216, 213, 205);

/// The color of faults and losses.
pub const TROUBLE: RGBColor = RGBColor(184, 51, 10);

/// Work that is done, as a share.
pub const PROGRESS: RGBColor = RGBColor(0, 105, 77);

/// Obstacles: solid ones, and patches that slow robots down or speed them up.
pub const SOLID: RGBColor = RGBColor(85, 90, 99);
pub const SLOW: RGBColor = RGBColor(138, 90, 0);
pub const FAST: RGBColor = RGBColor(0, 114, 178);

/// The color of marks of any kind without work that is left.
const DONE: RGBColor = RGBColor(225, 225, 225);

/// Returns the colors of a mark without and with all of its work: those of its kind, or else of its role.
#[must_use]
pub fn mark_colors(mark: &Mark) -> (RGBColor, RGBColor) {
    let of_kind = |kind: usize| (DONE, drawn(TASKS[kind % TASKS.len()]));
    mark.kind().map_or_else(|| of_role(mark.role), of_kind)
}

/// Returns the color of a mark: the fuller, the more of its work is left.
#[must_use]
pub fn mark_color(mark: &Mark) -> RGBColor {
    let (empty, full) = mark_colors(mark);
    let left = mark.share_left();
    let between = |from: u8, to: u8| {
        let (from, to) = (f32::from(from), f32::from(to));
        (from + left * (to - from)).round() as u8
    };
    RGBColor(
        between(empty.0, full.0),
        between(empty.1, full.1),
        between(empty.2, full.2),
    )
}

/// Returns the colors of a role without and with all of its work. The page has the same ones in its light theme.
#[must_use]
pub fn of_role(role: MarkRole) -> (RGBColor, RGBColor) {
    match role {
        MarkRole::Item => (ITEM, ITEM),
        MarkRole::Target => (RGBColor(233, 226, 244), RGBColor(179, 148, 216)),
        MarkRole::Zone => (RGBColor(246, 223, 208), RGBColor(233, 181, 146)),
        MarkRole::Goal => (RGBColor(217, 235, 227), RGBColor(163, 207, 187)),
        MarkRole::Range => (RGBColor(214, 220, 226), RGBColor(150, 164, 178)),
        MarkRole::Link => (RGBColor(86, 92, 102), RGBColor(32, 36, 44)),
    }
}

/// Returns a color as in CSS: `#0072b2`.
#[must_use]
pub fn css(RGBColor(red, green, blue): RGBColor) -> String {
    Rgb(red, green, blue).css()
}

/// Returns one color for each name, see [`observation::colors::colors`].
#[must_use]
pub fn colors<'n>(names: impl Iterator<Item = &'n str>) -> Vec<RGBColor> {
    let colors = observation::colors::colors(names).into_iter();
    colors.map(drawn).collect()
}
