//! World, router and agents, each started separately on its host.

use alliance_tests::harness::Process;
use nix::sys::signal::Signal;

use super::{Machines, Run, STALL_AFTER, WORLD};

const ROUTER: &str = "tls/10.0.0.2:7447";

const BEHIND: [&str; 2] = ["gold", "green"];

/// A run with robots gold and green on `h2` behind a router, and blue on `h3` without one.
struct Parts<'m> {
    run: Run<'m>,
    router: Process,
    agents: Vec<Process>,
}

fn places() -> [(&'static str, &'static [&'static str]); 3] {
    [("h1", &[]), ("h2", &BEHIND), ("h3", &["blue"])]
}

fn router(machines: &Machines) -> Process {
    let keys = machines.keys_of(&["host-h2", "robot-gold", "robot-green"]);
    machines.start(
        "h2",
        &[
            "cluster",
            "router",
            "--name",
            "h2",
            "--connect",
            WORLD,
            "--listen",
            ROUTER,
            "--keys",
            &keys,
            "--once",
        ],
    )
}

fn agent(machines: &Machines, host: &str, robot: &str, to: &str) -> Process {
    let keys = machines.keys_of(&[&format!("robot-{robot}")]);
    machines.start(
        host,
        &[
            "cluster",
            "agent",
            "--robot",
            robot,
            "--connect",
            to,
            "--keys",
            &keys,
        ],
    )
}

fn start<'m>(machines: &'m Machines, arguments: &[&str]) -> Parts<'m> {
    let common = [
        "cluster",
        "world",
        "waste-cleanup",
        "--listen",
        WORLD,
        "--keys",
        "keys",
        "--place",
        "h2=gold,green",
        "--out",
        "run",
    ];
    let launcher = machines.start("h1", &[&common, arguments].concat());
    let router = router(machines);
    let mut agents = vec![agent(machines, "h3", "blue", WORLD)];
    agents.extend(BEHIND.map(|robot| agent(machines, "h2", robot, ROUTER)));
    Parts {
        run: Run { machines, launcher },
        router,
        agents,
    }
}

#[test]
fn robots_behind_a_router_and_without_one_give_the_bytes_of_one_machine() {
    let Some(machines) = Machines::enter(3, &places()) else {
        return;
    };
    // The two hosts can communicate only through the world.
    machines.hosts.cut("h2", "h3");
    machines.hosts.cut("h3", "h2");
    let parts = start(&machines, &["--limit", "60", "--stall-after", "30"]);
    parts.run.end();
    for agent in parts.agents {
        agent.wait().expect(0);
    }
    parts.router.wait().expect(0);
    machines.assert_same_as_one_machine("60");
    machines.replayed_log();
}

#[test]
fn a_killed_router_ends_the_incarnations_behind_it_and_they_join_again() {
    let Some(machines) = Machines::enter(3, &places()) else {
        return;
    };
    let arguments = [
        "--limit",
        "200",
        "--speed",
        "10x",
        "--stall-after",
        STALL_AFTER,
    ];
    let Parts {
        mut run,
        router: first,
        agents,
    } = start(&machines, &arguments);
    run.wait_for("activated", &BEHIND, 1);
    first.signal(Signal::SIGKILL);
    let _ = first.wait();
    run.wait_for("gone", &BEHIND, 1);
    run.run_for(5);
    let second = router(&machines);
    run.wait_for_second_incarnations(&BEHIND);
    run.end_soon();
    // The agents' processes are still the first ones.
    for agent in agents {
        agent.wait().expect(0);
    }
    second.wait().expect(0);
    machines.assert_inputs(&["joined 1", "gone 1", "joined 2"]);
}
