//! What service promises, from the logs of whole runs (docs/missions/service.md).

use std::collections::{BTreeMap, BTreeSet};

use alliance_proto::fault::{Fault, Order};
use alliance_proto::log::{EventRow, LogLevel};
use alliance_proto::scenario::{Scenario, Setup};
use alliance_proto::tick::Outcome;
use missions::Registry;
use missions::service::data::ServiceSection;

use crate::in_process::run;
use crate::recompute::log_of;

/// Who can do what in `janitorial`, by kind.
const ABLE: [(&str, [&str; 2]); 3] = [
    ("garbage", ["gold", "green"]),
    ("dust", ["gold", "blue"]),
    ("floor", ["blue", "green"]),
];

fn janitorial() -> Scenario {
    let vocabulary = Registry::built_in().vocabulary();
    let builtin = vocabulary.builtin("janitorial").unwrap();
    Scenario::parse(builtin.name, builtin.text, &vocabulary).unwrap()
}

/// The kind of a point, by its name.
fn kind_of(scenario: &Scenario, point: &str) -> String {
    let section = ServiceSection::of(scenario);
    let number: usize = point.trim_start_matches('p').parse().unwrap();
    let kind = section.kind_of_each().nth(number).unwrap();
    section.kinds[kind].name.clone()
}

fn events(scenario: &Scenario, expected: Outcome) -> Vec<EventRow> {
    let setup = Setup::resolve(scenario.clone(), 1, None).unwrap().setup;
    let (outcome, recorder) = run(setup, LogLevel::Full);
    assert_eq!(outcome, expected);
    log_of(recorder).rows().unwrap()
}

/// Every point that arrived is done before it comes back, by a robot that can, and nobody begins what it cannot do.
fn check(scenario: &Scenario, events: &[EventRow]) {
    let mut open = BTreeSet::new();
    let mut done = BTreeMap::new();
    for event in events {
        let point = event.subject.as_str();
        match event.kind.as_str() {
            "arrived" => assert!(open.insert(point), "{point} arrives once a period"),
            "begun" | "done" => {
                let kind = kind_of(scenario, point);
                let able = ABLE.iter().find(|(name, _)| *name == kind).unwrap().1;
                assert!(able.contains(&event.robot.as_str()), "{event:?}");
                if event.kind == "done" {
                    assert!(open.remove(point), "{event:?}: it was open");
                    *done.entry(kind).or_insert(0) += 1;
                }
            }
            "expired" => panic!("{event:?}: it was to be done in its period"),
            _ => {}
        }
    }
    assert!(open.is_empty(), "{open:?} are left");
    // In 1,200 s: 3 points each 150 s, 4 each 200 s, 2 each 300 s.
    let expected = [("dust", 24), ("floor", 8), ("garbage", 24)];
    let expected = expected.map(|(kind, count)| (kind.to_owned(), count));
    assert_eq!(done, BTreeMap::from(expected));
}

#[test]
fn each_kind_of_work_is_done_in_every_period() {
    let scenario = janitorial();
    check(&scenario, &events(&scenario, Outcome::Complete));
}

/// Whoever is killed, others are able, and go on with all of its work.
#[test]
fn whoever_is_able_takes_over_from_the_dead() {
    for dead in ["gold", "blue", "green"] {
        let mut scenario = janitorial();
        scenario.faults.timeline.push(Order {
            at_s: Some(300.0),
            ..Order::now(Fault::Kill(dead.to_owned()))
        });
        let events = events(&scenario, Outcome::Complete);
        check(&scenario, &events);
        let late = events
            .iter()
            .filter(|event| event.t_ms.as_secs_f64() > 300.1);
        let late: BTreeSet<&str> = late
            .filter(|event| event.kind == "begun")
            .map(|event| event.robot.as_str())
            .collect();
        assert_eq!(late.len(), 2, "{late:?} work after {dead}'s death");
        assert!(!late.contains(dead));
    }
}
