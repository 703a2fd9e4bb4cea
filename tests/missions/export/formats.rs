//! Exported files contain the values of the log at each log level, and the same bytes each time.

use alliance_tests::harness::Lab;
use alliance_tests::python::python;
use alliance_tests::team::Team;
use nix::sys::signal::Signal;
use run_log::{LogLevel, MotivationRow, RunOutcome, TableRow};
use serde_json::{Value, json};

use super::{bad_day, bytes, files, read};

const TABLES: [&str; 6] = [
    "events",
    "messages",
    "mission",
    "motivations",
    "poses",
    "ticks",
];

const MCAP: [&str; 2] = ["mcap", "mcap_protobuf"];
const PARQUET: [&str; 2] = ["pandas", "pyarrow"];

/// Returns the number of rows of a table of a run.
fn rows(lab: &Lab, run: &str, table: &str) -> u64 {
    let text = String::from_utf8(bytes(lab, &format!("{run}/{table}.csv"))).unwrap();
    text.lines().count() as u64 - 1
}

#[test]
fn a_recording_contains_every_row_and_the_scene() {
    let Some(python) = python(&MCAP) else { return };
    let lab = Lab::new();
    bad_day(&lab, "run", &["--seed", "3", "--mcap"]);
    // The script compares every message with its row, and the scene with the log.
    let found = read(&lab, &python, "read_mcap.py", &["run", "run/run.mcap"]);

    let log = lab.log("run");
    let metadata = &found["metadata"]["run"];
    assert_eq!(metadata["seed"], "3");
    assert_eq!(metadata["scenario"], "a-bad-day");
    assert_eq!(metadata["outcome"], "time-limit");
    assert_eq!(metadata["hash"], json!(log.run.hash));
    assert_eq!(metadata["version"], json!(log.run.version));
    // The recording alone is enough to repeat the run.
    let scenario = metadata["scenario_toml"].as_str().unwrap();
    std::fs::write(lab.path("again.toml"), scenario).unwrap();
    lab.mission("again", &["again.toml", "--seed", "3", "--in-process"])
        .expect(1);
    assert_eq!(lab.log("again").run.hash, log.run.hash);

    for table in ["motivations", "messages", "events", "poses", "mission"] {
        let count = found["counts"][table].as_u64().unwrap();
        assert_eq!(count, rows(&lab, "run", table), "{table}");
        assert!(count > 5, "{table}: {count}");
    }
    assert_eq!(found["last_ms"], 120_000);
    assert_eq!(found["topics"]["/tf"], 2401);
    assert_eq!(found["threshold"], json!([[0, 100.0], [120_000, 100.0]]));
    assert_eq!(
        found["topics"]["/motivations/red/move-spill(top)"],
        found["topics"]["/motivations/red/report-progress"]
    );

    let labels = |robot: &str| {
        found["labels"][format!("robots/{robot}")]
            .as_array()
            .unwrap()
    };
    assert!(labels("blue").contains(&json!("blue: find-locations-methodical")));
    assert!(labels("gold").contains(&json!("gold: dead")));
    // The robot is absent at first.
    assert_eq!(labels("red")[0], "");
    assert!(labels("red").contains(&json!("red: idle")));
    // Slow ground from the start, and an obstacle for ten seconds.
    assert_eq!(
        found["obstacles"],
        json!([[0, 1], [30_050, 2], [40_050, 1]])
    );
    // A report changes the color of the report site.
    let site = found["site"].as_array().unwrap();
    assert!(site.len() >= 3, "{site:?}");
    assert_ne!(site[0][1], site[1][1]);
    assert_eq!(site[0][1], site[2][1]);
    let names = ["report site", "deposit", "spill (top)", "spill (bottom)"];
    assert_eq!(found["marks"], json!(names));
    assert!(found["sensed"]["border"].as_u64() > Some(100));
    assert!(found["sensed"]["avoidance"].as_u64() > Some(100));
    assert!(found["warnings"].as_u64() >= Some(5));
    // Static parts of the scene are not sent in every tick.
    let rarely = |topic: &str| found["topics"][topic].as_u64().unwrap() < 100;
    assert!(rarely("/scene/room") && rarely("/scene/items") && rarely("/scene/robots/blue"));
}

