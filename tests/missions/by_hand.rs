//! A world and its agents started from separate terminals, in any order.

use alliance_tests::harness::{Lab, Process, expect_all, wait_until};
use alliance_tests::testkit::{ROBOTS, assert_whole_up_to_a_tick};
use nix::sys::signal::Signal;

fn world(lab: &Lab) -> Process {
    lab.world("run", "--limit 50")
}

/// Checks that the run has the bytes of the same run under `alliance run`.
#[track_caller]
fn assert_as_expected(lab: &Lab) {
    lab.mission("expected", "--limit 50").expect(1);
    let hash = |out: &str| lab.log(out).run.hash;
    assert_eq!(hash("run"), hash("expected"));
    lab.assert_same_bytes("run", "expected");
}

#[test]
fn the_world_lists_missing_robots_and_refuses_unknown_and_duplicate_agents() {
    let lab = Lab::new();
    let gone = lab.run("cluster agent --robot blue --run gone").expect(3);
    gone.shows("robot-agent blue: no live run 'gone'; live runs: none");
    let mut world = world(&lab);
    world.wait_for_stderr("waiting for blue, gold, green");
    let gold = lab.agent("gold");
    world.wait_for_stderr("waiting for blue, green");

    let second = lab.agent("gold").wait().expect(3);
    second
        .shows("robot-agent gold: refused: robot 'gold' already has a live agent (incarnation 1)");
    let unknown = lab.agent("red").wait().expect(3);
    unknown.shows("robot-agent red: refused: the scenario has no robot 'red'; its robots are blue, gold, green");

    let agents = [gold, lab.agent("green"), lab.agent("blue")];
    world.wait_for_stderr("all robots are here; started");
    expect_all(agents, 0);
    let world = world.wait().expect(1);
    assert!(!world.stderr.contains("waiting for \n"), "{}", world.stderr);
    // Refused agents leave no trace in the log.
    assert_as_expected(&lab);
}

#[test]
fn the_order_in_which_the_processes_start_changes_no_byte() {
    for order in [
        ["green", "gold", "blue", "world"],
        ["gold", "world", "green", "blue"],
    ] {
        let lab = Lab::new();
        let (mut processes, mut has_world) = (Vec::new(), false);
        for name in order {
            // Each process must be ready before the next starts.
            let (mut process, begun) = match name {
                "world" => (world(&lab), "waiting for "),
                robot if has_world => (lab.agent(robot), "joined"),
                robot => (lab.agent(robot), "no run is live; waiting for the next"),
            };
            process.wait_for_stderr(begun);
            has_world |= name == "world";
            processes.push((name, process));
        }
        for (name, process) in processes {
            process.wait().expect(i32::from(name == "world"));
        }
        assert_as_expected(&lab);
    }
}

/// Without a launcher, the deadline alone detects a stopped agent, and agents detect the end of their world.
#[test]
fn a_stopped_agent_is_detected_by_the_deadline_and_a_killed_world_by_its_agents() {
    let lab = Lab::new();
    let world = lab.world("run", "--speed 20x --stall-after 0.3");
    let agents = ROBOTS.map(|robot| lab.agent(robot));
    let wait_for = |event: &str| {
        let events = lab.path("run/events.csv");
        wait_until(event, || {
            std::fs::read_to_string(&events).is_ok_and(|text| text.contains(event))
        });
    };
    wait_for(",activated,");
    agents[1].signal(Signal::SIGSTOP);
    wait_for(",stalled,gold,");
    agents[1].signal(Signal::SIGCONT);
    wait_for(",back,gold,");
    world.signal(Signal::SIGKILL);
    for agent in expect_all(agents, 3) {
        agent.shows("the connection to the world is lost");
    }
    assert_whole_up_to_a_tick(&lab.log("run"));
}
