//! Tests with a modified run.json. Replay, view and report either work or return a one-line error.

use missions::Registry;
use std::fs;
use std::path::Path;

use analysis::replay::replay;
use analysis::report::command::{FigureOptions, report};
use in_process::Team;
use run_log::recorder::Folder;
use run_log::{LogLevel, RunLog};
use scenario::testkit::entry;
use scenario::{Scenario, Setup};
use serde_json::{Value, json};
use tempfile::TempDir;

use crate::page::logged::Logged;

/// Creates a folder with the log of a short run with faults, obstacles and parameters.
fn run() -> TempDir {
    let folder = TempDir::new().unwrap();
    let text = r#"
        limit_s = 1
        faults.timeline = [
            { at_s = 0.5, fault = { pause = "gold" }, for_s = 1 },
            { at_s = 0.5, every_s = 0.2, fault = { waste = { x_m = 5, y_m = 5, items = 2 } } },
            { at_s = 1, fault = { drop = { from = "blue", to = "all", p = 0.5 } }, for_s = 1 },
        ]
        [[obstacles]]
        x_m = 8
        y_m = 1
        width_m = 1
        height_m = 1
        [alliance.sets.report-progress]
        fast_impatience = 20
    "#;
    let scenario = Scenario::parse("a.toml", text, &Registry::built_in().vocabulary()).unwrap();
    let setup = Setup::resolve(scenario, 1, None).unwrap().setup;
    let sink = Folder::create(folder.path()).unwrap();
    Team::new(setup, LogLevel::Full, sink)
        .unwrap()
        .run()
        .unwrap();
    folder
}

/// Returns JSON pointers to all values of a document.
fn pointers(value: &Value) -> Vec<String> {
    let mut found = Vec::new();
    let below = |key: String, inner: &Value, found: &mut Vec<String>| {
        let key = key.replace('~', "~0").replace('/', "~1");
        found.push(format!("/{key}"));
        found.extend(pointers(inner).iter().map(|rest| format!("/{key}{rest}")));
    };
    match value {
        Value::Object(entries) => {
            for (key, inner) in entries {
                below(key.clone(), inner, &mut found);
            }
        }
        Value::Array(items) => {
            for (index, inner) in items.iter().enumerate() {
                below(index.to_string(), inner, &mut found);
            }
        }
        _ => {}
    }
    found
}

fn without(run: &Value, pointer: &str) -> Value {
    let mut modified = run.clone();
    let (parent, key) = pointer.rsplit_once('/').unwrap();
    let key = key.replace("~1", "/").replace("~0", "~");
    match modified.pointer_mut(parent).unwrap() {
        Value::Object(entries) => drop(entries.remove(&key)),
        Value::Array(items) => drop(items.remove(key.parse().unwrap())),
        _ => unreachable!("only tables and lists hold something"),
    }
    modified
}

fn with(run: &Value, pointer: &str, value: Value) -> Value {
    let mut modified = run.clone();
    *modified.pointer_mut(pointer).unwrap() = value;
    modified
}

fn use_run(folder: &Path) -> anyhow::Result<()> {
    let log = RunLog::open(folder, &Registry::built_in().vocabulary())?;
    replay(&log, log.run.log, |_| {})?;
    // A page shows figures of run.json directly, besides the replay.
    Logged::open(folder)?;
    report(folder, &folder.join("report"), &FigureOptions::default())?;
    Ok(())
}

/// Returns `true` for values whose check is sufficient: a valid parameter in force is like one of any scenario, so no page is built.
fn is_plain(pointer: &str) -> bool {
    pointer.starts_with("/alliance/robots")
}

#[track_caller]
fn try_to_use(folder: &Path, modified: &Value, pointer: &str, what: &str) {
    fs::write(folder.join("run.json"), modified.to_string()).unwrap();
    let used = if is_plain(pointer) {
        RunLog::open(folder, &Registry::built_in().vocabulary())
            .map_err(anyhow::Error::from)
            .and_then(|log| replay(&log, log.run.log, |_| {}).map(drop))
    } else {
        use_run(folder)
    };
    if let Err(error) = used {
        let line = format!("{error:#}");
        assert_eq!(line.lines().count(), 1, "{what}: {line}");
        assert!(line.contains("run.json"), "{what}: {line}");
    }
}

#[test]
fn a_replaced_number_is_refused_in_one_line_or_harmless() {
    let folder = run();
    let text = fs::read(folder.path().join("run.json")).unwrap();
    let run: Value = serde_json::from_slice(&text).unwrap();
    let numbers = [
        json!(0),
        json!(-1),
        json!(1e-300),
        json!(1e308),
        json!(u64::MAX),
        json!(u32::MAX),
        Value::Null,
    ];
    for pointer in pointers(&run) {
        if !run.pointer(&pointer).unwrap().is_number() {
            continue;
        }
        for number in &numbers {
            let what = format!("{pointer} = {number}");
            let modified = with(&run, &pointer, number.clone());
            try_to_use(folder.path(), &modified, &pointer, &what);
        }
    }
}

#[test]
fn a_removed_or_replaced_value_is_refused_in_one_line_or_harmless() {
    let folder = run();
    let text = fs::read(folder.path().join("run.json")).unwrap();
    let run: Value = serde_json::from_slice(&text).unwrap();
    for pointer in pointers(&run) {
        try_to_use(folder.path(), &without(&run, &pointer), &pointer, &pointer);
        for value in [json!({}), json!([]), json!("*")] {
            let what = format!("{pointer} = {value}");
            let modified = with(&run, &pointer, value);
            try_to_use(folder.path(), &modified, &pointer, &what);
        }
    }
}

#[test]
fn errors_contain_value_rule_and_position() {
    let folder = run();
    let text = fs::read(folder.path().join("run.json")).unwrap();
    let run: Value = serde_json::from_slice(&text).unwrap();
    let answer = |what: &str, modified: &Value| {
        fs::write(folder.path().join("run.json"), modified.to_string()).unwrap();
        let line = format!("{:#}", use_run(folder.path()).unwrap_err());
        let (_, message) = line.split_once("run.json: ").unwrap();
        entry(what, message)
    };
    let slow = "/alliance/robots/blue/sets/report-progress/slow_impatience/gold";
    let mut answers = answer(&format!("without {slow}"), &without(&run, slow));
    for (pointer, value) in [
        ("/scenario/room/width_m", json!(0)),
        (slow, json!(50)),
        ("/result/ticks", json!(u64::MAX)),
    ] {
        let modified = with(&run, pointer, value.clone());
        answers += &answer(&format!("{pointer} = {value}"), &modified);
    }
    insta::assert_snapshot!(answers);
}
