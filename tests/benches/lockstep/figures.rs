//! The median and the spread of measurements.

use std::fmt;

/// The values of one quantity from several runs.
#[derive(Clone, Debug, Default)]
pub struct Figures(Vec<f64>);

impl Figures {
    pub fn push(&mut self, value: f64) {
        self.0.push(value);
        self.0.sort_by(f64::total_cmp);
    }

    /// Returns the middle value, or the mean of the two middle values.
    pub fn median(&self) -> f64 {
        let middle = self.0.len() / 2;
        match (self.0.len().is_multiple_of(2), middle.checked_sub(1)) {
            (true, None) => f64::NAN,
            (true, Some(before)) => f64::midpoint(self.0[before], self.0[middle]),
            (false, _) => self.0[middle],
        }
    }
}

/// Prints the median and, in brackets, the smallest and the largest value.
impl fmt::Display for Figures {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (Some(least), Some(most)) = (self.0.first(), self.0.last()) else {
            return f.pad("-");
        };
        let digits = if self.median() < 100.0 { 2 } else { 0 };
        let text = format!(
            "{:.digits$} [{least:.digits$} .. {most:.digits$}]",
            self.median()
        );
        f.pad(&text)
    }
}
