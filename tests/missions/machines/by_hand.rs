//! World, router and agents, each started by hand on its host.

use nix::sys::signal::Signal;

use super::{Machines, Run, STALL_AFTER, WORLD, sleep};
use crate::harness::Process;

/// Where the router of `h2` is reached.
const ROUTER: &str = "tls/10.0.0.2:7447";

const BEHIND: [&str; 2] = ["gold", "green"];

/// A run whose robots gold and green are on `h2` behind a router, and blue on `h3` by itself.
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
        &["agent", "--robot", robot, "--connect", to, "--keys", &keys],
    )
}

fn start<'m>(machines: &'m Machines, arguments: &[&str]) -> Parts<'m> {
    let common = [
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
fn behind_a_router_and_by_itself_gives_the_bytes_of_one_machine() {
    let Some(machines) = Machines::enter(3, &places()) else {
        return;
    };
    // Robots of two hosts speak by way of the world alone.
    machines.hosts.cut("h2", "h3");
    machines.hosts.cut("h3", "h2");
    let parts = start(&machines, &["--limit", "60", "--stall-after", "30"]);
    parts.run.end();
    for agent in parts.agents {
        agent.wait().expect(0);
    }
    parts.router.wait().expect(0);
    machines.assert_as_alone("60");
    machines.repeated();
}

#[test]
fn a_router_that_is_killed_ends_the_lives_behind_it_and_back_again_they_join_anew() {
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
    run.go_on(5);
    let second = router(&machines);
    run.wait_for_second_lives(&BEHIND);
    run.end_soon();
    // The processes are still those of the beginning.
    for agent in agents {
        agent.wait().expect(0);
    }
    second.wait().expect(0);
    machines.assert_fates(&["life 1", "end of 1", "life 2"]);
}

#[test]
fn a_router_that_is_stopped_makes_those_behind_it_silent() {
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
        router,
        agents,
    } = start(&machines, &arguments);
    run.wait_for("activated", &BEHIND, 1);
    router.signal(Signal::SIGSTOP);
    sleep(3);
    run.wait_for("stalled", &BEHIND, 1);
    run.go_on(5);
    router.signal(Signal::SIGCONT);
    run.wait_for("back", &BEHIND, 1);
    run.end_soon();
    for agent in agents {
        agent.wait().expect(0);
    }
    router.wait().expect(0);
    machines.assert_fates(&["life 1", "silent", "back"]);
}
