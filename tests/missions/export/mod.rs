//! Runs exported to the formats of other tools and read with the usual libraries of these formats.

mod formats;
mod notebook;
mod refusals;
mod rosbag;

use std::path::Path;

use alliance_tests::harness::{Lab, join};
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
fn bad_day(lab: &Lab, out: &str, arguments: &str) {
    lab.write("day.toml", BAD_DAY);
    let arguments = join("day.toml --limit 120", arguments);
    lab.mission(out, arguments).expect(1);
}

/// Returns the JSON output of a script for files of the lab.
#[track_caller]
fn read(lab: &Lab, python: &Path, script: &str, files: &[&str]) -> Value {
    serde_json::from_str(&run(lab, python, script, files)).unwrap()
}
