//! The result of a search for one allocator, and of the test: tuned values against the defaults, in pairs with the same
//! seeds.

use super::task::{Allocator, Task};
use super::tuning::{Outcome, Tuned, mean, percent, ratios};
use crate::compare::statistics::LEVEL;
use crate::compare::statistics::bootstrap::means;
use crate::sweep::statistics::Interval;

/// The file name of the scenario with the best parameters.
pub const TUNED: &str = "tuned.toml";

pub struct AllocatorResult<'r> {
    pub allocator: &'r Allocator,
    pub tuned: &'r Tuned,
    pub chosen: usize,
    pub verdicts: [Vec<TestComparison>; 2],
}

impl AllocatorResult<'_> {
    /// Checks whether the tuned values are significantly better than the defaults on the test seeds. Otherwise the defaults are
    /// kept.
    #[must_use]
    pub fn is_better(&self) -> bool {
        self.verdicts[self.chosen][0].is_better()
    }
}

/// The comparison of tuned values with the defaults, under one or several conditions.
#[derive(Clone, Debug, PartialEq)]
pub struct TestComparison {
    pub condition: String,
    pub n: usize,
    /// The means of the metric with the defaults and with tuned values; `None` for several conditions.
    pub means: Option<(f64, f64)>,
    /// The mean difference, tuned less default, with its interval; `None` for several conditions.
    pub difference: Option<(f64, Interval)>,
    /// The change relative to the defaults, %, from the mean logarithm of the ratios, with its interval. Negative is better for
    /// every metric.
    pub percent: (f64, Interval),
    /// The change of the bytes relative to the defaults, %.
    pub bytes_percent: f64,
}

impl TestComparison {
    /// Checks whether the entire interval is on the better side.
    #[must_use]
    pub fn is_better(&self) -> bool {
        self.percent.1.1 < 0.0
    }
}

/// Returns the verdicts of a method's best candidate: over all seen conditions, over all unseen ones, and for each condition.
#[must_use]
pub fn verdicts(task: &Task, tuned: &Tuned, method: usize) -> Vec<TestComparison> {
    let (defaults, tuned) = (&tuned.test[0], &tuned.test[method + 1]);
    let groups = [
        ("all seen conditions", false),
        ("all unseen conditions", true),
    ];
    let mut all = Vec::new();
    for (what, is_unseen) in groups {
        let places: Vec<usize> = (0..task.conditions.len())
            .filter(|place| task.conditions[*place].is_unseen == is_unseen)
            .collect();
        if !places.is_empty() {
            all.push(verdict(task, what, &places, defaults, tuned));
        }
    }
    for (place, condition) in task.conditions.iter().enumerate() {
        all.push(verdict(task, &condition.name, &[place], defaults, tuned));
    }
    all
}

fn verdict(
    task: &Task,
    condition: &str,
    places: &[usize],
    defaults: &[Vec<Outcome>],
    tuned: &[Vec<Outcome>],
) -> TestComparison {
    let seeds = task.tuning.test.0.len();
    // Conditions have equal weight: each seed counts with the mean over them.
    let by_seed = |of: fn((f64, f64)) -> f64| -> Vec<f64> {
        let of_seed = |seed: usize| {
            let each = places.iter();
            mean(each.map(|place| of(ratios(task, tuned[*place][seed], defaults[*place][seed]))))
        };
        (0..seeds).map(of_seed).collect()
    };
    let logs = by_seed(|ratio| ratio.0);
    let (log, (from, to)) = with_interval(&logs);
    let alone = match places {
        [place] => Some(*place),
        _ => None,
    };
    let pairs = alone.map(|place| {
        let both = defaults[place].iter().zip(&tuned[place]);
        both.filter_map(|(defaults, tuned)| Some((defaults.value?, tuned.value?)))
            .collect::<Vec<(f64, f64)>>()
    });
    let pairs = pairs.filter(|pairs| !pairs.is_empty());
    TestComparison {
        condition: condition.to_owned(),
        n: seeds,
        means: pairs.as_ref().map(|pairs| {
            let mean = |of: fn(&(f64, f64)) -> f64| mean(pairs.iter().map(of));
            (mean(|pair| pair.0), mean(|pair| pair.1))
        }),
        difference: pairs.map(|pairs| {
            let each = pairs.iter().map(|(defaults, tuned)| tuned - defaults);
            with_interval(&each.collect::<Vec<_>>())
        }),
        percent: (percent(log), (percent(from), percent(to))),
        bytes_percent: percent(mean(by_seed(|ratio| ratio.1).into_iter())),
    }
}

fn with_interval(values: &[f64]) -> (f64, Interval) {
    let found = mean(values.iter().copied());
    let interval = means(&[values])[0].interval(LEVEL);
    (found, interval.unwrap_or((found, found)))
}
