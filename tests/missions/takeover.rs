//! The takeover times of ALLIANCE.md §4 by real processes, to one step, with steps of 10, 50 and 200 ms.
//!
//! The robots are too slow to make progress: find-locations is always the only applicable task, and a robot that
//! works on it fails.

use missions::waste::data::default_scenario;
use std::time::Duration;

use run_log::{EventRow, MessageRow, MotivationRow, RunLog};
use scenario::{BehaviorSection, Preset, RobotSection, Scenario, SwitchSection};

use crate::harness::Lab;
use crate::team::Team;

const STEPS_MS: [u64; 3] = [10, 50, 200];

/// Returns a scenario with θ=100, δ_slow=1, τ=5, a heartbeat per second, large ψ and λ, and δ_fast per robot.
fn scenario(step_ms: u64, phi_s: f64, robots: &[(&str, f64)]) -> Scenario {
    let mut scenario = Scenario {
        step_ms,
        ..default_scenario()
    };
    scenario.body.speed_m_s = 1e-4;
    scenario.robots.truncate(robots.len());
    let alliance = &mut scenario.alliance;
    alliance.preset = Preset::Par98;
    alliance.defaults = BehaviorSection {
        broadcast_rate_hz: Some(1.0),
        ceased_after_s: Some(5.0),
        slow_impatience: Some(1.0),
        willing_to_affect_s: Some(phi_s),
        before_yielding_s: Some(10_000.0),
        before_giving_up_s: Some(10_000.0),
        ..BehaviorSection::default()
    };
    for (robot, &(name, fast)) in scenario.robots.iter_mut().zip(robots) {
        name.clone_into(&mut robot.name);
        robot.side_sensor = false;
        let mut section = RobotSection::default();
        section.defaults.fast_impatience = Some(fast);
        alliance.robots.insert(name.to_owned(), section);
    }
    scenario
}

/// Writes the scenario to a file of the lab, and returns the file name.
fn write(lab: &Lab, scenario: &Scenario) -> String {
    let file = format!("step-{}.toml", scenario.step_ms);
    std::fs::write(lab.path(&file), scenario.to_toml().unwrap()).unwrap();
    file
}

/// Runs the scenario up to the limit and returns the log.
fn run(scenario: &Scenario, limit_s: &str) -> RunLog {
    let lab = Lab::new();
    let file = write(&lab, scenario);
    lab.mission("run", &[&file, "--limit", limit_s]).expect(1);
    lab.log("run")
}

/// Returns time and reason of the `number`-th event of a kind and robot.
#[track_caller]
fn event(log: &RunLog, kind: &str, robot: &str, number: usize) -> (u64, String) {
    let rows: Vec<EventRow> = log.rows().unwrap();
    let mut rows = rows
        .into_iter()
        .filter(|row| row.kind == kind && row.robot == robot);
    let row = rows
        .nth(number)
        .unwrap_or_else(|| panic!("no '{kind}' of {robot}"));
    (row.t_ms.0, row.reason)
}

/// Returns the times at which gold received blue's first and last heartbeat with the task, in ms.
fn received(log: &RunLog) -> (u64, u64) {
    let rows: Vec<MessageRow> = log.rows().unwrap();
    let times: Vec<u64> = rows
        .iter()
        .filter(|row| row.receiver == "gold" && row.state == "executing" && row.delivery == "heard")
        .map(|row| row.t_ms.0)
        .collect();
    (times[0], times[times.len() - 1])
}

#[track_caller]
fn assert_within_a_step(actual_ms: u64, expected_s: f64, step_ms: u64) {
    let difference_ms = (actual_ms as f64 - 1000.0 * expected_s).abs();
    assert!(
        difference_ms <= step_ms as f64,
        "{actual_ms} ms instead of {expected_s} s at steps of {step_ms} ms"
    );
}

#[test]
fn a_task_without_a_robot_is_taken_at_the_threshold() {
    for step_ms in STEPS_MS {
        let log = run(&scenario(step_ms, 30.0, &[("gold", 5.0)]), "21");
        let (activated, reason) = event(&log, "activated", "gold", 0);
        assert_eq!(reason, "threshold");
        assert_within_a_step(activated, 20.0, step_ms);
    }
}

