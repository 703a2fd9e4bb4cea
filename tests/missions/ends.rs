//! Processes that end unexpectedly, and the state of the run afterwards.

use alliance_tests::harness::{Lab, command_line, wait_until};
use alliance_tests::team::Team;
use nix::sys::signal::Signal;
use proto::tick::Outcome;
use run_log::{RunLog, RunOutcome, TickRow};

/// Checks that the log of a run with a killed world is readable and complete up to a tick.
#[track_caller]
fn assert_whole_up_to_a_tick(log: &RunLog) {
    assert_eq!(log.run.outcome, RunOutcome::Running);
    let last = log.last.as_ref().unwrap();
    assert!(last.tick > 0);
    let ticks = log.rows::<TickRow>().unwrap();
    for tick in 0..=last.tick {
        assert!(
            ticks
                .iter()
                .any(|row| row.tick == tick && row.section == "run"),
            "tick {tick} of {} is missing",
            last.tick
        );
    }
}

#[test]
fn when_the_world_is_killed_the_agents_end_and_the_launcher_reports_it() {
    let lab = Lab::new();
    let mut team = Team::start(&lab, &["--speed", "20x"]);
    team.wait_for_row("events.csv", &[",activated,"]);
    let agents = ["blue", "gold", "green"].map(|robot| team.pid(robot));
    team.signal("world", Signal::SIGKILL);
    let finished = team.wait().expect(3);
    assert!(
        finished.stderr.contains("the world was killed by SIGKILL"),
        "{}",
        finished.stderr
    );
    assert!(
        !finished.stderr.contains("had to be killed"),
        "the agents must end by themselves: {}",
        finished.stderr
    );
    assert!(agents.iter().all(|pid| command_line(*pid).is_none()));
    assert_whole_up_to_a_tick(&lab.log("run"));
}

#[test]
fn a_separate_agent_whose_world_is_killed_ends_with_the_reason() {
    let lab = Lab::new();
    let world = lab.start(&["cluster", "world", "--out", "run", "--speed", "20x"]);
    let robots = ["blue", "gold", "green"];
    let agents = robots.map(|robot| lab.start(&["cluster", "agent", "--robot", robot]));
    wait_until("work", || {
        std::fs::read_to_string(lab.path("run/events.csv"))
            .is_ok_and(|events| events.contains(",activated,"))
    });
    world.signal(Signal::SIGKILL);
    for agent in agents {
        let finished = agent.wait().expect(3);
        assert!(
            finished
                .stderr
                .contains("the connection to the world is lost"),
            "{}",
            finished.stderr
        );
    }
    assert_whole_up_to_a_tick(&lab.log("run"));
}

#[test]
fn when_the_launcher_is_killed_all_processes_end_including_a_stopped_agent() {
    let lab = Lab::new();
    let mut team = Team::start(&lab, &["--speed", "20x"]);
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
    let mut team = Team::start(&lab, &["--speed", "60x", "--limit", "10000"]);
    team.wait_for_row("events.csv", &[",delivered,"]);
    team.signal("gold", Signal::SIGUSR1);
    team.wait_for_row("events.csv", &[",gone,gold,"]);
    let finished = team.wait().expect(0);
    assert!(
        finished.stderr.contains("gold crashed"),
        "{}",
        finished.stderr
    );
    assert!(
        finished.stderr.contains("a bug in the agent"),
        "the panic message must be shown: {}",
        finished.stderr
    );
    let result: serde_json::Value = serde_json::from_str(&finished.stdout).unwrap();
    assert_eq!(result["result"]["items"]["delivered"], 24);
}
