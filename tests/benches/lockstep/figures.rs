//! The values of one quantity from several runs.

use std::fmt;

#[derive(Clone, Debug, Default)]
pub struct Figures(Vec<f64>);

impl Figures {
    pub fn push(&mut self, value: f64) {
        self.0.push(value);
        self.0.sort_by(f64::total_cmp);
    }
}

/// Prints the median and, in brackets, the smallest and the largest value.
impl fmt::Display for Figures {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (Some(least), Some(most)) = (self.0.first(), self.0.last()) else {
            return f.pad("-");
        };
        let (low, high) = ((self.0.len() - 1) / 2, self.0.len() / 2);
        let median = f64::midpoint(self.0[low], self.0[high]);
        let digits = if median < 100.0 { 2 } else { 0 };
        f.pad(&format!(
            "{median:.digits$} [{least:.digits$} .. {most:.digits$}]"
        ))
    }
}

/// Prints a table with a line for each quantity.
pub fn print<'f>(lines: impl IntoIterator<Item = (String, &'f Figures)>) {
    println!("| | median [least .. most] |\n|---|---|");
    for (label, figures) in lines {
        println!("| {label} | {figures} |");
    }
}
