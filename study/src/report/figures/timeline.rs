//! What figures over time have in common: a window of time, the legend and the labels of faults above, and the lines that go
//! down from those.

use std::ops::Range;

use alliance_proto::time::SimTime;
use plotters::element::{PathElement, Rectangle};
use plotters::style::text_anchor::{HPos, VPos};
use plotters::style::{Color, RGBColor};

use super::WHITE;
use super::canvas::{
    Area, Drawn, FAINT, INK, Lettering, Mark, WIDTH_PX, line, px, rows_for, upright,
};
use crate::report::faults::{Fault, Phase};
use crate::report::spans::Span;

/// Height of a row of the legend or of labels, px.
const ROW_PX: f64 = 17.0;

/// Rows for labels of faults.
const LABEL_ROWS: usize = 3;

/// From an entry's sample to its text, px.
const SAMPLE_PX: f64 = 26.0;

/// What a figure over time shows of the run.
pub struct Timeline<'f> {
    /// Simulated time, s.
    pub window: Range<f64>,
    /// Left and right edge of the plot, px.
    pub edges: Range<f64>,
    /// What went wrong in the window.
    pub faults: Vec<&'f Fault>,
    /// What the signs mean.
    pub legend: Vec<(Sample, &'f str)>,
}

/// How a sign looks.
#[derive(Clone, Copy, Debug)]
pub enum Sample {
    /// A line.
    Line(RGBColor, f64),
    /// A broken line.
    Broken(RGBColor),
    /// A filled band.
    Fill(RGBColor, f64),
    /// A band hatched with lines so many px apart.
    Hatch(RGBColor, f64),
    /// A bar with a white stroke.
    Stroke(RGBColor),
    /// A mark.
    Mark(Mark, RGBColor),
}

