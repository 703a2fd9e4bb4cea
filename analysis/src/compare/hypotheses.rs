//! Hypotheses of a plan: checked before the first run, judged after the last one.
//!
//! A hypothesis makes a claim about each block and allocator that it names: its *parts*. A part is judged by the mean over the
//! seeds and its bootstrap interval, or Wilson's interval for completion.
//!
//! The hypothesis has held if each part's 95 % interval lies within the claim. It has failed if some part's interval, at a
//! level corrected for the number of parts, lies outside. Otherwise it is undecided.

use std::collections::BTreeSet;

use scenario::Problem;
use scenario::limits::check_known;

use super::data::{Block, ComparisonData};
use super::metrics::Metric;
use super::statistics::bootstrap::{Resampled, means};
use super::statistics::{LEVEL, normal_reach};
use crate::sweep::plan::hypothesis::{Claim, Hypothesis};
use crate::sweep::statistics::{Interval, mean, wilson_at};

/// The outcome of a hypothesis, or of a part of it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Outcome {
    /// The data confirm the claim.
    Held,
    /// The data contradict the claim.
    Failed,
    /// The data are insufficient.
    Undecided,
}

impl Outcome {
    #[must_use]
    pub fn as_str(self) -> &'static str {
        match self {
            Self::Held => "held",
            Self::Failed => "failed",
            Self::Undecided => "undecided",
        }
    }
}

/// The outcome of a hypothesis with its parts.
#[derive(Clone, Debug, PartialEq)]
pub struct Verdict {
    pub name: String,
    pub claim: String,
    pub outcome: Outcome,
    pub parts: Vec<PartVerdict>,
}

/// A hypothesis' claim about one block.
#[derive(Clone, Debug, PartialEq)]
pub struct PartVerdict {
    pub block: usize,
    /// The claim in short form.
    pub claim: String,
    /// The mean with its interval; `None` without data.
    pub found: Option<(f64, Interval)>,
    pub outcome: Outcome,
}

/// The values of a part and their claimed bounds.
struct Claimed {
    block: usize,
    claim: String,
    values: Vec<f64>,
    /// True if the seed has no effect: the only value is exact.
    is_exact: bool,
    /// True for values of 0 and 1. If all are equal, bootstrap samples are not informative.
    is_share: bool,
    at_least: f64,
    at_most: f64,
}

impl Claimed {
    /// Judges the part. `corrected` is the level of the interval that contradicts the claim.
    fn judge(&self, resampled: &Resampled, corrected: f64) -> PartVerdict {
        let count = self.values.len();
        let interval = |level: f64| {
            if self.is_share && !self.is_exact {
                let hits = self.values.iter().sum::<f64>() as usize;
                (count > 0).then(|| wilson_at(hits, count, normal_reach(level)))
            } else {
                resampled.interval(level)
            }
        };
        let found = mean(&self.values).zip(interval(LEVEL));
        let within = |(from, to): Interval| self.at_least <= from && to <= self.at_most;
        let outside = |(from, to): Interval| to < self.at_least || self.at_most < from;
        let is_anecdote = count < 2 && !self.is_exact;
        let outcome = if is_anecdote {
            Outcome::Undecided
        } else if found.is_some_and(|(_, interval)| within(interval)) {
            Outcome::Held
        } else if interval(corrected).is_some_and(outside) {
            Outcome::Failed
        } else {
            Outcome::Undecided
        };
        PartVerdict {
            block: self.block,
            claim: self.claim.clone(),
            found,
            outcome,
        }
    }
}

/// Checks the names and the form of all hypotheses.
///
/// # Errors
/// Returns the first mistake: line, problem and remedy.
pub fn check(hypotheses: &[Hypothesis], data: &ComparisonData) -> Result<(), Problem> {
    let (mut missions, mut classes) = (data.missions(), data.classes());
    for names in [&mut missions, &mut classes] {
        // A single mission or class has an empty name.
        names.retain(|name| !name.is_empty());
    }
    let allocators: Vec<&str> = data.allocators.iter().map(String::as_str).collect();
    for Hypothesis { name, line, claim } in hypotheses {
        let checked = check_claim(claim, data, &allocators, &missions, &classes);
        checked.map_err(|problem| problem.under(["hypotheses", name]).on_line(*line))?;
    }
    Ok(())
}

