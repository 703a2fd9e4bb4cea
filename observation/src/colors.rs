//! Colors of robots and tasks, the same on the page and in figures.

use std::collections::HashSet;

/// A color with its red, green and blue parts.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Rgb(pub u8, pub u8, pub u8);

impl Rgb {
    /// Returns the color as in CSS: `#0072b2`.
    #[must_use]
    pub fn css(self) -> String {
        let Self(red, green, blue) = self;
        format!("#{red:02x}{green:02x}{blue:02x}")
    }
}

/// Colors of robots in the order of their use, with the name of the robot that has the color first. They are legible as
/// thin lines on white and on the dark floor of the page.
const ROBOTS: [(&str, Rgb); 14] = [
    ("blue", Rgb(26, 120, 190)),
    ("orange", Rgb(224, 98, 8)),
    ("green", Rgb(0, 150, 108)),
    ("pink", Rgb(226, 120, 178)),
    ("cyan", Rgb(64, 170, 214)),
    ("gold", Rgb(216, 148, 0)),
    ("violet", Rgb(138, 100, 214)),
    ("brown", Rgb(146, 102, 60)),
    ("red", Rgb(210, 58, 58)),
    ("yellow", Rgb(176, 164, 0)),
    ("gray", Rgb(146, 146, 146)),
    ("purple", Rgb(158, 72, 158)),
    ("magenta", Rgb(206, 64, 146)),
    ("black", Rgb(96, 96, 96)),
];

/// The hues of tasks and kinds of marks: muted, so that no task looks like a robot. They differ in hue and in lightness, and
/// are legible as thin lines on white and on the dark panels of the page.
pub const TASKS: [Rgb; 6] = [
    Rgb(86, 107, 134),
    Rgb(162, 116, 96),
    Rgb(85, 124, 103),
    Rgb(133, 106, 134),
    Rgb(118, 157, 167),
    Rgb(146, 143, 96),
];

/// Returns the hues of tasks by catalog index, in turn, as in CSS.
#[must_use]
pub fn task_hues() -> Vec<String> {
    TASKS.map(Rgb::css).to_vec()
}

/// Returns one color for each name: first that of the name, then the free ones in turn, then mixed ones. No two names have
/// the same color.
#[must_use]
pub fn colors<'n>(names: impl Iterator<Item = &'n str>) -> Vec<Rgb> {
    let names: Vec<&str> = names.collect();
    let is_named = |color: &str| names.contains(&color);
    let free = ROBOTS.iter().filter(|(color, _)| !is_named(color));
    let mut seen: HashSet<Rgb> = ROBOTS.iter().map(|(_, color)| *color).collect();
    let mixed = (0..).map(mixed_color).filter(|color| seen.insert(*color));
    let mut others = free.map(|(_, color)| *color).chain(mixed);
    let color = |name: &&str| {
        let named = ROBOTS.iter().find(|(color, _)| color == name);
        named.map(|(_, color)| *color).or_else(|| others.next())
    };
    names.iter().filter_map(color).collect()
}

/// Returns a color of a sequence without end. Neighbors differ in hue by the golden angle, and in lightness.
fn mixed_color(number: usize) -> Rgb {
    const GOLDEN_ANGLE: f64 = 2.399_963_229_728_653;
    let number = number as f64;
    // Steps that never repeat. The ranges are legible on white and on the dark floor.
    let lightness = 0.54 + 0.16 * (0.754_877 * number).fract();
    let chroma = 0.07 + 0.07 * (0.569_840 * number).fract();
    let hue = GOLDEN_ANGLE * number;
    oklab(lightness, chroma * hue.cos(), chroma * hue.sin())
}

/// Converts a color from OKLab (Ottosson, "A perceptual color space for image processing", 2020). Parts beyond sRGB are cut.
fn oklab(lightness: f64, a: f64, b: f64) -> Rgb {
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
    Rgb(
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
        let different: HashSet<Rgb> = found.iter().copied().collect();
        assert_eq!(different.len(), 1000);
    }

    /// The contrast ratio of WCAG 2.
    fn contrast(one: Rgb, other: Rgb) -> f64 {
        let light = |Rgb(red, green, blue)| {
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

    /// Robots are vivid, tasks are muted.
    #[test]
    fn no_task_has_the_color_of_a_robot() {
        let saturation = |Rgb(red, green, blue)| {
            let (least, most) = (red.min(green).min(blue), red.max(green).max(blue));
            f64::from(most - least) / f64::from(most)
        };
        let mut robots = ROBOTS.iter();
        assert!(
            robots
                .all(|(name, color)| ["gray", "black"].contains(name) || saturation(*color) > 0.46)
        );
        assert!(TASKS.into_iter().all(|color| saturation(color) < 0.42));
        for color in TASKS {
            for floor in [Rgb(255, 255, 255), Rgb(29, 32, 38)] {
                let ratio = contrast(color, floor);
                assert!(ratio >= 2.9, "{color:?} on {floor:?}: {ratio:.2}");
            }
        }
    }

    #[test]
    fn robots_are_legible_on_white_and_on_the_dark_floor() {
        let mixed = (0..1000).map(|number| ("mixed", mixed_color(number)));
        for (name, color) in ROBOTS.into_iter().chain(mixed) {
            for floor in [Rgb(255, 255, 255), Rgb(35, 39, 46)] {
                let ratio = contrast(color, floor);
                assert!(ratio >= 2.3, "{name} on {floor:?}: {ratio:.2}");
            }
        }
    }
}
