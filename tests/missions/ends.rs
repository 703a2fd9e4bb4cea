//! Processes that end unexpectedly, and the state of the run afterwards.

use alliance_tests::harness::{Lab, command_line, wait_until};
use alliance_tests::team::Team;
use alliance_tests::testkit::{ROBOTS, assert_whole_up_to_a_tick};
use nix::sys::signal::Signal;
use proto::tick::Outcome;
use run_log::RunOutcome;

#[test]
fn when_the_world_is_killed_the_agents_end_and_the_launcher_reports_it() {
    let lab = Lab::new();
    let mut team = Team::start(&lab, "--speed 20x");
    team.wait_for_row("events.csv", &[",activated,"]);
    let agents = ROBOTS.map(|robot| team.pid(robot));
    team.signal("world", Signal::SIGKILL);
    let finished = team.wait().expect(3);
    finished.shows("the world was killed by SIGKILL");
    let stderr = &finished.stderr;
    let is_killed = stderr.contains("had to be killed");
    assert!(!is_killed, "the agents must end by themselves: {stderr}");
    assert!(agents.iter().all(|pid| command_line(*pid).is_none()));
    assert_whole_up_to_a_tick(&lab.log("run"));
}

#[test]
fn when_the_launcher_is_killed_all_processes_end_including_a_stopped_agent() {
    let lab = Lab::new();
    let mut team = Team::start(&lab, "--speed 20x");
    team.wait_for_row("events.csv", &[",activated,"]);
    team.signal("gold", Signal::SIGSTOP);
    team.wait_for_row("events.csv", &[",stalled,gold,"]);
    let children = team.launcher().children();
    assert_eq!(children.len(), 4);
    team.launcher().signal(Signal::SIGKILL);
    wait_until("the end of every process", || {
        children.iter().all(|pid| command_line(*pid).is_none())
    });
    let log = lab.log("run");
    assert!(log.last.is_some());
    // The world had time to complete its log.
    assert_eq!(log.run.outcome, RunOutcome::Ended(Outcome::Interrupted));
}

#[test]
fn an_agent_that_panics_is_reported_as_a_crash_with_its_message_and_the_team_continues() {
    let lab = Lab::new();
    let mut team = Team::start(&lab, "--speed 60x --limit 10000");
    team.wait_for_row("events.csv", &[",delivered,"]);
    team.signal("gold", Signal::SIGUSR1);
    team.wait_for_row("events.csv", &[",gone,gold,"]);
    let finished = team.wait().expect(0);
    finished.shows("gold crashed").shows("a bug in the agent");
    assert_eq!(finished.json()["result"]["items"]["delivered"], 24);
}