/// Checks the names and the form of a claim.
fn check_claim(
    claim: &Claim,
    data: &ComparisonData,
    allocators: &[&str],
    missions: &[&str],
    classes: &[&str],
) -> Result<(), Problem> {
    let problem = |what: &str, remedy: &str| Err(Problem::of_value(what, remedy));
    let metrics: Vec<String> = data.metrics.iter().map(Metric::name).collect();
    let metrics: Vec<&str> = metrics.iter().map(String::as_str).collect();
    let one = |name: &Option<String>| -> Vec<String> { name.iter().cloned().collect() };
    let names = [
        ("there is no allocator", &claim.order, allocators),
        ("there is no allocator", &claim.allocators, allocators),
        ("there is no mission", &claim.missions, missions),
        ("there is no class of faults", &claim.faults, classes),
        (
            "there is no class of faults",
            &one(&claim.more_than_under),
            classes,
        ),
        ("there is no metric", &one(&claim.metric), &metrics[..]),
    ];
    for (what, stated, known) in names {
        for name in stated {
            check_known((), what, name, known.iter().copied())?;
        }
    }
    let forms = [
        !claim.order.is_empty(),
        claim.at_most.is_some(),
        claim.at_least.is_some(),
    ];
    if forms.iter().filter(|stated| **stated).count() != 1 {
        let remedy = "state one of order, at_most and at_least";
        return problem("a hypothesis needs exactly one claim", remedy);
    }
    let about = data.blocks.iter().filter(|block| is_about(claim, block));
    let primary: BTreeSet<&Metric> = about.map(|block| &block.primary).collect();
    if claim.metric.is_none() && claim.order.is_empty() && primary.len() > 1 {
        let names: Vec<String> = primary.iter().map(|metric| metric.name()).collect();
        let what = format!(
            "the bound has no unit, because the missions are ranked by {}",
            names.join(" and ")
        );
        return problem(&what, "state metric");
    }
    if claim.order.len() == 1 {
        let remedy = "name two or more, in ascending order";
        return problem("order names one allocator", remedy);
    }
    let is_bound = !claim.allocators.is_empty() || claim.more_than_under.is_some();
    if !claim.order.is_empty() && is_bound {
        return problem(
            "order excludes allocators and more_than_under",
            "remove them",
        );
    }
    Ok(())
}

#[must_use]
pub fn judge(data: &ComparisonData, hypotheses: &[Hypothesis]) -> Vec<Verdict> {
    let verdicts = hypotheses.iter().map(|hypothesis| {
        let claim = &hypothesis.claim;
        let claimed = claimed(data, claim);
        let columns: Vec<&[f64]> = claimed.iter().map(|part| &part.values[..]).collect();
        let corrected = 1.0 - (1.0 - LEVEL) / claimed.len().max(1) as f64;
        let resampled = means(&columns);
        let parts = claimed.iter().zip(&resampled);
        let parts: Vec<PartVerdict> = parts
            .map(|(claimed, resampled)| claimed.judge(resampled, corrected))
            .collect();
        let any = |outcome| parts.iter().any(|part| part.outcome == outcome);
        Verdict {
            name: hypothesis.name.clone(),
            claim: claim.says.clone(),
            outcome: if any(Outcome::Failed) {
                Outcome::Failed
            } else if any(Outcome::Undecided) || parts.is_empty() {
                Outcome::Undecided
            } else {
                Outcome::Held
            },
            parts,
        }
    });
    verdicts.collect()
}

/// Returns the metric of a claim about a block: by default the primary metric of the block's mission.
fn claimed_metric<'d>(data: &'d ComparisonData, block: &'d Block, claim: &Claim) -> &'d Metric {
    let stated = claim.metric.as_deref();
    let mut metrics = data.metrics.iter();
    let found = metrics.find(|metric| Some(metric.name().as_str()) == stated);
    found.unwrap_or(&block.primary)
}

/// Checks whether a list contains a name. An empty list contains all names.
fn is_named(names: &[String], wanted: &str) -> bool {
    names.is_empty() || names.iter().any(|name| name == wanted)
}

/// Checks whether a claim is about a block.
fn is_about(claim: &Claim, block: &Block) -> bool {
    is_named(&claim.missions, &block.mission) && is_named(&claim.faults, &block.faults)
}

