//! A world and its agents started from separate terminals, in any order.

use alliance_tests::harness::{Lab, Process};

const LIMIT: &str = "50";

fn world(lab: &Lab) -> Process {
    lab.start(&["cluster", "world", "--out", "run", "--limit", LIMIT])
}

fn agent(lab: &Lab, robot: &str) -> Process {
    lab.start(&["cluster", "agent", "--robot", robot])
}

/// Returns the hash of the same run under `alliance run`.
fn expected(lab: &Lab) -> Option<String> {
    lab.mission("expected", &["--limit", LIMIT]).expect(1);
    lab.log("expected").run.hash
}

#[test]
fn the_world_lists_missing_robots_and_refuses_unknown_and_duplicate_agents() {
    let lab = Lab::new();
    let mut world = world(&lab);
    world.wait_for_stderr("waiting for blue, gold, green");
    let gold = agent(&lab, "gold");
    world.wait_for_stderr("waiting for blue, green");

    let second = agent(&lab, "gold").wait().expect(3);
    let expected_text =
        "robot-agent gold: refused: robot 'gold' already has a live agent (incarnation 1)";
    assert!(second.stderr.contains(expected_text), "{}", second.stderr);
    let unknown = agent(&lab, "red").wait().expect(3);
    let expected_text = "robot-agent red: refused: the scenario has no robot 'red'; its robots are blue, gold, green";
    assert!(unknown.stderr.contains(expected_text), "{}", unknown.stderr);

    let green = agent(&lab, "green");
    let blue = agent(&lab, "blue");
    world.wait_for_stderr("all robots are here; started");
    for agent in [blue, gold, green] {
        agent.wait().expect(0);
    }
    let world = world.wait().expect(1);
    assert!(!world.stderr.contains("waiting for \n"), "{}", world.stderr);
    // Refused agents leave no trace in the log.
    assert_eq!(lab.log("run").run.hash, expected(&lab));
    lab.assert_same_bytes("run", "expected");
}

#[test]
fn the_order_in_which_the_processes_start_changes_no_byte() {
    let orders = [
        ["green", "gold", "blue", "world"],
        ["gold", "world", "green", "blue"],
    ];
    for order in orders {
        let lab = Lab::new();
        let mut processes = Vec::new();
        for name in order {
            let mut process = match name {
                "world" => world(&lab),
                robot => agent(&lab, robot),
            };
            // Each process must be ready before the next starts.
            let begun = match name {
                "world" => "waiting for ",
                _ if processes.iter().any(|(name, _)| *name == "world") => "joined",
                _ => "no run is live; waiting for the next",
            };
            process.wait_for_stderr(begun);
            processes.push((name, process));
        }
        for (name, process) in processes {
            process.wait().expect(i32::from(name == "world"));
        }
        assert_eq!(lab.log("run").run.hash, expected(&lab), "{order:?}");
        lab.assert_same_bytes("run", "expected");
    }
}

#[test]
fn an_agent_of_a_missing_run_reports_the_live_runs() {
    let lab = Lab::new();
    let agent_alone = lab
        .run(&["cluster", "agent", "--robot", "blue", "--run", "gone"])
        .expect(3);
    assert!(
        agent_alone
            .stderr
            .contains("robot-agent blue: no live run 'gone'; live runs: none"),
        "{}",
        agent_alone.stderr
    );
}
