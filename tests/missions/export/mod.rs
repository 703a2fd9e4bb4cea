//! Runs exported to the formats of other tools and read with the usual libraries of these formats.

mod formats;
mod notebook;
mod refusals;

use std::path::Path;

use alliance_tests::harness::Lab;
use alliance_tests::python::run;
use serde_json::Value;

/// A scenario with many faults: a late robot, a crash, obstacles, slow ground, energy, message loss, delay and
/// duplication, and a dead sensor.
const BAD_DAY: &str = r#"
name = "a-bad-day"
robots = [
    { name = "blue", side_sensor = true },
    { name = "gold" },
    { name = "green" },
    { name = "red", absent = true },
]
obstacles = [{ x_m = 2.0, y_m = 7.0, width_m = 1.0, height_m = 1.5, penetrability = 0.5 }]
[energy]
[waste]
report_period_s = 20.0
[faults]
timeline = [
    { fault.add = "red", at_s = 15.0 },
    { fault.kill = "gold", at_s = 20.0, for_s = 5.0 },
    { fault.obstacle = { x_m = 6.0, y_m = 4.0, width_m = 0.5, height_m = 1.0 }, at_s = 30.0, for_s = 10.0 },
    { fault.drop = { p = 0.3 }, at_s = 10.0, for_s = 30.0 },
    { fault.delay = { from = "green", delay_s = 1.0, jitter_s = 0.5 }, at_s = 5.0 },
    { fault.duplicate = { p = 0.1 }, at_s = 10.0 },
    { fault.sensor = { robot = "green", device = "avoidance", mode = "dead" }, at_s = 40.0 },
]
"#;

/// Runs the scenario for two minutes with the run folder `out`.
fn bad_day(lab: &Lab, out: &str, arguments: &[&str]) {
    std::fs::write(lab.path("day.toml"), BAD_DAY).unwrap();
    let all = [&["day.toml", "--limit", "120"], arguments].concat();
    lab.mission(out, &all).expect(1);
}

/// Returns the JSON output of a script for files of the lab.
#[track_caller]
fn read(lab: &Lab, python: &Path, script: &str, files: &[&str]) -> Value {
    serde_json::from_str(&run(lab, python, script, files)).unwrap()
}

fn bytes(lab: &Lab, file: &str) -> Vec<u8> {
    std::fs::read(lab.path(file)).unwrap()
}

/// Returns the names of all files in a folder, including hidden ones.
fn files(lab: &Lab, folder: &str) -> Vec<String> {
    let entries = std::fs::read_dir(lab.path(folder)).unwrap();
    let mut names: Vec<String> = entries
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .collect();
    names.sort();
    names
}