fn claimed(data: &ComparisonData, claim: &Claim) -> Vec<Claimed> {
    let allocator = |name: &String| data.allocators.iter().position(|known| known == name);
    let mut parts = Vec::new();
    for (number, block) in data.blocks.iter().enumerate() {
        if !is_about(claim, block) {
            continue;
        }
        let metric = claimed_metric(data, block, claim);
        let (place, name) = (data.metric_index(metric), metric.name());
        // Without a stated metric, an order begins with the best allocator.
        let descends = claim.metric.is_none() && metric.more_is_better();
        let sign = if descends { -1.0 } else { 1.0 };
        for pair in claim.order.windows(2) {
            let (Some(first), Some(second)) = (allocator(&pair[0]), allocator(&pair[1])) else {
                continue;
            };
            let (first, second) = (&block.cells[first], &block.cells[second]);
            let is_exact = first.is_constant && second.is_constant;
            let (less, more) = first.paired(second, place);
            // Equal values do not confirm an order.
            let differences = metric.differences(&more, &less).into_iter();
            let than = ["<", ">"][usize::from(descends)];
            parts.push(Claimed {
                block: number,
                claim: format!("{name}: {} {than} {}", pair[0], pair[1]),
                values: differences
                    .map(|difference| sign * difference / metric.steps_per_unit())
                    .collect(),
                is_exact,
                is_share: false,
                at_least: f64::MIN_POSITIVE,
                at_most: f64::INFINITY,
            });
        }
        if !claim.order.is_empty() {
            continue;
        }
        let class = claim.more_than_under.as_ref();
        let other = class.map(|class| same_under(data, block, class));
        for (rival, cell) in data.allocators.iter().zip(0..) {
            if !is_named(&claim.allocators, rival) {
                continue;
            }
            let own = &block.cells[cell];
            let (values, is_exact) = match other {
                None => (own.values_of(place), own.is_constant),
                Some(None) => (Vec::new(), false),
                Some(Some(other)) => {
                    let other = &other.cells[cell];
                    let (base, values) = other.paired(own, place);
                    let differences = metric.differences(&values, &base).into_iter();
                    let values = differences.map(|difference| difference / metric.steps_per_unit());
                    (values.collect(), own.is_constant && other.is_constant)
                }
            };
            let (sign, bound) = match (claim.at_most, claim.at_least) {
                (Some(bound), _) => ("≤", bound),
                (None, bound) => ("≥", bound.unwrap_or(f64::NEG_INFINITY)),
            };
            let than = claim.more_than_under.iter();
            let than: String = than
                .map(|class| format!(" more than under {class}"))
                .collect();
            parts.push(Claimed {
                block: number,
                claim: format!("{name} of {rival} {sign} {bound}{than}"),
                values,
                is_exact,
                is_share: *metric == Metric::Completion && other.is_none(),
                at_least: claim.at_least.unwrap_or(f64::NEG_INFINITY),
                at_most: claim.at_most.unwrap_or(f64::INFINITY),
            });
        }
    }
    parts
}

/// Returns the block with the same mission under another class of faults.
fn same_under<'d>(data: &'d ComparisonData, block: &Block, class: &str) -> Option<&'d Block> {
    let mut blocks = data.blocks.iter();
    blocks.find(|other| other.mission == block.mission && other.faults == class)
}

#[cfg(test)]
mod tests {
    use super::super::data::tests::{data, data_with, far_by, own};
    use super::*;

    fn judged(data: &ComparisonData, claim: Claim) -> Verdict {
        let hypothesis = Hypothesis {
            name: "h".to_owned(),
            line: 1,
            claim,
        };
        judge(data, &[hypothesis]).remove(0)
    }

    fn names(names: &[&str]) -> Vec<String> {
        names.iter().map(|name| (*name).to_owned()).collect()
    }

    /// Creates data in which alliance needs a little over 40 s and nearest 50 s. With a dead robot, alliance needs 10 s more
    /// and nearest rarely completes.
    fn sample() -> ComparisonData {
        data(
            |block, rival, seed| {
                let bit = (seed * 7 % 5) as f64;
                let is_dead = block % 2 == 1;
                Some(match rival {
                    0 => 40.0 + bit + if is_dead { 10.0 } else { 0.0 },
                    1 => 30.0,
                    _ if is_dead && seed < 18 => -1.0,
                    _ => 50.0 - bit,
                })
            },
            20,
        )
    }

    #[test]
    fn an_order_holds_if_values_ascend() {
        let order = |order: &[&str], faults: &[&str]| {
            let claim = Claim {
                order: names(order),
                faults: names(faults),
                ..Claim::default()
            };
            judged(&sample(), claim)
        };
        let held = order(&["oracle", "alliance", "nearest"], &["none"]);
        assert_eq!(held.outcome, Outcome::Held);
        // Two missions with two pairs each.
        assert_eq!(held.parts.len(), 4);
        assert_eq!(held.parts[0].claim, "par2_s: oracle < alliance");
        assert_eq!(held.parts[0].found.unwrap().0, 12.0);
        let turned = order(&["nearest", "alliance"], &[]);
        assert_eq!(turned.outcome, Outcome::Failed);
        // An allocator compared with itself has neither less nor more.
        let same = order(&["oracle", "oracle"], &["none"]);
        assert_eq!(same.outcome, Outcome::Failed);
    }

