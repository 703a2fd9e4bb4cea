//! Drawing tools for all figures: an SVG, panels with a common time axis, text, and marks that differ without color.

use std::io;
use std::ops::Range;

use plotters::coord::Shift;
use plotters::coord::types::RangedCoordf64;
use plotters::element::{PathElement, Polygon, Rectangle};
use plotters::prelude::{
    Cartesian2d, ChartBuilder, ChartContext, DrawingArea, DrawingAreaErrorKind, IntoDrawingArea,
    RGBColor, SVGBackend, ShapeStyle,
};
use plotters::style::text_anchor::{HPos, Pos, VPos};
use plotters::style::{Color, FontDesc, FontFamily, FontStyle, FontTransform, TextStyle};

use super::hatching::join_lines;

/// Drawing units per pixel. The backend supports only whole units, and a pixel is too coarse.
pub const UNITS_PER_PX: f64 = 4.0;

/// The ratio of the font size given to the backend to the font size that it writes.
const FONT_FACTOR: f64 = 1.24;

/// The average letter width as a share of the font size. The backend has no font metrics.
const LETTER: f64 = 0.56;

/// The width factor of bold letters.
const BOLD: f64 = 1.13;

/// Free space at the left edge of a panel, px.
pub const EDGE_PX: f64 = 6.0;

/// The default width of a figure, px.
pub const WIDTH_PX: f64 = 960.0;

/// The default font size, px.
pub const TEXT_PX: f64 = 12.0;

/// The maximum height of a figure, px, which still fits a screen or a sheet of paper.
const HIGHEST_PX: f64 = 1_980.0;

/// The height of an x axis with labels and title, px.
pub const X_AXIS_PX: f64 = 40.0;

pub const WHITE: RGBColor = RGBColor(255, 255, 255);

/// The color of text and axes.
pub const INK: RGBColor = RGBColor(34, 34, 34);

/// The color of less important elements.
pub const FAINT: RGBColor = RGBColor(150, 150, 150);

/// A drawing or a part of it, in drawing units.
pub type Area<'a> = DrawingArea<SVGBackend<'a>, Shift>;

pub type Chart<'a> = ChartContext<'a, SVGBackend<'a>, Cartesian2d<RangedCoordf64, RangedCoordf64>>;

/// The result of a drawing operation. Drawing into memory does not fail.
pub type DrawResult<T = ()> = Result<T, DrawingAreaErrorKind<io::Error>>;

/// Converts a length in px to drawing units.
#[must_use]
pub fn px(length: f64) -> i32 {
    (length * UNITS_PER_PX).round() as i32
}

/// The layout width and the scale of a figure. The layout uses the font size [`TEXT_PX`]. A larger font enlarges the
/// whole figure, which leaves room for less.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sheet {
    pub width_px: f64,
    scale: f64,
}

impl Default for Sheet {
    fn default() -> Self {
        Self::new(WIDTH_PX, TEXT_PX)
    }
}

impl Sheet {
    #[must_use]
    pub fn new(width_px: f64, font_px: f64) -> Self {
        let scale = font_px / TEXT_PX;
        Self {
            width_px: width_px / scale,
            scale,
        }
    }

    #[must_use]
    pub fn max_height_px(&self) -> f64 {
        HIGHEST_PX / self.scale.max(1.0)
    }

    /// Returns the width and the height, px, at which a layout of this height is shown.
    #[must_use]
    pub fn shown_px(&self, height_px: f64) -> [f64; 2] {
        [self.width_px, height_px].map(|length| (length * self.scale * 100.0).round() / 100.0)
    }

