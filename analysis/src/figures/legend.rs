//! Legends: samples with texts, in rows.

use std::ops::Range;

use plotters::element::{PathElement, Rectangle};
use plotters::style::{Color, RGBColor};

use super::canvas::{Area, DrawResult, INK, Mark, TextLabel, line, px};

/// The height of a row, px.
pub const ROW_PX: f64 = 17.0;

/// The distance from a sample to its text, px.
const SAMPLE_PX: f64 = 26.0;

/// The sample of a legend entry.
#[derive(Clone, Copy, Debug)]
pub enum Sample {
    /// A line with its width, px.
    Line(RGBColor, f64),
    /// A dashed line with dash and gap lengths, px.
    Dashed(RGBColor, (f64, f64)),
    /// A filled band with its opacity.
    Fill(RGBColor, f64),
    /// A hatched band with the distance of its lines, px.
    Hatch(RGBColor, f64),
    /// A bar with a tick at its upper edge.
    Ticked(RGBColor),
    Mark(Mark, RGBColor),
}

/// Samples with their texts. A row that reaches the right edge continues in the next one.
pub struct Legend<'l> {
    entries: Vec<(Sample, &'l str)>,
    /// Left and right edge, px.
    edges: Range<f64>,
}

impl<'l> Legend<'l> {
    #[must_use]
    pub fn new(entries: Vec<(Sample, &'l str)>, edges: Range<f64>) -> Self {
        Self { entries, edges }
    }

    /// Creates a legend with one entry per row.
    #[must_use]
    pub fn column(entries: Vec<(Sample, &'l str)>, left_px: f64) -> Self {
        Self::new(entries, left_px..left_px)
    }

    #[must_use]
    pub fn height_px(&self) -> f64 {
        self.places().last().map_or(0.0, |(row, _)| row + 1.0) * ROW_PX
    }

    pub fn draw(&self, area: &Area<'_>, top_px: f64) -> DrawResult {
        for ((sample, text), (row, x)) in self.entries.iter().zip(self.places()) {
            let y = top_px + (row + 0.5) * ROW_PX;
            sample.draw(area, x, y)?;
            TextLabel::LEFT.write(area, text, (x + SAMPLE_PX, y))?;
        }
        Ok(())
    }

    /// Returns row and x of each entry.
    fn places(&self) -> Vec<(f64, f64)> {
        let (mut row, mut x) = (0.0, self.edges.start);
        let mut places = Vec::new();
        for (_, text) in &self.entries {
            let width = SAMPLE_PX + TextLabel::LEFT.width_px(text) + 16.0;
            if x + width > self.edges.end && x > self.edges.start {
                row += 1.0;
                x = self.edges.start;
            }
            places.push((row, x));
            x += width;
        }
        places
    }
}

impl Sample {
    /// Draws the sample at the start of a legend entry.
    fn draw(self, area: &Area<'_>, x_px: f64, y_px: f64) -> DrawResult {
        let (left, right) = (px(x_px), px(x_px + SAMPLE_PX - 6.0));
        let (top, middle, bottom) = (px(y_px - 6.0), px(y_px), px(y_px + 6.0));
        let half = (left + right) / 2;
        let stroke = |from, to, style| area.draw(&PathElement::new([from, to], style));
        let filled = |from, to, style| area.draw(&Rectangle::new([from, to], style));
        match self {
            Self::Line(color, width_px) => {
                stroke((left, middle), (right, middle), line(color, width_px))
            }
            Self::Dashed(color, (dash_px, gap_px)) => {
                let starts = (left..right).step_by(px(dash_px + gap_px) as usize);
                let mut dashes = starts.map(|from| (from, from + px(dash_px)));
                let style = line(color, 1.25);
                dashes.try_for_each(|(from, to)| stroke((from, middle), (to, middle), style))
            }
            Self::Fill(color, opacity) => {
                filled((left, top), (right, bottom), color.mix(opacity).filled())
            }
            Self::Ticked(color) => {
                filled((left, middle), (right, bottom), color.filled())?;
                stroke((half, top), (half, middle), line(INK, 1.0))
            }
            Self::Hatch(color, apart_px) => {
                let mut lines = (left..=right).step_by(px(apart_px) as usize);
                lines.try_for_each(|x| stroke((x, top), (x, bottom), line(color, 1.0)))
            }
            Self::Mark(mark, color) => mark.draw(area, (half, middle), color),
        }
    }
}
