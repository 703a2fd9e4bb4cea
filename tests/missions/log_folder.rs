//! The run folder: each documented file, header line and key.

use alliance_tests::harness::Lab;
use alliance_tests::testkit::{ROBOTS, files};
use scenario::testkit::entry;
use serde_json::Value;

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
