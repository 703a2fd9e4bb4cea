//! Exported files contain the values of the log at each log level, and the same bytes each time.

use alliance_tests::harness::Lab;
use alliance_tests::python::python;
use alliance_tests::team::Team;
use alliance_tests::testkit::in_repository;
use nix::sys::signal::Signal;
use run_log::{LogLevel, MotivationRow, RunOutcome, TableRow};
use serde_json::json;

use super::{bad_day, read};

/// The tables of a run without faults.
const TABLES: [&str; 7] = [
    "events",
    "messages",
    "mission",
    "motivations",
    "poses",
    "sent",
    "ticks",
];

const MCAP: [&str; 2] = ["mcap", "mcap_protobuf"];
const PARQUET: [&str; 2] = ["pandas", "pyarrow"];

/// Returns the number of rows of a table of a run.
fn rows(lab: &Lab, run: &str, table: &str) -> u64 {
    let text = lab.text(&format!("{run}/{table}.csv"));
    text.lines().count() as u64 - 1
}

/// Returns the names of the tables in an exported folder.
fn tables(lab: &Lab, folder: &str) -> Vec<String> {
    let names = lab.names(folder).into_iter();
    names.map(|name| name.replace(".parquet", "")).collect()
}

#[test]
fn a_recording_contains_every_row_and_the_scene() {
    let Some(python) = python(&MCAP) else { return };
    let lab = Lab::new();
    bad_day(&lab, "run", "--seed 3 --mcap --log full");
    // The script compares every message with its row, and the scene with the log.
    let found = read(&lab, &python, "read_mcap.py", &["run", "run/run.mcap"]);

    let log = lab.log("run");
    let metadata = &found["metadata"]["run"];
    for (key, expected) in [
        ("seed", json!("3")),
        ("scenario", json!("a-bad-day")),
        ("outcome", json!("time-limit")),
        ("hash", json!(log.run.hash)),
        ("version", json!(log.run.version)),
    ] {
        assert_eq!(metadata[key], expected, "{key}");
    }
    // The recording alone is enough to repeat the run.
    let scenario = metadata["scenario_toml"].as_str().unwrap();
    lab.write("again.toml", scenario);
    let again = "again.toml --seed 3 --in-process";
    lab.mission("again", again).expect(1);
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

    let labels = |robot: &str| &found["labels"][format!("robots/{robot}")];
    let has = |robot: &str, label: &str| {
        let labels = labels(robot).as_array().unwrap();
        assert!(labels.contains(&json!(label)), "{robot}: {labels:?}");
    };
    has("blue", "blue: find-locations-methodical");
    has("gold", "gold: dead");
    // The robot is absent at first.
    assert_eq!(labels("red")[0], "");
    has("red", "red: idle");
    // Slow ground from the start, and an obstacle for ten seconds.
    let obstacles = json!([[0, 1], [30_050, 2], [40_050, 1]]);
    assert_eq!(found["obstacles"], obstacles);
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
    for topic in ["/scene/room", "/scene/items", "/scene/robots/blue"] {
        assert!(found["topics"][topic].as_u64().unwrap() < 100, "{topic}");
    }
}

#[test]
fn a_recording_is_the_same_at_each_log_level_and_at_each_export() {
    let lab = Lab::new();
    bad_day(&lab, "full", "--mcap --in-process --log full");
    bad_day(&lab, "compact", "--mcap --log compact");
    bad_day(&lab, "summary", "--log summary --in-process");
    bad_day(&lab, "off", "--log off --mcap");
    lab.run("export summary --mcap=elsewhere.mcap").expect(0);
    let full = lab.bytes("full/run.mcap");
    assert!(full == lab.bytes("compact/run.mcap"), "--log compact");
    assert!(full == lab.bytes("off/run.mcap"), "--log off");
    assert!(full == lab.bytes("elsewhere.mcap"), "--log summary");
    // The export replaces an older file.
    lab.write("full/run.mcap", "old");
    let finished = lab.run("export full --mcap").expect(0);
    assert_eq!(finished.answer(), "mcap    full/run.mcap\n");
    assert!(full == lab.bytes("full/run.mcap"), "a second time");
}

