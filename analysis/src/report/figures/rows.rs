//! Rows of a figure for many things: one row each, or a shared row for several if space is short.

use std::ops::Range;

use plotters::style::RGBColor;

use crate::figures::canvas::{Area, Chart, DrawResult, INK, TextLabel, fill, px};
use crate::report::spans::Spans;

/// Room for names at the left of rows, px, and its maximum share of the width.
pub const LEFT_PX: f64 = 210.0;
pub const LEFT_SHARE: f64 = 0.3;

/// The default height of a row, px.
const ROW_PX: f64 = 17.0;

/// The minimum height of a row, px. Lower rows are indistinguishable.
const LEAST_PX: f64 = 4.0;

/// The height of a shared row, px.
const TOGETHER_PX: f64 = 10.0;

/// The minimum distance between names, px.
const NAME_PX: f64 = 12.0;

/// Width of a cell of a heat map, px.
pub const CELL_PX: f64 = 3.0;

/// The number of shades in a heat map.
const SHADES: f64 = 10.0;

/// Returns a part of a lane, from shares of its height.
pub fn within(lane: &Range<f64>, shares: &Range<f64>) -> Range<f64> {
    let height = lane.end - lane.start;
    lane.start + shares.start * height..lane.start + shares.end * height
}

/// Rows of equal height, from the top down.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rows {
    pub count: usize,
    /// The number of things per row.
    pub per_row: usize,
    pub row_px: f64,
}

impl Rows {
    /// Creates rows with a total height of at most `most_px`.
    #[must_use]
    pub fn fit(count: usize, most_px: f64) -> Self {
        let row_px = (most_px / count.max(1) as f64).min(ROW_PX);
        if row_px >= LEAST_PX {
            return Self {
                count,
                per_row: 1,
                row_px,
            };
        }
        let rows = (most_px / TOGETHER_PX).floor().max(1.0);
        Self {
            count,
            per_row: (count as f64 / rows).ceil() as usize,
            row_px: TOGETHER_PX,
        }
    }

    #[must_use]
    pub fn len(&self) -> usize {
        self.count.div_ceil(self.per_row)
    }

    #[must_use]
    pub fn height_px(&self) -> f64 {
        self.len() as f64 * self.row_px
    }

    /// Returns the upper and lower edge of a thing's row, px below the upper edge of the first row.
    #[must_use]
    pub fn extent(&self, thing: usize) -> Range<f64> {
        let top = (thing / self.per_row) as f64 * self.row_px;
        top..top + self.row_px
    }

    #[must_use]
    pub fn members(&self, row: usize) -> Range<usize> {
        row * self.per_row..((row + 1) * self.per_row).min(self.count)
    }

    /// Returns the rows that have room for a name. Important rows come first, then upper rows.
    #[must_use]
    pub fn named(&self, is_important: impl Fn(usize) -> bool) -> Vec<usize> {
        let (important, others): (Vec<usize>, Vec<usize>) =
            (0..self.len()).partition(|row| self.members(*row).any(&is_important));
        let apart = (NAME_PX / self.row_px).ceil() as usize;
        let mut taken = vec![false; self.len()];
        let mut named = Vec::new();
        for row in important.into_iter().chain(others) {
            let near = row.saturating_sub(apart - 1)..(row + apart).min(taken.len());
            if !taken[near].contains(&true) {
                taken[row] = true;
                named.push(row);
            }
        }
        named
    }

    /// Writes names beside the rows that have room, within `room_px`. The first row starts at y = `top` in the plot.
    pub fn write_names<'n>(
        &self,
        area: &Area<'_>,
        chart: &Chart<'_>,
        (room_px, top): (Range<f64>, f64),
        name: impl Fn(usize) -> (&'n str, RGBColor),
        is_important: impl Fn(usize) -> bool,
    ) -> DrawResult {
        for row in self.named(is_important) {
            let things = self.members(row);
            let (first, color) = name(things.start);
            let color = if self.per_row == 1 { color } else { INK };
            let letters = TextLabel::RIGHT.sized(11.0).colored(color);
            let room = room_px.end - room_px.start;
            let text = match things.len() {
                1 => first.to_owned(),
                _ => format!("{first} … {}", name(things.end - 1).0),
            };
            let text = match letters.width_px(&text) <= room || things.len() == 1 {
                true => letters.cut(&text, room),
                false => letters.cut(&format!("{first} …"), room),
            };
            let middle = top + (row as f64 + 0.5) * self.row_px;
            let (_, y) = chart.plotting_area().map_coordinate(&(0.0, middle));
            area.draw_text(&text, &letters.style(), (px(room_px.end), y))?;
        }
        Ok(())
    }
}

