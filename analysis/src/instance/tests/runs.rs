//! Results of runs, the published schema, and properties that a mission may support.

use scenario::Setup;
use scenario::testkit::check_generated;

use super::*;
use crate::instance::model::{Instance, TaskState, schema};
use crate::instance::result::of_run;
use crate::instance::source::Source;
use crate::testkit;

/// Two robots with two tasks each, and a task that expires before a robot can reach it.
const LINE: &str = "\
type,id,x_m,y_m,work_s,deadline_s
robot,blue,1,2,,
robot,gold,9,2,,
task,a,2,2,2,
task,b,3,2,3,
task,c,8,2,2,
task,d,7,2,3,
task,e,5,7,2,3
";

fn run_of(text: &str, allocator: &str) -> Instance {
    let mut scenario = imported("line.csv", text).scenario;
    scenario.allocator = Some(allocator.to_owned());
    let starts: Vec<[f64; 2]> = scenario
        .robots
        .iter()
        .filter_map(|robot| robot.start)
        .map(|start| [start.x_m.into(), start.y_m.into()])
        .collect();
    let setup = Setup::resolve(scenario, 1, None).unwrap().setup;
    of_run(&testkit::run(setup), &starts).unwrap().instance
}

#[test]
fn the_result_of_a_run_names_robots_times_and_value() {
    let instance = run_of(LINE, "nearest");
    let result = instance.result.unwrap();
    assert_eq!((result.allocator.as_str(), result.seed), ("nearest", 1));
    // A run with expired work is not complete.
    assert_eq!(
        (result.outcome.as_str(), result.makespan_s),
        ("expired", None)
    );
    assert_eq!(result.value, 4.0);
    let states: Vec<TaskState> = result.tasks.iter().map(|task| task.state).collect();
    use TaskState::{Done, Expired};
    assert_eq!(states, [Done, Done, Done, Done, Expired]);
    let order: Vec<String> = result
        .robots
        .iter()
        .map(|robot| format!("{}: {}", robot.id, robot.tasks.join(" ")))
        .collect();
    assert_eq!(order, ["blue: a b", "gold: c d"]);
    assert_eq!(result.tasks[1].robots, ["blue"]);
    for task in &result.tasks[..4] {
        let (begun_s, ended_s) = (task.begun_s.unwrap(), task.ended_s.unwrap());
        // A task with 2 s of work takes 2 s from its first to its last step.
        let work_s = ended_s - begun_s;
        let expected = if ["a", "c"].contains(&task.id.as_str()) {
            2.0
        } else {
            3.0
        };
        assert!((work_s - expected).abs() <= 0.1, "{task:?}");
    }
    assert_eq!(
        (result.tasks[4].begun_s, result.tasks[4].ended_s),
        (None, Some(3.0))
    );
    assert!(result.end_s >= result.tasks[3].ended_s.unwrap());
}

#[test]
fn a_complete_run_has_a_makespan() {
    let line: String = LINE
        .lines()
        .filter(|line| !line.starts_with("task,e"))
        .map(|line| format!("{line}\n"))
        .collect();
    let result = run_of(&line, "cbba").result.unwrap();
    assert_eq!(result.outcome, "complete");
    let last_s = result
        .tasks
        .iter()
        .filter_map(|task| task.ended_s)
        .fold(0.0, f64::max);
    assert_eq!(result.makespan_s, Some(last_s));
}

#[test]
fn runs_of_other_missions_have_no_instance() {
    let setup = Setup::resolve(testkit::shipped("parker-box"), 1, None)
        .unwrap()
        .setup;
    let mut scenario = setup.scenario;
    scenario.limit_s = 1.0;
    let log = testkit::run(Setup::resolve(scenario, 1, None).unwrap().setup);
    let refused = of_run(&log, &[]).unwrap_err().to_string();
    assert!(
        refused.ends_with("; only runs of the mission service have tasks at places"),
        "{refused}"
    );
}

#[test]
fn a_property_with_a_key_in_the_mission_is_written() {
    let text = r#"{
  "tasks": [
    { "id": "a", "x_m": 2, "y_m": 2, "work_s": 8, "opens_s": 30, "deadline_s": 90, "value": 2.5, "priority": 1 },
    { "id": "b", "x_m": 3, "y_m": 2, "work_s": 4, "needs": { "arm": 1, "camera": 2 }, "after": ["a"], "deliver_to": [4, 4] }
  ],
  "robots": [{ "id": "blue", "x_m": 1, "y_m": 1, "skills": { "arm": 1, "camera": 1, "lamp": 1 } }]
}"#;
    let loaded = crate::instance::formats::Format::Json
        .read(Source { name: "", text })
        .unwrap();
    let frame =
        crate::instance::frame::Frame::new(&loaded, None, Source { name: "", text: "" }).unwrap();
    let written = crate::instance::write::scenario(&loaded, &frame, "All.").unwrap();
    insta::assert_snapshot!(written.text);
}

#[test]
fn the_published_schema_is_up_to_date() {
    check_generated("docs/instance.schema.json", &format!("{:#}\n", schema()));
}