#[test]
fn tables_keep_every_value() {
    let Some(python) = python(&PARQUET) else {
        return;
    };
    let lab = Lab::new();
    bad_day(&lab, "run", "--in-process --log full");
    let finished = lab.run("export run --parquet").expect(0);
    assert_eq!(finished.stderr, "parquet run/parquet\n");
    // The script compares every value with that of the CSV file.
    let found = read(&lab, &python, "read_parquet.py", &["run", "run/parquet"]);
    let log = lab.log("run");
    let mut all = TABLES.to_vec();
    all.insert(1, "hits");
    for &table in &all {
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

    assert_eq!(tables(&lab, "run/parquet"), all);
    lab.run("export run --parquet=again/tables").expect(0);
    for name in all {
        let [first, second] = ["run/parquet", "again/tables"]
            .map(|folder| lab.bytes(&format!("{folder}/{name}.parquet")));
        assert!(first == second, "{name}");
    }
}

/// A short run that exports its tables into the same folder as the others: tables that are not logged are omitted, and
/// their older files are removed. The utilities of an allocator without motivations and the targets of a mission are
/// in both formats.
#[test]
fn each_run_has_its_own_tables_and_topics_in_both_formats() {
    let lab = Lab::new();
    let python = python(&[MCAP, PARQUET].concat());
    let utilities = "/allocation/blue/find-locations-wander";
    let motivations = "/motivations/blue/report-progress";
    let nearest = "--limit 30 --allocator nearest --log full";
    for (run, arguments, table, topic, least) in [
        ("nearest", nearest, "allocation", utilities, 1000),
        (
            "full",
            "--limit 5 --log full",
            "motivations",
            motivations,
            100,
        ),
        (
            "watched",
            "cmommt --limit 10 --log full",
            "targets",
            "/targets/t0",
            200,
        ),
        ("summary", "--limit 5 --log summary", "events", "", 3),
    ] {
        let mission = format!("{arguments} --in-process --mcap");
        lab.mission(run, mission).expect(1);
        let exported = lab.run(format!("export {run} --parquet=tables")).expect(0);
        let tables = tables(&lab, "tables");
        if run == "summary" {
            assert_eq!(tables, ["events", "mission", "ticks"]);
            exported.shows("note: --log summary keeps no motivations, messages, poses\n");
        } else {
            assert_eq!(exported.stderr, "parquet tables\n");
            assert!(tables.iter().any(|name| name == table), "{run}: {tables:?}");
            assert!(run != "full" || tables == TABLES, "{tables:?}");
        }
        let expected = rows(&lab, run, table);
        assert!(expected >= least, "{run}: {expected}");
        let Some(python) = &python else {
            continue;
        };
        let found = read(&lab, python, "read_parquet.py", &[run, "tables"]);
        assert_eq!(found[table]["rows"], expected);
        if !topic.is_empty() {
            let mcap = format!("{run}/run.mcap");
            let found = read(&lab, python, "read_mcap.py", &[run, &mcap]);
            assert_eq!(found["counts"][table], expected);
            assert!(found["topics"][topic].as_u64() > Some(90), "{topic}");
        }
    }
}

#[test]
fn the_run_of_a_killed_world_is_exported_up_to_its_last_complete_tick() {
    let lab = Lab::new();
    let mut team = Team::start(&lab, "--speed 10x");
    team.wait_for_row("events.csv", &[",activated,"]);
    team.signal("world", Signal::SIGKILL);
    team.wait().expect(3);
    let log = lab.log("run");
    assert_eq!(log.run.outcome, RunOutcome::Running);
    let last = log.last.unwrap();
    let exported = lab.run("export run --mcap --parquet").expect(0);
    let paths = "parquet run/parquet\nmcap    run/run.mcap\n";
    assert_eq!(exported.stderr, paths);

    let Some(python) = python(&[MCAP, PARQUET].concat()) else {
        return;
    };
    // The readers must find the complete part of each table.
    let tables = run_log::Table::ALL.into_iter();
    let files = tables.map(|table| (table, format!("run/{}", table.file_name())));
    for (table, file) in files.filter(|(_, file)| lab.exists(file)) {
        lab.write(&file, log.full_table(table, None).unwrap());
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
    assert_eq!(log.run.log, LogLevel::Compact);
}

#[test]
fn layouts_use_only_existing_topics() {
    let Some(python) = python(&MCAP) else { return };
    let lab = Lab::new();
    let mission = "--limit 100 --in-process --mcap";
    lab.mission("run", mission).expect(1);
    let layouts = ["foxglove.json", "plotjuggler.xml"].map(|name| {
        in_repository("docs/layouts")
            .join(name)
            .display()
            .to_string()
    });
    let files = ["run/run.mcap", &layouts[0], &layouts[1]];
    let found = read(&lab, &python, "read_layouts.py", &files);
    let both = [
        "/motivations/gold/move-spill(top)",
        "/motivations/blue/find-locations-methodical",
        "/threshold",
    ];
    let foxglove = ["/log", "/scene/robots/green", "/sensors/blue/border"];
    for (layout, own) in [
        ("foxglove", &foxglove[..]),
        ("plotjuggler", &["/poses/green"]),
    ] {
        let topics = found[layout].as_array().unwrap();
        for topic in both.iter().chain(own) {
            assert!(topics.contains(&json!(topic)), "{layout}: {topic}");
        }
    }
    assert!(found["plotjuggler"].as_array().unwrap().len() > 15);
}

#[test]
fn other_readers_find_every_frame_of_a_film() {
    let Some(python) = python(&["PIL"]) else {
        return;
    };
    let lab = Lab::new();
    lab.mission("run", "--limit 3 --in-process").expect(1);
    let mut films = Vec::new();
    for film in ["film.gif", "film.webp"] {
        let options = "--from 1s --speed 2x --fps 10 --width 480";
        let finished = lab
            .run(format!("export run --video {film} {options}"))
            .expect(0);
        let answer = format!("video   {film} (11 frames, 1.1 s at 2x)\n");
        assert!(finished.stderr.ends_with(&answer), "{}", finished.stderr);
        films.push(film);
    }
    let found = read(
        &lab,
        &python,
        "read_film.py",
        &["2", "2", films[0], films[1]],
    );
    for film in films {
        let film = &found[film];
        assert_eq!(film["frames"], 11, "{film}");
        assert_eq!(film["size"][0], 480);
        assert_eq!(film["first"], json!([255, 255, 255]));
        let durations = film["durations"].as_array().unwrap();
        assert!(
            durations[..10]
                .iter()
                .all(|each| each.as_f64() == Some(100.0)),
            "{film}"
        );
        assert_eq!(durations[10].as_f64(), Some(2000.0));
    }
}
