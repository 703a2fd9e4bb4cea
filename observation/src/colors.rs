//! Colors of robots and tasks, the same on the page and in figures.

/// A color with its red, green and blue parts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
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

/// The hues of tasks and kinds of marks: the color-blind safe palette of Okabe and Ito, without yellow, which is too
/// light for lines. Gray and black have other meanings in task figures.
pub const TASKS: [Rgb; 6] = [
    Rgb(0, 114, 178),
    Rgb(213, 94, 0),
    Rgb(0, 158, 115),
    Rgb(204, 121, 167),
    Rgb(86, 180, 233),
    Rgb(230, 159, 0),
];

/// Returns the hues of tasks by catalog index, in turn, as in CSS.
#[must_use]
pub fn task_hues() -> Vec<String> {
    TASKS.map(Rgb::css).to_vec()
}

/// Returns one color for each name: first that of the name, then the free ones in turn. Colors repeat only after all of
/// them are used.
#[must_use]
pub fn colors<'n>(names: impl Iterator<Item = &'n str>) -> Vec<Rgb> {
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

    #[test]
    fn robots_are_legible_on_white_and_on_the_dark_floor() {
        for (name, color) in ROBOTS {
            for floor in [Rgb(255, 255, 255), Rgb(35, 39, 46)] {
                let ratio = contrast(color, floor);
                assert!(ratio >= 2.3, "{name} on {floor:?}: {ratio:.2}");
            }
        }
    }
}
