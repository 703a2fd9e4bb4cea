//! Texts that a browser shows while the pointer is over a part of a figure. Other programs ignore them.

use std::fmt::Write;

use super::canvas::{Chart, UNITS_PER_PX};

/// The distance from a mark to the edge of its hint, px.
const AROUND_PX: f64 = 8.0;

/// The hints of a figure, as elements of an SVG.
#[derive(Debug, Default)]
pub struct Hints(String);

impl Hints {
    /// Adds a hint for a rectangle: its upper left corner and its size, px.
    pub fn add(&mut self, (left, top): (f64, f64), (width, height): (f64, f64), text: &str) {
        let [x, y, width, height] =
            [left, top, width, height].map(|length| (length * UNITS_PER_PX).round());
        let title = maud::html! { title { (text) } }.into_string();
        // Writing to a String cannot fail.
        let _ = writeln!(
            self.0,
            r#"<rect x="{x}" y="{y}" width="{width}" height="{height}" fill="none" pointer-events="all">{title}</rect>"#
        );
    }

    /// Adds a hint for a mark at a point of a plot.
    pub fn add_at(&mut self, chart: &Chart<'_>, point: (f64, f64), text: &str) {
        let (x, y) = chart.plotting_area().map_coordinate(&point);
        let corner = [x, y].map(|place| f64::from(place) / UNITS_PER_PX - AROUND_PX);
        self.add(corner.into(), (2.0 * AROUND_PX, 2.0 * AROUND_PX), text);
    }

    /// Adds the extent of a part of the figure, px: the page shows only the parts about what is chosen. `about` is the
    /// attribute of such a part.
    pub fn add_part(&mut self, top: f64, (width, height): (f64, f64), about: &str) {
        let [top, width, height] =
            [top, width, height].map(|length| (length * UNITS_PER_PX).round());
        let part = maud::html! {
            rect x="0" y=(top) width=(width) height=(height) fill="none" pointer-events="none" data-about=(about) {}
        };
        self.0 += &part.into_string();
        self.0.push('\n');
    }

    /// Returns the SVG of the figure with the hints above everything else.
    #[must_use]
    pub fn put_on(&self, svg: &str) -> String {
        let (content, end) = svg.rsplit_once("</svg>").unwrap_or((svg, ""));
        format!("{content}{}</svg>{end}", self.0)
    }
}

/// Returns a value with its 95 % interval and its number of runs, for a hint.
#[must_use]
pub fn estimate_hint(
    name: &str,
    (value, (from, to)): (f64, (f64, f64)),
    show: impl Fn(f64) -> String,
    runs: usize,
) -> String {
    let [value, from, to] = [value, from, to].map(show);
    let plural = if runs == 1 { "" } else { "s" };
    format!("{name}: {value} (95 %: {from} – {to}), {runs} run{plural}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn hints_are_invisible_elements_at_the_end() {
        let mut hints = Hints::default();
        let text = estimate_hint(
            "cbba, <killed>",
            (346.2, (340.0, 352.0)),
            |s| format!("{s:.0} s"),
            8,
        );
        hints.add((10.0, 2.5), (20.0, 1.0), &text);
        let svg = hints.put_on("<svg>\n<path/>\n</svg>\n");
        let hint = r#"<rect x="40" y="10" width="80" height="4" fill="none" pointer-events="all"><title>cbba, &lt;killed&gt;: 346 s (95 %: 340 s – 352 s), 8 runs</title></rect>"#;
        assert_eq!(svg, format!("<svg>\n<path/>\n{hint}\n</svg>\n"));

        let mut parts = Hints::default();
        parts.add_part(2.5, (20.0, 1.0), r#"{"faults":"none"}"#);
        let part = r#"<rect x="0" y="10" width="80" height="4" fill="none" pointer-events="none" data-about="{&quot;faults&quot;:&quot;none&quot;}"></rect>"#;
        assert_eq!(parts.put_on("<svg></svg>"), format!("<svg>{part}\n</svg>"));
    }
}