/// Returns, for each of `parts` equal parts of a window, s, the share covered by the spans, as a mean over all span
/// sets.
#[must_use]
pub fn shares<'s>(
    window: &Range<f64>,
    parts: usize,
    all: impl IntoIterator<Item = &'s Spans>,
) -> Vec<f64> {
    let length = (window.end - window.start) / parts as f64;
    let mut shares = vec![0.0; parts];
    let mut count = 0.0_f64;
    for spans in all {
        count += 1.0;
        for span in spans.iter() {
            let edge = |at: f64| ((at - window.start) / length).clamp(0.0, parts as f64);
            let (from, to) = (edge(span.from.as_secs_f64()), edge(span.to.as_secs_f64()));
            for (part, share) in shares
                .iter_mut()
                .enumerate()
                .take(to.ceil() as usize)
                .skip(from as usize)
            {
                *share += (to.min(part as f64 + 1.0) - from.max(part as f64)).max(0.0);
            }
        }
    }
    shares.iter().map(|share| share / count.max(1.0)).collect()
}

/// Draws a row of a heat map from values between 0 and 1 of equal parts of a window. Values above 0 are always visible.
pub fn heat(
    chart: &Chart<'_>,
    window: &Range<f64>,
    y: Range<f64>,
    color: RGBColor,
    values: &[f64],
) -> DrawResult {
    let length = (window.end - window.start) / values.len() as f64;
    let shade = |value: &f64| (value.clamp(0.0, 1.0) * SHADES).ceil();
    let mut from = 0;
    for same in values.chunk_by(|a, b| shade(a) == shade(b)) {
        let to = from + same.len();
        let x = window.start + from as f64 * length..window.start + to as f64 * length;
        if shade(&same[0]) > 0.0 {
            fill(chart, x, y.clone(), color, shade(&same[0]) / SHADES)?;
        }
        from = to;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use scenario::time::SimTime;

    use super::*;
    use observation::stints::Span;

    #[test]
    fn each_thing_has_its_own_row_while_rows_are_visible() {
        let few = Rows::fit(3, 1000.0);
        assert_eq!((few.per_row, few.height_px()), (1, 51.0));
        assert_eq!(few.extent(2), 34.0..51.0);
        let many = Rows::fit(250, 1000.0);
        assert_eq!((many.per_row, many.height_px()), (1, 1000.0));
        let crowd = Rows::fit(251, 1000.0);
        assert_eq!((crowd.per_row, crowd.len(), crowd.row_px), (3, 84, 10.0));
        assert_eq!(crowd.extent(250), 830.0..840.0);
        assert_eq!(crowd.members(83), 249..251);
        assert!(Rows::fit(1_000_000, 1000.0).height_px() <= 1000.0);
        assert_eq!(Rows::fit(0, 1000.0).len(), 0);
    }

    #[test]
    fn names_stand_apart_and_the_important_ones_come_first() {
        let rows = Rows::fit(200, 1000.0);
        // A name takes three rows of 5 px.
        assert_eq!(rows.named(|_| false)[..4], [0, 3, 6, 9]);
        assert_eq!(rows.named(|row| row == 2)[..4], [2, 5, 8, 11]);
        assert_eq!(Rows::fit(3, 1000.0).named(|_| false), [0, 1, 2]);
    }

    #[test]
    fn shares_of_a_window() {
        let spans = |from, to| {
            Spans::from_iter([Span {
                from: SimTime(from),
                to: SimTime(to),
            }])
        };
        let all = [spans(0, 15_000), spans(5_000, 40_000)];
        let window = 10.0..30.0;
        assert_eq!(shares(&window, 4, &all), [1.0, 0.5, 0.5, 0.5]);
        assert_eq!(shares(&window, 2, &all), [0.75, 0.5]);
        assert_eq!(shares(&window, 2, &[]), [0.0, 0.0]);
        // A span across the border of two parts.
        assert_eq!(shares(&window, 2, &[spans(19_999, 20_001)]).len(), 2);
    }
}
