//! Comparisons of whole runs in which time and completion are constants.

use std::num::NonZeroUsize;

use super::analysis::Analysis;
use super::answer::{Answer, answer};
use super::command::prepare;
use super::data::ComparisonData;
use super::metrics::Metric;
use crate::sweep::plan::Plan;
use crate::sweep::run::execute_run;
use crate::testkit::scenario;

/// Foraging: items come back, and each run takes the whole duration.
const FORAGING: &str = "
limit_s = 90.0
room = { width_m = 6.0, height_m = 5.0 }
robots = [{ name = 'a' }, { name = 'b' }]
[waste]
respawn = true
duration_s = 90.0
border_known = true
spills = [{ name = 'food', items = 5 }, { name = 'more', items = 5, y_fraction = 0.8 }]
";

/// More points than two robots can serve before they expire.
const EXPIRING: &str = "
limit_s = 150.0
room = { width_m = 8.0, height_m = 8.0 }
robots = [{ name = 'a' }, { name = 'b' }]
[service]
[[service.kinds]]
name = 't'
work_s = { min = 5.0, max = 5.0 }
deadline_s = { min = 30.0, max = 30.0 }
[[service.random]]
n = 30
rate_hz = 0.4
";

/// Runs a plan with six seeds, the least number for two allocators.
fn compare(mission: &str, text: &str, allocators: [&str; 2]) -> (ComparisonData, Answer) {
    let text = format!(
        "seeds = 6\n[grid]\nallocator = {allocators:?}\n[missions.m]\nscenario = 'm'\n{text}"
    );
    let plan = Plan::parse("plan.toml", &text, |_| Ok(scenario(mission)));
    let mut plan = plan.unwrap();
    let comparison = prepare(&mut plan, NonZeroUsize::MIN).unwrap().unwrap();
    let runs = 0..plan.design.runs().unwrap();
    let rows: Vec<_> = runs
        .map(|run| execute_run(&plan, run, &|| false).unwrap())
        .collect();
    let data = ComparisonData::of(&plan.design, &comparison, &rows);
    let analysis = Analysis::new(&data, NonZeroUsize::MIN);
    let answer = answer(&data, &analysis, &[]);
    (data, answer)
}

#[test]
fn foraging_is_compared_by_its_rate() {
    let (data, found) = compare(FORAGING, "", ["nearest", "static"]);
    assert_eq!(data.blocks[0].primary.name(), "items_per_hour");
    assert!(data.are_equal(0, &Metric::Par2) && data.are_equal(0, &Metric::Completion));
    let [best, completion, significance] = &found.sentences[..] else {
        panic!("{found:?}")
    };
    assert!(
        best.starts_with("Best: in m static (items_per_hour "),
        "{best}"
    );
    assert!(best.ends_with("; all others are worse)."), "{best}");
    assert_eq!(
        completion,
        "Every counted run lasted 90 s, so completion and time show no difference."
    );
    assert_eq!(
        significance,
        "In 1 of 1 block some allocator is significantly worse than the best."
    );
}

#[test]
fn expiring_work_is_compared_by_the_amount_that_is_done() {
    let (data, found) = compare(EXPIRING, "", ["threshold", "cbba"]);
    assert_eq!(data.blocks[0].primary, Metric::Done);
    let [best, completion, significance] = &found.sentences[..] else {
        panic!("{found:?}")
    };
    assert!(best.starts_with("Best: in m cbba (done "), "{best}");
    assert!(best.ends_with("; all others are worse)."), "{best}");
    assert_eq!(
        completion,
        "12 of 12 counted runs did not complete their mission, 6 of them with threshold."
    );
    assert_eq!(
        significance,
        "In 1 of 1 block some allocator is significantly worse than the best."
    );
}

/// The plan can state PAR2. All runs count twice the limit by it, which is no equality.
#[test]
fn a_saturated_metric_names_the_one_that_decides() {
    let (data, found) = compare(EXPIRING, "metric = 'par2_s'\n", ["threshold", "cbba"]);
    assert_eq!(data.blocks[0].primary, Metric::Par2);
    assert_eq!(data.mean(0, 0, &Metric::Par2), Some(300.0));
    assert_eq!(data.deciding(0), Some(&Metric::Done));
    assert_eq!(
        found.sentences[2],
        "In 1 of 1 block some allocator is significantly worse than the best. \
         In 1 block par2_s is the same for all, but done differs."
    );
}
