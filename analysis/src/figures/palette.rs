//! Colors of robots, tasks and marks in figures.

use std::collections::HashSet;

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

/// Returns one color for each name: first that of the name, then the free ones in turn, then mixed ones. No two names have
/// the same color.
#[must_use]
pub fn colors<'n>(names: impl Iterator<Item = &'n str>) -> Vec<RGBColor> {
    let names: Vec<&str> = names.collect();
    let is_named = |color: &str| names.contains(&color);
    let free = ROBOTS.iter().filter(|(color, _)| !is_named(color));
    let mut seen: HashSet<RGBColor> = ROBOTS.iter().map(|(_, color)| *color).collect();
    let mixed = (0..).map(mixed_color).filter(|color| seen.insert(*color));
    let mut others = free.map(|(_, color)| *color).chain(mixed);
    let color = |name: &&str| {
        let named = ROBOTS.iter().find(|(color, _)| color == name);
        named.map(|(_, color)| *color).or_else(|| others.next())
    };
    names.iter().filter_map(color).collect()
}

/// Returns a color of a sequence without end. Neighbors differ in hue by the golden angle, and in lightness.
fn mixed_color(number: usize) -> RGBColor {
    const GOLDEN_ANGLE: f64 = 2.399_963_229_728_653;
    let number = number as f64;
    // Steps that never repeat. The ranges are legible on white and on the dark floor.
    let lightness = 0.54 + 0.16 * (0.754_877 * number).fract();
    let chroma = 0.07 + 0.07 * (0.569_840 * number).fract();
    let hue = GOLDEN_ANGLE * number;
    oklab(lightness, chroma * hue.cos(), chroma * hue.sin())
}

/// Converts a color from OKLab (Ottosson, "A perceptual color space for image processing", 2020). Parts beyond sRGB are cut.
fn oklab(lightness: f64, a: f64, b: f64) -> RGBColor {
    let long = (lightness + 0.396_337_777_4 * a + 0.215_803_757_3 * b).powi(3);
    let medium = (lightness - 0.105_561_345_8 * a - 0.063_854_172_8 * b).powi(3);
    let short = (lightness - 0.089_484_177_5 * a - 1.291_485_548 * b).powi(3);
    let encoded = |linear: f64| {
        let part = match linear <= 0.003_130_8 {
            true => 12.92 * linear,
            false => 1.055 * linear.powf(1.0 / 2.4) - 0.055,
        };
        (255.0 * part).round().clamp(0.0, 255.0) as u8
    };
    RGBColor(
        encoded(4.076_741_662_1 * long - 3.307_711_591_3 * medium + 0.230_969_929_2 * short),
        encoded(-1.268_438_004_6 * long + 2.609_757_401_1 * medium - 0.341_319_396_5 * short),
        encoded(-0.004_196_086_3 * long - 0.703_418_614_7 * medium + 1.707_614_701 * short),
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_two_robots_have_one_color() {
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
        let more: Vec<String> = (0..1000).map(|robot| format!("robot-{robot}")).collect();
        let found = colors(more.iter().map(String::as_str));
        assert_eq!(found[0], ROBOTS[0].1);
        let different: HashSet<RGBColor> = found.iter().copied().collect();
        assert_eq!(different.len(), 1000);
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
        let mixed = (0..1000).map(|number| ("mixed", mixed_color(number)));
        for (name, color) in ROBOTS.into_iter().chain(mixed) {
            for floor in [RGBColor(255, 255, 255), RGBColor(35, 39, 46)] {
                let ratio = contrast(color, floor);
                assert!(ratio >= 2.3, "{name} on {floor:?}: {ratio:.2}");
            }
        }
    }
}
