//! Instances of other programs as scenarios, and runs as instances, judged by other readers.

use std::path::Path;

use alliance_tests::harness::Lab;
use alliance_tests::python::{python, run};
use alliance_tests::testkit::in_repository;
use analysis::instance::formats::Format;
use analysis::instance::source::Source;
use serde_json::{Value, json};

/// Solomon's form: a depot and three customers, by this project.
const SOLOMON: &str = "\
trio

VEHICLE
NUMBER     CAPACITY
  3         60

CUSTOMER
CUST NO.  XCOORD.   YCOORD.    DEMAND   READY TIME  DUE DATE   SERVICE TIME

    0      35         35          0          0       230          0
    1      41         49         10        161       171         10
    2      35         17          7         50        60         12
    3      55         45         13        116       126         10
";

/// VRPLIB's form with windows, by this project.
const VRPLIB: &str = "\
NAME : windows
COMMENT : by alliance-sim
TYPE : VRPTW
DIMENSION : 4
VEHICLES : 2
EDGE_WEIGHT_TYPE : EUC_2D
CAPACITY : 25
NODE_COORD_SECTION
1 35 35
2 -41.5 49
3 35 17
4 55 45
DEMAND_SECTION
1 0
2 10
3 7
4 13
TIME_WINDOW_SECTION
1 0 230
2 161 171
3 50 60
4 116 126
SERVICE_TIME_SECTION
1 0
2 10
3 12
4 10
DEPOT_SECTION
1
-1
EOF
";

#[test]
fn another_reader_of_vehicle_routing_finds_the_same_problem() {
    let Some(python) = python(&["vrplib"]) else {
        return;
    };
    let lab = Lab::new();
    let files = [("trio.txt", SOLOMON), ("windows.vrp", VRPLIB)];
    for (name, text) in files {
        lab.write(name, text);
    }
    let found = run(
        &lab,
        &python,
        "read_vrplib.py",
        &files.map(|(name, _)| name),
    );
    let found: Value = serde_json::from_str(&found).unwrap();
    let own = files.map(|(name, text)| {
        let loaded = Format::Vrplib.read(Source { name, text }).unwrap();
        let depot = &loaded.depots[0];
        let tasks = loaded.instance.tasks.iter().map(|task| {
            // The deadline is the end of a service that begins at the last moment.
            let window = [
                task.opens_s.unwrap_or(0.0),
                task.deadline_s.unwrap() - task.work_s,
            ];
            json!({
                "place": [task.x_m, task.y_m],
                "demand": task.demand.unwrap_or(0.0),
                "window": window,
                "service": task.work_s,
            })
        });
        json!({
            "name": loaded.instance.name,
            "capacity": depot.capacity,
            "vehicles": depot.vehicles,
            "depot": [depot.x, depot.y],
            "tasks": tasks.collect::<Vec<Value>>(),
        })
    });
    assert_eq!(found, json!(own));
}

#[test]
fn an_exported_run_fits_the_published_schema_and_can_be_imported() {
    let lab = Lab::new();
    lab.write("trio.txt", SOLOMON);
    let imported = lab.run("import trio.txt --out trio.toml").expect(0);
    assert!(
        imported.stderr.ends_with("scenario trio.toml\n"),
        "{}",
        imported.stderr
    );
    lab.run("check trio.toml").expect(0);
    lab.mission("run", "trio.toml --in-process --allocator cbba")
        .expect(0);
    lab.run("export run --instance").expect(0);
    let instance: Value = serde_json::from_str(&lab.text("run/instance.json")).unwrap();
    let result = &instance["result"];
    assert_eq!(result["outcome"], "complete");
    assert_eq!(result["value"], 3.0);
    let tasks = result["tasks"].as_array().unwrap();
    assert!(
        tasks.iter().all(|task| task["state"] == "done"),
        "{tasks:?}"
    );
    lab.run("import run/instance.json --out again.toml")
        .expect(0);
    lab.mission("again", "again.toml --in-process --allocator cbba")
        .expect(0);
    // The scenario of the instance repeats the run: same points, same times.
    assert_eq!(lab.text("again/events.csv"), lab.text("run/events.csv"));

    let Some(python) = python(&["check_jsonschema"]) else {
        return;
    };
    let schema = in_repository("docs/instance.schema.json");
    let judge = |file: &Path| {
        let mut command = std::process::Command::new(&python);
        command.args(["-m", "check_jsonschema", "--schemafile"]);
        command
            .arg(&schema)
            .arg(file)
            .output()
            .unwrap()
            .status
            .success()
    };
    assert!(judge(&lab.path("run/instance.json")));
    lab.write(
        "broken.json",
        lab.text("run/instance.json")
            .replace("\"work_s\"", "\"work\""),
    );
    assert!(!judge(&lab.path("broken.json")));
}