#[test]
fn a_robot_without_progress_is_taken_over_after_phi() {
    for (phi_s, takeover_s, limit_s) in [(30.0, 44.0, "56"), (300.0, 100.0, "112")] {
        for step_ms in STEPS_MS {
            let log = run(
                &scenario(step_ms, phi_s, &[("blue", 10.0), ("gold", 5.0)]),
                limit_s,
            );
            let (first, _) = received(&log);
            let (activated, _) = event(&log, "activated", "gold", 0);
            assert_within_a_step(activated - first, takeover_s, step_ms);

            // The first heartbeat resets gold once. Then gold's motivation rises slowly.
            let rows: Vec<MotivationRow> = log.rows().unwrap();
            let gold: Vec<&MotivationRow> = rows.iter().filter(|row| row.robot == "gold").collect();
            let find = |row: &&&MotivationRow| row.behavior_set == "find-locations-wander";
            let resets: Vec<u64> = gold
                .iter()
                .filter(find)
                .filter(|row| !row.impatience_reset)
                .map(|row| row.t_ms.0)
                .collect();
            assert_eq!(resets, [first]);
            let after: Vec<_> = gold
                .iter()
                .filter(find)
                .skip_while(|row| row.t_ms.0 < first)
                .take(2)
                .map(|row| (row.motivation, row.impatience))
                .collect();
            assert_eq!(after, [(0.0, 1.0), (step_ms as f64 / 1000.0, 1.0)]);
        }
    }
}

/// Blue is killed by a real signal, at a time that the log contains.
#[test]
fn a_silent_robot_is_taken_over_after_tau() {
    for step_ms in STEPS_MS {
        let lab = Lab::new();
        let robots = [("blue", 10.0), ("gold", 5.0)];
        let file = write(&lab, &scenario(step_ms, 300.0, &robots));
        let mut team = Team::start(&lab, &[&file, "--speed", "20x", "--limit", "115"]);
        team.wait_for_row("events.csv", &[",activated,blue,"]);
        team.run_for(Duration::from_millis(100));
        team.kill("blue");
        team.wait().expect(1);
        let log = lab.log("run");
        let (first, last) = received(&log);
        let slow_s = (last - first) as f64 / 1000.0 + 5.0;
        // θ/δ_slow = 100 s is the limit if blue is killed very late.
        let takeover_s = f64::min(slow_s + (100.0 - slow_s) / 5.0, 100.0);
        let (activated, _) = event(&log, "activated", "gold", 0);
        assert_within_a_step(activated - first, takeover_s, step_ms);
    }
}

/// The time and reason of the incumbent's yielding, as if it had reached θ at exactly 20 s. The engine has the same
/// test.
#[test]
fn an_incumbent_yields_after_psi_or_at_the_first_message_of_a_newcomer() {
    for step_ms in STEPS_MS {
        let step_s = step_ms as f64 / 1000.0;
        for (stops, left_s, expected_reason) in [
            (false, 100.0, "acquiesced-psi"),
            (true, 90.0 + 2.0 * step_s, "reset-by gold"),
        ] {
            let mut scenario = scenario(step_ms, 60.0, &[("blue", 5.0), ("gold", 4.0)]);
            scenario.alliance.switches = SwitchSection {
                reset_stops_active: Some(stops),
                ..SwitchSection::default()
            };
            let blue = scenario.alliance.robots.get_mut("blue").unwrap();
            blue.defaults.before_yielding_s = Some(80.0);
            let log = run(&scenario, "102");
            let (activated, _) = event(&log, "activated", "blue", 0);
            assert_within_a_step(activated, 20.0, step_ms);
            let (left, reason) = event(&log, "hibernated", "blue", 0);
            assert_eq!(reason, expected_reason);
            assert_within_a_step(20_000 + left - activated, left_s, step_ms);
        }
    }
}
