//! Colors of robots, tasks and marks in figures.

use plotters::style::RGBColor;
use proto::view::{Mark, MarkRole};

/// Colors of robots in the order of their use, with the name of the robot that has the color first. They are legible as
/// thin lines on white and on the dark floor of the page.
const ROBOTS: [(&str, RGBColor); 14] = [
    ("blue", RGBColor(26, 120, 190)),
    ("orange", RGBColor(224, 98, 8)),
    ("green", RGBColor(0, 150, 108)),
    ("pink", RGBColor(226, 120, 178)),
    ("cyan", RGBColor(64, 170, 214)),
    ("gold", RGBColor(216, 148, 0)),
    ("violet", RGBColor(138, 100, 214)),
    ("brown", RGBColor(146, 102, 60)),
    ("red", RGBColor(210, 58, 58)),
    ("yellow", RGBColor(176, 164, 0)),
    ("gray", RGBColor(146, 146, 146)),
    ("purple", RGBColor(158, 72, 158)),
    ("magenta", RGBColor(206, 64, 146)),
    ("black", RGBColor(96, 96, 96)),
];

/// The hues of tasks and kinds of marks: the color-blind safe palette of Okabe and Ito, without yellow, which is too
/// light for lines. Gray and black have other meanings in task figures.
const TASKS: [RGBColor; 6] = [
    RGBColor(0, 114, 178),
    RGBColor(213, 94, 0),
    RGBColor(0, 158, 115),
    RGBColor(204, 121, 167),
    RGBColor(86, 180, 233),
    RGBColor(230, 159, 0),
];

/// The color of robots that share a row.
pub const SHARED_ROW: RGBColor = TASKS[0];

/// Returns the hues of tasks by catalog index, in turn, as in CSS.
#[must_use]
pub fn task_hues() -> Vec<String> {
    TASKS.map(css).to_vec()
}

/// Returns the color of a task by its catalog index: each hue full, pale and dark in turn.
#[must_use]
pub fn task_color(task: usize) -> RGBColor {
    let RGBColor(red, green, blue) = TASKS[task % TASKS.len()];
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
    let of_kind = |kind: usize| (DONE, TASKS[kind % TASKS.len()]);
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
    format!("#{red:02x}{green:02x}{blue:02x}")
}

/// Returns one color for each name: first that of the name, then the free ones in turn. Colors repeat only after all of
/// them are used.
#[must_use]
pub fn colors<'n>(names: impl Iterator<Item = &'n str>) -> Vec<RGBColor> {
    let names: Vec<&str> = names.collect();
    let is_named = |color: &str| names.contains(&color);
    let mut free = ROBOTS.iter().filter(|(color, _)| !is_named(color));
    let mut again = ROBOTS.iter().cycle();
    let color = |name: &&str| {
        let named = ROBOTS.iter().find(|(color, _)| color == name);
        named.or_else(|| free.next()).or_else(|| again.next())
    };
    names
        .iter()
        .filter_map(color)
        .map(|(_, color)| *color)
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_two_robots_have_one_color_while_colors_are_free() {
        let names = [
            "r0", "blue", "r1", "gold", "grey", "r3", "red", "r5", "r6", "r7", "r8", "r9", "r10",
            "r11",
        ];
        let found = colors(names.into_iter());
        let named = |name| ROBOTS.iter().find(|(color, _)| *color == name).unwrap().1;
        assert_eq!(
            [found[1], found[3], found[6]],
            ["blue", "gold", "red"].map(named)
        );
        assert_eq!([found[0], found[2]], ["orange", "green"].map(named));
        for (rank, color) in found.iter().enumerate() {
            assert!(
                !found[..rank].contains(color),
                "{} has {color:?}",
                names[rank]
            );
        }
        let more = colors(names.into_iter().chain(["r12"]));
        assert_eq!(more[14], ROBOTS[0].1, "from the start again");
    }

    /// The contrast ratio of WCAG 2.
    fn contrast(one: RGBColor, other: RGBColor) -> f64 {
        let light = |RGBColor(red, green, blue)| {
            let linear = |part: u8| {
                let part = f64::from(part) / 255.0;
                match part <= 0.04045 {
                    true => part / 12.92,
                    false => ((part + 0.055) / 1.055).powf(2.4),
                }
            };
            0.2126 * linear(red) + 0.7152 * linear(green) + 0.0722 * linear(blue) + 0.05
        };
        let (one, other) = (light(one), light(other));
        one.max(other) / one.min(other)
    }

    #[test]
    fn robots_are_legible_on_white_and_on_the_dark_floor() {
        for (name, color) in ROBOTS {
            for floor in [RGBColor(255, 255, 255), RGBColor(35, 39, 46)] {
                let ratio = contrast(color, floor);
                assert!(ratio >= 2.3, "{name} on {floor:?}: {ratio:.2}");
            }
        }
    }
}
