//! Every allocator on a mission of service: as `study/sweeps/allocators-service.toml` plays it with many seeds and faults.

use alliance_proto::scenario::Scenario;
use alliance_proto::tick::Outcome;
use missions::Registry;

use crate::harness::Lab;
use crate::negotiation::checked;

const PLAN: &str = include_str!("../../study/sweeps/allocators-service.toml");

const KILL: &str = "faults.timeline = [{ fault.kill = \"gold\", when = \"gold finishes\" }]\n";

/// The mission of the plan as a scenario file, with a line on top.
fn text(allocator: &str, faults: &str) -> String {
    let plan: toml::Table = toml::from_str(PLAN).unwrap();
    let mission = toml::to_string(&plan["scenario"]).unwrap();
    format!("allocator = \"{allocator}\"\n{faults}{mission}")
}

/// The same, read.
pub fn scenario(allocator: &str, faults: &str) -> Scenario {
    let known = Registry::built_in().vocabulary();
    Scenario::parse("s.toml", &text(allocator, faults), &known).unwrap()
}

/// Of each pattern of talking one allocator, with a real SIGKILL.
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

/// Whoever does not wait for the dead does their work, too, and what must hold in every run holds.
#[test]
fn the_work_of_the_dead_is_done() {
    for allocator in Registry::built_in().vocabulary().allocators {
        let name = allocator.name;
        if name == "threshold" {
            // It leaves its work so often that this would take long.
            continue;
        }
        let (outcome, log, violation) = checked(scenario(name, KILL));
        assert_eq!(violation, None, "{name}");
        let wanted = match name {
            "static" => Outcome::TimeLimit,
            _ => Outcome::Complete,
        };
        assert_eq!(outcome, wanted, "{name}");
        let done = log.run.result.mission.get("done").count();
        assert_eq!(done == 24, name != "static", "{name}: {done}");
    }
}
