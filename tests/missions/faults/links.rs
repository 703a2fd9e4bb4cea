//! Link faults: messages are lost, delayed, duplicated, reordered or cut, and the mission completes.

use alliance_tests::runs::Events;
use proto::tick::Outcome;
use run_log::{MessageRow, RunLog};

use super::{assert_exclusive_from, at, healing_bound_s, hit, mission};

fn with_delivery(log: &RunLog, delivery: &str) -> Vec<MessageRow> {
    let mut rows = log.rows::<MessageRow>().unwrap();
    rows.retain(|row| row.delivery == delivery);
    rows
}

#[test]
fn the_mission_completes_with_delayed_duplicated_and_reordered_messages() {
    let scenario = r#"
        [faults]
        timeline = [
            { id = "late", fault.delay = { delay_s = 0.5, jitter_s = 1.5 } },
            { id = "twice", fault.duplicate = { p = 0.3 } },
            { id = "overtaken", fault.reorder = { p = 0.3 } },
        ]
    "#;
    let log = mission("late", scenario, Outcome::Complete);
    for id in ["late", "twice", "overtaken"] {
        hit(&log, id);
    }
    let mut delayed = with_delivery(&log, "delayed");
    assert!(delayed.len() > 100);
    for row in &delayed {
        assert!(row.t_ms.since(row.sent_ms) >= at(0.5), "{row:?}");
    }
    // No message arrives on time.
    assert!(with_delivery(&log, "received").is_empty());
    assert!(!with_delivery(&log, "duplicate").is_empty());
    delayed.retain(|row| row.sender == "blue" && row.receiver == "gold");
    let is_overtaken = |pair: &[MessageRow]| pair[0].seq > pair[1].seq;
    assert!(delayed.windows(2).any(is_overtaken));
}

#[test]
fn exclusive_tasks_are_exclusive_again_after_a_partition() {
    for (name, one_way) in [("two-way", false), ("one-way", true)] {
        // The spills have more items than a team delivers in ten minutes, so that the work lasts after healing.
        let scenario = format!(
            "[[waste.spills]]\nname = \"top\"\nitems = 40\ny_fraction = 0.6667\n\
             [[waste.spills]]\nname = \"bottom\"\nitems = 40\ny_fraction = 0.3333\n\
             [[faults.timeline]]\nid = \"p\"\nat_s = 70.0\nfor_s = 60.0\n\
             fault.partition = {{ groups = [[\"blue\", \"gold\"], [\"green\"]], one_way = {one_way} }}\n"
        );
        let log = mission(name, &scenario, Outcome::Complete);
        let cut = with_delivery(&log, "cut");
        assert_eq!(hit(&log, "p").hits, cut.len() as u64);
        let crosses = |row: &MessageRow| (row.sender == "green") != (row.receiver == "green");
        assert!(cut.iter().all(crosses));
        // Later groups receive from earlier ones.
        let from_others = cut.iter().any(|row| row.receiver == "green");
        assert_eq!(from_others, !one_way);
        assert_eq!(log.events("healed")[0].t_ms, at(130.0));
        assert_exclusive_from(&log, at(130.0 + healing_bound_s(&log)));
    }
}

#[test]
fn mute_deaf_hold_and_range_affect_the_stated_messages() {
    let scenario = r#"
        [faults]
        timeline = [
            { id = "mute", fault.mute = "blue", at_s = 10.0, for_s = 10.0 },
            { id = "deaf", fault.deaf = "gold", at_s = 30.0, for_s = 10.0 },
            { id = "hold", fault.hold = { from = "green" }, at_s = 50.0, for_s = 10.0 },
            { id = "range", fault.range = { range_m = 3.0 }, at_s = 80.0, for_s = 100.0 },
        ]
    "#;
    let log = mission("cut-off", scenario, Outcome::Complete);
    for id in ["mute", "deaf", "hold", "range"] {
        hit(&log, id);
    }
    let rows = log.rows::<MessageRow>().unwrap();
    let during = |from: f64, to: f64| {
        let within = move |row: &&MessageRow| (at(from)..at(to)).contains(&row.t_ms);
        rows.iter().filter(within)
    };
    assert!(during(10.0, 20.0).all(|row| (row.delivery == "cut") == (row.sender == "blue")));
    assert!(during(30.0, 40.0).all(|row| (row.delivery == "cut") == (row.receiver == "gold")));
    // The held messages of green all arrive in the tick in which the fault ends.
    assert!(during(50.0, 60.0).all(|row| row.sender != "green"));
    let released = with_delivery(&log, "delayed");
    assert!(released.len() > 2);
    let is_held = |row: &MessageRow| row.sender == "green" && row.t_ms == at(60.0);
    assert!(released.iter().all(is_held));
    for delivery in ["cut", "received"] {
        let mut in_range = during(80.0, 180.0);
        assert!(in_range.any(|row| row.delivery == delivery), "{delivery}");
    }
}
