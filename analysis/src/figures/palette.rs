//! Colors of robots, tasks and marks in figures.

use plotters::style::RGBColor;
use proto::view::{Mark, MarkRole};

/// Colors of robots that are named after a color, dark enough for a thin line on white. They also differ in lightness,
/// for print in gray.
const BY_NAME: [(&str, RGBColor); 14] = [
    ("blue", RGBColor(24, 84, 168)),
    ("gold", RGBColor(222, 158, 0)),
    ("green", RGBColor(38, 140, 84)),
    ("red", RGBColor(190, 40, 40)),
    ("violet", RGBColor(122, 62, 160)),
    ("purple", RGBColor(110, 40, 130)),
    ("orange", RGBColor(232, 116, 20)),
    ("cyan", RGBColor(40, 160, 190)),
    ("magenta", RGBColor(200, 50, 140)),
    ("pink", RGBColor(232, 120, 170)),
    ("brown", RGBColor(120, 74, 40)),
    ("black", RGBColor(30, 30, 30)),
    ("gray", RGBColor(120, 120, 120)),
    ("grey", RGBColor(120, 120, 120)),
];

/// Colors of all other robots, in turn: the color-blind safe palette of Okabe and Ito, without yellow, which is too
/// light for lines.
const OTHERS: [RGBColor; 7] = [
    RGBColor(0, 114, 178),
    RGBColor(213, 94, 0),
    RGBColor(0, 158, 115),
    RGBColor(204, 121, 167),
    RGBColor(86, 180, 233),
    RGBColor(230, 159, 0),
    RGBColor(0, 0, 0),
];

/// The color of robots that share a row.
pub const SHARED_ROW: RGBColor = OTHERS[0];

/// Returns the color of a task by its catalog index: six hues, each full, pale and dark in turn. Gray and black have
/// other meanings in task figures.
#[must_use]
pub fn task_color(task: usize) -> RGBColor {
    let colors = OTHERS.len() - 1;
    let RGBColor(red, green, blue) = OTHERS[task % colors];
    let toned = |part: u8| match task / colors % 3 {
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

pub const ITEM: RGBColor = RGBColor(196, 60, 40);

/// The color of completed marks of any kind.
const DONE: RGBColor = RGBColor(225, 225, 225);

/// Returns the color of a mark. A mark without a kind becomes fuller with its done share; a mark with a kind becomes
/// paler.
#[must_use]
pub fn mark_color(mark: &Mark) -> RGBColor {
    let of_kind = |kind: usize| (OTHERS[kind % OTHERS.len()], DONE);
    let (light, full) = mark.kind().map_or_else(|| of_role(mark.role), of_kind);
    let share = mark.share.unwrap_or(0.0).clamp(0.0, 1.0);
    let between = |from: u8, to: u8| {
        let (from, to) = (f32::from(from), f32::from(to));
        (from + share * (to - from)).round() as u8
    };
    RGBColor(
        between(light.0, full.0),
        between(light.1, full.1),
        between(light.2, full.2),
    )
}

/// Returns the light and the full color of a role.
fn of_role(role: MarkRole) -> (RGBColor, RGBColor) {
    match role {
        MarkRole::Item => (ITEM, ITEM),
        MarkRole::Target => (RGBColor(206, 200, 230), RGBColor(122, 62, 160)),
        MarkRole::Zone => (RGBColor(236, 190, 170), RGBColor(205, 120, 84)),
        MarkRole::Goal => (RGBColor(190, 220, 190), RGBColor(104, 168, 116)),
        MarkRole::Range => (RGBColor(214, 220, 226), RGBColor(150, 164, 178)),
        MarkRole::Link => (RGBColor(110, 110, 110), RGBColor(60, 60, 60)),
    }
}

/// Returns one color for each name.
#[must_use]
pub fn colors<'n>(names: impl Iterator<Item = &'n str>) -> Vec<RGBColor> {
    let mut others = OTHERS.iter().cycle().copied();
    names
        .filter_map(|name| {
            let named = BY_NAME.iter().find(|(color, _)| *color == name);
            named.map(|(_, color)| *color).or_else(|| others.next())
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn by_name_and_in_turn() {
        let names = [
            "r0", "blue", "r1", "gold", "r2", "r3", "r4", "r5", "r6", "r7",
        ];
        let found = colors(names.into_iter());
        assert_eq!(found.len(), names.len());
        assert_eq!([found[1], found[3]], [BY_NAME[0].1, BY_NAME[1].1]);
        assert_eq!(
            [found[0], found[2], found[4]],
            [OTHERS[0], OTHERS[1], OTHERS[2]]
        );
        assert_eq!(found[9], OTHERS[0], "from the start again");
    }
}
