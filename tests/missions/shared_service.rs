//! Every allocator in the service mission of `analysis/sweeps/allocators-service.toml`, which sweeps seeds and faults.

use missions::Registry;
use proto::tick::Outcome;
use scenario::Scenario;

use crate::harness::Lab;
use crate::negotiation::checked;

const PLAN: &str = include_str!("../../analysis/sweeps/allocators-service.toml");

const KILL: &str = "faults.timeline = [{ fault.kill = \"gold\", when = \"gold finishes\" }]\n";

/// Returns the mission of the plan as a scenario file with an allocator and faults.
fn text(allocator: &str, faults: &str) -> String {
    let plan: toml::Table = toml::from_str(PLAN).unwrap();
    let mission = toml::to_string(&plan["scenario"]).unwrap();
    format!("allocator = \"{allocator}\"\n{faults}{mission}")
}

pub fn scenario(allocator: &str, faults: &str) -> Scenario {
    let known = Registry::built_in().vocabulary();
    Scenario::parse("s.toml", &text(allocator, faults), &known).unwrap()
}

/// Compares one allocator of each communication pattern, with a real SIGKILL.
#[test]
fn processes_and_one_process_write_the_same_bytes() {
    for allocator in ["l-alliance", "murdoch", "acbba", "oracle"] {
        let lab = Lab::new();
        std::fs::write(lab.path("s.toml"), text(allocator, KILL)).unwrap();
        let arguments = ["s.toml", "--limit", "120"];
        lab.mission("many", &arguments).expect(1);
        lab.run(&[&["run", "--in-process", "--out", "one"], &arguments[..]].concat())
            .expect(1);
        lab.assert_same_bytes("many", "one");
    }
}

#[test]
fn the_work_of_a_crashed_robot_is_done() {
    for allocator in Registry::built_in().vocabulary().allocators {
        let name = allocator.name;
        if name == "threshold" {
            // This allocator leaves its tasks so often that the test would take long.
            continue;
        }
        let (outcome, log, violation) = checked(scenario(name, KILL));
        assert_eq!(violation, None, "{name}");
        let expected = match name {
            "static" => Outcome::TimeLimit,
            _ => Outcome::Complete,
        };
        assert_eq!(outcome, expected, "{name}");
        let done = log.run.result.mission.get("done").count();
        assert_eq!(done == 24, name != "static", "{name}: {done}");
    }
}
