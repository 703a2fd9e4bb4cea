//! Common parts of figures over time: a window, a legend, fault labels above, and fault shades below.

use std::ops::Range;

use plotters::style::text_anchor::{HPos, VPos};
use plotters::style::{Color, RGBColor};
use scenario::time::SimTime;

use super::RunFigures;
use super::rows::CELL_PX;
use crate::figures::canvas::{
    Area, Axes, Chart, DrawResult, Frame, TextLabel, X_AXIS_PX, chart, line, part, rectangle,
    rows_for, vertical_line,
};
use crate::figures::legend::{Legend, ROW_PX, Sample};
use crate::report::faults::FaultSpan;
use observation::stints::Span;

/// The maximum number of rows for fault labels.
const LABEL_ROWS: usize = 6;

/// The color of faults.
const FAULT: RGBColor = RGBColor(214, 140, 0);

/// The time axis, legend and faults of a figure.
pub struct Timeline<'f> {
    /// The shown simulated time, s.
    pub window: Range<f64>,
    /// Left and right edge of the plot, px.
    pub edges: Range<f64>,
    pub faults: Vec<&'f FaultSpan>,
    legend: Legend<'f>,
    width_px: f64,
}

impl<'f> Timeline<'f> {
    /// Creates a timeline whose plot starts at `left_px`.
    #[must_use]
    pub fn new(
        run: &'f RunFigures<'_>,
        window: Range<f64>,
        left_px: f64,
        legend: Vec<(Sample, &'f str)>,
    ) -> Self {
        let inside = |fault: &&FaultSpan| {
            let span = fault.span;
            span.from.as_secs_f64() < window.end && span.to.as_secs_f64() >= window.start
        };
        Self {
            faults: run.faults.iter().filter(inside).collect(),
            edges: left_px..run.sheet.width_px - 22.0,
            legend: Legend::new(legend, left_px..run.sheet.width_px),
            width_px: run.sheet.width_px,
            window,
        }
    }

    /// Returns the height of legend and labels, px.
    #[must_use]
    pub fn head_px(&self) -> f64 {
        self.legend.height_px() + self.label_rows() as f64 * ROW_PX + 8.0
    }

    /// Draws the legend and the faults: labeled bands above, and shades in the plots, which lie at the y ranges
    /// `plots`. Call it before drawing the plots, so that their content stays on top.
    pub fn draw_head(&self, area: &Area<'_>, plots: &[Range<f64>]) -> DrawResult {
        let letters = TextLabel::LEFT;
        self.legend.draw(area, 0.0)?;
        let band = |x: &Range<f64>, y: Range<f64>, opacity: f64| {
            rectangle(area, x.clone(), y, FAULT.mix(opacity).filled())
        };
        let top = self.head_px() - 4.0;
        let labels = self.labels();
        let unnamed = labels.iter().filter(|label| label.row.is_none()).count();
        for label in &labels {
            let x = &label.x;
            for plot in plots {
                band(x, plot.clone(), 0.13)?;
                vertical_line(area, x.start, plot.clone(), line(FAULT, 1.0), false)?;
                if x.end > x.start && x.end < self.edges.end {
                    vertical_line(area, x.end, plot.clone(), line(FAULT, 1.0), true)?;
                }
            }
            if let Some(row) = label.row {
                let y = top - (row as f64 + 0.5) * ROW_PX;
                band(x, y - 7.0..y + 7.0, 0.4)?;
                vertical_line(area, x.start, y - 7.0..y + 7.0, line(FAULT, 1.5), false)?;
                letters.write(area, label.text, (label.text_px, y))?;
            }
        }
        if unnamed > 0 {
            let y = top - (LABEL_ROWS as f64 + 0.5) * ROW_PX;
            let text = match unnamed {
                1 => "and 1 more fault, shaded below".to_owned(),
                _ => format!("and {unnamed} more faults, shaded below"),
            };
            letters.write(area, &text, (self.edges.start, y))?;
        }
        Ok(())
    }

    /// Draws the axes of a plot between two y, px below the upper edge of the figure. The time axis lies below the plot.
    pub fn chart<'a>(
        &self,
        area: &Area<'a>,
        y_px: Range<f64>,
        (y, y_title, y_labels): (Range<f64>, &str, usize),
        has_time_axis: bool,
    ) -> DrawResult<Chart<'a>> {
        let bottom = if has_time_axis { X_AXIS_PX } else { 0.0 };
        let height_px = y_px.end - y_px.start + bottom;
        let panel = part(area, (0.0, y_px.start), (self.width_px, height_px));
        let frame = Frame {
            left: self.edges.start,
            right: self.width_px - self.edges.end,
            bottom,
        };
        let axes = Axes {
            x: (self.window.clone(), "time t in s"),
            y: (y, y_title),
            y_labels,
        };
        chart(&panel, frame, &axes)
    }

    /// Returns the number of cells in a row of a heat map.
    #[must_use]
    pub fn cells(&self) -> usize {
        ((self.edges.end - self.edges.start) / CELL_PX) as usize
    }

    #[must_use]
    pub fn x_px(&self, at: SimTime) -> f64 {
        let share = (at.as_secs_f64() - self.window.start) / (self.window.end - self.window.start);
        self.edges.start + share * (self.edges.end - self.edges.start)
    }

    /// Returns the part of a span in the window, s.
    #[must_use]
    pub fn cut(&self, span: Span) -> Option<Range<f64>> {
        let from = span.from.as_secs_f64().max(self.window.start);
        let to = span.to.as_secs_f64().min(self.window.end);
        (from < to).then_some(from..to)
    }

    #[must_use]
    pub fn shows(&self, at: SimTime) -> bool {
        self.window.contains(&at.as_secs_f64())
    }

    /// Returns the number of label rows, including one for unnamed faults.
    fn label_rows(&self) -> usize {
        let labels = self.labels().into_iter();
        let rows = labels.map(|label| label.row.unwrap_or(LABEL_ROWS) + 1);
        rows.max().unwrap_or(0)
    }

    fn labels(&self) -> Vec<Label<'f>> {
        let letters = TextLabel::LEFT;
        let mut labels: Vec<Label<'f>> = self
            .faults
            .iter()
            .map(|fault| {
                let edge = |at| self.x_px(at).clamp(self.edges.start, self.edges.end);
                let x = edge(fault.span.from)..edge(fault.span.to);
                // A text that would leave the figure ends at its right edge.
                let text_px =
                    (x.start + 4.0).min(self.width_px - letters.width_px(&fault.label) - 2.0);
                Label {
                    text: &fault.label,
                    text_px,
                    x,
                    row: None,
                }
            })
            .collect();
        let left = |label: &Label<'_>| label.x.start.min(label.text_px);
        labels.sort_by(|a, b| left(a).total_cmp(&left(b)));
        let places: Vec<(f64, f64)> = labels
            .iter()
            .map(|label| {
                let right = (label.text_px + letters.width_px(label.text)).max(label.x.end);
                (left(label), right - left(label) + 6.0)
            })
            .collect();
        for (label, row) in labels.iter_mut().zip(rows_for(&places, LABEL_ROWS)) {
            label.row = row;
        }
        labels
    }
}

struct Label<'f> {
    text: &'f str,
    text_px: f64,
    /// Start and end of the band, px.
    x: Range<f64>,
    /// Row of the label, counted from below; `None` without room.
    row: Option<usize>,
}

/// Writes the common y title of several panels.
pub fn y_title(area: &Area<'_>, text: &str, y_px: Range<f64>) -> DrawResult {
    let letters = TextLabel {
        anchor: (HPos::Center, VPos::Top),
        upright: true,
        ..TextLabel::LEFT
    };
    letters.write(area, text, (4.0, (y_px.start + y_px.end) / 2.0))
}
