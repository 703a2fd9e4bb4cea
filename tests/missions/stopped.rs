//! Stopped and continued agents.

use alliance_tests::harness::{Lab, wait_until};
use alliance_tests::team::Team;
use nix::sys::signal::Signal;
use run_log::{EventRow, MotivationRow, RunLog};

/// Returns the simulated times of a robot's events of a kind, in ms.
fn times(log: &RunLog, kind: &str, robot: &str) -> Vec<u64> {
    let rows = log.rows::<EventRow>().unwrap().into_iter();
    rows.filter(|row| row.kind == kind && row.robot == robot)
        .map(|row| row.t_ms.0)
        .collect()
}

#[test]
fn the_team_continues_without_a_stopped_agent_which_later_returns_and_works() {
    let lab = Lab::new();
    // The deadline never passes, so only the launcher can report the stop.
    let mut team = Team::start(&lab, &["--speed", "50x", "--stall-after", "3600"]);
    team.wait_for_row("events.csv", &[",delivered,"]);
    team.signal("gold", Signal::SIGSTOP);
    let stalled = team.wait_for_row("events.csv", &[",stalled,gold,"]);
    let stalled: u64 = stalled.split(',').next().unwrap().parse().unwrap();
    // Ten more seconds of simulated time pass without the stopped agent.
    wait_until("the others to continue", || {
        let mission = std::fs::read_to_string(lab.path("run/poses.csv")).unwrap();
        let last = mission.trim_end().lines().last().unwrap_or_default();
        let now = last.split(',').next().unwrap().parse().unwrap_or(0);
        now > stalled + 10_000
    });
    team.signal("gold", Signal::SIGCONT);
    team.wait_for_row("events.csv", &[",back,gold,"]);
    let finished = team.wait().expect(0);
    let result: serde_json::Value = serde_json::from_str(&finished.stdout).unwrap();
    assert_eq!(result["result"]["items"]["delivered"], 24);
    assert_eq!(
        result["unscripted"], true,
        "the scenario does not contain the stop"
    );

    let log = lab.log("run");
    let (away, back) = (
        times(&log, "stalled", "gold")[0],
        times(&log, "back", "gold")[0],
    );
    assert!(back > away + 10_000);
    // A robot has motivation rows for exactly the ticks in which it takes part.
    let counted: Vec<u64> = log
        .rows::<MotivationRow>()
        .unwrap()
        .into_iter()
        .filter(|row| row.robot == "gold")
        .map(|row| row.t_ms.0)
        .collect();
    assert!(
        !counted.iter().any(|t| (away..back).contains(t)),
        "no rows while the agent is stopped"
    );
    assert!(counted.contains(&back), "a row in the tick of the return");
    assert_eq!(
        counted.last(),
        log.last.as_ref().map(|last| last.now.0).as_ref(),
        "rows to the end of the run"
    );
    assert_eq!(
        result["result"]["robots"]["gold"]["incarnations"], 1,
        "the incarnation must be the same"
    );
}

#[test]
fn in_a_separate_world_the_stall_deadline_detects_a_stopped_agent() {
    let lab = Lab::new();
    let world = lab.start(&[
        "cluster",
        "world",
        "--out",
        "run",
        "--speed",
        "50x",
        "--stall-after",
        "0.3",
    ]);
    let robots = ["blue", "gold", "green"];
    let agents: Vec<_> = robots
        .iter()
        .map(|robot| lab.start(&["cluster", "agent", "--robot", robot]))
        .collect();
    let has = |text: &str| {
        std::fs::read_to_string(lab.path("run/events.csv"))
            .is_ok_and(|events| events.contains(text))
    };
    wait_until("work", || has(",delivered,"));
    agents[1].signal(Signal::SIGSTOP);
    wait_until("the deadline", || has(",stalled,gold,"));
    agents[1].signal(Signal::SIGCONT);
    wait_until("the return", || has(",back,gold,"));
    world.wait().expect(0);
    for agent in agents {
        agent.wait().expect(0);
    }
}