impl<'f> Timeline<'f> {
    /// A timeline whose plot ends a little before the right edge of the figure.
    #[must_use]
    pub fn new(
        window: Range<f64>,
        left_px: f64,
        faults: &'f [Fault],
        legend: Vec<(Sample, &'f str)>,
    ) -> Self {
        let inside = |fault: &&Fault| window.contains(&fault.at.as_secs_f64());
        Self {
            faults: faults.iter().filter(inside).collect(),
            edges: left_px..WIDTH_PX - 22.0,
            legend,
            window,
        }
    }

    /// Height of legend and labels, px.
    #[must_use]
    pub fn head_px(&self) -> f64 {
        let rows = self.legend_places().last().map_or(0, |(row, _)| row + 1);
        let labels = self.labels().into_iter().filter_map(|(_, row)| row).max();
        let labels = match labels {
            Some(last) => (last + 1) as f64 * ROW_PX + 4.0,
            None if self.faults.is_empty() => 0.0,
            None => 8.0,
        };
        rows as f64 * ROW_PX + labels + 4.0
    }

    /// Draws legend, labels, and the lines down to `bottom_px`.
    ///
    /// # Errors
    /// When it cannot be drawn.
    pub fn draw_head(&self, area: &Area<'_>, bottom_px: f64) -> Drawn {
        let letters = Lettering::default();
        for ((sample, text), (row, x)) in self.legend.iter().zip(self.legend_places()) {
            let y = (row as f64 + 0.5) * ROW_PX;
            sample.draw(area, x, y)?;
            letters.write(area, text, (x + SAMPLE_PX, y))?;
        }
        let top = self.head_px();
        for (fault, row) in self.labels() {
            let x = self.x_px(fault.at);
            let y = row.map_or(top - 4.0, |row| top - 4.0 - (row as f64 + 0.5) * ROW_PX);
            match fault.phase {
                Phase::Begin => upright(area, x, y..bottom_px, line(INK, 1.25), false)?,
                Phase::End => upright(area, x, y..bottom_px, line(INK, 1.0), true)?,
                Phase::Hit => upright(area, x, top - 6.0..top, line(FAINT, 1.0), false)?,
            }
            if row.is_some() {
                let at = (x + 4.0, y);
                letters.write(area, &fault.label, at)?;
            }
        }
        Ok(())
    }

    /// Where that moment is, px.
    #[must_use]
    pub fn x_px(&self, at: SimTime) -> f64 {
        let share = (at.as_secs_f64() - self.window.start) / (self.window.end - self.window.start);
        self.edges.start + share * (self.edges.end - self.edges.start)
    }

    /// The part of a span that lies in the window, s.
    #[must_use]
    pub fn cut(&self, span: Span) -> Option<Range<f64>> {
        let from = span.from.as_secs_f64().max(self.window.start);
        let to = span.to.as_secs_f64().min(self.window.end);
        (from < to).then_some(from..to)
    }

    /// Whether a moment lies in the window.
    #[must_use]
    pub fn shows(&self, at: SimTime) -> bool {
        self.window.contains(&at.as_secs_f64())
    }

    /// Row and x of each entry of the legend.
    fn legend_places(&self) -> Vec<(usize, f64)> {
        let letters = Lettering::default();
        let (mut row, mut x) = (0, self.edges.start);
        let mut places = Vec::new();
        for (_, text) in &self.legend {
            let width = SAMPLE_PX + letters.width_px(text) + 16.0;
            if x + width > WIDTH_PX && x > self.edges.start {
                row += 1;
                x = self.edges.start;
            }
            places.push((row, x));
            x += width;
        }
        places
    }

    /// The faults, each with the row of its label, counted from below; `None` where there is no room, and for hits.
    fn labels(&self) -> Vec<(&'f Fault, Option<usize>)> {
        let letters = Lettering::default();
        let (named, hits): (Vec<&Fault>, Vec<&Fault>) = self
            .faults
            .iter()
            .partition(|fault| fault.phase != Phase::Hit);
        let places: Vec<(f64, f64)> = named
            .iter()
            .map(|fault| (self.x_px(fault.at), letters.width_px(&fault.label) + 14.0))
            .collect();
        // A label that would leave the figure is left out.
        let fits = |(x, width): (f64, f64)| x + width <= WIDTH_PX + 10.0;
        let rows = rows_for(&places, LABEL_ROWS);
        let rows = rows.into_iter().zip(places);
        let rows = rows.map(|(row, place)| row.filter(|_| fits(place)));
        let hits = hits.into_iter().map(|fault| (fault, None));
        named.into_iter().zip(rows).chain(hits).collect()
    }
}

impl Sample {
    /// Draws it where an entry of the legend begins.
    fn draw(self, area: &Area<'_>, x_px: f64, y_px: f64) -> Drawn {
        let (left, right) = (px(x_px), px(x_px + SAMPLE_PX - 6.0));
        let (top, middle, bottom) = (px(y_px - 6.0), px(y_px), px(y_px + 6.0));
        match self {
            Self::Line(color, width_px) => {
                let ends = [(left, middle), (right, middle)];
                area.draw(&PathElement::new(ends, line(color, width_px)))
            }
            Self::Broken(color) => {
                for from in (left..right).step_by(px(6.0) as usize) {
                    let ends = [(from, middle), (from + px(3.5), middle)];
                    area.draw(&PathElement::new(ends, line(color, 1.25)))?;
                }
                Ok(())
            }
            Self::Fill(color, opacity) => {
                let corners = [(left, top), (right, bottom)];
                area.draw(&Rectangle::new(corners, color.mix(opacity).filled()))
            }
            Self::Stroke(color) => {
                let corners = [(left, top), (right, bottom)];
                area.draw(&Rectangle::new(corners, color.filled()))?;
                let ends = [((left + right) / 2, top), ((left + right) / 2, bottom)];
                area.draw(&PathElement::new(ends, line(WHITE, 1.5)))
            }
            Self::Hatch(color, apart_px) => {
                for place in (left..=right).step_by(px(apart_px) as usize) {
                    let ends = [(place, top), (place, bottom)];
                    area.draw(&PathElement::new(ends, line(color, 1.0)))?;
                }
                Ok(())
            }
            Self::Mark(mark, color) => mark.draw(area, ((left + right) / 2, middle), color),
        }
    }
}

/// Writes what y is beside panels that have it in common.
///
/// # Errors
/// When it cannot be drawn.
pub fn y_title(area: &Area<'_>, text: &str, y_px: Range<f64>) -> Drawn {
    let letters = Lettering {
        anchor: (HPos::Center, VPos::Top),
        upright: true,
        ..Lettering::default()
    };
    letters.write(area, text, (4.0, (y_px.start + y_px.end) / 2.0))
}
