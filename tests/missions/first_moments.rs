//! Signals from the start of a run on. A process that ends or stops before it has joined is treated like a later one,
//! and a waiting run names the robots it waits for.

use alliance_tests::harness::Lab;
use alliance_tests::team::Team;
use alliance_tests::testkit::ROBOTS;
use nix::sys::signal::Signal;
use run_log::Input;

/// The others complete the mission in any case, and a replay repeats the run.
#[test]
fn a_robot_that_ends_before_it_joined_is_a_crashed_robot() {
    for signal in [Signal::SIGKILL, Signal::SIGTERM] {
        let lab = Lab::new();
        let team = Team::start(&lab, lab.mission_of(4));
        team.try_signal("gold", signal);
        let finished = team.wait().expect(0);
        assert_eq!(finished.json()["outcome"], "complete", "{signal}");
        let inputs = lab.log("run").inputs().unwrap();
        let is_gold = |input: &Input| matches!(input, Input::Gone { robot, .. } if robot == "gold");
        let crashes = inputs.iter().filter(|line| is_gold(&line.input)).count();
        assert_eq!(crashes, 1, "{signal}: {}", finished.stderr);
        lab.assert_repeated("run");
    }
}

/// The world may end before the launcher has joined the bus. This is no problem of the run.
#[test]
fn a_run_that_ends_at_once_is_not_reported_as_unobserved() {
    let lab = Lab::new();
    for run in 0..8 {
        let finished = lab.mission(&format!("run-{run}"), "--limit 0.2").expect(1);
        let stderr = &finished.stderr;
        assert!(!stderr.contains("cannot observe"), "{stderr}");
    }
}

/// The processes are still starting, and their handlers of signals may be missing.
#[test]
fn a_run_that_is_interrupted_at_its_start_has_the_status_of_an_interrupted_run() {
    for _ in 0..6 {
        let lab = Lab::new();
        let team = Team::start(&lab, "--speed 1x");
        team.launcher().signal(Signal::SIGINT);
        let stderr = team.wait().expect(130).stderr;
        assert!(!stderr.contains("was killed"), "{stderr}");
    }
}

#[test]
fn a_robot_that_is_stopped_before_it_joined_takes_part_later() {
    let lab = Lab::new();
    let mut team = Team::start(&lab, "--speed 20x");
    team.signal("gold", Signal::SIGSTOP);
    team.wait_for_row("events.csv", &[",activated,"]);
    team.signal("gold", Signal::SIGCONT);
    team.wait_for_row("events.csv", &[",activated,gold,"]);
    team.signal("world", Signal::SIGTERM);
    team.wait();
    lab.assert_repeated("run");
}

/// If all robots are stopped, the terminal and the status name the awaited robots. The run continues with them.
#[test]
fn a_waiting_run_names_the_robots_it_waits_for() {
    let lab = Lab::new();
    let mission = lab.mission_of(4);
    let mut team = Team::start(&lab, format!("{mission} --speed 5x"));
    team.wait_for_row("events.csv", &[",activated,"]);
    for robot in ROBOTS {
        team.signal(robot, Signal::SIGSTOP);
    }
    let blue = format!("blue (process {})", team.pid("blue"));
    team.wait_for_stderr(&format!("it waits for {blue}"));
    lab.run("status").expect(0).shows(&blue);
    for robot in ROBOTS {
        team.signal(robot, Signal::SIGCONT);
    }
    lab.run("clock speed max").expect(0);
    team.wait().expect(0).shows("Ctrl-C ends the run");
    lab.assert_repeated("run");
}