    pub fn svg(
        &self,
        title: &str,
        height_px: f64,
        draw: impl FnOnce(&Area<'_>) -> DrawResult,
    ) -> anyhow::Result<String> {
        let size = (px(self.width_px) as u32, px(height_px) as u32);
        let mut text = String::new();
        {
            let area = SVGBackend::with_string(&mut text, size).into_drawing_area();
            let drawn = area.fill(&plotters::style::WHITE);
            let drawn = drawn
                .and_then(|()| draw(&area))
                .and_then(|()| area.present());
            drawn.map_err(|error| anyhow::anyhow!("{title}: {error}"))?;
        }
        // A px of the layout has `UNITS_PER_PX` drawing units.
        let large = format!("width=\"{}\" height=\"{}\"", size.0, size.1);
        let shown = self.shown_px(height_px);
        let shown = format!(
            "width=\"{}\" height=\"{}\" role=\"img\"",
            shown[0], shown[1]
        );
        let text = text.replacen(&large, &shown, 1);
        let title = maud::html! { title { (title) } }.into_string();
        let text = text.replacen(">\n", &format!(">\n{title}\n"), 1);
        Ok(join_lines(&text))
    }
}

/// Draws an SVG of the default width.
pub fn svg(
    title: &str,
    height_px: f64,
    draw: impl FnOnce(&Area<'_>) -> DrawResult,
) -> anyhow::Result<String> {
    Sheet::default().svg(title, height_px, draw)
}

/// Returns a part of the area, given in px from its upper left corner.
#[must_use]
pub fn part<'a>(area: &Area<'a>, corner: (f64, f64), size: (f64, f64)) -> Area<'a> {
    area.clone()
        .shrink((px(corner.0), px(corner.1)), (px(size.0), px(size.1)))
}

#[derive(Clone, Copy)]
pub struct TextLabel {
    pub size_px: f64,
    pub bold: bool,
    pub color: RGBColor,
    /// The point of the text that is placed at the given position.
    pub anchor: (HPos, VPos),
    /// `true` for text that runs upwards.
    pub upright: bool,
}

impl TextLabel {
    pub const LEFT: Self = Self {
        size_px: TEXT_PX,
        bold: false,
        color: INK,
        anchor: (HPos::Left, VPos::Center),
        upright: false,
    };

    pub const RIGHT: Self = Self {
        anchor: (HPos::Right, VPos::Center),
        ..Self::LEFT
    };

    pub const CENTERED: Self = Self {
        anchor: (HPos::Center, VPos::Center),
        ..Self::LEFT
    };

    pub const BOLD: Self = Self {
        bold: true,
        ..Self::LEFT
    };

    pub fn sized(self, size_px: f64) -> Self {
        Self { size_px, ..self }
    }

    pub fn colored(self, color: RGBColor) -> Self {
        Self { color, ..self }
    }

    #[must_use]
    pub fn style(&self) -> TextStyle<'static> {
        let face = if self.bold {
            FontStyle::Bold
        } else {
            FontStyle::Normal
        };
        let size = self.size_px * UNITS_PER_PX * FONT_FACTOR;
        let mut font = FontDesc::new(FontFamily::SansSerif, size, face);
        if self.upright {
            font = font.transform(FontTransform::Rotate270);
        }
        let (h_pos, v_pos) = self.anchor;
        font.color(&self.color).pos(Pos::new(h_pos, v_pos))
    }

    /// Writes a text at a position in px.
    pub fn write(&self, area: &Area<'_>, text: &str, at: (f64, f64)) -> DrawResult {
        area.draw_text(text, &self.style(), (px(at.0), px(at.1)))
    }

    /// Returns the approximate width of a text, px.
    #[must_use]
    pub fn width_px(&self, text: &str) -> f64 {
        let face = if self.bold { BOLD } else { 1.0 };
        self.size_px * LETTER * face * text.chars().count() as f64
    }

    /// Shortens a text to a width, px, with an ellipsis at the end.
    #[must_use]
    pub fn cut(&self, text: &str, width_px: f64) -> String {
        let letters = (width_px / self.width_px("x")).max(0.0) as usize;
        if text.chars().count() <= letters {
            return text.to_owned();
        }
        let kept = text.chars().take(letters.saturating_sub(1));
        kept.chain(['…']).collect()
    }
}