#[test]
fn a_recording_is_the_same_at_each_log_level_and_at_each_export() {
    let lab = Lab::new();
    bad_day(&lab, "full", &["--mcap", "--in-process"]);
    bad_day(&lab, "summary", &["--log", "summary", "--in-process"]);
    bad_day(&lab, "off", &["--log", "off", "--mcap"]);
    lab.run(&["export", "summary", "--mcap=elsewhere.mcap"])
        .expect(0);
    let full = bytes(&lab, "full/run.mcap");
    assert!(full == bytes(&lab, "off/run.mcap"), "--log off");
    assert!(full == bytes(&lab, "elsewhere.mcap"), "--log summary");
    // The export replaces an older file.
    std::fs::write(lab.path("full/run.mcap"), "old").unwrap();
    let finished = lab.run(&["export", "full", "--mcap"]).expect(0);
    assert_eq!(finished.answer(), "mcap    full/run.mcap\n");
    assert!(full == bytes(&lab, "full/run.mcap"), "a second time");
}

#[test]
fn tables_keep_every_value() {
    let Some(python) = python(&PARQUET) else {
        return;
    };
    let lab = Lab::new();
    bad_day(&lab, "run", &["--in-process"]);
    let finished = lab.run(&["export", "run", "--parquet"]).expect(0);
    assert_eq!(finished.stderr, "parquet run/parquet\n");
    // The script compares every value with that of the CSV file.
    let found = read(&lab, &python, "read_parquet.py", &["run", "run/parquet"]);
    let log = lab.log("run");
    for table in TABLES {
        let facts = &found[table];
        assert_eq!(facts["rows"], rows(&lab, "run", table), "{table}");
        assert!(facts["rows"].as_u64() > Some(5), "{table}");
        assert_eq!(facts["metadata"]["seed"], "1");
        assert_eq!(facts["metadata"]["scenario"], "a-bad-day");
        assert_eq!(facts["metadata"]["hash"], json!(log.run.hash));
    }
    // A PositionUpdate has no `since`, and there is no last report before the first one.
    assert!(found["messages"]["nulls"].as_u64() > Some(0));
    assert!(found["mission"]["nulls"].as_u64() > Some(0));
    assert_eq!(found["poses"]["nulls"], 0, "energy is simulated");

    let names = TABLES.map(|table| format!("{table}.parquet"));
    assert_eq!(files(&lab, "run/parquet"), names);
    lab.run(&["export", "run", "--parquet=again/tables"])
        .expect(0);
    for name in names {
        let [first, second] =
            ["run/parquet", "again/tables"].map(|folder| bytes(&lab, &format!("{folder}/{name}")));
        assert!(first == second, "{name}");
    }
}

#[test]
fn unlogged_tables_are_omitted_and_their_older_files_removed() {
    let Some(python) = python(&PARQUET) else {
        return;
    };
    let lab = Lab::new();
    lab.mission("full", &["--limit", "5", "--in-process"])
        .expect(1);
    lab.run(&["export", "full", "--parquet=tables"]).expect(0);
    lab.mission(
        "summary",
        &["--limit", "5", "--log", "summary", "--in-process"],
    )
    .expect(1);
    let finished = lab
        .run(&["export", "summary", "--parquet=tables"])
        .expect(0);
    assert_eq!(
        finished.stderr,
        "note: --log summary keeps no motivations, messages, poses\nparquet tables\n"
    );
    assert_eq!(
        files(&lab, "tables"),
        ["events.parquet", "mission.parquet", "ticks.parquet"]
    );
    let found = read(&lab, &python, "read_parquet.py", &["summary", "tables"]);
    assert_eq!(found["events"]["rows"], rows(&lab, "summary", "events"));
}

/// The utilities of an allocator without motivations are in both formats. A later export of another run removes their
/// table.
#[test]
fn utilities_are_exported_like_motivations() {
    let lab = Lab::new();
    let short = ["--limit", "30", "--in-process"];
    let nearest = [&short[..], &["--allocator", "nearest", "--mcap"]].concat();
    lab.mission("nearest", &nearest).expect(1);
    lab.run(&["export", "nearest", "--parquet=tables"])
        .expect(0);
    assert!(files(&lab, "tables").contains(&"allocation.parquet".to_owned()));
    if let Some(python) = python(&[MCAP, PARQUET].concat()) {
        let expected = rows(&lab, "nearest", "allocation");
        assert!(expected > 1000);
        let mcap = ["nearest", "nearest/run.mcap"];
        let found = read(&lab, &python, "read_mcap.py", &mcap);
        assert_eq!(found["counts"]["allocation"], expected);
        for set in ["find-locations-methodical", "find-locations-wander"] {
            let topic = format!("/allocation/blue/{set}");
            assert!(found["topics"][&topic].as_u64() > Some(100), "{topic}");
        }
        let found = read(&lab, &python, "read_parquet.py", &["nearest", "tables"]);
        assert_eq!(found["allocation"]["rows"], expected);
    }
    lab.mission("alliance", &short).expect(1);
    let exported = lab
        .run(&["export", "alliance", "--parquet=tables"])
        .expect(0);
    assert_eq!(exported.stderr, "parquet tables\n");
    let names = TABLES.map(|table| format!("{table}.parquet"));
    assert_eq!(files(&lab, "tables"), names);
}

