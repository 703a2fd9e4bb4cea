//! The run folder: each documented file, header line and key.

use alliance_tests::testkit::{ROBOTS, files};
use scenario::testkit::entry;
use serde_json::Value;

use crate::harness::Lab;

fn json(lab: &Lab, file: &str) -> Value {
    serde_json::from_slice(&std::fs::read(lab.path(file)).unwrap()).unwrap()
}

#[test]
fn a_run_folder_has_the_documented_files_and_headers() {
    let lab = Lab::new();
    lab.mission("run", &["--limit", "5"]).expect(1);
    let mut listing = String::new();
    for (name, bytes) in files(&lab.path("run")) {
        if name.ends_with(".csv") {
            let text = String::from_utf8(bytes).unwrap();
            let mut lines = text.lines();
            listing += &entry(&name, lines.next().unwrap());
            assert!(lines.next().is_some(), "{name} has no row");
        } else {
            listing += &format!("{name}\n\n");
        }
    }
    insta::assert_snapshot!(listing);
}

#[test]
fn run_json_has_the_documented_keys() {
    let lab = Lab::new();
    lab.mission("run", &["--limit", "5", "--seed", "4"])
        .expect(1);
    let run = json(&lab, "run/run.json");
    assert_eq!(run["seed"], 4);
    assert_eq!(run["outcome"], "time-limit");
    assert_eq!(run["scenario"]["limit_s"], 5.0);
    for (rank, robot) in ROBOTS.into_iter().enumerate() {
        assert_eq!(run["alliance"]["robots"][robot]["rank"], rank);
    }
    let keys: Vec<&String> = run.as_object().unwrap().keys().collect();
    let mut listing = format!("run.json: {keys:?}\n");
    add_keys(&mut listing, "alliance", &run["alliance"]);
    insta::assert_snapshot!(listing);
}

/// Adds a line with the keys of each table in a value.
fn add_keys(listing: &mut String, path: &str, value: &Value) {
    let Some(table) = value.as_object() else {
        return;
    };
    let keys: Vec<&String> = table.keys().collect();
    *listing += &format!("{path}: {keys:?}\n");
    for (key, inner) in table {
        add_keys(listing, &format!("{path}.{key}"), inner);
    }
}

/// A parameter file as in the thesis (Fig. 3.4), with keys for a robot and a behavior set that this team lacks.
const PARAMETERS: &str = "\
threshold = 80

broadcastRate.report-progress = 2
timeAllowedTillCeased.report-progress = 7
timeWillingToAffect.gold.report-progress = 40
slowImpatience.gold.report-progress = 0.5
slowImpatience.gold.blue.report-progress = 0.25
fastImpatience.report-progress = 8
fastImpatience.green.report-progress = 9
timeBeforeYielding.report-progress = 55
timeBeforeGivingUp.report-progress = 66
fastImpatience.violet.report-progress = 3
slowImpatience.violet.report-progress = 0.5
timeBeforeYielding.sing = 5
";

#[test]
fn a_parameter_file_applies_and_its_unknown_keys_are_listed_once() {
    let lab = Lab::new();
    std::fs::write(lab.path("team.properties"), PARAMETERS).unwrap();
    let finished = lab
        .mission("run", &["--limit", "5", "--params", "team.properties"])
        .expect(1);
    let alliance = &json(&lab, "run/run.json")["alliance"];
    assert_eq!(alliance["threshold"], 80.0);
    for robot in ROBOTS {
        let values = &alliance["robots"][robot]["sets"]["report-progress"];
        assert_eq!(values["broadcast_rate_hz"], 2.0, "{robot}");
        assert_eq!(values["ceased_after_s"], 7.0, "{robot}");
        assert_eq!(
            values["fast_impatience"],
            if robot == "green" { 9.0 } else { 8.0 }
        );
        assert_eq!(values["before_yielding_s"], 55.0, "{robot}");
        assert_eq!(values["before_giving_up_s"], 66.0, "{robot}");
        if robot != "gold" {
            assert_eq!(values["willing_to_affect_s"]["gold"], 40.0, "{robot}");
            let slow = if robot == "blue" { 0.25 } else { 0.5 };
            assert_eq!(values["slow_impatience"]["gold"], slow, "{robot}");
        }
    }
    for skipped in [
        "fastImpatience.violet.report-progress (line 12)",
        "slowImpatience.violet.report-progress (line 13)",
        "timeBeforeYielding.sing (line 14)",
    ] {
        assert_eq!(
            finished.stderr.matches(skipped).count(),
            1,
            "{skipped} in:\n{}",
            finished.stderr
        );
    }
    assert_eq!(
        finished.stderr.matches("(line ").count(),
        3,
        "{}",
        finished.stderr
    );
}