    #[test]
    fn bounds_of_means_and_of_differences_to_a_baseline() {
        let bound = |claim: Claim| judged(&sample(), claim).outcome;
        let completion = |name: &str, at_least: f64| Claim {
            metric: Some("completion".to_owned()),
            allocators: names(&[name]),
            faults: names(&["dead"]),
            at_least: Some(at_least),
            ..Claim::default()
        };
        assert_eq!(bound(completion("nearest", 0.5)), Outcome::Failed);
        // 20 of 20 are at least 83.9 %, by Wilson.
        assert_eq!(bound(completion("alliance", 0.83)), Outcome::Held);
        assert_eq!(bound(completion("alliance", 0.85)), Outcome::Undecided);
        let more = |at_most: f64| Claim {
            allocators: names(&["alliance"]),
            faults: names(&["dead"]),
            more_than_under: Some("none".to_owned()),
            at_most: Some(at_most),
            ..Claim::default()
        };
        assert_eq!(bound(more(10.0)), Outcome::Held);
        assert_eq!(bound(more(9.9)), Outcome::Failed);
        let nowhere = Claim {
            missions: names(&["nowhere"]),
            ..more(10.0)
        };
        assert_eq!(bound(nowhere), Outcome::Undecided);
    }

    /// A seed without effect gives one exact value, and a single run with chance decides nothing.
    #[test]
    fn equal_runs_are_exact_and_a_single_run_is_an_anecdote() {
        let claim = || Claim {
            metric: Some("completion".to_owned()),
            allocators: names(&["oracle"]),
            at_least: Some(1.0),
            ..Claim::default()
        };
        let outcome = |seeds: usize| {
            let data = data(|_, _, _| Some(30.0), seeds);
            judged(&data, claim()).outcome
        };
        assert_eq!(outcome(2), Outcome::Held);
        assert_eq!(outcome(1), Outcome::Undecided);
    }

    /// Without a metric, an order begins with the best allocator by the mission's own measure.
    #[test]
    fn an_order_without_a_metric_uses_the_primary_metric() {
        let comparison = far_by(&own("late", "report_lateness_mean_ms"));
        let data = data_with(|_, rival, _| Some(30.0 + rival as f64), 2, &comparison);
        let claim = Claim {
            order: names(&["alliance", "oracle"]),
            ..Claim::default()
        };
        let verdict = judged(&data, claim);
        let [_, time, late, _] = &verdict.parts[..] else {
            panic!("{verdict:?}")
        };
        assert_eq!(time.claim, "par2_s: alliance < oracle");
        assert_eq!(late.claim, "late: alliance > oracle");
        // All runs have the same lateness.
        assert_eq!(
            [time.outcome, late.outcome],
            [Outcome::Held, Outcome::Failed]
        );
        let bound = |metric: Option<&str>| Hypothesis {
            name: "h".to_owned(),
            line: 3,
            claim: Claim {
                metric: metric.map(str::to_owned),
                at_most: Some(1.0),
                ..Claim::default()
            },
        };
        let error = check(&[bound(None)], &data).unwrap_err().to_string();
        assert!(
            error.ends_with("the missions are ranked by par2_s and late; state metric"),
            "{error}"
        );
        assert!(check(&[bound(Some("late"))], &data).is_ok());
    }

    #[test]
    fn many_parts_need_a_corrected_level_to_fail() {
        // The interval of alliance's mean starts at 51.06 at 95 %, and at 50.88 at the corrected level for 4 parts.
        let noisy = data(
            |_, rival, seed| {
                Some(if rival == 0 {
                    50.0 + (seed * 37 % 101) as f64 / 25.0
                } else {
                    50.0
                })
            },
            12,
        );
        let claim = |missions: &[&str], faults: &[&str]| Claim {
            allocators: names(&["alliance"]),
            missions: names(missions),
            faults: names(faults),
            at_most: Some(51.0),
            ..Claim::default()
        };
        let alone = judged(&noisy, claim(&["near"], &["none"]));
        let together = judged(&noisy, claim(&[], &[]));
        assert_eq!((alone.parts.len(), together.parts.len()), (1, 4));
        assert_eq!(alone.parts[0].found, together.parts[0].found);
        assert_eq!(alone.outcome, Outcome::Failed);
        assert_eq!(together.outcome, Outcome::Undecided);
    }
}
