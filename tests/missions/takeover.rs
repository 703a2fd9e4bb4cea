//! The takeover time of a silent robot (ALLIANCE.md §4) by real processes, to one step, with steps of 10, 50 and 200 ms.
//!
//! The robots are too slow to make progress: find-locations is always the only applicable task, and a robot that
//! works on it fails.

use missions::waste::data::default_scenario;
use std::time::Duration;

use run_log::{EventRow, MessageRow, RunLog};
use scenario::{BehaviorSection, Preset, RobotSection, Scenario};

use crate::harness::Lab;
use crate::team::Team;

const STEPS_MS: [u64; 3] = [10, 50, 200];

/// Returns a scenario with θ=100, δ_slow=1, τ=5, φ=300, a heartbeat per second, large ψ and λ, and δ_fast per robot.
fn scenario(step_ms: u64, robots: &[(&str, f64)]) -> Scenario {
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
        willing_to_affect_s: Some(300.0),
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

/// Returns the times at which gold received blue's first and last heartbeat with the task, in ms.
fn received(log: &RunLog) -> (u64, u64) {
    let rows: Vec<MessageRow> = log.rows().unwrap();
    let times: Vec<u64> = rows
        .iter()
        .filter(|row| {
            row.receiver == "gold" && row.state == "executing" && row.delivery == "received"
        })
        .map(|row| row.t_ms.0)
        .collect();
    (times[0], times[times.len() - 1])
}

/// Blue is killed by a real signal, at a time that the log contains.
#[test]
fn a_silent_robot_is_taken_over_after_tau() {
    for step_ms in STEPS_MS {
        let lab = Lab::new();
        let robots = [("blue", 10.0), ("gold", 5.0)];
        let text = scenario(step_ms, &robots).to_toml().unwrap();
        std::fs::write(lab.path("slow.toml"), text).unwrap();
        let mut team = Team::start(&lab, &["slow.toml", "--speed", "20x", "--limit", "115"]);
        team.wait_for_row("events.csv", &[",activated,blue,"]);
        team.run_for(Duration::from_millis(100));
        team.kill("blue");
        team.wait().expect(1);
        let log = lab.log("run");
        let (first, last) = received(&log);
        let slow_s = (last - first) as f64 / 1000.0 + 5.0;
        // θ/δ_slow = 100 s is the limit if blue is killed very late.
        let takeover_s = f64::min(slow_s + (100.0 - slow_s) / 5.0, 100.0);
        let rows: Vec<EventRow> = log.rows().unwrap();
        let is_takeover = |row: &&EventRow| row.kind == "activated" && row.robot == "gold";
        let taken_over = rows.iter().find(is_takeover).unwrap().t_ms.0;
        let difference_ms = ((taken_over - first) as f64 - 1000.0 * takeover_s).abs();
        assert!(
            difference_ms <= step_ms as f64,
            "{taken_over} ms instead of {first} ms + {takeover_s} s at steps of {step_ms} ms"
        );
    }
}
