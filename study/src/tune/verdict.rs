//! What the test says: tuned against the defaults, in pairs with the same seeds.

use super::task::Task;
use super::tuning::{Outcome, Tuned, mean, percent, ratios};
use crate::compare::statistics::bootstrap::means;
use crate::sweep::statistics::Interval;

/// Of all intervals.
const LEVEL: f64 = 0.95;

/// Tuned against the defaults, under a condition or several.
#[derive(Clone, Debug, PartialEq)]
pub struct Verdict {
    /// Of which conditions.
    pub what: String,
    /// Seeds.
    pub n: usize,
    /// Means of the metric: of the defaults, and tuned. Of several conditions none.
    pub means: Option<(f64, f64)>,
    /// Mean of the differences, tuned less default, with its interval; likewise.
    pub difference: Option<(f64, Interval)>,
    /// How much more or less it is than with the defaults, %, by the mean logarithm of the ratios, with its interval; negative is
    /// better, also of a metric of which more is better.
    pub percent: (f64, Interval),
    /// Likewise of the bytes, %.
    pub bytes_percent: f64,
}

impl Verdict {
    /// Whether the whole interval is on the good side.
    #[must_use]
    pub fn is_better(&self) -> bool {
        self.percent.1.1 < 0.0
    }
}

/// All classes that the search had, all that it had not, and each condition by itself, of a method's best.
#[must_use]
pub fn verdicts(task: &Task, tuned: &Tuned, method: usize) -> Vec<Verdict> {
    let (defaults, own) = (&tuned.test[0], &tuned.test[method + 1]);
    let groups = [
        ("all that the search had", false),
        ("all that it had not", true),
    ];
    let mut all = Vec::new();
    for (what, is_unseen) in groups {
        let places: Vec<usize> = (0..task.conditions.len())
            .filter(|place| task.conditions[*place].is_unseen == is_unseen)
            .collect();
        if !places.is_empty() {
            all.push(verdict(task, what, &places, defaults, own));
        }
    }
    for (place, condition) in task.conditions.iter().enumerate() {
        all.push(verdict(task, &condition.name, &[place], defaults, own));
    }
    all
}

fn verdict(
    task: &Task,
    what: &str,
    places: &[usize],
    defaults: &[Vec<Outcome>],
    own: &[Vec<Outcome>],
) -> Verdict {
    let seeds = task.tuning.test.0.len();
    // Classes weigh the same: of each seed the mean over them.
    let by_seed = |of: fn((f64, f64)) -> f64| -> Vec<f64> {
        let of_seed = |seed: usize| {
            let each = places.iter();
            mean(each.map(|place| of(ratios(task, own[*place][seed], defaults[*place][seed]))))
        };
        (0..seeds).map(of_seed).collect()
    };
    let logs = by_seed(|it| it.0);
    let (log, (from, to)) = with_interval(&logs);
    let alone = match places {
        [place] => Some(*place),
        _ => None,
    };
    let pairs = alone.map(|place| {
        let both = defaults[place].iter().zip(&own[place]);
        both.filter_map(|(defaults, own)| Some((defaults.value?, own.value?)))
            .collect::<Vec<(f64, f64)>>()
    });
    let pairs = pairs.filter(|pairs| !pairs.is_empty());
    Verdict {
        what: what.to_owned(),
        n: seeds,
        means: pairs.as_ref().map(|pairs| {
            let each = pairs.iter();
            (mean(each.clone().map(|it| it.0)), mean(each.map(|it| it.1)))
        }),
        difference: pairs.map(|pairs| {
            let each: Vec<f64> = pairs.iter().map(|(defaults, own)| own - defaults).collect();
            with_interval(&each)
        }),
        percent: (percent(log), (percent(from), percent(to))),
        bytes_percent: percent(mean(by_seed(|it| it.1).into_iter())),
    }
}

/// The mean with the interval of the bootstrap.
fn with_interval(values: &[f64]) -> (f64, Interval) {
    let found = mean(values.iter().copied());
    let resampled = means(&[values]);
    let interval = resampled.first().and_then(|it| it.interval(LEVEL));
    (found, interval.unwrap_or((found, found)))
}
