//! Processes that end when they should not, and what is left of the run then (issue "It holds", item 4).

use alliance_proto::log::{RunLog, RunOutcome, TickRow};
use alliance_proto::tick::Outcome;
use nix::sys::signal::Signal;

use crate::harness::{Lab, command_line, wait_until};
use crate::team::Team;

/// The log of a run whose world was killed is readable, and whole up to a tick.
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
fn when_the_world_is_killed_the_agents_end_and_the_launcher_says_so() {
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
        "agents end by themselves: {}",
        finished.stderr
    );
    assert!(agents.iter().all(|pid| command_line(*pid).is_none()));
    assert_whole_up_to_a_tick(&lab.log("run"));
}

#[test]
fn by_hand_an_agent_whose_world_is_killed_ends_and_says_why() {
    let lab = Lab::new();
    let world = lab.start(&["world", "--out", "run", "--speed", "20x"]);
    let robots = ["blue", "gold", "green"];
    let agents = robots.map(|robot| lab.start(&["agent", "--robot", robot]));
    wait_until("work", || {
        std::fs::read_to_string(lab.path("run/events.csv"))
            .is_ok_and(|events| events.contains(",activated,"))
    });
    world.signal(Signal::SIGKILL);
    for agent in agents {
        let finished = agent.wait().expect(3);
        assert!(
            finished.stderr.contains("the world is gone"),
            "{}",
            finished.stderr
        );
    }
    assert_whole_up_to_a_tick(&lab.log("run"));
}

#[test]
fn when_the_launcher_is_killed_nothing_is_left_running_not_even_a_stopped_agent() {
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
    // The world had the time to end its log.
    assert_eq!(log.run.outcome, RunOutcome::Ended(Outcome::Interrupted));
}

#[test]
fn an_agent_that_panics_is_reported_as_a_crash_with_its_last_words_and_the_team_goes_on() {
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
        "its message is shown: {}",
        finished.stderr
    );
    let result: serde_json::Value = serde_json::from_str(&finished.stdout).unwrap();
    assert_eq!(result["result"]["items"]["delivered"], 24);
}