#[must_use]
pub fn line(color: RGBColor, width_px: f64) -> ShapeStyle {
    color.stroke_width((px(width_px) as u32).max(1))
}

/// The margins of a panel, px; the rest is the plot.
#[derive(Clone, Copy, Debug)]
pub struct Frame {
    /// Room for the y labels.
    pub left: f64,
    pub right: f64,
    /// Room for the x labels and title; 0 hides both.
    pub bottom: f64,
}

/// The margins of a panel with two labeled axes.
pub const FRAME: Frame = Frame {
    left: 62.0,
    right: 8.0,
    bottom: X_AXIS_PX,
};

/// The axes of a panel with their titles.
pub struct Axes<'t> {
    /// The range of x, and its title with the unit.
    pub x: (Range<f64>, &'t str),
    /// The range of y, and its title with the unit.
    pub y: (Range<f64>, &'t str),
    /// The approximate number of y labels; 0 for none.
    pub y_labels: usize,
}

/// Draws the axes of a panel and returns the plot.
pub fn chart<'a>(area: &Area<'a>, frame: Frame, axes: &Axes<'_>) -> DrawResult<Chart<'a>> {
    let mut chart = ChartBuilder::on(area)
        .margin_right(px(frame.right))
        .margin_top(px(2.0))
        // Room for the vertical title, which the label area would cut off.
        .margin_left(px(EDGE_PX))
        .x_label_area_size(px(frame.bottom))
        .y_label_area_size(px(frame.left - EDGE_PX))
        .build_cartesian_2d(axes.x.0.clone(), axes.y.0.clone())?;
    let letters = TextLabel::LEFT.style();
    let (width, _) = area.dim_in_pixel();
    let plot_px = f64::from(width) / UNITS_PER_PX - frame.left - frame.right;
    let x_labels = match frame.bottom > 0.0 {
        true => (plot_px / 45.0).clamp(2.0, 12.0) as usize,
        false => 0,
    };
    let number = |value: &f64| format!("{}", (value * 1000.0).round() / 1000.0);
    chart
        .configure_mesh()
        .disable_mesh()
        .axis_style(line(INK, 1.0))
        .set_all_tick_mark_size(px(4.0))
        .x_labels(x_labels)
        .y_labels(axes.y_labels)
        .x_label_formatter(&number)
        .y_label_formatter(&number)
        .label_style(letters.clone())
        .axis_desc_style(letters)
        .x_desc(if frame.bottom > 0.0 { axes.x.1 } else { "" })
        .y_desc(axes.y.1)
        .draw()?;
    Ok(chart)
}

/// Fills a rectangle of a plot. A rectangle narrower than 1 px is drawn 1 px wide.
pub fn fill(
    chart: &Chart<'_>,
    x: Range<f64>,
    y: Range<f64>,
    color: RGBColor,
    opacity: f64,
) -> DrawResult {
    let area = chart.plotting_area();
    let (shown, units) = (area.get_x_range(), area.get_x_axis_pixel_range());
    let least = (shown.end - shown.start) * f64::from(px(1.0)) / f64::from(units.end - units.start);
    let start = x.start.min(shown.end - least).max(shown.start);
    let corners = [(start, y.start), (x.end.max(start + least), y.end)];
    let style = color.mix(opacity).filled();
    area.draw(&Rectangle::new(corners, style))
}

/// Hatches a rectangle of a plot, a part of `area`, with vertical lines. `style` gives their color and distance, px.
pub fn hatch(
    area: &Area<'_>,
    chart: &Chart<'_>,
    x: Range<f64>,
    y: Range<f64>,
    style: (RGBColor, f64),
) -> DrawResult {
    let plot = chart.plotting_area();
    let (left, top) = plot.map_coordinate(&(x.start, y.start));
    let (right, bottom) = plot.map_coordinate(&(x.end, y.end));
    let (color, apart_px) = style;
    for place in (left..=right).step_by(px(apart_px) as usize) {
        let ends = [(place, top), (place, bottom)];
        area.draw(&PathElement::new(ends, line(color, 1.0)))?;
    }
    Ok(())
}

/// Draws a rectangle with edges in px.
pub fn rectangle(area: &Area<'_>, x: Range<f64>, y: Range<f64>, style: ShapeStyle) -> DrawResult {
    let corners = [(px(x.start), px(y.start)), (px(x.end), px(y.end))];
    area.draw(&Rectangle::new(corners, style))
}

/// Draws a line through points in px.
pub fn path(area: &Area<'_>, points: &[(f64, f64)], style: ShapeStyle) -> DrawResult {
    let points: Vec<(i32, i32)> = points.iter().map(|(x, y)| (px(*x), px(*y))).collect();
    area.draw(&PathElement::new(points, style))
}

/// Draws estimates with their intervals, joined by a line. An estimate has x, y and the interval of y.
pub fn series(
    area: &Area<'_>,
    chart: &Chart<'_>,
    estimates: &[(f64, f64, (f64, f64))],
    (mark, color): (Mark, RGBColor),
) -> DrawResult {
    let points = estimates.iter().map(|(x, y, _)| (*x, *y)).collect();
    curve(chart, points, line(color, 0.75))?;
    for &(x, y, (from, to)) in estimates {
        curve(chart, vec![(x, from), (x, to)], line(color, 2.0))?;
        mark.draw_at(area, chart, (x, y), color)?;
    }
    Ok(())
}

/// Draws a line through points of a chart. A single point has no line.
pub fn curve(chart: &Chart<'_>, points: Vec<(f64, f64)>, style: ShapeStyle) -> DrawResult {
    if points.len() < 2 {
        return Ok(());
    }
    chart.plotting_area().draw(&PathElement::new(points, style))
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Mark {
    Triangle,
    Diamond,
    Cross,
    Square,
}

impl Mark {
    /// Returns the mark of a series by its number. Marks repeat after four series.
    #[must_use]
    pub fn of_series(number: usize) -> Self {
        [Self::Square, Self::Diamond, Self::Triangle, Self::Cross][number % 4]
    }

    /// Draws the mark around a point of a plot, a part of `area`.
    pub fn draw_at(
        self,
        area: &Area<'_>,
        chart: &Chart<'_>,
        point: (f64, f64),
        color: RGBColor,
    ) -> DrawResult {
        self.draw(area, chart.plotting_area().map_coordinate(&point), color)
    }

    /// Draws the mark around a point in drawing units, filled and with a dark edge.
    pub fn draw(self, area: &Area<'_>, at: (i32, i32), color: RGBColor) -> DrawResult {
        self.draw_sized(area, at, color, 4.5)
    }

    /// Draws the mark with that radius, px.
    pub fn draw_sized(
        self,
        area: &Area<'_>,
        at: (i32, i32),
        color: RGBColor,
        radius_px: f64,
    ) -> DrawResult {
        let r = px(radius_px);
        let corners: &[(i32, i32)] = match self {
            Self::Triangle => &[(-r, -r), (r, -r), (0, r)],
            Self::Diamond => &[(0, -r), (r, 0), (0, r), (-r, 0)],
            Self::Square => &[(-r, -r), (r, -r), (r, r), (-r, r)],
            Self::Cross => {
                for ends in [[(-r, -r), (r, r)], [(-r, r), (r, -r)]] {
                    let ends = ends.map(|(x, y)| (at.0 + x, at.1 + y));
                    area.draw(&PathElement::new(ends, line(color, 2.0)))?;
                }
                return Ok(());
            }
        };
        let mut edge: Vec<_> = corners.iter().map(|(x, y)| (at.0 + x, at.1 + y)).collect();
        area.draw(&Polygon::new(edge.clone(), color.filled()))?;
        edge.push(edge[0]);
        area.draw(&PathElement::new(edge, line(INK, 0.75)))
    }
}

/// Draws a vertical line between two y, px, optionally dashed.
pub fn vertical_line(
    area: &Area<'_>,
    x_px: f64,
    y_px: Range<f64>,
    style: ShapeStyle,
    dashed: bool,
) -> DrawResult {
    let (dash, step) = if dashed {
        (4.0, 8.0)
    } else {
        (y_px.end, y_px.end)
    };
    let mut from = y_px.start;
    while from < y_px.end {
        let to = (from + dash).min(y_px.end);
        let ends = [(px(x_px), px(from)), (px(x_px), px(to))];
        area.draw(&PathElement::new(ends, style))?;
        from += step;
    }
    Ok(())
}

/// Draws a dashed horizontal line over the whole width of a plot.
pub fn horizontal_line(chart: &Chart<'_>, x: Range<f64>, y: f64, style: ShapeStyle) -> DrawResult {
    let dashes = 120;
    let dash = (x.end - x.start) / f64::from(dashes);
    for place in (0..dashes).step_by(2) {
        let from = x.start + f64::from(place) * dash;
        curve(chart, vec![(from, y), (from + dash, y)], style)?;
    }
    Ok(())
}

/// Writes centered texts at their x, px, in rows so that they do not overlap. `y_px` returns the y of a row, px.
pub fn write_in_rows(
    area: &Area<'_>,
    labels: &[(String, f64)],
    rows: usize,
    y_px: impl Fn(usize) -> f64,
) -> DrawResult {
    let letters = TextLabel::CENTERED;
    for ((text, x), row) in labels.iter().zip(label_rows(labels, rows)) {
        if let Some(row) = row {
            letters.write(area, text, (*x, y_px(row)))?;
        }
    }
    Ok(())
}

/// Returns the row of each centered text, or `None` if it has no room.
#[must_use]
pub fn label_rows(labels: &[(String, f64)], rows: usize) -> Vec<Option<usize>> {
    let places = labels.iter().map(|(text, x)| {
        let width = TextLabel::CENTERED.width_px(text) + 8.0;
        (x - width / 2.0, width)
    });
    rows_for(&places.collect::<Vec<_>>(), rows)
}

/// Assigns labels to rows so that they do not overlap. Each label has the x of its left edge and its width, and labels
/// are sorted by x. A label without room gets `None`.
#[must_use]
pub fn rows_for(labels: &[(f64, f64)], rows: usize) -> Vec<Option<usize>> {
    let mut free_from = vec![f64::NEG_INFINITY; rows];
    labels
        .iter()
        .map(|&(x, width)| {
            let row = free_from.iter().position(|free| *free <= x)?;
            free_from[row] = x + width;
            Some(row)
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn labels_do_not_run_into_each_other() {
        let labels = [
            (0.0, 10.0),
            (5.0, 10.0),
            (8.0, 10.0),
            (10.0, 5.0),
            (15.0, 5.0),
        ];
        let rows = [Some(0), Some(1), None, Some(0), Some(0)];
        assert_eq!(rows_for(&labels, 2), rows);
        assert_eq!(rows_for(&labels, 0), [None; 5]);
    }

    #[test]
    fn an_svg_of_the_size_that_it_is_shown_at() {
        let text = svg("a < b", 100.0, |area| {
            TextLabel::LEFT.write(area, "x & y", (10.0, 10.0))
        })
        .unwrap();
        let head = "<svg width=\"960\" height=\"100\" role=\"img\" viewBox=\"0 0 3840 400\" \
                    xmlns=\"http://www.w3.org/2000/svg\">\n<title>a &lt; b</title>\n";
        assert!(text.starts_with(head), "{text}");
        assert!(text.contains("x &amp; y"), "{text}");
        assert!(text.ends_with("</svg>\n"), "{text}");
    }
}
