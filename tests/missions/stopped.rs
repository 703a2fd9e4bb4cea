//! A stopped and continued agent.

use alliance_tests::harness::{Lab, join, wait_until};
use alliance_tests::runs::{self, Events};
use alliance_tests::team::Team;
use nix::sys::signal::Signal;
use run_log::MotivationRow;

#[test]
fn the_team_continues_without_a_stopped_agent_which_later_returns_and_works() {
    let lab = Lab::new();
    // The deadline never passes, so only the launcher can report the stop.
    let mut team = Team::start(&lab, "--speed 50x --stall-after 3600");
    team.wait_for_row("events.csv", &[",delivered,"]);
    team.signal("gold", Signal::SIGSTOP);
    let stalled = team.wait_for_row("events.csv", &[",stalled,gold,"]);
    let time = |row: &str| row.split(',').next().unwrap().parse().unwrap_or(0_u64);
    // Ten more seconds of simulated time pass without the stopped agent.
    wait_until("the others to continue", || {
        let poses = lab.text("run/poses.csv");
        time(poses.trim_end().lines().last().unwrap_or_default()) > time(&stalled) + 10_000
    });
    team.signal("gold", Signal::SIGCONT);
    team.wait_for_row("events.csv", &[",back,gold,"]);
    let result = team.wait().expect(0).json();
    assert_eq!(result["result"]["items"]["delivered"], 24);
    let why = "the scenario does not contain the stop";
    assert_eq!(result["unscripted"], true, "{why}");
    // The incarnation is the same.
    assert_eq!(result["result"]["robots"]["gold"]["incarnations"], 1);

    let log = lab.log("run");
    let away = log.times_of("gold", "stalled")[0];
    let back = log.times_of("gold", "back")[0];
    assert!(back > away + 10_000);
    // A robot has motivation rows for exactly the ticks in which it takes part.
    let mut rows = log.rows::<MotivationRow>().unwrap();
    rows.retain(|row| row.robot == "gold");
    let counted: Vec<u64> = rows.iter().map(|row| row.t_ms.0).collect();
    let is_away = |t_ms: &u64| (away..back).contains(t_ms);
    assert!(!counted.iter().any(is_away), "rows of the stopped agent");
    assert!(counted.contains(&back), "a row in the tick of the return");
    let last = log.last.as_ref().map(|last| last.now.0);
    assert_eq!(counted.last().copied(), last, "rows to the end of the run");
}

/// The news of a stop can arrive before a report that the agent sent earlier.
#[test]
fn a_report_from_before_the_stop_is_not_the_return_of_the_agent() {
    let lab = Lab::new();
    let mut scenario = runs::builtin("waste-cleanup");
    // Ten seconds, enough for the return on a busy machine.
    scenario.limit_s = 100.0;
    scenario.robots[1].controller = Some("liar".to_owned());
    lab.write("mine.toml", scenario.to_toml().unwrap());
    let controller = format!("liar={} stopped", env!("CARGO_BIN_EXE_liar"));
    let options = ["--controller", &controller, "mine.toml", "--speed", "10x"];
    let options = join(options, "--stall-after 3600");
    lab.mission("run", options).expect(1);

    let log = lab.log("run");
    let [away, back] = ["stalled", "back"].map(|kind| log.times_of("gold", kind));
    assert_eq!((away.len(), back.len()), (1, 1), "{away:?} {back:?}");
    // It returns when the news of its continuation arrive.
    assert!(back[0] >= away[0] + 1_000, "{away:?} {back:?}");
    lab.assert_repeated("run");
}
