//! World, router and agents, each started separately on its host.

use alliance_tests::harness::{Process, expect_all};
use nix::sys::signal::Signal;

use super::{AWAY, Machines, Run, STALL_AFTER, WORLD};

const ROUTER: &str = "tls/10.0.0.2:7447";

const PLACES: [(&str, &[&str]); 3] = [("h1", &[]), ("h2", &AWAY), ("h3", &["blue"])];

/// A run with robots gold and green on `h2` behind a router, and blue on `h3` without one.
struct Parts<'m> {
    run: Run<'m>,
    router: Process,
    agents: Vec<Process>,
}

fn router(machines: &Machines) -> Process {
    let keys = machines.keys_of(&["host-h2", "robot-gold", "robot-green"]);
    let router = format!(
        "cluster router --name h2 --connect {WORLD} --listen {ROUTER} --keys {keys} --once"
    );
    machines.start("h2", router)
}

fn agent(machines: &Machines, host: &str, robot: &str, to: &str) -> Process {
    let keys = machines.keys_of(&[&format!("robot-{robot}")]);
    let agent = format!("cluster agent --robot {robot} --connect {to} --keys {keys}");
    machines.start(host, agent)
}

fn start<'m>(machines: &'m Machines, arguments: &str) -> Parts<'m> {
    let world = format!(
        "cluster world waste-cleanup --listen {WORLD} --keys keys --place h2=gold,green --out run"
    );
    let launcher = machines.start("h1", format!("{world} {arguments}"));
    let router = router(machines);
    let mut agents = vec![agent(machines, "h3", "blue", WORLD)];
    agents.extend(AWAY.map(|robot| agent(machines, "h2", robot, ROUTER)));
    Parts {
        run: Run { machines, launcher },
        router,
        agents,
    }
}

#[test]
fn robots_behind_a_router_and_without_one_give_the_bytes_of_one_machine() {
    let Some(machines) = Machines::enter(3, &PLACES) else {
        return;
    };
    // The two hosts can communicate only through the world.
    machines.hosts.cut("h2", "h3");
    machines.hosts.cut("h3", "h2");
    let parts = start(&machines, "--limit 60 --stall-after 30");
    parts.run.end();
    expect_all(parts.agents, 0);
    parts.router.wait().expect(0);
    machines.assert_same_as_one_machine("60");
    machines.replayed_log();
}

#[test]
fn a_killed_router_ends_the_incarnations_behind_it_and_they_join_again() {
    let Some(machines) = Machines::enter(3, &PLACES) else {
        return;
    };
    let arguments = format!("--limit 200 --speed 4x --stall-after {STALL_AFTER}");
    let Parts {
        mut run,
        router: first,
        agents,
    } = start(&machines, &arguments);
    run.wait_for("activated", &AWAY);
    first.signal(Signal::SIGKILL);
    let _ = first.wait();
    run.wait_for("gone", &AWAY);
    run.run_for(5);
    let second = router(&machines);
    run.wait_for_second_incarnations();
    run.end_soon();
    // The agents' processes are still the first ones.
    expect_all(agents, 0);
    second.wait().expect(0);
    machines.assert_inputs(&["joined 1", "gone 1", "joined 2"]);
}