#[test]
fn each_target_has_a_topic_and_the_table_has_all_rows() {
    let lab = Lab::new();
    let short = ["cmommt", "--limit", "10", "--in-process", "--mcap"];
    lab.mission("watched", &short).expect(1);
    lab.run(&["export", "watched", "--parquet=tables"])
        .expect(0);
    let Some(python) = python(&[MCAP, PARQUET].concat()) else {
        return;
    };
    let expected = rows(&lab, "watched", "targets");
    assert!(expected >= 200);
    let mcap = ["watched", "watched/run.mcap"];
    let found = read(&lab, &python, "read_mcap.py", &mcap);
    assert_eq!(found["counts"]["targets"], expected);
    assert!(found["topics"]["/targets/t0"].as_u64() >= Some(200));
    let found = read(&lab, &python, "read_parquet.py", &["watched", "tables"]);
    assert_eq!(found["targets"]["rows"], expected);
}

#[test]
fn the_run_of_a_killed_world_is_exported_up_to_its_last_complete_tick() {
    let lab = Lab::new();
    let mut team = Team::start(&lab, &["--speed", "10x"]);
    team.wait_for_row("events.csv", &[",activated,"]);
    team.signal("world", Signal::SIGKILL);
    team.wait().expect(3);
    let log = lab.log("run");
    assert_eq!(log.run.outcome, RunOutcome::Running);
    let last = log.last.unwrap();
    let exported = lab.run(&["export", "run", "--mcap", "--parquet"]).expect(0);
    assert_eq!(
        exported.stderr,
        "parquet run/parquet\nmcap    run/run.mcap\n"
    );

    let Some(python) = python(&[MCAP, PARQUET].concat()) else {
        return;
    };
    // The readers must find the complete part of each table.
    let tables = run_log::Table::ALL.into_iter();
    for table in tables.filter(|table| !table.is_optional()) {
        std::fs::write(lab.path("run").join(table.file_name()), log.table(table)).unwrap();
    }
    let found = read(&lab, &python, "read_mcap.py", &["run", "run/run.mcap"]);
    let hash = format!("{:016x}", last.hash);
    assert_eq!(found["metadata"]["run"]["outcome"], "running");
    assert_eq!(found["metadata"]["run"]["hash"], hash);
    assert_eq!(found["last_ms"], last.now.0 + 50);
    let tables = read(&lab, &python, "read_parquet.py", &["run", "run/parquet"]);
    let motivations = MotivationRow::TABLE.file_name().trim_end_matches(".csv");
    assert_eq!(tables[motivations]["rows"], found["counts"][motivations]);
    assert_eq!(tables["events"]["metadata"]["hash"], hash);
    assert_eq!(log.run.log, LogLevel::Full);
}

#[test]
fn layouts_use_only_existing_topics() {
    let Some(python) = python(&MCAP) else { return };
    let lab = Lab::new();
    lab.mission("run", &["--limit", "100", "--in-process", "--mcap"])
        .expect(1);
    let layouts = format!("{}/../docs/layouts", env!("CARGO_MANIFEST_DIR"));
    let found = read(
        &lab,
        &python,
        "read_layouts.py",
        &[
            "run/run.mcap",
            &format!("{layouts}/foxglove.json"),
            &format!("{layouts}/plotjuggler.xml"),
        ],
    );
    let names = |layout: &str, topic: &str| {
        let topics = found[layout].as_array().unwrap();
        assert!(topics.contains(&json!(topic)), "{layout}: {topic}");
    };
    for layout in ["foxglove", "plotjuggler"] {
        names(layout, "/motivations/gold/move-spill(top)");
        names(layout, "/motivations/blue/find-locations-methodical");
        names(layout, "/threshold");
    }
    names("foxglove", "/log");
    names("foxglove", "/scene/robots/green");
    names("foxglove", "/sensors/blue/border");
    names("plotjuggler", "/poses/green");
    assert!(matches!(&found["plotjuggler"], Value::Array(topics) if topics.len() > 15));
}
