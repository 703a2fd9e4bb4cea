//! Positions in a picture: from meters to px, and room for texts.

use glam::Vec2;
use maud::{Markup, html};
use plotters::style::RGBColor;
use scenario::Room;

use crate::figures::canvas::TextLabel;
use crate::figures::palette::{FLOOR, css};

/// Formats a number of px with at most two decimals.
pub fn n(value: f64) -> String {
    // The addition turns -0 into 0.
    format!("{}", (value * 100.0).round() / 100.0 + 0.0)
}

/// A point, px; y points down.
pub type Point = (f64, f64);

/// A projection of the room to scale.
#[derive(Clone, Copy, Debug)]
pub struct Projection {
    /// The scale, px per m.
    pub scale: f64,
    pub room: Room,
    /// The upper left corner of the room, px.
    pub corner: Point,
}

impl Projection {
    #[must_use]
    pub fn length(&self, length_m: f32) -> f64 {
        self.scale * f64::from(length_m)
    }

    #[must_use]
    pub fn point(&self, at: Vec2) -> Point {
        let from_low = at - self.room.low();
        (
            self.corner.0 + self.length(from_low.x),
            self.corner.1 + self.length(self.room.height_m) - self.length(from_low.y),
        )
    }

    /// Returns the extent of the room.
    #[must_use]
    pub fn extent(&self) -> Extent {
        let (left, top) = self.corner;
        Extent {
            left,
            top,
            right: left + self.length(self.room.width_m),
            bottom: top + self.length(self.room.height_m),
        }
    }
}

/// A rectangle in the picture, px.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Extent {
    pub left: f64,
    pub top: f64,
    pub right: f64,
    pub bottom: f64,
}

impl Extent {
    #[must_use]
    pub fn around((x, y): Point, half_width: f64, half_height: f64) -> Self {
        Self {
            left: x - half_width,
            top: y - half_height,
            right: x + half_width,
            bottom: y + half_height,
        }
    }

    #[must_use]
    pub fn overlaps(&self, other: &Self) -> bool {
        let beside = self.right <= other.left || other.right <= self.left;
        let above = self.bottom <= other.top || other.bottom <= self.top;
        !beside && !above
    }

    #[must_use]
    pub fn contains(&self, other: &Self) -> bool {
        let (x, y) = (self.left..=self.right, self.top..=self.bottom);
        x.contains(&other.left)
            && x.contains(&other.right)
            && y.contains(&other.top)
            && y.contains(&other.bottom)
    }
}

/// The texts of a picture, of which no two overlap.
#[derive(Debug)]
pub struct Taken {
    within: Extent,
    taken: Vec<Extent>,
}

impl Taken {
    /// Creates a space in which all of `within` is free.
    #[must_use]
    pub fn new(within: Extent) -> Self {
        Self {
            within,
            taken: Vec::new(),
        }
    }

    pub fn take(&mut self, place: Extent) {
        self.taken.push(place);
    }

    /// Takes the first free one of some places.
    pub fn first_free<T>(
        &mut self,
        places: impl IntoIterator<Item = (T, Extent)>,
    ) -> Option<(T, Extent)> {
        let is_free = |place: &Extent| {
            self.within.contains(place) && !self.taken.iter().any(|other| other.overlaps(place))
        };
        let (what, place) = places.into_iter().find(|(_, place)| is_free(place))?;
        self.taken.push(place);
        Some((what, place))
    }
}

/// Returns a text at the middle of a line. A rim in the color of the floor keeps the text legible on lines.
pub fn text(letters: &TextLabel, words: &str, (x, y): Point, anchor: &str) -> Markup {
    // The baseline lies about a third of the size below the middle.
    let baseline = y + 0.36 * letters.size_px;
    html! {
        text x=(n(x)) y=(n(baseline)) font-size=(n(letters.size_px)) font-weight=[letters.bold.then_some("bold")]
            fill=(css(letters.color)) stroke=(css(FLOOR)) stroke-width="3" stroke-linejoin="round"
            paint-order="stroke" text-anchor=(anchor) { (words) }
    }
}

/// Returns a straight line.
pub fn line(from: Point, to: Point, color: RGBColor, width_px: f64) -> Markup {
    html! {
        path d=(format!("M{} {}L{} {}", n(from.0), n(from.1), n(to.0), n(to.1)))
            fill="none" stroke=(css(color)) stroke-width=(n(width_px)) stroke-linecap="round" {}
    }
}

/// Returns the part of a circle that is filled from below up to a share above 0 and below 1, as the data of a path.
pub fn segment((x, y): Point, radius: f64, share: f64) -> String {
    let level = y + radius - 2.0 * radius * share;
    let half = (radius * radius - (level - y).powi(2)).max(0.0).sqrt();
    let large = u8::from(share > 0.5);
    let (left, right) = (n(x - half), n(x + half));
    let (radius, level) = (n(radius), n(level));
    format!("M{left} {level}A{radius} {radius} 0 {large} 0 {right} {level}Z")
}
