//! The runs of one allocator in a block.

use super::metrics::Metric;
use crate::sweep::results::figures_of;
use crate::sweep::run::{Figures, Row};

/// The runs of an allocator in a block; they differ only in the seed.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct AllocatorCell {
    /// The cell's number, for the option --cell.
    pub number: usize,
    pub runs: usize,
    pub failed: usize,
    pub without_effect: usize,
    /// True if all runs have equal values: the seed has no effect, so the runs count as one.
    pub is_constant: bool,
    /// Values of the counted runs by metric and seed; `None` for a missing value.
    pub values: Vec<Vec<Option<f64>>>,
}

impl AllocatorCell {
    #[must_use]
    pub fn counted(&self) -> usize {
        self.runs - self.failed - self.without_effect
    }

    /// Returns the existing values of a metric: one value if the seed has no effect.
    #[must_use]
    pub fn values_of(&self, metric: usize) -> Vec<f64> {
        let most = if self.is_constant { 1 } else { usize::MAX };
        let values_of = self.values[metric].iter().flatten().copied();
        values_of.take(most).collect()
    }

    /// Returns the values of both cells for the seeds that both have: one pair if the seed has no effect on either.
    #[must_use]
    pub fn paired(&self, other: &Self, metric: usize) -> (Vec<f64>, Vec<f64>) {
        let are_constant = self.is_constant && other.is_constant;
        let most = if are_constant { 1 } else { usize::MAX };
        let both = self.values[metric].iter().zip(&other.values[metric]);
        let both = both.filter_map(|(first, second)| Some(((*first)?, (*second)?)));
        both.take(most).unzip()
    }

    /// Adds the run with the seed of this index.
    pub fn add(&mut self, metrics: &[Metric], row: &Row, seed: usize) {
        self.runs += 1;
        let Some(figures) = figures_of(row) else {
            self.failed += 1;
            return;
        };
        if !is_hit(figures) {
            self.without_effect += 1;
            return;
        }
        if let Some(measures) = &figures.measures {
            for (values, metric) in self.values.iter_mut().zip(metrics) {
                values[seed] = metric.of(figures, measures);
            }
        }
    }

    /// Sets [`is_constant`](Self::is_constant) after all runs are added.
    pub fn find_constant(&mut self) {
        let are_equal = |values: &Vec<Option<f64>>| values.iter().all(|value| *value == values[0]);
        self.is_constant =
            self.runs > 1 && self.counted() == self.runs && self.values.iter().all(are_equal);
    }
}

/// Checks whether a run has no faults, or at least one of them had an effect.
fn is_hit(figures: &Figures) -> bool {
    let faults = figures.all_faults();
    faults.armed == 0 || faults.hit > 0
}
