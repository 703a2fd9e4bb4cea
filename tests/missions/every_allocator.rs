//! Every allocator with thirty robots, in push and in observe, with a crash and message loss. Other tests cover some
//! of them.

use missions::Registry;
use missions::waste::data::family;
use scenario::fault::{Fault, Order};
use scenario::{Scenario, Vocabulary};

use crate::harness::Lab;
use crate::negotiation::checked;

/// Returns a message loss of 30 % and a kill of `victim` at `at_s`.
fn loss_and_kill(victim: &str, at_s: f64) -> Vec<Order> {
    let loss = "fault.drop = { from = 'all', to = 'all', p = 0.3 }\nat_s = 0.0";
    let kill = Order {
        at_s: Some(at_s),
        ..Order::now(Fault::Kill(victim.to_owned()))
    };
    vec![toml::from_str(loss).unwrap(), kill]
}

fn builtin(known: &Vocabulary, name: &str) -> Scenario {
    let builtin = known.builtin(name).unwrap();
    Scenario::parse(builtin.name, builtin.text, known).unwrap()
}

/// Checks that in a large team the invariants hold in each tick, and that items are delivered.
#[test]
fn thirty_robots_work_with_every_allocator() {
    for allocator in Registry::built_in().vocabulary().allocators {
        let mut scenario = family(30, 20);
        scenario.allocator = Some(allocator.name.to_owned());
        scenario.limit_s = 200.0;
        scenario.faults.timeline = loss_and_kill("r1", 100.0);
        let (_, log, violation) = checked(scenario);
        assert_eq!(violation, None, "{}", allocator.name);
        let delivered = log.run.result.mission.get("items.delivered").count();
        assert!(delivered > 0, "{}", allocator.name);
    }
}

#[test]
fn every_allocator_pushes_and_observes() {
    let known = Registry::built_in().vocabulary();
    for allocator in &known.allocators {
        for (mission, victim) in [("parker-box", "blue"), ("cmommt-crowded", "gold")] {
            let mut scenario = builtin(&known, mission);
            scenario.allocator = Some(allocator.name.to_owned());
            scenario.limit_s = scenario.limit_s.min(120.0);
            scenario.faults.timeline = loss_and_kill(victim, 30.0);
            let (_, log, violation) = checked(scenario);
            assert_eq!(violation, None, "{mission} by {}", allocator.name);
            let worked = match mission {
                "parker-box" => log.run.result.mission.get("strokes").count() > 0,
                _ => log.run.result.mission.get("a").number().unwrap() > 0.0,
            };
            assert!(worked, "{mission} by {}", allocator.name);
        }
    }
}

/// Compares one allocator of each communication pattern, with a real SIGKILL. The waste and service missions are covered by
/// `shared_service`, `allocators`, `consensus`, `negotiation` and `learning`.
#[test]
fn processes_and_one_process_write_the_same_bytes() {
    let known = Registry::built_in().vocabulary();
    for allocator in ["l-alliance", "ble", "murdoch", "acbba", "grape", "oracle"] {
        for (mission, victim) in [("parker-box", "blue"), ("cmommt-crowded", "gold")] {
            let lab = Lab::new();
            let mut scenario = builtin(&known, mission);
            scenario.allocator = Some(allocator.to_owned());
            scenario.limit_s = 8.0;
            scenario.faults.timeline = loss_and_kill(victim, 4.0);
            std::fs::write(lab.path("s.toml"), scenario.to_toml().unwrap()).unwrap();
            let many = lab.mission("many", &["s.toml"]);
            let one = lab.run(&["run", "--in-process", "--out", "one", "s.toml"]);
            assert!(matches!(one.status.code(), Some(0 | 1)), "{}", one.stderr);
            assert_eq!(many.status, one.status, "{mission} by {allocator}");
            lab.assert_same_bytes("many", "one");
            assert_eq!(
                lab.log("many").run.faults[1].hits,
                1,
                "{mission} by {allocator}"
            );
        }
    }
}
